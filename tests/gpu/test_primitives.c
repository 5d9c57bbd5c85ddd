/* Layer primitive and picks over splats, lines and panels: each pixel says as what it is drawn, by every method, and a
 * pick there says the same, with the plane where it is a panel. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "gpu/frames.h"

enum { width = 200, height = 150, side = SPL_PANEL_SIDE, columns = 40, splat_count = columns * columns };
static const double cell = 0.03, center[3] = {100.4, 200, 5.25}; /* of the panel */

/* Splats to the left of a panel of a wall, in its plane, and a wire before both; looked at squarely. */
static struct spl_dataset *make_scene(const struct make_panels *panels)
{
    struct make_splat *splats = calloc(splat_count + 2, sizeof *splats);
    assert_non_null(splats);
    for (size_t i = 0; i < splat_count + 2; i++) {
        size_t column = i % columns, row = i / columns;
        splats[i] = (struct make_splat){.position = {99.15 + 0.02 * (double)column, 200, 4.9 + 0.02 * (double)row},
                                        .normal = {0, -1, 0},
                                        .radius = 0.025f,
                                        .color = {50, 100, 150},
                                        .classification = 6};
    }
    for (size_t i = splat_count; i < splat_count + 2; i++) {
        splats[i].position[0] = i == splat_count ? 99 : 101;
        splats[i].position[1] = 199.8;
        splats[i].position[2] = 5.2;
        splats[i].vertex = true;
        splats[i].linear = i == splat_count;
    }
    struct spl_dataset *dataset = make_dataset_panels(splats, splat_count + 2, panels, 1, 1);
    free(splats);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    return dataset;
}

static struct make_panels make_wall(struct spl_panel *panel)
{
    struct spl_panel_plane plane = {
        .normal = {0, -1, 0}, .cell = (float)cell, .error_mean = 0.004f, .error_most = 0.01f, .points = 1234};
    struct spl_panel_frame frame;
    struct spl_chunk chunk;
    spl_panels_begin(&plane, &chunk);
    spl_panels_get_frame(&chunk, &frame);
    for (int i = 0; i < 3; i++)
        plane.origin[i] = center[i] - 0.5 * side * cell * (double)(frame.u[i] + frame.v[i]);
    memset(panel, 0, sizeof *panel);
    for (int y = 0; y < side; y++)
        panel->cells[y] = 0xffff;
    return (struct make_panels){.plane = plane, .panels = panel, .count = 1};
}

static struct spl_view squarely(enum spl_method method)
{
    struct spl_view view = looking(origin, 1, width, height);
    const double eye[3] = {100.05, 198.7, 5.25}, target[3] = {100.05, 200, 5.25}, up[3] = {0, 0, 1};
    assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
    view.method = method;
    view.lod = 0;
    return view;
}

static uint32_t shape_at(const struct spl_frame *frame, size_t at)
{
    return ((const uint32_t *)frame->images[SPL_LAYER_PRIMITIVE].pixels)[at];
}

/* Pixels of each shape in columns [from, to). */
static void count_shapes(const struct spl_frame *frame, uint32_t from, uint32_t to, size_t shapes[SPL_SHAPE_COUNT])
{
    memset(shapes, 0, SPL_SHAPE_COUNT * sizeof *shapes);
    for (size_t at = 0; at < width * height; at++) {
        uint32_t shape = shape_at(frame, at);
        assert_true(shape < SPL_SHAPE_COUNT);
        if (at % width >= from && at % width < to)
            shapes[shape]++;
    }
}

static void each_pixel_says_what_it_shows(void **state)
{
    (void)state;
    struct spl_panel panel;
    struct make_panels panels = make_wall(&panel);
    struct spl_dataset *dataset = make_scene(&panels);
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        for (int shapes = 0; shapes < SPL_SHAPES_COUNT; shapes++) {
            struct spl_view view = squarely((enum spl_method)method);
            struct spl_frame frame;
            size_t left[SPL_SHAPE_COUNT], right[SPL_SHAPE_COUNT];
            view.shapes = (enum spl_shapes)shapes;
            assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_OK);
            count_shapes(&frame, 0, width / 2 - 4, left);
            count_shapes(&frame, width / 2 + 8, width, right);
            assert_true(left[SPL_SHAPE_SPLAT] > (method == SPL_METHOD_POINTS ? 500 : 3000));
            assert_true(right[SPL_SHAPE_PANEL] > (method == SPL_METHOD_POINTS ? 100 : 2000));
            assert_int_equal(left[SPL_SHAPE_PANEL] + right[SPL_SHAPE_SPLAT], 0);
            assert_int_equal(left[SPL_SHAPE_MESH] + right[SPL_SHAPE_MESH], 0);
            if (method == SPL_METHOD_FILL)
                assert_true(left[SPL_SHAPE_LINE] > width / 2 - 20 && right[SPL_SHAPE_LINE] > width / 2 - 20);
            for (size_t at = 0; at < width * height; at++)
                assert_true((shape_at(&frame, at) == SPL_SHAPE_NONE) ==
                            isnan(((const float *)frame.images[SPL_LAYER_DEPTH].pixels)[at]));
            spl_frame_finish(&frame);
            same_images(dataset, &view, spl_method_name(view.method));
        }
    }
    done(dataset);
}

/* What a frame has drawn is counted by kind: of the scene's one panel, its wire and its splats. */
static void each_kind_is_counted_by_itself(void **state)
{
    (void)state;
    struct spl_panel panel;
    struct make_panels panels = make_wall(&panel);
    struct spl_dataset *dataset = make_scene(&panels);
    for (int method = 0; method < SPL_METHOD_COUNT; method++)
        for (int away = 0; away < 2; away++) {
            struct spl_view view = squarely((enum spl_method)method);
            const double up[3] = {0, 0, 1}, eye[3] = {100.05, 198.7, 5.25}, behind[3] = {100.05, 190, 5.25};
            struct spl_frame frame;
            if (away)
                assert_int_equal(spl_camera_look_at(&view.camera, eye, behind, up, NULL), SPL_OK);
            assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_OK);
            assert_int_equal(frame.stats.splats_drawn, away ? 0 : splat_count);
            assert_int_equal(frame.stats.panels_drawn, !away);
            assert_int_equal(frame.stats.lines_drawn, !away && method == SPL_METHOD_FILL);
            assert_int_equal(frame.stats.meshes_drawn, 0);
            spl_frame_finish(&frame);
        }
    done(dataset);
}

/* Alone it is drawn as beside all others, of samples as of pixels. */
static void it_needs_no_other_layer(void **state)
{
    (void)state;
    struct spl_panel panel;
    struct make_panels panels = make_wall(&panel);
    struct spl_dataset *dataset = make_scene(&panels);
    for (int method = 0; method < SPL_METHOD_COUNT; method++)
        for (int samples = 1; samples <= 2; samples++) {
            struct spl_view view = squarely((enum spl_method)method);
            struct spl_frame all, one;
            view.supersample = samples;
            assert_int_equal(spl_renderer_render(renderer, dataset, &view, &all, NULL), SPL_OK);
            view.layers = 1u << SPL_LAYER_PRIMITIVE;
            assert_int_equal(spl_renderer_render(renderer, dataset, &view, &one, NULL), SPL_OK);
            assert_null(one.images[SPL_LAYER_COLOR].pixels);
            assert_memory_equal(all.images[SPL_LAYER_PRIMITIVE].pixels, one.images[SPL_LAYER_PRIMITIVE].pixels,
                                width * height * 4);
            spl_frame_finish(&all);
            spl_frame_finish(&one);
        }
    done(dataset);
}

static void a_pick_says_the_same_and_the_plane(void **state)
{
    (void)state;
    struct spl_panel panel;
    struct make_panels panels = make_wall(&panel);
    struct spl_dataset *dataset = make_scene(&panels);
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        struct spl_view view = squarely((enum spl_method)method);
        struct spl_frame frame;
        int seen[SPL_SHAPE_COUNT] = {0};
        assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_OK);
        for (size_t at = 0; at < width * height; at++) {
            const uint32_t shape = shape_at(&frame, at);
            struct spl_pick pick;
            if (++seen[shape] > 3 && at % 997) // some of each, and some anywhere
                continue;
            size_t x = at % width, y = at / width;
            assert_int_equal(
                spl_renderer_pick(renderer, dataset, &view, (double)x + 0.5, (double)y + 0.5, &pick, NULL), SPL_OK);
            assert_int_equal(pick.primitive, shape);
            if (shape != SPL_SHAPE_PANEL) {
                static const struct spl_pick_plane none = {0};
                assert_memory_equal(&pick.plane, &none, sizeof none);
                continue;
            }
            assert_int_equal(pick.splat, splat_count + 2);
            assert_true(pick.plane.points == 1234 && pick.plane.error_mean == (double)0.004f &&
                        pick.plane.error_most == (double)0.01f);
            assert_true(fabs(pick.plane.normal[1] + 1) < 1e-6);
            assert_int_equal(spl_method_has_normals(view.method, spl_dataset_get_info(dataset)),
                             fabs(pick.normal[1]) > 0.5);
            for (int i = 0; i < 3; i++)
                assert_true(pick.normal[1] == 0 || fabs(pick.normal[i]) == fabs(pick.plane.normal[i]));
            double off = 0;
            for (int i = 0; i < 3; i++) {
                assert_true(fabs(pick.plane.point[i] - center[i]) < side * cell);
                off += (pick.plane.point[i] - pick.position[i]) * pick.plane.normal[i];
            }
            assert_true(fabs(off) < 1e-4);
        }
        assert_true(seen[SPL_SHAPE_SPLAT] && seen[SPL_SHAPE_PANEL] && seen[SPL_SHAPE_NONE]);
        spl_frame_finish(&frame);
    }
    done(dataset);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        frames_test(each_pixel_says_what_it_shows),
        frames_test(each_kind_is_counted_by_itself),
        frames_test(it_needs_no_other_layer),
        frames_test(a_pick_says_the_same_and_the_plane),
    };
    return frames_run(argc, argv, "primitives", tests, sizeof tests / sizeof *tests);
}
