/* Meshes as the triangles that they are, of methods splat and nearest: against rays that meet the same triangles in
 * doubles, and closed where these are; flat ones against the panels that they are; far away, along their edges, very
 * near. test_panel_kinds.c holds them against the plain C reference. One body for every backend. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "gpu/frames.h"
#include "gpu/panel_scenes.h"
#include "support/make_sheet.h"
#include "support/sanitised.h"

enum { side = SPL_PANEL_SIDE, across = SHEET_ACROSS_MAX };

static const enum spl_method drawing[] = {SPL_METHOD_SPLAT, SPL_METHOD_NEAREST};

static struct spl_dataset *add_sheets(const struct make_panels *made, size_t count)
{
    struct spl_dataset *dataset = make_dataset_panels(NULL, 0, made, count, 1);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    return dataset;
}

static struct spl_dataset *add_sheet(const struct make_sheet *sheet)
{
    return add_sheets(&sheet->made, 1);
}

static void random_waves(struct make_sheet *sheet, double high, double length)
{
    double first = 6.28 * uniform(), second = 6.28 * uniform();
    make_sheet_waves(sheet, high, length, (double[]){first, second});
}

/* With cells that are not there, and colours. */
static void spoil_panels(struct make_sheet *sheet)
{
    for (size_t i = 0; i < sheet->made.count; i++)
        random_panel(&sheet->panels[i], sheet->panels[i].column, sheet->panels[i].row);
}

/* Four sheets of every level around the origin, of waves up to as steep as they are long, cells of some `cell`. */
static struct spl_dataset *random_sheets(double cell)
{
    enum { sheets = 4 };
    struct make_sheet *sheet = calloc(sheets, sizeof *sheet);
    struct make_panels made[sheets];
    assert_non_null(sheet);
    for (unsigned i = 0; i < sheets; i++) {
        float normal[3];
        double center[3];
        random_unit(normal);
        for (int a = 0; a < 3; a++)
            center[a] = 1.4 * uniform() - 0.7;
        make_sheet_begin(&sheet[i], normal, center, 2 + i % 3, cell * pow(4, uniform() - 0.5), 3 - i);
        random_waves(&sheet[i], 12 * uniform() * uniform(), 1 + 3 * uniform());
        spoil_panels(&sheet[i]);
        made[i] = sheet[i].made;
    }
    struct spl_dataset *dataset = add_sheets(made, sheets);
    free(sheet);
    return dataset;
}

/* What the ray of a sample meets first, in doubles. */
struct met {
    double z; /* 0 = nothing */
    uint32_t id;
    double at[2]; /* panels along u and v */
};

static double cross(const double a[2], const double b[2])
{
    return a[0] * b[1] - a[1] * b[0];
}

/* Where the ray of direction d from the eye, both in cells of the chunk and heights, meets triangle a, b, c: its
 * parameter, or 0. By the sides of the triangle as it is seen along the ray. */
static double meet(const double eye[3], const double d[3], const double corners[3][3], double at[2])
{
    double e[2][3], n[3], facing = 0, away = 0;
    for (int i = 0; i < 3; i++) {
        e[0][i] = corners[1][i] - corners[0][i];
        e[1][i] = corners[2][i] - corners[0][i];
    }
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        n[i] = e[0][j] * e[1][k] - e[0][k] * e[1][j];
        facing += n[i] * d[i];
        away += n[i] * (corners[0][i] - eye[i]);
    }
    double z = away / facing;
    for (int i = 0; i < 2; i++)
        at[i] = eye[i] + z * d[i];
    double sign = 0;
    for (int i = 0; i < 3; i++) { /* seen from above: heights are single-valued */
        const double *p = corners[i], *q = corners[(i + 1) % 3];
        double turn = cross((double[]){q[0] - p[0], q[1] - p[1]}, (double[]){at[0] - p[0], at[1] - p[1]});
        if (turn * sign < 0)
            return 0;
        sign = turn != 0 ? turn : sign;
    }
    return isfinite(z) ? z : 0;
}

/* Meets all triangles of panel i with the ray of direction d. */
static void meet_panel(const struct spl_chunk *chunk, uint32_t i, const struct spl_panel *panel,
                       const struct spl_relief *relief, const double eye[3], const double d[3], struct met *met)
{
    const int squares = 1 << relief->level;
    const double wide = side / (double)squares, first[2] = {side * panel->column, side * panel->row};
    for (int k = 0; k < 2 * squares * squares; k++) {
        const int x = k / 2 % squares, y = k / 2 / squares;
        const int ends[3][2] = {{x, y}, {x + (k % 2 == 0), y + (k % 2)}, {x + 1, y + 1}};
        double corners[3][3], at[2];
        for (int c = 0; c < 3; c++) {
            for (int a = 0; a < 2; a++)
                corners[c][a] = first[a] + wide * ends[c][a];
            corners[c][2] = (double)relief->height[ends[c][1] * (squares + 1) + ends[c][0]] / (double)chunk->step;
        }
        double z = meet(eye, d, (const double(*)[3])corners, at);
        if (!(z > 0) || (met->z > 0 && z >= met->z))
            continue;
        int cell[2] = {(int)fmin(fmax(at[0] - first[0], 0), side - 1), (int)fmin(fmax(at[1] - first[1], 0), side - 1)};
        if (panel->cells[cell[1]] >> cell[0] & 1)
            *met = (struct met){z, (uint32_t)chunk->first_id + i, {at[0] / side, at[1] / side}};
    }
}

/* All samples of the view. */
static struct met *meet_all(const struct spl_dataset *dataset, const struct spl_view *view)
{
    const struct spl_camera *c = &view->camera;
    const uint32_t samples = c->width * c->height;
    struct met *all = calloc(samples, sizeof *all);
    double(*d)[3] = calloc(samples, sizeof *d);
    uint64_t chunk_count, node_count;
    size_t bytes;
    const struct spl_chunk *chunks = spl_dataset_get_chunks(dataset, &chunk_count);
    const struct spl_node *node = spl_dataset_get_nodes(dataset, &node_count);
    const uint32_t *page = spl_dataset_get_page(dataset, node->page, &bytes);
    assert_non_null(all);
    assert_non_null(d);
    for (uint64_t k = 0; k < chunk_count; k++) {
        struct spl_panel_frame frame;
        spl_panels_get_frame(&chunks[k], &frame);
        const float *axes[3] = {frame.u, frame.v, frame.normal};
        double eye[3] = {0};
        for (int along = 0; along < 3; along++)
            for (int a = 0; a < 3; a++)
                eye[along] += (double)axes[along][a] * (c->eye[a] - node->origin[a] - (double)frame.origin[a]) /
                              (double)frame.cell;
        for (uint32_t i = 0; i < samples; i++) {
            double ray[3];
            for (int a = 0; a < 3; a++)
                ray[a] = c->rotation[a] * (i % c->width + 0.5 - c->cx) / c->fx +
                         c->rotation[3 + a] * (i / c->width + 0.5 - c->cy) / c->fy + c->rotation[6 + a];
            for (int along = 0; along < 3; along++) {
                d[i][along] = 0;
                for (int a = 0; a < 3; a++)
                    d[i][along] += (double)axes[along][a] * ray[a] / (double)frame.cell;
            }
        }
        for (uint32_t p = 0; p < chunks[k].count; p++) {
            struct spl_panel panel;
            struct spl_relief relief;
            spl_panels_decode(&chunks[k], page, p, &panel);
            spl_panels_get_relief(&chunks[k], page, p, &relief);
            for (uint32_t i = 0; i < samples; i++)
                meet_panel(&chunks[k], p, &panel, &relief, eye, d[i], &all[i]);
        }
    }
    free(d);
    return all;
}

/* Do the samples around (x, y) meet the same panel, with no step in depth? */
static bool is_inner(const struct met *all, const struct spl_camera *camera, uint32_t x, uint32_t y)
{
    const struct met *own = &all[y * camera->width + x];
    if (x == 0 || y == 0 || x + 1 == camera->width || y + 1 == camera->height)
        return false;
    for (uint32_t k = 0; k < 9; k++) {
        const struct met *beside = &all[(y + k / 3 - 1) * camera->width + x + k % 3 - 1];
        if (beside->id != own->id || (beside->z > 0) != (own->z > 0) || fabs(beside->z - own->z) > 0.02 * own->z)
            return false;
    }
    return true;
}

static void rays_find_the_same(void **state)
{
    (void)state;
    size_t inner_ones = 0;
    for (uint64_t seed = 1; seed <= 2; seed++) {
        random_state = 200 + seed;
        struct spl_dataset *dataset = random_sheets(0.016);
        struct spl_view view = looking(origin, 1.2 + uniform(), 120, 90);
        struct met *all = meet_all(dataset, &view);
        for (int method = 0; method < 2; method++) {
            view.method = drawing[method];
            view.lod = 0;
            struct spl_frame frame = render(dataset, &view);
            const float *depth = frame.images[SPL_LAYER_DEPTH].pixels;
            const uint32_t *ids = frame.images[SPL_LAYER_ID].pixels;
            const double exact = method ? 1e-4 : 0.004; /* splat has the mean of what it blends */
            size_t covered = 0, inner = 0, ids_differ = 0, depths_differ = 0, differ = 0;
            for (uint32_t i = 0; i < 120 * 90; i++) {
                bool hit = all[i].z > 0, own = is_inner(all, &view.camera, i % 120, i / 120);
                covered += hit;
                differ += hit && isnan(depth[i]);
                if (!hit || !own)
                    continue;
                inner++;
                ids_differ += ids[i] != all[i].id;
                depths_differ += !(fabs((double)depth[i] / all[i].z - 1) < exact);
            }
            inner_ones += inner;
            if (differ > 1 || ids_differ > inner / 100 + 1 || depths_differ > inner / 100 + 1)
                fail_msg("%s, seed %d: of %zu samples %zu are empty; of %zu inner ones %zu have another id, %zu depth",
                         spl_method_name(view.method), (int)seed, covered, differ, inner, ids_differ, depths_differ);
            spl_frame_finish(&frame);
        }
        free(all);
        done(dataset);
    }
    assert_true(inner_ones > 600);
}

/* Waves without a hole have none wherever they are looked at from, of either side, and nothing lies before them, but
 * what faces the eye within a radius behind what turns its back. */
static void what_is_closed_shows_no_hole(void **state)
{
    (void)state;
    size_t seen = 0;
    for (uint64_t seed = 1; seed <= TEST_SIZE(8, 2); seed++) {
        struct make_sheet sheet;
        float normal[3];
        random_state = 300 + seed;
        random_unit(normal);
        make_sheet_begin(&sheet, normal, origin, across, 0.01 * pow(4, uniform()), (unsigned)seed % 4);
        random_waves(&sheet, 10 * uniform(), 1.5 + 3 * uniform());
        struct spl_dataset *dataset = add_sheet(&sheet);
        struct spl_view view = looking(origin, 1, 80, 60);
        double away = 0.3 + 3 * uniform(), eye[3], target[3];
        float toward[3];
        random_unit(toward);
        for (int a = 0; a < 3; a++) {
            eye[a] = away * (double)toward[a] + 0.01;
            target[a] = 0.3 * (uniform() - 0.5);
        }
        look(&view, eye, target);
        view.lod = 0;
        struct met *all = meet_all(dataset, &view);
        for (int method = 0; method < 2; method++) {
            view.method = drawing[method];
            struct spl_frame frame = render(dataset, &view);
            const float *depth = frame.images[SPL_LAYER_DEPTH].pixels;
            const double radius = SPL_RADIUS_SPACING * (double)sheet.made.plane.cell;
            const double behind = method ? radius : 1.1 * SPL_MARGIN_SLANT * radius + radius;
            size_t holes = 0, wrong = 0;
            for (uint32_t i = 0; i < 80 * 60; i++) {
                const double *at = all[i].at;
                if (!(all[i].z > view.camera.near) || at[0] < 0.1 || at[1] < 0.1 || at[0] > across - 0.1 ||
                    at[1] > across - 0.1)
                    continue;
                seen++;
                holes += isnan(depth[i]);
                wrong += (double)depth[i] > all[i].z * 1.0001 + behind;
            }
            if (holes || wrong > 2)
                fail_msg("%s, seed %d: %zu holes, %zu samples show what lies behind", spl_method_name(view.method),
                         (int)seed, holes, wrong);
            spl_frame_finish(&frame);
        }
        free(all);
        done(dataset);
    }
    assert_true(seen > TEST_SIZE(8, 2) * 1000);
}

/* All heights the same: the panel that it is, moved. */
static void a_flat_mesh_is_a_panel(void **state)
{
    (void)state;
    for (int k = 0; k < TEST_SIZE(12, 4); k++) {
        struct make_sheet mesh, flat;
        float normal[3];
        double cell = 0.02, height = k % 3 ? (uniform() - 0.5) * 0.2 : 0;
        do { /* not along its edge, where either's cells show alone, but not the same ones */
            random_unit(normal);
        } while (fabs(0.6 * (double)normal[0] - 0.7 * (double)normal[1] + 0.4 * (double)normal[2]) < 0.3);
        make_sheet_begin(&flat, normal, origin, 4, cell, 0);
        spoil_panels(&flat);
        mesh = flat;
        flat.made.panels = flat.panels;
        flat.made.reliefs = NULL;
        mesh.made.panels = mesh.panels;
        mesh.made.reliefs = mesh.reliefs;
        float worth = spl_relief_worth((float)cell, spl_relief_choose_step((float)cell, fabsf((float)height)));
        height = (double)(roundf((float)height / worth) * worth);
        struct spl_panel_frame frame;
        struct spl_chunk chunk;
        spl_panels_begin(&flat.made.plane, &chunk);
        spl_panels_get_frame(&chunk, &frame);
        for (int a = 0; a < 3; a++)
            flat.made.plane.origin[a] += height * (double)frame.normal[a];
        for (size_t i = 0; i < mesh.made.count; i++) {
            mesh.reliefs[i].level = (unsigned)k % 4;
            for (int p = 0; p < SPL_RELIEF_POINTS(k % 4); p++)
                mesh.reliefs[i].height[p] = (float)height;
        }
        struct spl_dataset *a = add_sheet(&mesh), *b = add_sheet(&flat);
        struct spl_view view = looking(origin, 0.5 + 5 * uniform(), 160, 120);
        for (int method = 0; method < 2; method++) {
            view.method = drawing[method];
            view.lod = k % 2;
            struct spl_frame meshes = render(a, &view), panels = render(b, &view);
            struct tally t = compare(&meshes, &panels);
            size_t few = t.pixels / 500;
            assert_true(t.primitive_differs > 200);
            if (t.covered_differs > few || t.color_differs > few || t.id_differs > few || t.normal_differs > few ||
                (t.depth_differs > few && t.depth_worst > 1e-5))
                fail_msg("%s, %d: of %zu pixels differ: coverage %zu, depth %zu (worst %g), colour %zu, id %zu, normal "
                         "%zu",
                         spl_method_name(view.method), k, t.pixels, t.covered_differs, t.depth_differs, t.depth_worst,
                         t.color_differs, t.id_differs, t.normal_differs);
            spl_frame_finish(&meshes);
            spl_frame_finish(&panels);
        }
        done(a);
        done(b);
    }
}

/* One cell of a steep mesh, less than a sample wide, covers a sample or two wherever it falls. */
static void a_cell_far_away_does_not_vanish(void **state)
{
    (void)state;
    for (int k = 0; k < TEST_SIZE(24, 8); k++) {
        struct make_sheet sheet;
        make_sheet_begin(&sheet, (float[]){0.36f, -0.48f, 0.8f}, origin, 1, 0.01, (unsigned)k % 4);
        random_waves(&sheet, 12, 2);
        memset(sheet.panels[0].cells, 0, sizeof sheet.panels[0].cells);
        sheet.panels[0].cells[(3 * k + 5) % side] = (uint16_t)(1 << (5 * k) % side);
        struct spl_dataset *dataset = add_sheet(&sheet);
        struct spl_view view = looking(origin, 20 * pow(10, uniform()), 64, 48);
        view.method = drawing[k / 4 % 2];
        view.lod = k % 3 ? 0 : 1;
        view.camera.cx += uniform();
        view.camera.cy += uniform();
        struct spl_frame frame = render(dataset, &view);
        const float *coverage = frame.images[SPL_LAYER_COVERAGE].pixels;
        unsigned samples = 0;
        for (size_t i = 0; i < 64 * 48; i++)
            samples += coverage[i] > 0;
        assert_in_range(samples, 1, 2);
        spl_frame_finish(&frame);
        done(dataset);
    }
}

/* A slope that is looked along is a line without gaps, however the plane beneath it lies. */
static void slopes_along_their_edge_are_lines(void **state)
{
    (void)state;
    for (int k = 0; k < TEST_SIZE(8, 2); k++) {
        struct make_sheet sheet;
        make_sheet_begin(&sheet, (float[]){0, 0, 1}, origin, 2, 0.01, (unsigned)k % 4);
        for (size_t i = 0; i < sheet.made.count; i++) { /* it rises along y as it goes along it */
            struct spl_relief *relief = &sheet.reliefs[i];
            int points = (1 << relief->level) + 1;
            for (int p = 0; p < points * points; p++)
                relief->height[p] =
                    0.01f * side * ((float)sheet.panels[i].row - 1 + (float)(p / points) / (float)(points - 1));
        }
        struct spl_dataset *dataset = add_sheet(&sheet);
        struct spl_panel_frame plane;
        uint64_t chunks;
        spl_panels_get_frame(spl_dataset_get_chunks(dataset, &chunks), &plane);
        struct spl_view view = looking(origin, 1, 200, 150);
        double turn = 6.28 * uniform(), eye[3];
        for (int a = 0; a < 3; a++) /* along the slope, in its plane */
            eye[a] = 3 * (cos(turn) * (double)plane.u[a] +
                          sin(turn) * sqrt(0.5) * ((double)plane.v[a] + (double)plane.normal[a]));
        const double up[3] = {0.3, 0.2, 1};
        assert_int_equal(spl_camera_look_at(&view.camera, eye, origin, up, NULL), SPL_OK);
        view.camera.cx += uniform();
        view.camera.cy += uniform();
        view.method = drawing[k % 2];
        struct spl_frame frame = render(dataset, &view);
        const float *coverage = frame.images[SPL_LAYER_COVERAGE].pixels;
        size_t gaps[2] = {0}, count[2] = {0};
        for (int rows = 0; rows < 2; rows++) {
            size_t run = 0, wide = rows ? 150 : 200;
            for (size_t i = 0; i < wide; i++) {
                bool has = false;
                for (size_t p = 0; p < (rows ? 200 : 150); p++)
                    has |= coverage[rows ? i * 200 + p : p * 200 + i] > 0;
                gaps[rows] += has && count[rows] ? run : 0;
                run = has ? 0 : run + 1;
                count[rows] += has;
            }
        }
        double longest = (double)(count[0] > count[1] ? count[0] : count[1]), expected = 0.3 * view.camera.fx / 3.4;
        if (gaps[0] || gaps[1] || longest < 0.7 * expected)
            fail_msg("%s, %d: %zu columns and %zu rows are covered, with %zu and %zu gaps; %g of them expected",
                     spl_method_name(view.method), k, count[0], count[1], gaps[0], gaps[1], expected);
        spl_frame_finish(&frame);
        done(dataset);
    }
}

/* A mesh so near that each of its triangles covers many windows: every round that it takes is done. */
static void the_largest_triangles_are_whole(void **state)
{
    (void)state;
    for (unsigned level = 0; level < 4; level++) {
        struct make_sheet sheet;
        make_sheet_begin(&sheet, (float[]){0, -1, 0}, origin, 1, 0.4, level);
        random_waves(&sheet, 0.5, 3);
        struct spl_dataset *dataset = add_sheet(&sheet);
        struct spl_view view = looking(origin, 1, 1000, 640);
        look(&view, (double[]){0.1, -1, 0.05}, (double[]){0, 0, 0.1});
        for (int method = 0; method < 2; method++) {
            view.method = drawing[method];
            view.layers = 1u << SPL_LAYER_DEPTH | 1u << SPL_LAYER_COVERAGE;
            struct spl_frame frame = render(dataset, &view);
            const float *coverage = frame.images[SPL_LAYER_COVERAGE].pixels;
            size_t holes = 0;
            for (size_t i = 0; i < 1000 * 640; i++)
                holes += !(coverage[i] > 0);
            assert_int_equal(holes, 0);
            spl_frame_finish(&frame);
        }
        done(dataset);
    }
}

/* Of triangles that cross the near plane only what lies behind it is drawn. */
static void nothing_is_drawn_before_the_near_plane(void **state)
{
    (void)state;
    struct make_sheet sheet;
    size_t covered = 0;
    make_sheet_begin(&sheet, (float[]){0.1f, -0.2f, 0.97f}, origin, 3, 0.05, 1);
    random_waves(&sheet, 4, 2);
    struct spl_dataset *dataset = add_sheet(&sheet);
    for (int method = 0; method < 2; method++) {
        struct spl_view view = looking(origin, 1.2, 120, 90);
        view.method = drawing[method];
        view.camera.near = 1.1;
        struct spl_frame frame = render(dataset, &view);
        const float *depth = frame.images[SPL_LAYER_DEPTH].pixels;
        for (int i = 0; i < 120 * 90; i++) {
            covered += !isnan(depth[i]);
            assert_false((double)depth[i] < 0.999 * view.camera.near);
        }
        spl_frame_finish(&frame);
    }
    assert_true(covered > 2000);
    done(dataset);
}

/* A pick on a mesh says its id, that it is one, and where. */
static void picks_say_which_mesh(void **state)
{
    (void)state;
    struct make_sheet sheet;
    make_sheet_begin(&sheet, (float[]){0, -1, 0}, origin, 4, 0.05, 2);
    random_waves(&sheet, 4, 3);
    struct spl_dataset *dataset = add_sheet(&sheet);
    for (int method = 0; method < 2; method++) {
        struct spl_view view = looking(origin, 1, 200, 150);
        struct spl_pick pick;
        view.method = drawing[method];
        look(&view, (double[]){0.1, -1.5, 0.05}, (double[]){0, 0, 0});
        struct spl_frame frame = render(dataset, &view);
        for (int k = 0; k < 20; k++) {
            uint32_t x = (uint32_t)(200 * uniform()), y = (uint32_t)(150 * uniform());
            assert_int_equal(spl_renderer_pick(renderer, dataset, &view, x + 0.5, y + 0.5, &pick, NULL), SPL_OK);
            assert_true(pick.hit);
            assert_int_equal(pick.primitive, SPL_SHAPE_MESH);
            assert_int_equal(((uint32_t *)frame.images[SPL_LAYER_PRIMITIVE].pixels)[200 * y + x], SPL_SHAPE_MESH);
            assert_int_equal(pick.splat, ((uint32_t *)frame.images[SPL_LAYER_ID].pixels)[200 * y + x]);
            assert_true(fabs(pick.position[1]) < 0.21);
            assert_true(fabs(pick.depth / (double)((float *)frame.images[SPL_LAYER_DEPTH].pixels)[200 * y + x] - 1) <
                        1e-6);
        }
        spl_frame_finish(&frame);
    }
    done(dataset);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        frames_test(rays_find_the_same),
        frames_test(what_is_closed_shows_no_hole),
        frames_test(a_flat_mesh_is_a_panel),
        frames_test(a_cell_far_away_does_not_vanish),
        frames_test(slopes_along_their_edge_are_lines),
        frames_test(the_largest_triangles_are_whole),
        frames_test(nothing_is_drawn_before_the_near_plane),
        frames_test(picks_say_which_mesh),
    };
    return frames_run(argc, argv, "triangles", tests, sizeof tests / sizeof *tests);
}
