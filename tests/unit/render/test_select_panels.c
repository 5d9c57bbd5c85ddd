/* Level selection of panels and meshes, against the naive selector: nothing that is seen of them is missing, each chunk
 * once a window, behind its bounds, and their spacing. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "cameras.h"
#include "dataset/chunk.h"
#include "render/select.h"
#include "support/make_dataset.h"
#include "support/naive_select.h"
#include "support/reference_panels.h"

enum { planes = 24, coarse_planes = 6, most = 40, across = 9, width = 320, height = 200 };

static uint64_t random_state;

static double uniform(void)
{
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (double)(random_state >> 11) / 9007199254740992.0;
}

static enum spl_select_answer take(void *context, uint32_t page)
{
    (void)context;
    (void)page;
    return SPL_SELECT_YES;
}

/* Planes in a cube of 2 m, a quarter of them on the root, half of them with relief of up to 20 cells, and some splats;
 * cells over a decade of size. */
static struct spl_dataset *make_planes(void)
{
    static struct make_panels made[planes];
    static struct spl_panel panels[planes][most];
    static struct spl_relief reliefs[planes][most];
    struct make_splat splats[300];
    memset(made, 0, sizeof made);
    memset(panels, 0, sizeof panels);
    memset(splats, 0, sizeof splats);
    for (int i = 0; i < 300; i++) {
        for (int c = 0; c < 3; c++)
            splats[i].position[c] = 2 * uniform() - 1;
        splats[i].normal[2] = 1;
        splats[i].radius = 0.01f;
    }
    for (int i = 0; i < planes; i++) {
        struct spl_panel_plane *plane = &made[i].plane;
        double n[3], length = 0;
        for (int c = 0; c < 3; c++) {
            n[c] = uniform() - 0.5;
            length += n[c] * n[c];
            plane->origin[c] = 1.9 * uniform() - 0.95;
        }
        for (int c = 0; c < 3; c++)
            plane->normal[c] = (float)(n[c] / sqrt(length));
        made[i].coarse = i < coarse_planes;
        plane->cell = (float)(0.004 * pow(10, uniform()));
        plane->points = 10;
        made[i].panels = panels[i];
        made[i].reliefs = i % 2 ? reliefs[i] : NULL;
        for (int p = 0; p < most; p++) {
            reliefs[i][p].level = (unsigned)i / 2 % (SPL_RELIEF_LEVEL_MAX + 1);
            for (int h = 0; h < SPL_RELIEF_POINTS_MAX; h++)
                reliefs[i][p].height[h] = (float)(20 * (2 * uniform() - 1)) * plane->cell;
        }
        for (int place = 0; place < across * across && made[i].count < most; place++)
            if (place == 3 || uniform() < 0.2) {
                struct spl_panel *panel = &panels[i][made[i].count++];
                panel->column = (uint8_t)(place % across);
                panel->row = (uint8_t)(place / across);
                for (int y = 0; y < SPL_PANEL_SIDE; y++)
                    panel->cells[y] = (uint16_t)(65535 * uniform());
                panel->cells[0] |= 1;
            }
    }
    return make_dataset_panels(splats, 300, made, planes, 2);
}

/* The chunk as it is listed in the window that sample (x, y) lies in, or whole; NULL = it is not. */
static const struct spl_draw_chunk *find(const struct spl_draw_list *list, uint64_t first_id, double x, double y,
                                         float *near)
{
    const struct spl_draw_chunk *found = NULL;
    for (size_t i = 0; i < list->chunk_count; i++) {
        const struct spl_draw_chunk *draw = &list->chunks[i];
        uint32_t window = draw->count >> SPL_COUNT_BITS, column = window & ((1u << SPL_WINDOW_BITS) - 1);
        bool inside = !window || ((uint32_t)x / SPL_WINDOW == column - 1 &&
                                  (uint32_t)y / SPL_WINDOW == window >> SPL_WINDOW_BITS);
        if (draw->first_id != first_id || !inside)
            continue;
        assert_null(found);
        found = draw;
        *near = list->bounds[i].near;
    }
    return found;
}

static void check_view(const struct spl_dataset *dataset, const struct spl_camera *camera, double lod, bool whole,
                       size_t *seen, size_t *windows)
{
    size_t count, bytes;
    uint64_t ignored, drawn = 0;
    struct spl_select_params params = {.dataset = dataset,
                                       .camera = camera,
                                       .lod = lod,
                                       .low_pass = (double)SPL_LOW_PASS,
                                       .discs = true,
                                       .panels = whole,
                                       .meshes = whole,
                                       .resident = take};
    struct spl_draw_list list = {0};
    assert_int_equal(spl_select(&params, &list, NULL), SPL_OK);
    struct naive_chunk *naive = naive_select(
        &(struct naive_options){
            .dataset = dataset, .camera = camera, .lod = lod, .panels = whole, .meshes = whole}, &count);
    for (size_t i = 0; i < count; i++) {
        const struct spl_node *node = &spl_dataset_get_nodes(dataset, &ignored)[naive[i].node];
        const struct spl_chunk *chunk = &spl_dataset_get_chunks(dataset, &ignored)[naive[i].chunk];
        if (!naive[i].panels)
            continue;
        struct reference_plane plane =
            reference_plane(camera, node, chunk, spl_dataset_get_page(dataset, node->page, &bytes));
        const double widest = spl_chunk_kind(chunk) == SPL_CHUNK_MESHES ? SPL_MESH_WINDOW : SPL_PANEL_WINDOW;
        double low[2], high[2]; // of a panel's cells on the image
        for (uint32_t k = 0; k < chunk->count * SPL_PANEL_SIDE * SPL_PANEL_SIDE; k++) {
            struct reference_cell cell;
            if (k % (SPL_PANEL_SIDE * SPL_PANEL_SIDE) == 0) {
                low[0] = low[1] = INFINITY;
                high[0] = high[1] = -INFINITY;
            }
            if (!reference_panel_cell(&plane, k, &cell) || !(cell.p[2] >= (float)camera->near) ||
                !(cell.p[2] <= (float)camera->far))
                continue;
            double x = camera->fx * cell.p[0] / cell.p[2] + camera->cx;
            double y = camera->fy * cell.p[1] / cell.p[2] + camera->cy;
            if (!(x >= 0 && y >= 0 && x < width && y < height))
                continue;
            float near;
            const struct spl_draw_chunk *draw = find(&list, chunk->first_id, x, y, &near);
            assert_non_null(draw);
            assert_true(near <= cell.p[2]);
            assert_int_equal(draw->count & ((1u << SPL_COUNT_BITS) - 1), chunk->count);
            assert_true(draw->step == chunk->step && draw->color_word == chunk->geometry_word + chunk->color_bits - 1);
            assert_int_equal(draw->color_bits, spl_panels_get_level(chunk));
            assert_true(draw->radius_step == spl_panels_get_worth(chunk));
            assert_float_equal(draw->radius_min, whole ? chunk->radius_min : SPL_RADIUS_SPACING * chunk->step, 1e-9);
            for (int a = 0; a < 2; a++) { // a loop of a kernel ends
                low[a] = fmin(low[a], a ? y : x);
                high[a] = fmax(high[a], a ? y : x);
                assert_true(!whole || draw->count >> SPL_COUNT_BITS || high[a] - low[a] <= widest);
            }
            ++*seen;
            *windows += draw->count >> SPL_COUNT_BITS != 0;
        }
    }
    for (size_t i = 0; i < list.chunk_count; i++) { /* nothing of another level */
        bool known = false;
        for (size_t k = 0; k < count; k++)
            known |= spl_dataset_get_chunks(dataset, &ignored)[naive[k].chunk].first_id == list.chunks[i].first_id;
        assert_true(known);
        drawn += list.chunks[i].count >> SPL_COUNT_BITS ? 0 : list.chunks[i].count;
    }
    assert_true(drawn <= list.drawn[SPL_CHUNK_DISCS] + list.drawn[SPL_CHUNK_PANELS] + list.drawn[SPL_CHUNK_MESHES]);
    assert_true(whole ? !list.chunk_count || list.sample_panels + list.sample_splats : !list.sample_panels);
    double spacing;
    bool complete = true;
    assert_int_equal(spl_select_spacing(&params, &spacing, &complete, NULL), SPL_OK);
    assert_float_equal(spacing / naive_spacing(naive, count), 1, 1e-9);
    free(naive);
    spl_draw_list_finish(&list);
}

static void every_cell_that_is_seen_is_drawn(void **state)
{
    (void)state;
    static const double lods[] = {0, 0.3, 1, 4, 16};
    size_t seen = 0, windows = 0;
    random_state = 29;
    struct spl_dataset *dataset = make_planes();
    for (int view = 0; view < 100; view++) {
        struct spl_camera camera = random_camera(uniform, width, height);
        check_view(dataset, &camera, lods[view % 5], view % 2, &seen, &windows);
    }
    assert_true(seen > 100000 && windows > 1000 && windows < seen / 2);
    spl_dataset_close(dataset);
}

/* Does the line through `from` along `along` (cells of the panel, all three) meet the triangle of the lattice's points
 * p? With as much overlap as kernels have. */
static bool meets(const double from[3], const double along[3], double p[3][3])
{
    enum { hair = 64 }; /* of a cell */
    double a[3], b[3], n[3], t = 0, facing = 0;
    for (int c = 0; c < 3; c++) {
        a[c] = p[1][c] - p[0][c];
        b[c] = p[2][c] - p[0][c];
    }
    for (int c = 0; c < 3; c++) {
        n[c] = a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
        t += n[c] * (p[0][c] - from[c]);
        facing += n[c] * along[c];
    }
    t /= facing;
    for (int i = 0; i < 3; i++) { /* across each side, in the plane */
        const double *q = p[i], *r = p[(i + 1) % 3], *inner = p[(i + 2) % 3];
        double side[2] = {r[0] - q[0], r[1] - q[1]}, length = hypot(side[0], side[1]);
        double at[2] = {from[0] + t * along[0] - q[0], from[1] + t * along[1] - q[1]};
        double beyond = (side[0] * at[1] - side[1] * at[0]) / length;
        beyond *= side[0] * (inner[1] - q[1]) - side[1] * (inner[0] - q[0]) > 0 ? -1 : 1;
        if (!(beyond < sqrt(2) / hair))
            return false;
    }
    return true;
}

/* Triangles of the panel's that the line meets. */
static uint32_t count_met(const struct spl_relief *relief, double cell, const double from[3], const double along[3])
{
    const int squares = 1 << relief->level;
    const double wide = (double)SPL_PANEL_SIDE / squares;
    uint32_t met = 0;
    for (int i = 0; i < 2 * squares * squares; i++) {
        const int at[2] = {i / 2 % squares, i / 2 / squares};
        const int corners[3][2] = {{0, 0}, {1, 1}, {i % 2, 1 - i % 2}};
        double p[3][3];
        for (int k = 0; k < 3; k++) {
            int x = at[0] + corners[k][0], y = at[1] + corners[k][1];
            p[k][0] = wide * x;
            p[k][1] = wide * y;
            p[k][2] = (double)relief->height[(squares + 1) * y + x] / cell;
        }
        met += meets(from, along, p);
    }
    return met;
}

/* Weights of fragments follow from how many a panel may add: of one with relief, seen along it, several. */
static void a_ray_meets_as_many_triangles_as_are_counted(void **state)
{
    (void)state;
    random_state = 3;
    for (unsigned level = 0; level <= SPL_RELIEF_LEVEL_MAX; level++) {
        struct spl_panel panel = {.cells = {1}};
        struct spl_relief relief = {.level = level};
        const int wide = (1 << level) + 1;
        for (int i = 0; i < wide * wide; i++)
            relief.height[i] = (i / wide + i % wide) % 2 ? 0.1f : -0.1f; /* every square folds */
        struct make_panels made = {.plane = {.normal = {0, 0, 1}, .cell = 0.01f, .points = 1},
                                   .panels = &panel,
                                   .reliefs = &relief,
                                   .count = 1};
        struct spl_dataset *dataset = make_dataset_panels(NULL, 0, &made, 1, 1);
        struct spl_camera camera = {.near = 0.01, .far = 100};
        const double eye[3] = {2, 1, 3}, target[3] = {0}, up[3] = {0, 0, 1};
        assert_int_equal(spl_camera_look_at(&camera, eye, target, up, NULL), SPL_OK);
        assert_int_equal(spl_camera_set_fov(&camera, 40, width, height, NULL), SPL_OK);
        struct spl_select_params params = {
            .dataset = dataset, .camera = &camera, .discs = true, .panels = true, .meshes = true, .resident = take};
        struct spl_draw_list list = {0};
        assert_int_equal(spl_select(&params, &list, NULL), SPL_OK);
        assert_int_equal(list.sample_panels, 1);
        uint32_t most_met = 0;
        for (int round = 0; round < 20000; round++) {
            double from[3], along[3];
            for (int c = 0; c < 3; c++) {
                from[c] = c < 2 ? SPL_PANEL_SIDE * uniform() : 2 * uniform() - 1;
                along[c] = (c < 2 ? 1 : 0.1 * uniform()) * (2 * uniform() - 1);
            }
            if (round % 4 == 0) { /* along a row of points */
                from[1] = (double)SPL_PANEL_SIDE / (wide - 1) * (int)(wide * uniform());
                along[1] = 1e-3 * (uniform() - 0.5);
            }
            uint32_t met = count_met(&relief, 0.01, from, along);
            most_met = met > most_met ? met : most_met;
        }
        assert_true(most_met > (1u << level) && most_met <= list.sample_splats);
        spl_draw_list_finish(&list);
        spl_dataset_close(dataset);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_cell_that_is_seen_is_drawn),
        cmocka_unit_test(a_ray_meets_as_many_triangles_as_are_counted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
