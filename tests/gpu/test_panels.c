/* Panels by what must be seen of them: walls that are closed, floors at a slant, planes along their edge, cells far
 * away, thin walls, what is hidden, what stations colour and trim, picks. One body for every backend. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "dataset/panels.h"
#include "gpu/frames.h"
#include "gpu/panel_scenes.h"
#include "support/mapped_dataset.h"
#include "support/sanitised.h"

enum { side = SPL_PANEL_SIDE };

/* What a ball behind waves of colour shows, and sky and what was not scanned around it. */
static void look_around(const struct make_map *map, const double d[3], double color[3], double *range)
{
    double away = 0, along = 0, local[3];
    mapped_local(&map->row, origin, local);
    for (int i = 0; i < 3; i++) {
        away += local[i] * local[i];
        along += local[i] * d[i];
        color[i] = 127.5 + 100 * sin(7 * d[i] + 4 * d[(i + 1) % 3]);
    }
    double root = along * along - away + 0.36;
    *range = root > 0 && along > 0 ? fmax(along - sqrt(root), 0.06) : sin(20 * d[2]) > 0 ? INFINITY : NAN;
}

/* Stations colour panels and trim them as they do discs, in either form. */
static void maps_colour_and_trim_panels(void **state)
{
    (void)state;
    static const double places[3][3] = {{3, 0.5, 1}, {-1, -2.5, 0.2}, {0.1, 0.2, 0.05}};
    for (uint64_t seed = 1; seed <= TEST_SIZE(4, 2); seed++) {
        random_state = 300 + seed;
        struct spl_dataset *plain = random_panels(4, seed % 2 ? 300 : 0, origin, 0.012, seed > 2 ? 3 : 0);
        struct make_map maps[3];
        for (uint32_t i = 0; i < 3; i++) {
            maps[i] = (struct make_map){.row = mapped_row(places[i], 1 + i, 64, 1 + i, 30 + 7 * i),
                                        .look = look_around};
            maps[i].row.slack = 0.05f; /* much is near enough to the ball to have its colour */
        }
        struct spl_dataset *dataset = make_mapped_alike(plain, maps, 3, seed != 1);
        assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
        struct spl_view view = looking(origin, seed == 4 ? 0.8 : 3, 160, 120);
        for (int method = 0; method < SPL_METHOD_COUNT; method++)
            if (spl_method_get_params((enum spl_method)method) & SPL_PARAM_BIT(maps)) {
                same_of(dataset, &view, (enum spl_method)method, "mapped");
                struct spl_view on = view, off;
                struct spl_frame with, without;
                on.method = (enum spl_method)method;
                on.shapes = SPL_SHAPES_ALL;
                off = on;
                off.maps = SPL_MAPS_OFF;
                assert_int_equal(spl_renderer_render(renderer, dataset, &on, &with, NULL), SPL_OK);
                assert_int_equal(spl_renderer_render(renderer, dataset, &off, &without, NULL), SPL_OK);
                struct tally t = compare(&with, &without);
                if (seed <= 3 && (t.color_differs < 50 || (t.covered_differs > 50) != (seed != 1)))
                    fail_msg("%zu, %s: maps change %zu colours and take %zu samples away", (size_t)seed,
                             spl_method_name(method), t.color_differs, t.covered_differs);
                spl_frame_finish(&with);
                spl_frame_finish(&without);
            }
        done(dataset);
        done(plain);
    }
}

/* 15 mm more than the wall lies from the station, straight ahead. */
static void look_behind(const struct make_map *map, const double d[3], double color[3], double *range)
{
    (void)map, (void)d;
    color[0] = color[1] = color[2] = 100;
    *range = 2.015;
}

/* A wall of whole panels on the plane of `normal` through the origin, `across` a side, cells of `cell` metres and one
 * colour; `hole` of its cells across and up from the middle are not there. */
static struct spl_dataset *make_wall(const float normal[3], unsigned across, double cell, int hole)
{
    struct make_panels wall = {
        .plane = {.cell = (float)cell, .points = 1000}, .color_error = 3, .classification = 6};
    struct spl_panel *panels = calloc((size_t)across * across, sizeof *panels);
    struct spl_panel_frame frame;
    struct spl_chunk chunk;
    assert_non_null(panels);
    memcpy(wall.plane.normal, normal, sizeof wall.plane.normal);
    spl_panels_begin(&wall.plane, &chunk);
    spl_panels_get_frame(&chunk, &frame);
    int middle = (int)(side * across / 2);
    for (int c = 0; c < 3; c++)
        wall.plane.origin[c] = -cell * middle * ((double)frame.u[c] + (double)frame.v[c]);
    for (unsigned i = 0; i < across * across; i++) {
        struct spl_panel panel = {.column = (uint8_t)(i % across), .row = (uint8_t)(i / across)};
        bool any = false;
        for (int y = 0; y < side; y++)
            for (int x = 0; x < side; x++) {
                int from[2] = {side * panel.column + x - middle, side * panel.row + y - middle};
                bool there = !(from[0] >= 0 && from[0] < hole && from[1] >= 0 && from[1] < hole);
                panel.cells[y] |= (uint16_t)(there << x);
                any |= there;
                memcpy(panel.color[y][x], (uint8_t[]){200, 120, 40}, 3);
            }
        if (any)
            panels[wall.count++] = panel;
    }
    wall.panels = panels;
    struct spl_dataset *dataset = make_dataset_panels(NULL, 0, &wall, 1, 1);
    free(panels);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    return dataset;
}

/* Where the ray of a sample meets a plane through the origin: its depth, and *at in cells from the origin. */
static double meet(const struct spl_camera *c, const struct spl_panel_frame *plane, int x, int y, double at[2])
{
    double ray[3], facing = 0, away = 0;
    for (int a = 0; a < 3; a++) {
        ray[a] = c->rotation[a] * (x + 0.5 - c->cx) / c->fx + c->rotation[3 + a] * (y + 0.5 - c->cy) / c->fy +
                 c->rotation[6 + a];
        facing += (double)plane->normal[a] * ray[a];
        away -= (double)plane->normal[a] * c->eye[a];
    }
    double z = away / facing;
    at[0] = at[1] = 0;
    for (int a = 0; a < 3; a++) {
        at[0] += (double)plane->u[a] * (c->eye[a] + z * ray[a]) / (double)plane->cell;
        at[1] += (double)plane->v[a] * (c->eye[a] + z * ray[a]) / (double)plane->cell;
    }
    return z;
}

static const enum spl_method drawing[] = {SPL_METHOD_SPLAT, SPL_METHOD_NEAREST};

/* A wall is closed where it is, whatever a cell takes of the image, and its hole is open: of cells of less than a
 * sample up to ones of a hundred, depth and normal to a float. */
static void a_wall_is_closed_and_its_hole_open(void **state)
{
    (void)state;
    const float normal[3] = {0.1f, -0.99f, 0.0995f};
    struct spl_view view = looking(origin, 1, 200, 150);
    for (int method = 0; method < 2; method++)
        for (double cell = 0.0007; cell < 0.2; cell *= 3.1) {
            unsigned across = (unsigned)(1.6 / (cell * side)) + 2;
            across += across % 2;
            struct spl_dataset *dataset = make_wall(normal, across, cell, 3);
            view.method = drawing[method];
            view.lod = 0;
            look(&view, (double[]){0.05, -1, 0.02}, origin);
            struct spl_frame frame = render(dataset, &view);
            const float *depth = frame.images[SPL_LAYER_DEPTH].pixels;
            uint64_t chunks;
            struct spl_panel_frame plane;
            spl_panels_get_frame(spl_dataset_get_chunks(dataset, &chunks), &plane);
            size_t holes = 0, wrong = 0, open = 0;
            for (int y = 0; y < 150; y++)
                for (int x = 0; x < 200; x++) { /* where the ray meets the wall, in doubles */
                    double at[2], z = meet(&view.camera, &plane, x, y, at);
                    bool in = at[0] > -0.05 && at[0] < 3.05 && at[1] > -0.05 && at[1] < 3.05;
                    bool inner = at[0] > 0.05 && at[0] < 2.95 && at[1] > 0.05 && at[1] < 2.95;
                    float is = depth[200 * y + x];
                    holes += !in && isnan(is);
                    open += inner && isnan(is);
                    /* a hole of one sample is a speck, which is closed */
                    wrong += (inner && !isnan(is) && cell > 0.005) ||
                             (!in && !isnan(is) && fabs((double)is / z - 1) > 1e-5);
                }
            if (holes || wrong)
                fail_msg("%s, cells of %g m: %zu samples of the wall are empty, %zu wrong",
                         spl_method_name(view.method), cell, holes, wrong);
            assert_true(open > 0 || cell <= 0.005);
            spl_frame_finish(&frame);
            done(dataset);
        }
}

/* What lies as little before a station's ranges as its cells are wide was not seen through. */
static void a_station_sees_through_no_cell(void **state)
{
    (void)state;
    struct spl_dataset *plain = make_wall((float[]){0, -1, 0}, 2, 0.05, 0);
    struct make_map map = {.row = mapped_row((double[]){0, -2, 0}, 0.3, 64, 1, 64), .look = look_behind};
    map.row.slack = 0.001f;
    struct spl_dataset *dataset = make_mapped_alike(plain, &map, 1, true);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    for (int method = 0; method < 2; method++) {
        struct spl_view view = looking(origin, 1, 100, 75);
        view.method = drawing[method];
        look(&view, (double[]){0.1, -1, 0.05}, origin);
        struct spl_frame with = render(dataset, &view), without = render(plain, &view);
        struct tally t = compare(&with, &without);
        assert_true(t.covered_differs == 0 && t.color_differs > 1000);
        spl_frame_finish(&with);
        spl_frame_finish(&without);
    }
    done(dataset);
    done(plain);
}

/* Planes near and far cut a wall where they are, and leave all of it between them. */
static void a_wall_is_whole_between_near_and_far(void **state)
{
    (void)state;
    enum { across = 4, width = 100, height = 75 };
    const float normal[3] = {0, -1, 0};
    const double half = side * across / 2 - 0.1; /* cells */
    struct spl_dataset *dataset = make_wall(normal, across, 0.05, 0);
    uint64_t chunks;
    struct spl_panel_frame plane;
    spl_panels_get_frame(spl_dataset_get_chunks(dataset, &chunks), &plane);
    size_t seen = 0, before = 0, beyond = 0;
    for (int k = 0; k < 24; k++) {
        struct spl_view view = looking(origin, 1, width, height);
        view.method = drawing[k % 2];
        view.lod = 0;
        look(&view, (double[]){4 * uniform() - 2, -0.1 - uniform(), 4 * uniform() - 2}, origin);
        view.camera.near = 0.3 + uniform();
        view.camera.far = view.camera.near + 0.2 + uniform();
        struct spl_frame frame = render(dataset, &view);
        const float *depth = frame.images[SPL_LAYER_DEPTH].pixels;
        for (int i = 0; i < width * height; i++) {
            double at[2], z = meet(&view.camera, &plane, i % width, i / width, at);
            if (!(z > 0 && fabs(at[0]) < half && fabs(at[1]) < half))
                continue;
            bool is = !isnan(depth[i]), in = z > 1.001 * view.camera.near && z < 0.999 * view.camera.far;
            bool out = z < 0.95 * view.camera.near || z > 1.05 * view.camera.far; /* cells of their own reach farther */
            if ((in && !is) || (out && is))
                fail_msg("%s, view %d: a sample %g m away is %s", spl_method_name(view.method), k, z,
                         is ? "there" : "empty");
            seen += in;
            before += z < view.camera.near;
            beyond += z > view.camera.far;
        }
        spl_frame_finish(&frame);
    }
    assert_true(seen > 10000 && before > 1000 && beyond > 1000);
    done(dataset);
}

/* Far away on a floor, where a sample holds the depths of many panels, its depth is that at its middle, and not that of
 * the nearest cell, which is 3 % less. */
static void a_floor_at_a_slant_is_where_it_is(void **state)
{
    (void)state;
    enum { across = 40 };
    const float normal[3] = {0, 0, 1};
    struct spl_dataset *dataset = make_wall(normal, across, 0.02, 0);
    struct spl_view view = looking(origin, 1, 200, 150);
    uint64_t chunks;
    struct spl_panel_frame plane;
    spl_panels_get_frame(spl_dataset_get_chunks(dataset, &chunks), &plane);
    for (int k = 0; k < 6; k++) {
        size_t seen = 0;
        view.method = drawing[k % 2];
        look(&view, (double[]){5 * uniform(), -10.0 - 5 * k, 1.7}, origin);
        struct spl_frame frame = render(dataset, &view);
        const float *depth = frame.images[SPL_LAYER_DEPTH].pixels;
        for (int y = 0; y < 150; y++)
            for (int x = 0; x < 200; x++) {
                const double most = side * across / 2 * 0.8;
                double at[2], z = meet(&view.camera, &plane, x, y, at);
                if (!(z > 0 && fabs(at[0]) < most && fabs(at[1]) < most))
                    continue;
                seen++;
                if (!(fabs((double)depth[200 * y + x] / z - 1) < 5e-3))
                    fail_msg("%s, view %d: depth %g instead of %g", spl_method_name(view.method), k,
                             (double)depth[200 * y + x], z);
            }
        assert_true(seen > 40);
        spl_frame_finish(&frame);
    }
    done(dataset);
}

/* Columns (or rows) of the image without a sample, between the first and the last that have one. */
static size_t count_gaps(const struct spl_frame *frame, bool rows, size_t *covered)
{
    const float *coverage = frame->images[SPL_LAYER_COVERAGE].pixels;
    size_t width = frame->images[SPL_LAYER_COVERAGE].width, height = frame->images[SPL_LAYER_COVERAGE].height;
    size_t gaps = 0, run = 0, across = rows ? height : width;
    *covered = 0;
    for (size_t i = 0; i < across; i++) {
        bool has = false;
        for (size_t k = 0; k < (rows ? width : height); k++)
            has |= coverage[rows ? i * width + k : k * width + i] > 0;
        gaps += has && *covered ? run : 0;
        run = has ? 0 : run + 1;
        *covered += has;
    }
    return gaps;
}

/* A strip seen along its plane, or nearly so, is a line without gaps, as its cells' discs are. */
static void planes_along_their_edge_are_lines(void **state)
{
    (void)state;
    const float normal[3] = {0, 0, 1};
    struct spl_dataset *dataset = make_wall(normal, 2, 0.01, 0);
    struct spl_view view = looking(origin, 1, 200, 150);
    for (int method = 0; method < 2; method++)
        for (int k = 0; k < 40; k++) {
            double angle = k < 10 ? 0 : 0.02 * uniform() * uniform(), turn = 6.28 * uniform(), covered_share = 0.9;
            view.method = drawing[method];
            look(&view, (double[]){3 * cos(turn), 3 * sin(turn), 3 * sin(angle)}, (double[]){0, 0, 0.2 * uniform()});
            view.camera.cx += uniform();
            view.camera.cy += uniform();
            struct spl_frame frame = render(dataset, &view);
            size_t covered, gaps = count_gaps(&frame, false, &covered);
            double wide = 0.32 * view.camera.fx / 3.3; /* at least, of its 32 cells */
            if (gaps || (double)covered < covered_share * wide)
                fail_msg("%s, view %d: of %g columns or more %zu are covered, with %zu gaps",
                         spl_method_name(view.method), k, wide, covered, gaps);
            spl_frame_finish(&frame);
            if (k % 5 == 0)
                same_of(dataset, &view, view.method, "along its edge");
        }
    done(dataset);
}

/* A panel of one cell, less than a sample wide, covers a sample or two wherever it falls. */
static void a_cell_far_away_does_not_vanish(void **state)
{
    (void)state;
    struct spl_panel one = {.color[7][3] = {250, 20, 90}};
    one.cells[7] = 1 << 3;
    struct make_panels panels = {.plane = {.cell = 0.01f, .normal = {0.36f, -0.48f, 0.8f}, .points = 1},
                                 .panels = &one,
                                 .count = 1};
    struct spl_dataset *dataset = make_dataset_panels(NULL, 0, &panels, 1, 1);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    for (int k = 0; k < 60; k++) {
        struct spl_view view = looking(origin, 20 * pow(10, uniform()), 64, 48);
        view.method = drawing[k % 2];
        view.lod = k % 3 ? 0 : 1;
        view.camera.cx += uniform();
        view.camera.cy += uniform();
        struct spl_frame frame = render(dataset, &view);
        const float *coverage = frame.images[SPL_LAYER_COVERAGE].pixels;
        const uint8_t *color = frame.images[SPL_LAYER_COLOR].pixels;
        unsigned samples = 0;
        for (size_t i = 0; i < 64 * 48; i++)
            if (coverage[i] > 0) {
                samples++;
                assert_in_range(color[4 * i], 246, 254);
                assert_in_range(color[4 * i + 1], 16, 24);
            }
        assert_in_range(samples, 1, 2);
        spl_frame_finish(&frame);
    }
    done(dataset);
}

/* Two faces closer than a cell, each seen from its own side: the other's colour is not mixed in. As discs likewise. */
static void a_thin_wall_shows_the_face_that_it_turns(void **state)
{
    (void)state;
    const uint8_t red[3] = {200, 0, 0}, blue[3] = {0, 0, 200};
    struct spl_panel panels[2] = {{.column = 0}, {.column = 0}};
    struct make_panels faces[2];
    for (int f = 0; f < 2; f++) {
        for (int y = 0; y < side; y++)
            for (int x = 0; x < side; x++) {
                panels[f].cells[y] |= (uint16_t)(1u << x);
                memcpy(panels[f].color[y][x], f ? blue : red, 3);
            }
        struct spl_panel_frame frame;
        struct spl_chunk chunk;
        faces[f] = (struct make_panels){
            .plane = {.normal = {0, f ? 1 : -1, 0}, .cell = 0.03f, .points = 200}, .panels = &panels[f], .count = 1};
        spl_panels_begin(&faces[f].plane, &chunk);
        spl_panels_get_frame(&chunk, &frame);
        for (int c = 0; c < 3; c++)
            faces[f].plane.origin[c] = (c == 1 ? 0.005 * f : 0) -
                                       0.03 * side / 2 * ((double)frame.u[c] + (double)frame.v[c]);
    }
    struct spl_dataset *dataset = make_dataset_panels(NULL, 0, faces, 2, 1);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    for (int i = 0; i < 8; i++) {
        struct spl_view view = looking(origin, 1, 64, 48);
        look(&view, (double[3]){0.1, i % 2 ? 1 : -1, 0.05}, origin);
        view.method = drawing[i / 2 % 2];
        view.shapes = i / 4 ? SPL_SHAPES_ALL : SPL_SHAPES_OFF;
        struct spl_frame frame = render(dataset, &view);
        const uint8_t *middle = (const uint8_t *)frame.images[SPL_LAYER_COLOR].pixels + 4 * (24 * 64 + 32);
        assert_true(middle[i % 2 ? 2 : 0] > 190 && middle[i % 2 ? 0 : 2] < 10);
        spl_frame_finish(&frame);
    }
    done(dataset);
}

/* The nearer half hides what is behind it, chunk by chunk; the reference hides nothing. A wall of panels before flocks
 * of discs and other panels, and one of discs before panels. */
static void what_is_hidden_changes_nothing(void **state)
{
    (void)state;
    enum { behind = 6000, flock = 128 };
    for (int front = 0; front < 2; front++) {
        struct make_splat *splats = random_splats(behind, origin, 0.01);
        struct make_panels made[21] = {0};
        struct spl_panel panels[21][SPL_PANELS_MAX] = {0};
        for (int i = 0; i < behind; i++) {
            bool wall = front == 1 && i < behind / 2;
            if (wall) {
                splats[i] = (struct make_splat){.position = {0.04 * (i % 55) - 1.1, -1, 0.04 * (i / 55) - 1.1},
                                                .normal = {0, -1, 0},
                                                .radius = 0.05f,
                                                .color = {10, 200, 30}};
                continue;
            }
            for (int c = 0; c < 3; c++) /* small flocks, so that whole chunks hide */
                splats[i].position[c] = splats[i - i % flock].position[c] * 0.8 + 0.1 * uniform();
        }
        for (int p = 0; p < 21; p++) {
            bool wall = p == 20;
            made[p].plane = (struct spl_panel_plane){.cell = wall ? 0.025f : 0.004f, .normal = {0, -1, 0}, .points = 9};
            made[p].panels = panels[p];
            made[p].color_error = 4;
            for (int c = 0; c < 3; c++)
                made[p].plane.origin[c] = wall ? -1.1 : 1.2 * uniform() - 0.6;
            made[p].plane.origin[1] = wall ? -1.2 : made[p].plane.origin[1];
            made[p].plane.origin[0] = wall ? 1.1 : made[p].plane.origin[0]; /* u points to -x of such a normal or +x */
            for (int i = 0; i < 30 && (!wall || !front); i++) {
                random_panel(&panels[p][made[p].count], (unsigned)i % 6, (unsigned)i / 6);
                for (int y = 0; y < side && wall; y++)
                    panels[p][made[p].count].cells[y] = 0xffff;
                made[p].count++;
            }
        }
        struct spl_panel_frame frame;
        struct spl_chunk chunk;
        spl_panels_begin(&made[20].plane, &chunk);
        spl_panels_get_frame(&chunk, &frame);
        made[20].plane.origin[0] = frame.u[0] > 0 ? -1.1 : 1.1;
        made[20].plane.origin[2] = frame.v[2] > 0 ? -1.0 : 1.0;
        struct spl_dataset *dataset = make_dataset_panels(splats, behind, made, front ? 20 : 21, 1);
        free(splats);
        assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
        struct spl_view view = looking(origin, 3, 160, 120);
        for (int side_on = 0; side_on < 2; side_on++) {
            same_images(dataset, &view, "splat"); /* its cells are too many for the largest weight, as discs */
            same_of(dataset, &view, SPL_METHOD_NEAREST, side_on ? "from the front" : "from aside");
            same_of(dataset, &view, SPL_METHOD_POINTS, side_on ? "from the front" : "from aside");
            look(&view, (double[]){0.1, -4, 0.2}, origin);
        }
        done(dataset);
    }
}

/* A pick on a panel says its id, class, plane and place. */
static void picks_say_which_panel(void **state)
{
    (void)state;
    const float normal[3] = {0, -1, 0};
    struct spl_dataset *dataset = make_wall(normal, 4, 0.05, 0);
    for (int method = 0; method < 2; method++) {
        struct spl_view view = looking(origin, 1, 200, 150);
        struct spl_pick pick;
        view.method = drawing[method];
        look(&view, (double[]){0.1, -1, 0.05}, (double[]){0, 0, 0});
        struct spl_frame frame = render(dataset, &view);
        for (int k = 0; k < 20; k++) {
            int x = (int)(200 * uniform()), y = (int)(150 * uniform());
            assert_int_equal(spl_renderer_pick(renderer, dataset, &view, x + 0.5, y + 0.5, &pick, NULL), SPL_OK);
            assert_true(pick.hit);
            assert_true(fabs(pick.position[1]) < 1e-5);
            assert_true(pick.normal[1] < -0.999);
            assert_int_equal(pick.splat, ((uint32_t *)frame.images[SPL_LAYER_ID].pixels)[200 * y + x]);
            assert_int_equal(pick.classification, 6);
        }
        spl_frame_finish(&frame);
    }
    done(dataset);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        frames_test(maps_colour_and_trim_panels),
        frames_test(a_wall_is_closed_and_its_hole_open),
        frames_test(a_station_sees_through_no_cell),
        frames_test(a_wall_is_whole_between_near_and_far),
        frames_test(a_floor_at_a_slant_is_where_it_is),
        frames_test(planes_along_their_edge_are_lines),
        frames_test(a_cell_far_away_does_not_vanish),
        frames_test(a_thin_wall_shows_the_face_that_it_turns),
        frames_test(what_is_hidden_changes_nothing),
        frames_test(picks_say_which_panel),
    };
    return frames_run(argc, argv, "panels", tests, sizeof tests / sizeof *tests);
}
