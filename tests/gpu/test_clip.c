/* Discs that end at clip lines, and specks for which a neighbour stands. One body for every backend. */
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

/* A direction across `normal`, and how far along it the disc reaches. */
static void random_line(struct make_splat *splat)
{
    const float *n = splat->normal;
    double length = 0, along = 0, d[3];
    for (int c = 0; c < 3; c++) {
        d[c] = uniform() - 0.5;
        along += d[c] * n[c];
    }
    for (int c = 0; c < 3; c++) {
        d[c] -= along * n[c];
        length += d[c] * d[c];
    }
    for (int c = 0; c < 3; c++)
        splat->clip[c] = (float)(d[c] / sqrt(length));
    splat->clip_offset = (float)uniform();
}

/* Chunks with lines among chunks without, whole, pruned, inside a level that was made coarser, and in windows. */
static void clip_lines_match(void **state)
{
    (void)state;
    random_state = 5;
    struct make_splat *splats = random_splats(6000, origin, 0.05);
    for (size_t i = 0; i < 6000; i++)
        if (i / 128 % 3 && (i % 3 || i / 128 % 2))
            random_line(&splats[i]);
    static const struct {
        const char *what;
        int levels;
        double distance, lod;
    } rows[] = {
        {"lines", 1, 3, 0}, {"lines, pruned", 1, 3, 12}, {"lines, coarse", 2, 8, 12}, {"among lines", 1, 0.4, 1}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_dataset *dataset = make_dataset_levels(splats, 6000, rows[i].levels);
        assert_true(spl_dataset_get_info(dataset)->attribute_bits[SPL_ATTRIBUTE_CLIP] > 0);
        assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
        struct spl_view view = looking(origin, rows[i].distance, 160, 120);
        view.lod = rows[i].lod;
        same_images(dataset, &view, rows[i].what);
        done(dataset);
    }
    free(splats);
}

/* Discs of 40 pixels that face the eye end where their line says, wherever it lies and points, and nowhere else. */
static void discs_end_at_their_lines(void **state)
{
    (void)state;
    static const double eye[3] = {0, 0, 4}, up[3] = {0, 1, 0};
    for (int turn = 0; turn < 12; turn++) {
        for (int end = 0; end < 4; end++) {
            double angle = turn * M_PI / 6 + 0.1, x = cos(angle), y = sin(angle), offset = 0.25 * end;
            struct make_splat splat = {
                .normal = {0, 0, 1}, .radius = 1, .clip = {(float)x, (float)y, 0}, .clip_offset = (float)offset};
            struct spl_dataset *dataset = make_dataset(&splat, 1);
            assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
            struct spl_view view = looking(origin, 4, 160, 120);
            assert_int_equal(spl_camera_look_at(&view.camera, eye, origin, up, NULL), SPL_OK);
            view.camera.fx = view.camera.fy = 160; /* 40 pixels a metre */
            struct spl_frame frame;
            assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_OK);
            const float *coverage = frame.images[SPL_LAYER_COVERAGE].pixels;
            for (int row = 0; row < 120; row++)
                for (int column = 0; column < 160; column++) {
                    double px = (column + 0.5 - 80) / 40, py = (60 - row - 0.5) / 40, far = px * x + py * y;
                    double from_line = far - offset, from_rim = sqrt(px * px + py * py) - 1, off = 0.24;
                    bool covered = coverage[160 * row + column] > 0;
                    if (from_rim > 0.03 || from_line > off)
                        assert_false(covered);
                    else if (from_rim < -0.03 && from_line < -off)
                        assert_true(covered);
                }
            spl_frame_finish(&frame);
            done(dataset);
        }
    }
}

/* A wall with a disc a pixel: where one or two are missing a neighbour stands for them in every layer, where three are,
 * and outside, nothing does. */
static void specks_take_a_neighbour(void **state)
{
    (void)state;
    enum { side = 20, columns = 40, rows = 30 };
    static const double eye[3] = {0, 0, 4}, up[3] = {0, 1, 0};
    static const uint8_t missing[][2] = {{10, 10}, {5, 5}, {6, 5}, {15, 5}, {15, 6}, {16, 5}};
    struct make_splat splats[side * side];
    size_t count = 0;
    for (unsigned at = 0; at < side * side; at++) {
        uint8_t x = at % side, y = at / side;
        bool there = true;
        for (size_t i = 0; i < sizeof missing / sizeof *missing; i++)
            there &= missing[i][0] != x || missing[i][1] != y;
        if (there)
            splats[count++] = (struct make_splat){.position = {(x - 9.5) / 40, (9.5 - y) / 40, 0},
                                                  .normal = {0, 0, 1},
                                                  .radius = 0.01f,
                                                  .color = {(uint8_t)(10 * x), (uint8_t)(10 * y), 200}};
    }
    struct spl_dataset *dataset = make_dataset(splats, count);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    struct spl_view view = looking(origin, 4, columns, rows);
    assert_int_equal(spl_camera_look_at(&view.camera, eye, origin, up, NULL), SPL_OK);
    view.camera.fx = view.camera.fy = 160; /* 40 pixels a metre: disc (x, y) on pixel (x + 10, y + 5) */
    view.lod = 0;
    view.background[3] = 0;
    struct spl_frame frame;
    assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_OK);
    for (int row = 0; row < rows; row++)
        for (int column = 0; column < columns; column++) {
            int at = columns * row + column, x = column - 10, y = row - 5;
            bool wall = x >= 0 && y >= 0 && x < side && y < side;
            bool hole = !wall || (x == 15 && (y == 5 || y == 6)) || (x == 16 && y == 5);
            const uint8_t *color = (const uint8_t *)frame.images[SPL_LAYER_COLOR].pixels + 4 * (size_t)at;
            assert_int_equal(color[3], hole ? 0 : 255);
            assert_true(isnan(((float *)frame.images[SPL_LAYER_DEPTH].pixels)[at]) == hole);
            assert_true((((uint32_t *)frame.images[SPL_LAYER_ID].pixels)[at] == UINT32_MAX) == hole);
            assert_float_equal(((float *)frame.images[SPL_LAYER_COVERAGE].pixels)[at], !hole, 0);
            if (!hole)
                assert_true(abs(color[0] - 10 * x) <= 11 && abs(color[1] - 10 * y) <= 11);
        }
    spl_frame_finish(&frame);
    done(dataset);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        frames_test(clip_lines_match),
        frames_test(discs_end_at_their_lines),
        frames_test(specks_take_a_neighbour),
    };
    return frames_run(argc, argv, "clip", tests, sizeof tests / sizeof *tests);
}
