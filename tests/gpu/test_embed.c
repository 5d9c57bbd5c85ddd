/* What programs that embed the renderer use and the daemon does not: frames in the caller's memory, cancelled frames,
 * picks. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include <splatd/render.h>

#include "support/make_dataset.h"

enum { width = 120, height = 90, all_layers = (1 << SPL_LAYER_COUNT) - 1, apart = 8 };

static const char *device;
static struct spl_renderer *renderer;
static struct spl_dataset *dataset;

/* A wall at x = 0 of class 6, one splat for every 2 cm; it ends at z = 0.5. */
static struct spl_dataset *make_wall(void)
{
    enum { side = 50 };
    static struct make_splat splats[side * side];
    for (int i = 0; i < side * side; i++)
        splats[i] = (struct make_splat){.position = {0, 0.02 * (i % side) - 0.5, 0.02 * (i / side) - 0.5},
                                        .normal = {1, 0, 0},
                                        .radius = 0.03f,
                                        .color = {200, 100, 50},
                                        .classification = 6};
    return make_dataset(splats, side * side);
}

static struct spl_view looking(double supersample)
{
    struct spl_view view;
    const double eye[3] = {1.5, 0.1, 0.2}, target[3] = {0, 0, 0.2}, up[3] = {0, 0, 1};
    spl_view_init(&view);
    view.camera.near = 0.01;
    view.camera.far = 100;
    view.layers = all_layers;
    view.supersample = supersample;
    assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
    assert_int_equal(spl_camera_set_fov(&view.camera, 50, width, height, NULL), SPL_OK);
    return view;
}

/* The caller's images of every layer, rows `apart` bytes apart, all bytes 0xcd. */
struct mine {
    struct spl_image images[SPL_LAYER_COUNT];
};

static void mine_init(struct mine *mine, const struct spl_frame *like)
{
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
        struct spl_image *image = &mine->images[layer];
        *image = like->images[layer];
        image->row_bytes = image->width * spl_pixel_bytes(image->type) + apart;
        image->pixels = malloc(image->row_bytes * image->height);
        assert_non_null(image->pixels);
        memset(image->pixels, 0xcd, image->row_bytes * image->height);
    }
}

static void mine_finish(struct mine *mine)
{
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++)
        spl_image_finish(&mine->images[layer]);
}

static void assert_same_rows(const struct spl_image *mine, const struct spl_image *packed)
{
    size_t bytes = packed->width * (size_t)spl_pixel_bytes(packed->type);
    for (uint32_t y = 0; y < packed->height; y++) {
        const uint8_t *row = (const uint8_t *)mine->pixels + y * mine->row_bytes;
        assert_memory_equal(row, (const uint8_t *)packed->pixels + y * bytes, bytes);
        for (int i = 0; i < apart; i++)
            assert_int_equal(row[bytes + (size_t)i], 0xcd);
    }
}

static void frames_in_the_callers_memory_have_the_same_bytes(void **state)
{
    (void)state;
    static const double sides[] = {0.5, 1, 2};
    for (size_t s = 0; s < sizeof sides / sizeof *sides; s++) {
        struct spl_view view = looking(sides[s]);
        struct spl_frame frame, rest;
        struct spl_render_options options;
        struct mine mine;
        assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_OK);
        spl_render_options_init(&options);
        mine_init(&mine, &frame);
        options.images = mine.images;
        options.image_count = SPL_LAYER_COUNT;
        assert_int_equal(spl_renderer_render_with(renderer, dataset, &view, &options, NULL, NULL), SPL_OK);
        for (int layer = 0; layer < SPL_LAYER_COUNT; layer++)
            assert_same_rows(&mine.images[layer], &frame.images[layer]);
        options.image_count = 2; // the first two into mine, the others into a frame
        memset(mine.images[0].pixels, 0xcd, mine.images[0].row_bytes * height);
        assert_int_equal(spl_renderer_render_with(renderer, dataset, &view, &options, &rest, NULL), SPL_OK);
        assert_same_rows(&mine.images[0], &frame.images[0]);
        for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
            const struct spl_image *made = &rest.images[layer], *wanted = &frame.images[layer];
            assert_true(!made->pixels == (layer < 2));
            if (made->pixels)
                assert_memory_equal(made->pixels, wanted->pixels,
                                    (size_t)width * height * spl_pixel_bytes(wanted->type));
        }
        assert_true(rest.stats.splats_drawn == frame.stats.splats_drawn);
        spl_frame_finish(&rest);
        spl_frame_finish(&frame);
        mine_finish(&mine);
    }
}

static void images_that_do_not_fit_are_refused(void **state)
{
    (void)state;
    struct spl_view view = looking(1);
    static uint32_t pixels[width * height + 1];
    const struct spl_image good = {SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, width, height, pixels};
    struct spl_image bad[10];
    for (int i = 0; i < 10; i++)
        bad[i] = good;
    bad[0].layer = SPL_LAYER_COUNT;
    bad[1].layer = SPL_LAYER_DEPTH; // whose pixels are floats
    bad[2].width--;
    bad[3].height++;
    bad[4].pixels = NULL;
    bad[5].pixels = (uint8_t *)pixels + 1;
    bad[6].row_bytes = 4 * width - 4;
    bad[7].row_bytes = 4 * width + 2;
    bad[8].layer = SPL_LAYER_ID; // which the view below lacks
    bad[8].type = SPL_PIXEL_U32;
    bad[9].row_bytes = SIZE_MAX / 4 + 1; // whose fourth row would be the first again
    view.layers = 1u << SPL_LAYER_COLOR | 1u << SPL_LAYER_DEPTH;
    for (int i = 0; i <= 10; i++) {
        struct spl_error err = {0};
        struct spl_frame frame;
        struct spl_render_options options = {
            .size = sizeof options, .images = i < 10 ? &bad[i] : NULL, .image_count = 1};
        assert_int_equal(spl_renderer_render_with(renderer, dataset, &view, &options, &frame, &err), SPL_E_USAGE);
        assert_string_equal(err.field, "images");
        assert_null(frame.images[SPL_LAYER_DEPTH].pixels);
    }
    const struct spl_image twice[2] = {good, good};
    struct spl_render_options options = {.size = sizeof options, .images = twice, .image_count = 2};
    struct spl_frame frame;
    assert_int_equal(spl_renderer_render_with(renderer, dataset, &view, &options, &frame, NULL), SPL_E_USAGE);
    options.image_count = 1; // depth would have no place
    assert_int_equal(spl_renderer_render_with(renderer, dataset, &view, &options, NULL, NULL), SPL_E_USAGE);
    options.size = 0;
    assert_int_equal(spl_renderer_render_with(renderer, dataset, &view, &options, &frame, NULL), SPL_E_USAGE);
}

static void a_cancelled_frame_is_not_made(void **state)
{
    (void)state;
    struct spl_view view = looking(1);
    struct spl_cancel cancel = {0};
    struct spl_render_options options = {.size = sizeof options, .cancel = &cancel};
    struct spl_frame frame;
    struct spl_error err = {0};
    spl_cancel_set(&cancel);
    assert_int_equal(spl_renderer_render_with(renderer, dataset, &view, &options, &frame, &err), SPL_E_CANCELLED);
    assert_null(frame.images[SPL_LAYER_COLOR].pixels);
    spl_cancel_clear(&cancel);
    assert_int_equal(spl_renderer_render_with(renderer, dataset, &view, &options, &frame, NULL), SPL_OK);
    assert_non_null(frame.images[SPL_LAYER_COLOR].pixels);
    spl_frame_finish(&frame);
}

static void picks_agree_with_the_image(void **state)
{
    (void)state;
    struct spl_view view = looking(1);
    struct spl_frame frame;
    int hits = 0, misses = 0, others = 0;
    assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_OK);
    view.layers = 1u << SPL_LAYER_COVERAGE; // a pick needs none of the view's layers
    for (uint32_t y = 2; y < height; y += 17) {
        for (uint32_t x = 3; x < width; x += 19) {
            struct spl_pick pick;
            struct spl_error err = {0};
            size_t at = (size_t)y * width + x;
            double pixel[2], depth;
            if (spl_renderer_pick(renderer, dataset, &view, x + 0.5, y + 0.5, &pick, &err))
                fail_msg("%s", err.message);
            assert_true(pick.hit == !isnan(((const float *)frame.images[SPL_LAYER_DEPTH].pixels)[at]));
            misses += !pick.hit;
            if (!pick.hit) {
                assert_true(pick.depth == 0 && pick.splat == 0);
                continue;
            }
            hits++;
            assert_true(fabs(pick.depth - (double)((const float *)frame.images[SPL_LAYER_DEPTH].pixels)[at]) < 1e-3);
            assert_true(spl_camera_project(&view.camera, pick.position, pixel, &depth));
            assert_true(fabs(pixel[0] - x - 0.5) < 1e-6 && fabs(pixel[1] - y - 0.5) < 1e-6);
            assert_true(fabs(pick.position[0]) < 5e-3 && fabs(pick.normal[0] - 1) < 0.05); // the wall, to the eye
            others += pick.splat != ((const uint32_t *)frame.images[SPL_LAYER_ID].pixels)[at];
            assert_int_equal(pick.classification, 6);
            assert_true(abs(pick.color[0] - 200) <= 2 && abs(pick.color[2] - 50) <= 2);
        }
    }
    assert_true(hits > 5 && misses > 2);
    /* Of a wall's splats, which lie equally near, GPUs may take another: kernels of one layer round not as of
     * another. */
    assert_true(others == 0 || !spl_renderer_get_device(renderer)->software);
    struct spl_pick pick;
    struct spl_error err = {0};
    assert_int_equal(spl_renderer_pick(renderer, dataset, &view, width + 1, 0, &pick, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "x");
    err = (struct spl_error){0};
    assert_int_equal(spl_renderer_pick(renderer, dataset, &view, 0, NAN, &pick, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "y");
    spl_frame_finish(&frame);
}

/* What an older or another language's program has of a view: the rest has its defaults. */
static void a_view_may_end_early(void **state)
{
    (void)state;
    struct spl_view view = looking(1);
    struct {
        struct spl_view view;
        char after[16];
    } early;
    struct spl_frame whole, frame;
    memset(&early, 0x77, sizeof early);
    const size_t size = offsetof(struct spl_view, disc);
    spl_view_init_sized(&early.view, size);
    for (size_t i = size; i < sizeof early; i++)
        assert_int_equal(((const uint8_t *)&early)[i], 0x77);
    assert_int_equal(early.view.size, size);
    early.view.camera = view.camera;
    early.view.layers = view.layers;
    assert_int_equal(spl_view_check(&early.view, NULL), SPL_OK);
    assert_int_equal(spl_renderer_render(renderer, dataset, &view, &whole, NULL), SPL_OK);
    assert_int_equal(spl_renderer_render(renderer, dataset, &early.view, &frame, NULL), SPL_OK);
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++)
        assert_memory_equal(frame.images[layer].pixels, whole.images[layer].pixels,
                            (size_t)width * height * spl_pixel_bytes(whole.images[layer].type));
    spl_frame_finish(&whole);
    spl_frame_finish(&frame);
    view.size = 0;
    assert_int_equal(spl_view_check(&view, NULL), SPL_E_USAGE);
    assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_E_USAGE);
}

int main(int argc, char **argv)
{
    device = argc > 1 ? argv[1] : getenv("SPLATD_TEST_DEVICE");
    struct spl_renderer_options options = {.size = sizeof options, .device = device, .scratch_samples = 1 << 16};
    struct spl_error err = {0};
    if (spl_renderer_create(&options, &renderer, &err)) {
        fprintf(stderr, "%s\n", err.message);
        return err.code == SPL_E_NO_DEVICE ? 77 : 1;
    }
    dataset = make_wall();
    if (spl_renderer_add(renderer, dataset, &err)) {
        fprintf(stderr, "%s\n", err.message);
        return 1;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frames_in_the_callers_memory_have_the_same_bytes),
        cmocka_unit_test(images_that_do_not_fit_are_refused),
        cmocka_unit_test(a_cancelled_frame_is_not_made),
        cmocka_unit_test(picks_agree_with_the_image),
        cmocka_unit_test(a_view_may_end_early),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    spl_renderer_destroy(renderer);
    spl_dataset_close(dataset);
    return failed;
}
