/* Frames that take turns on one device: a view of many tiles is interrupted after each by another view, of another
 * dataset, with pages driven out and datasets added and removed in between, and has the bytes that it has alone. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include <splatd/render.h>

#include "base/memory.h"
#include "geom/size.h"
#include "image/resample.h"
#include "render/fault.h"
#include "support/make_dataset.h"
#include "support/sanitised.h"

enum { all_layers = (1 << SPL_LAYER_COUNT) - 1, count = 6000 };

static const char *device;

static double uniform(void)
{
    static uint64_t state = 5;
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) / 9007199254740992.0;
}

static struct spl_dataset *cube(void)
{
    struct make_splat *splats = calloc(count, sizeof *splats);
    assert_non_null(splats);
    for (size_t i = 0; i < count; i++) {
        struct make_splat *s = &splats[i];
        *s = (struct make_splat){.normal = {0, 0, 1}, .radius = 0.03f};
        for (int c = 0; c < 3; c++) {
            s->position[c] = 2 * uniform() - 1;
            s->color[c] = (uint8_t)(256 * uniform());
        }
    }
    struct spl_dataset *dataset = make_dataset(splats, count);
    free(splats);
    return dataset;
}

static struct spl_view looking(double distance, uint32_t width, uint32_t height)
{
    struct spl_view view;
    const double eye[3] = {distance, 0.4, 0.3}, target[3] = {0}, up[3] = {0, 0, 1};
    spl_view_init(&view);
    view.camera.near = 0.01;
    view.camera.far = 100;
    view.layers = all_layers;
    assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
    assert_int_equal(spl_camera_set_fov(&view.camera, 50, width, height, NULL), SPL_OK);
    return view;
}

static struct spl_renderer *open_renderer(uint64_t memory_limit)
{
    struct spl_renderer *renderer = NULL;
    struct spl_renderer_options options = {.size = sizeof options,
                                           .device = device,
                                           .memory_limit = memory_limit,
                                           .scratch_samples = 160 * 160,
                                           .debug = true};
    struct spl_error err = {0};
    if (spl_renderer_create(&options, &renderer, &err))
        fprintf(stderr, "%s\n", err.message);
    return renderer;
}

static void assert_same(const struct spl_frame *a, const struct spl_frame *b)
{
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
        const struct spl_image *x = &a->images[layer], *y = &b->images[layer];
        assert_int_equal(x->width * x->height, y->width * y->height);
        assert_memory_equal(x->pixels, y->pixels, (size_t)x->width * x->height * spl_pixel_bytes(x->type));
    }
}

static void interrupted_frames_have_the_bytes_that_they_have_alone(void **state)
{
    (void)state;
    static const double sides[] = {0.5, 1, 4};
    struct spl_renderer *renderer = open_renderer(0);
    struct spl_dataset *one = cube(), *other = cube(), *comer = cube();
    assert_int_equal(spl_renderer_add(renderer, other, NULL), SPL_OK);
    assert_int_equal(spl_renderer_add(renderer, one, NULL), SPL_OK);
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        for (size_t i = TEST_SIZE(0, 1); i < sizeof sides / sizeof *sides; i++) {
            struct spl_view views[2] = {looking(3, sides[i] > 1 ? 103 : 403, 76), looking(2, 240, 160)};
            const struct spl_dataset *datasets[2] = {one, other};
            struct spl_frame alone[2], small_alone, small, frames[2];
            struct spl_view little = looking(2.5, 64, 48);
            struct spl_frame_steps *steps[2];
            bool more[2] = {true, true};
            uint64_t left = UINT64_MAX;
            int interruptions = 0;
            for (int v = 0; v < 2; v++) {
                views[v].method = (enum spl_method)method;
                /* that tiles have room for */
                views[v].fill.kernel = method == SPL_METHOD_FILL ? sides[i] > 1 ? 3 : 8 : 0;
                views[v].supersample = sides[i];
                if (v && sides[i] < 4) { /* in faces */
                    assert_int_equal(spl_camera_set_around(&views[v].camera, SPL_EQUIRECTANGULAR, 240, 120, NULL),
                                     SPL_OK);
                    views[v].layers &= ~(1u << SPL_LAYER_DEPTH);
                }
                assert_int_equal(spl_renderer_render(renderer, datasets[v], &views[v], &alone[v], NULL), SPL_OK);
            }
            assert_int_equal(spl_renderer_render(renderer, other, &little, &small_alone, NULL), SPL_OK);
            for (int v = 0; v < 2; v++)
                assert_int_equal(spl_frame_begin(renderer, datasets[v], &views[v], &steps[v], NULL), SPL_OK);
            assert_int_equal(spl_frame_get_samples_left(steps[0]) >= spl_view_get_samples(&views[0]), 1);
            while (more[0] || more[1]) {
                for (int v = 0; v < 2; v++)
                    if (more[v])
                        assert_int_equal(spl_frame_step(steps[v], UINT64_MAX, &more[v], NULL), SPL_OK);
                assert_true(!more[0] || spl_frame_get_samples_left(steps[0]) < left);
                left = spl_frame_get_samples_left(steps[0]);
                if (interruptions % 2) // moves the others in the renderer's table
                    spl_renderer_remove(renderer, comer);
                else
                    assert_int_equal(spl_renderer_add(renderer, comer, NULL), SPL_OK);
                assert_int_equal(spl_renderer_render(renderer, other, &little, &small, NULL), SPL_OK);
                assert_same(&small, &small_alone);
                spl_frame_finish(&small);
                interruptions++;
            }
            spl_renderer_remove(renderer, comer);
            assert_true(interruptions > 2);
            for (int v = 0; v < 2; v++) {
                spl_frame_end(steps[v], &frames[v]);
                assert_same(&frames[v], &alone[v]);
                assert_int_equal(frames[v].stats.tiles, alone[v].stats.tiles);
                assert_int_equal(frames[v].stats.splats_drawn, alone[v].stats.splats_drawn);
                assert_true(frames[v].stats.complete && frames[v].stats.total_ms > 0);
                spl_frame_finish(&frames[v]);
                spl_frame_finish(&alone[v]);
            }
            spl_frame_finish(&small_alone);
        }
    }
    spl_renderer_destroy(renderer);
    spl_dataset_close(one);
    spl_dataset_close(other);
    spl_dataset_close(comer);
}

/* Memory for the pages of one of two datasets: each tile of one drives out those of the other. */
static void pages_driven_out_between_tiles_come_back(void **state)
{
    (void)state;
    struct spl_dataset *one = cube(), *other = cube();
    struct spl_renderer *roomy = open_renderer(0);
    struct spl_view view = looking(3, 603, 151), little = looking(2, 64, 48);
    struct spl_frame alone, small, frame;
    struct spl_frame_steps *steps;
    assert_int_equal(spl_renderer_add(roomy, one, NULL), SPL_OK);
    uint64_t bare = spl_renderer_get_memory(roomy);
    assert_int_equal(spl_renderer_render(roomy, one, &view, &alone, NULL), SPL_OK);
    uint64_t full = spl_renderer_get_memory(roomy);
    spl_renderer_destroy(roomy);
    struct spl_renderer *tight = open_renderer(full + (full - bare) / 4);
    assert_int_equal(spl_renderer_add(tight, one, NULL), SPL_OK);
    assert_int_equal(spl_renderer_add(tight, other, NULL), SPL_OK);
    assert_int_equal(spl_frame_begin(tight, one, &view, &steps, NULL), SPL_OK);
    for (bool more = true; more;) {
        assert_int_equal(spl_frame_step(steps, UINT64_MAX, &more, NULL), SPL_OK);
        if (more && spl_frame_is_waiting(steps)) {
            spl_renderer_wait(tight, UINT64_MAX);
            continue;
        }
        assert_int_equal(spl_renderer_render(tight, other, &little, &small, NULL), SPL_OK);
        spl_frame_finish(&small);
    }
    spl_frame_end(steps, &frame);
    assert_true(frame.stats.pages_loaded > 1);
    assert_true(frame.stats.complete);
    assert_same(&frame, &alone);
    spl_frame_finish(&frame);
    spl_frame_finish(&alone);
    spl_renderer_destroy(tight);
    spl_dataset_close(one);
    spl_dataset_close(other);
}

static void a_frame_may_be_given_up_between_tiles(void **state)
{
    (void)state;
    struct spl_dataset *one = cube();
    struct spl_renderer *renderer = open_renderer(0);
    struct spl_view view = looking(3, 603, 151);
    struct spl_frame_steps *late, *lost;
    struct spl_frame frame;
    struct spl_error err = {0};
    bool more;
    assert_int_equal(spl_renderer_add(renderer, one, NULL), SPL_OK);
    assert_int_equal(spl_renderer_preload(renderer, one, NULL), SPL_OK);
    assert_int_equal(spl_frame_begin(renderer, one, &view, &late, NULL), SPL_OK);
    assert_int_equal(spl_frame_begin(renderer, one, &view, &lost, NULL), SPL_OK);
    assert_int_equal(spl_frame_step(lost, UINT64_MAX, &more, NULL), SPL_OK);
    assert_int_equal(spl_frame_step(late, UINT64_MAX, &more, NULL), SPL_OK);
    assert_true(more);
    assert_int_equal(spl_frame_step(late, 1, &more, &err), SPL_E_TIMEOUT);
    assert_false(more);
    spl_frame_end(late, &frame);
    assert_null(frame.images[SPL_LAYER_COLOR].pixels);
    spl_renderer_inject_loss(renderer);
    assert_int_equal(spl_frame_step(lost, UINT64_MAX, &more, NULL), SPL_E_DEVICE_LOST);
    spl_renderer_destroy(renderer);
    spl_frame_end(lost, NULL); // the renderer has gone
    spl_dataset_close(one);
}

/* Whatever memory is refused while a tile is recorded (kernels are made then), the next frame is as good as any. */
static void a_tile_that_fails_leaves_the_device_usable(void **state)
{
    (void)state;
    struct spl_dataset *dataset = cube();
    int refused = 0;
    for (long n = 1; n <= 24; n += 1 + n / 8) {
        struct spl_renderer *renderer = open_renderer(0);
        struct spl_frame frame, again;
        struct spl_view view = looking(4, 64, 48);
        view.method = n % 2 ? SPL_METHOD_NEAREST : SPL_METHOD_SPLAT;
        assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
        assert_int_equal(spl_renderer_preload(renderer, dataset, NULL), SPL_OK);
        spl_memory_fail_after(n);
        int code = spl_renderer_render(renderer, dataset, &view, &frame, NULL);
        spl_memory_fail_after(0);
        refused += code != 0;
        assert_true(code == 0 || code == SPL_E_NOMEM);
        assert_int_equal(spl_renderer_render(renderer, dataset, &view, &again, NULL), SPL_OK);
        if (!code)
            assert_same(&frame, &again);
        spl_frame_finish(&frame);
        spl_frame_finish(&again);
        spl_renderer_remove(renderer, dataset);
        spl_renderer_destroy(renderer);
    }
    assert_true(refused > 6);
    spl_dataset_close(dataset);
}

/* Samples a side that are no whole number: an image of that size, resampled. */
static void other_sizes_are_resampled(void **state)
{
    (void)state;
    static const double sides[] = {0.5, 1.25, 1.5};
    struct spl_renderer *renderer = open_renderer(0);
    struct spl_dataset *dataset = cube();
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    for (size_t i = 0; i < sizeof sides / sizeof *sides; i++) {
        struct spl_view view = looking(3, 83, 61), drawn = view; /* which none of them divides */
        struct spl_frame frame, whole;
        view.supersample = sides[i];
        spl_camera_coarsen(&drawn.camera, sides[i]);
        assert_int_equal(spl_view_get_samples(&view), (uint64_t)(83 * 61 * (sides[i] < 1 ? 1 : sides[i] * sides[i])));
        assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_OK);
        assert_int_equal(spl_renderer_render(renderer, dataset, &drawn, &whole, NULL), SPL_OK);
        for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
            struct spl_image *image = &frame.images[layer], wanted = *image;
            const size_t bytes = 83 * 61 * spl_pixel_bytes(image->type);
            assert_non_null(wanted.pixels = malloc(bytes));
            spl_image_resample(&whole.images[layer], sides[i], 0, &wanted, 0, 61);
            assert_memory_equal(wanted.pixels, image->pixels, bytes);
            free(wanted.pixels);
        }
        spl_frame_finish(&frame);
        spl_frame_finish(&whole);
    }
    spl_renderer_destroy(renderer);
    spl_dataset_close(dataset);
}

static void what_kernels_take_is_told_of_the_frame_that_needs_them_first(void **state)
{
    (void)state;
    struct spl_renderer *renderer = open_renderer(0);
    struct spl_dataset *dataset = cube();
    struct spl_view view = looking(3, 83, 61);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    for (int i = 0; i < 4; i++) { /* each method's first frame, and the same again */
        struct spl_frame frame;
        view.method = i < 2 ? SPL_METHOD_SPLAT : SPL_METHOD_NEAREST;
        assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_OK);
        if (i % 2)
            assert_true(frame.stats.kernels_ms == 0);
        else
            assert_true(frame.stats.kernels_ms > 0 && frame.stats.kernels_ms < frame.stats.total_ms);
        spl_frame_finish(&frame);
    }
    spl_renderer_destroy(renderer);
    spl_dataset_close(dataset);
}

int main(int argc, char **argv)
{
    device = argc > 1 ? argv[1] : getenv("SPLATD_TEST_DEVICE");
    struct spl_renderer *renderer = open_renderer(0);
    if (!renderer)
        return 77;
    spl_renderer_destroy(renderer);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(interrupted_frames_have_the_bytes_that_they_have_alone),
        cmocka_unit_test(pages_driven_out_between_tiles_come_back),
        cmocka_unit_test(a_frame_may_be_given_up_between_tiles),
        cmocka_unit_test(a_tile_that_fails_leaves_the_device_usable),
        cmocka_unit_test(other_sizes_are_resampled),
        cmocka_unit_test(what_kernels_take_is_told_of_the_frame_that_needs_them_first),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
