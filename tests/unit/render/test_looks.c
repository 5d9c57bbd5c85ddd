/* The work that selection lists, against what chunks hold: the boxes on the image of all their discs, panels and
 * triangles of meshes, of which a kernel looks at every sample, are never more. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "dataset/chunk.h"
#include "dataset/panels.h"
#include "render/select.h"
#include "support/make_dataset.h"

enum { width = 400, height = 240, discs = 1200, planes = 8, across = 5, side = SPL_PANEL_SIDE };

static uint64_t random_state = 1;

static double uniform(void)
{
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (double)(random_state >> 11) / 9007199254740992.0;
}

static void random_unit(float n[3])
{
    double v[3] = {uniform() - 0.5, uniform() - 0.5, uniform() - 0.5};
    for (int c = 0; c < 3; c++)
        n[c] = (float)(v[c] / sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]));
}

/* Clumps of discs of a chunk each, over three decades of size; planes flat and with relief of every level, up to as
 * steep as walls. */
static struct spl_dataset *make_scene(void)
{
    static struct make_splat splats[discs];
    static struct spl_panel panels[across * across];
    static struct spl_relief reliefs[planes][across * across];
    struct make_panels made[planes] = {0};
    double middle[3] = {0}, largest = 0;
    for (int i = 0; i < discs; i++) {
        for (int c = 0; c < 3; c++) {
            middle[c] = i % SPL_CHUNK_SPLATS ? middle[c] : 2 * uniform() - 1;
            splats[i].position[c] = middle[c] + 0.1 * uniform();
        }
        largest = i % SPL_CHUNK_SPLATS ? largest : 0.001 * pow(1000, uniform());
        random_unit(splats[i].normal);
        splats[i].radius = (float)(largest * (i / SPL_CHUNK_SPLATS % 2 ? 1 : 0.1 + 0.9 * uniform()));
    }
    for (int i = 0; i < across * across; i++) {
        panels[i] = (struct spl_panel){.column = (uint8_t)(i % across), .row = (uint8_t)(i / across)};
        memset(panels[i].cells, 0xff, sizeof panels[i].cells);
    }
    for (int i = 0; i < planes; i++) {
        struct spl_panel_plane *plane = &made[i].plane;
        random_unit(plane->normal);
        plane->cell = (float)(0.002 * pow(30, uniform()));
        plane->points = 1;
        for (int c = 0; c < 3; c++)
            plane->origin[c] = 2 * uniform() - 1;
        made[i].panels = panels;
        made[i].reliefs = i % 2 ? reliefs[i] : NULL;
        made[i].count = across * across;
        for (int p = 0; p < across * across; p++) {
            reliefs[i][p].level = (unsigned)i / 2 % (SPL_RELIEF_LEVEL_MAX + 1);
            for (int h = 0; h < SPL_RELIEF_POINTS_MAX; h++)
                reliefs[i][p].height[h] = (float)((i % 4 + 0.1) * 4 * uniform()) * plane->cell;
        }
    }
    return make_dataset_panels(splats, discs, made, planes, 1);
}

static enum spl_select_answer take(void *context, uint32_t page)
{
    (void)context;
    (void)page;
    return SPL_SELECT_YES;
}

static struct spl_camera random_camera(void)
{
    struct spl_camera camera = {.near = 0.01, .far = 1000};
    const double up[3] = {0.1, 0.2, 1}, away = 0.1 + 4 * uniform() * uniform();
    double eye[3], target[3];
    do
        for (int c = 0; c < 3; c++) {
            eye[c] = away * (2 * uniform() - 1);
            target[c] = 1.5 * (2 * uniform() - 1);
        }
    while (spl_camera_look_at(&camera, eye, target, up, NULL));
    assert_int_equal(spl_camera_set_fov(&camera, 10 + 90 * uniform(), width, height, NULL), SPL_OK);
    camera.cx += 100 * (uniform() - 0.5);
    camera.fy *= 0.8 + 0.4 * uniform();
    return camera;
}

/* A box on the image, in samples. */
struct box {
    double low[2], high[2];
    bool crosses; /* the near plane: it may be anywhere */
};

static const struct box nothing = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}, false};

static void add(struct box *box, const struct spl_camera *camera, const struct spl_node *node, const float at[3])
{
    double p[3] = {0};
    for (int c = 0; c < 3; c++)
        for (int a = 0; a < 3; a++)
            p[c] += camera->rotation[3 * c + a] * (node->origin[a] - camera->eye[a] + (double)at[a]);
    box->crosses |= p[2] < camera->near;
    const double place[2] = {camera->fx * p[0] / p[2] + camera->cx, camera->fy * p[1] / p[2] + camera->cy};
    for (int i = 0; i < 2; i++) {
        box->low[i] = fmin(box->low[i], place[i]);
        box->high[i] = fmax(box->high[i], place[i]);
    }
}

/* Middles of samples in the box, and `around` it, that lie in the window that the chunk is listed for. */
static double count_samples(const struct spl_draw_chunk *drawn, const struct box *box, double around)
{
    const uint32_t window = drawn->count >> SPL_COUNT_BITS, size[2] = {width, height};
    const uint32_t place[2] = {(window & ((1u << SPL_WINDOW_BITS) - 1)) - 1, window >> SPL_WINDOW_BITS};
    double samples = 1;
    for (int i = 0; i < 2; i++) {
        double first = window ? place[i] * SPL_WINDOW : 0;
        double end = window ? fmin(first + SPL_WINDOW, size[i]) : size[i];
        first = fmax(first, ceil(box->low[i] - around - 0.5));
        end = fmin(end, floor(box->high[i] + around - 0.5) + 1);
        samples *= fmax(end - first, 0);
    }
    return box->crosses ? 0 : samples; // those are tested by what does not cross
}

static double count_disc(const struct spl_draw_chunk *drawn, const struct spl_camera *camera,
                         const struct spl_node *node, const struct spl_splat *splat)
{
    enum { rim = 24 };
    struct box box = nothing;
    float u[3], v[3], at[3];
    const double other[3] = {fabsf(splat->normal[0]) < 0.7f, fabsf(splat->normal[0]) >= 0.7f, 0};
    const double n[3] = {(double)splat->normal[0], (double)splat->normal[1], (double)splat->normal[2]};
    double x[3] = {n[1] * other[2] - n[2] * other[1], n[2] * other[0] - n[0] * other[2],
                   n[0] * other[1] - n[1] * other[0]};
    const double length = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
    for (int c = 0; c < 3; c++)
        u[c] = (float)(x[c] / length);
    for (int c = 0; c < 3; c++)
        v[c] = (float)(n[(c + 1) % 3] * (double)u[(c + 2) % 3] - n[(c + 2) % 3] * (double)u[(c + 1) % 3]);
    for (int i = 0; i < rim; i++) {
        const float r = splat->radius * drawn->texture_scale, angle = (float)(2 * M_PI * i / rim);
        for (int c = 0; c < 3; c++)
            at[c] = splat->position[c] + r * (cosf(angle) * u[c] + sinf(angle) * v[c]);
        add(&box, camera, node, at);
    }
    return count_samples(drawn, &box, (double)SPL_LOW_PASS);
}

static double count_panel(const struct spl_draw_chunk *drawn, const struct spl_camera *camera,
                          const struct spl_node *node, const struct spl_chunk *chunk, const uint32_t *page, uint32_t i)
{
    struct spl_panel panel;
    struct spl_relief relief;
    struct spl_panel_frame frame;
    float at[3], normal[3];
    double samples = 0;
    spl_panels_decode(chunk, page, i, &panel);
    spl_panels_get_relief(chunk, page, i, &relief);
    spl_panels_get_frame(chunk, &frame);
    const bool mesh = spl_chunk_kind(chunk) == SPL_CHUNK_MESHES;
    const unsigned squares = mesh ? 1u << relief.level : 1, corners = mesh ? 3 : 4;
    for (unsigned t = 0; t < squares * squares * (mesh ? 2 : 1); t++) {
        const unsigned square = mesh ? t / 2 : t;
        struct box box = nothing;
        for (unsigned c = 0; c < corners; c++) { // of the triangle below the diagonal, or beyond it
            unsigned x = mesh ? c == 2 || (c == 1 && t % 2 == 0) : c % 2;
            unsigned y = mesh ? c == 2 || (c == 1 && t % 2) : c / 2;
            spl_panels_place(&frame, &panel, &relief, (float)(side / squares * (square % squares + x)),
                             (float)(side / squares * (square / squares + y)), at, normal);
            add(&box, camera, node, at);
        }
        samples += count_samples(drawn, &box, 0);
    }
    return samples;
}

static void work_is_never_less_than_boxes_hold(void **state)
{
    (void)state;
    struct spl_dataset *dataset = make_scene();
    uint64_t count, node_count;
    size_t bytes, kinds[SPL_CHUNK_KINDS][2] = {0};
    const struct spl_node *node = spl_dataset_get_nodes(dataset, &node_count);
    const struct spl_chunk *chunks = spl_dataset_get_chunks(dataset, &count);
    const uint32_t *page = spl_dataset_get_page(dataset, 0, &bytes);
    assert_int_equal(node_count, 1);
    for (int view = 0; view < 40; view++) {
        struct spl_camera camera = random_camera();
        struct spl_select_params params = {.dataset = dataset,
                                           .camera = &camera,
                                           .lod = view % 3,
                                           .low_pass = (double)SPL_LOW_PASS,
                                           .discs = true,
                                           .panels = true,
                                           .meshes = true,
                                           .resident = take};
        struct spl_draw_list list = {0};
        assert_int_equal(spl_select(&params, &list, NULL), SPL_OK);
        for (size_t i = 0; i < list.chunk_count; i++) {
            const struct spl_draw_chunk *drawn = &list.chunks[i];
            const struct spl_chunk *chunk = chunks;
            while (chunk->first_id != drawn->first_id)
                chunk++;
            const uint32_t kind = spl_chunk_kind(chunk), items = drawn->count & ((1u << SPL_COUNT_BITS) - 1);
            double samples = 0;
            for (uint32_t k = 0; k < items; k++) {
                struct spl_splat splat;
                if (kind == SPL_CHUNK_DISCS)
                    spl_chunk_decode(chunk, page, k, &splat);
                samples += kind == SPL_CHUNK_DISCS ? count_disc(drawn, &camera, node, &splat)
                                                   : count_panel(drawn, &camera, node, chunk, page, k);
            }
            if ((double)list.work_of_chunk[i] < samples)
                fail_msg("view %d, kind %u: %g samples, %llu are listed", view, kind, samples,
                         (unsigned long long)list.work_of_chunk[i]);
            kinds[kind][drawn->count >> SPL_COUNT_BITS != 0]++;
        }
        spl_draw_list_finish(&list);
    }
    for (int windows = 0; windows < 2; windows++)
        assert_true(kinds[SPL_CHUNK_DISCS][windows] && kinds[SPL_CHUNK_PANELS][windows] &&
                    kinds[SPL_CHUNK_MESHES][windows]);
    spl_dataset_close(dataset);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(work_is_never_less_than_boxes_hold)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
