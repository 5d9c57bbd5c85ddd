/* An image is the same however it is cut into tiles, and coarse frames show the same place. One body for every
 * backend. */
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
#include "support/sanitised.h"

/* Says where two images of a tile each way differ first. */
static void same_pixels(const struct spl_frame frames[2], int layer, const char *what, uint64_t seed)
{
    const struct spl_image *a = &frames[0].images[layer], *b = &frames[1].images[layer];
    size_t bytes = spl_pixel_bytes(a->type), pixels = (size_t)a->width * a->height, differ = 0, first = 0, channel = 0;
    for (size_t at = pixels; at-- > 0;)
        if (memcmp((char *)a->pixels + at * bytes, (char *)b->pixels + at * bytes, bytes)) {
            differ++;
            first = at;
        }
    if (!differ)
        return;
    size_t width = a->type == SPL_PIXEL_RGBA8 ? 1 : 4;
    uint32_t values[2] = {0};
    for (channel = 0; channel < bytes / width; channel++) {
        for (int i = 0; i < 2; i++)
            memcpy(&values[i], (char *)frames[i].images[layer].pixels + first * bytes + channel * width, width);
        if (values[0] != values[1])
            break;
    }
    fail_msg(
        "%s, seed %llu: %zu of %zu pixels of layer %s differ, the first at column %zu, row %zu: channel %zu is %#x "
        "in one tile, %#x in %u",
        what, (unsigned long long)seed, differ, pixels, spl_layer_name((enum spl_layer)layer), first % a->width,
        first / a->width, channel, values[0], values[1], frames[1].stats.tiles);
}

/* A pixel is the same in whatever tile it lies, to the bit. Of 20,000 points some lie so close to a border of samples
 * that a float rounded from another corner moves one of them, in some of the images: hence the seeds. Method splat
 * chooses each tile's largest weight, so of it only what has no sums is the same. */
static void tiles_leave_no_seams(void **state)
{
    enum { count = 20000, seeds = TEST_SIZE(8, 4) };
    struct spl_renderer_options options = {.size = sizeof options, .device = device, .scratch_samples = 160 * 160};
    struct spl_renderer *small;
    (void)state;
    assert_int_equal(spl_renderer_create(&options, &small, NULL), SPL_OK);
    for (uint64_t seed = 1; seed <= seeds; seed++) {
        random_state = seed;
        struct make_splat *splats = random_splats(count, origin, 0.02);
        for (size_t k = 0; k < count; k++)
            splats[k].linear = k % 5 == 0;
        struct spl_dataset *dataset = make_dataset(splats, count);
        free(splats);
        assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
        assert_int_equal(spl_renderer_add(small, dataset, NULL), SPL_OK);
        for (int method = 0; method < SPL_METHOD_COUNT; method++) {
            struct spl_view view = looking(origin, 3, 203, 151);
            struct spl_frame frames[2];
            if (method != SPL_METHOD_FILL && seed > 2)
                continue;
            view.method = method;
            view.supersample = 1 + (double)(seed % 2);
            view.fill.kernel = 8.0 / view.supersample; /* a guard of half a cell of the coarsest level */
            assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frames[0], NULL), SPL_OK);
            assert_int_equal(spl_renderer_render(small, dataset, &view, &frames[1], NULL), SPL_OK);
            assert_int_equal(frames[0].stats.tiles, 1);
            assert_true(frames[1].stats.tiles > 1);
            for (int layer = 0; layer < SPL_LAYER_COUNT; layer++)
                if (method != SPL_METHOD_SPLAT || layer == SPL_LAYER_COVERAGE || layer == SPL_LAYER_ID)
                    same_pixels(frames, layer, spl_method_name(method), seed);
            spl_frame_finish(&frames[0]);
            spl_frame_finish(&frames[1]);
        }
        spl_renderer_remove(small, dataset);
        done(dataset);
    }
    spl_renderer_destroy(small);
}

static void a_kernel_too_large_for_its_tiles_is_refused(void **state)
{
    struct spl_renderer_options options = {.size = sizeof options, .device = device, .scratch_samples = 160 * 160};
    struct spl_renderer *small;
    (void)state;
    assert_int_equal(spl_renderer_create(&options, &small, NULL), SPL_OK);
    struct spl_dataset *dataset = random_cube(1000, origin, 0.02);
    assert_int_equal(spl_renderer_add(small, dataset, NULL), SPL_OK);
    struct spl_view view = looking(origin, 3, 203, 151);
    struct spl_frame frame;
    struct spl_error err = {0};
    view.method = SPL_METHOD_FILL;
    view.fill.kernel = 129;
    assert_int_equal(spl_renderer_render(small, dataset, &view, &frame, &err), SPL_E_LIMIT);
    assert_string_equal(err.field, "kernel");
    spl_renderer_remove(small, dataset);
    done(dataset);
    spl_renderer_destroy(small);
}

static void small_tiles_give_the_same_image(void **state)
{
    (void)state;
    struct spl_renderer_options options = {.size = sizeof options, .device = device, .scratch_samples = 5000};
    struct spl_renderer *small, *large = renderer;
    assert_int_equal(spl_renderer_create(&options, &small, NULL), SPL_OK);
    struct spl_dataset *dataset = random_cube(3000, origin, 0.02);
    assert_int_equal(spl_renderer_add(small, dataset, NULL), SPL_OK);
    struct spl_view view = looking(origin, 3, 203, 151);
    struct spl_frame frames[2];
    assert_int_equal(spl_renderer_render(large, dataset, &view, &frames[0], NULL), SPL_OK);
    assert_int_equal(spl_renderer_render(small, dataset, &view, &frames[1], NULL), SPL_OK);
    assert_int_equal(frames[0].stats.tiles, 1);
    assert_true(frames[1].stats.tiles > 4);
    struct tally t = compare(&frames[0], &frames[1]);
    /* Each tile has its own largest weight, whose rounding moves the mean depth where steep discs cross. */
    size_t few = t.pixels / 10000 + 1;
    if (t.color_differs > few || t.depth_differs > t.pixels / 500 || t.depth_worst > 1e-3 || t.id_differs > few ||
        t.covered_differs > few)
        fail_msg("of %zu pixels differ: coverage %zu, depth %zu (worst %g), colour %zu (worst %d), id %zu", t.pixels,
                 t.covered_differs, t.depth_differs, t.depth_worst, t.color_differs, t.color_worst, t.id_differs);
    spl_frame_finish(&frames[0]);
    spl_frame_finish(&frames[1]);
    spl_renderer_destroy(small);
    done(dataset);
}

/* Pixels of a piece that are not those of the whole. */
static size_t find_others(const struct spl_frame *whole, const struct spl_frame *piece, uint32_t left, uint32_t top)
{
    const struct spl_image *a = &whole->images[SPL_LAYER_COLOR], *b = &piece->images[SPL_LAYER_COLOR];
    size_t others = 0;
    for (uint32_t y = 0; y < b->height; y++)
        for (uint32_t x = 0; x < b->width; x++) {
            const uint8_t *p = (const uint8_t *)a->pixels + 4 * ((size_t)(top + y) * a->width + left + x);
            const uint8_t *q = (const uint8_t *)b->pixels + 4 * ((size_t)y * b->width + x);
            others += abs(p[0] - q[0]) > 1 || abs(p[1] - q[1]) > 1 || abs(p[2] - q[2]) > 1 || p[3] != q[3];
        }
    return others;
}

/* One that begins where coarse cells of fill's pyramid do, as map tiles do, and one that does not: cells lie otherwise
 * there, a sample may be a crack in one and not in the other, and what is around it is shaded by its depth. */
static const struct part {
    uint32_t left, top;
    size_t fill_share, less; /* of fill's pixels one in so many may differ; of those that differ alone */
} parts[] = {{80, 64, 80, 8}, {83, 61, 12, 3}};

static void as_in_the_whole(const struct spl_dataset *dataset, const struct spl_view *view, const struct part *part)
{
    enum { width = 40, height = 32 };
    struct spl_view piece = *view;
    struct spl_frame whole, alone, surrounded;
    piece.camera.width = width;
    piece.camera.height = height;
    piece.camera.cx -= part->left;
    piece.camera.cy -= part->top;
    assert_int_equal(spl_renderer_render(renderer, dataset, view, &whole, NULL), SPL_OK);
    assert_int_equal(spl_renderer_render(renderer, dataset, &piece, &alone, NULL), SPL_OK);
    piece.surrounded = true;
    assert_int_equal(spl_renderer_render(renderer, dataset, &piece, &surrounded, NULL), SPL_OK);
    const size_t others = find_others(&whole, &surrounded, part->left, part->top),
                 before = find_others(&whole, &alone, part->left, part->top),
                 most = view->method == SPL_METHOD_FILL ? width * height / part->fill_share : 2;
    if (others > most || before < part->less * others + 50)
        fail_msg("%s, %d samples a side, from %u, %u: of %d pixels %zu differ, %zu alone",
                 spl_method_name(view->method), (int)view->supersample, part->left, part->top, width * height, others,
                 before);
    spl_frame_finish(&whole);
    spl_frame_finish(&alone);
    spl_frame_finish(&surrounded);
}

/* A piece of an image knows what lies around it, or its borders are shaded and smoothed otherwise. */
static void a_surrounded_piece_is_as_in_the_whole(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_cube(20000, origin, 0.02);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    for (int method = 0; method < SPL_METHOD_COUNT; method++)
        for (int samples = 1; samples <= 2; samples++) {
            struct spl_view view = looking(origin, 3, 203, 151);
            view.method = method;
            view.supersample = samples;
            view.fill.kernel = 8;
            assert_int_equal(spl_shade_parse("edl", &view.shade, NULL), SPL_OK);
            view.shade.radius = 5;
            view.layers = 1u << SPL_LAYER_COLOR;
            for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
                as_in_the_whole(dataset, &view, &parts[i]);
        }
    done(dataset);
}

/* A wall seen aslant, at a half and a quarter of the samples: the same plane, at any size of image. */
static void coarse_frames_show_the_same_place(void **state)
{
    (void)state;
    enum { side = 200 };
    struct make_splat *splats = calloc(side * side, sizeof *splats);
    for (size_t i = 0; i < side * side; i++)
        splats[i] = (struct make_splat){.position = {(double)(i % side) * 0.02 - 2, 0, (double)(i / side) * 0.02 - 2},
                                        .normal = {0, -1, 0},
                                        .radius = 0.02f,
                                        .color = {90, 160, 30}};
    struct spl_dataset *dataset = make_dataset(splats, side * side);
    free(splats);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    struct spl_view view = looking(origin, 2, 203, 151);
    view.lod = 0; /* every splat: no specks, for which a neighbour would stand */
    view.background[3] = 0;
    struct spl_frame fine;
    assert_int_equal(spl_renderer_render(renderer, dataset, &view, &fine, NULL), SPL_OK);
    for (view.supersample = 0.5; view.supersample > 0.2; view.supersample /= 2) {
        struct spl_frame coarse;
        assert_int_equal(spl_renderer_render(renderer, dataset, &view, &coarse, NULL), SPL_OK);
        const float *a = fine.images[SPL_LAYER_DEPTH].pixels, *b = coarse.images[SPL_LAYER_DEPTH].pixels;
        const uint8_t *color = coarse.images[SPL_LAYER_COLOR].pixels;
        size_t pixels = 0;
        double sum = 0;
        for (uint32_t y = 10; y < 140; y++) {
            for (uint32_t x = 10; x < 190; x++) {
                size_t at = (size_t)y * 203 + x;
                bool inside = true; /* of the wall, by the coarsest pixel */
                for (int dy = -8; dy <= 8; dy += 4)
                    for (int dx = -8; dx <= 8; dx += 4)
                        inside &= !isnan(a[at + (size_t)(203 * dy + dx)]);
                if (!inside || isnan(b[at]))
                    continue;
                pixels++;
                double off = (b[at] - a[at]) / a[at];
                sum += off;
                assert_true(fabs(off) < 0.02); /* half a coarse pixel of this slant */
                assert_true(color[4 * at] == 90 && color[4 * at + 1] == 160 && color[4 * at + 2] == 30);
            }
        }
        assert_true(pixels > 10000);
        assert_true(fabs(sum / (double)pixels) < 1e-3); /* a shift by half a coarse pixel would be 1 % */
        assert_int_equal(coarse.images[SPL_LAYER_ID].width, 203);
        spl_frame_finish(&coarse);
    }
    spl_frame_finish(&fine);
    done(dataset);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        frames_test(tiles_leave_no_seams),
        frames_test(a_kernel_too_large_for_its_tiles_is_refused),
        frames_test(small_tiles_give_the_same_image),
        frames_test(a_surrounded_piece_is_as_in_the_whole),
        frames_test(coarse_frames_show_the_same_place),
    };
    return frames_run(argc, argv, "tiles", tests, sizeof tests / sizeof *tests);
}
