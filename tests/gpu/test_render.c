/* The kernels against the plain C reference, on random scenes and real cameras: depth within 1e-6 relative, colour
 * within one level, the same nearest splat but at ties, coverage equal. One body for every backend.
 * What tiles, clip lines and the screen-space filter do has programs of its own. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "base/error.h"
#include "dataset/chunk.h"
#include "gpu/frames.h"
#include "render/fault.h"

static const double utm[3] = {406000.125, 7405000.5, 30.25};

static void random_splats_match(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_cube(3000, origin, 0.02);
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        for (uint32_t supersample = 1; supersample <= 4; supersample *= 2) {
            struct spl_view view = looking(origin, 3, 160, 120);
            view.method = method;
            view.supersample = supersample;
            view.background[0] = 200;
            view.background[3] = supersample == 2 ? 0 : 255;
            same_images(dataset, &view, spl_method_name(method));
        }
    }
    done(dataset);
}

/* Occlusion drops chunks; the reference drops none. A dense wall in blocks of a chunk each hides most behind it. */
static void a_wall_that_hides_the_rest_changes_nothing(void **state)
{
    (void)state;
    enum { blocks = 24, behind = 48 * 128, count = blocks * blocks * 128 + behind };
    double flock[3] = {0};
    struct make_splat *splats = calloc(count, sizeof *splats);
    for (size_t i = 0; i < count; i++) {
        struct make_splat *s = &splats[i];
        size_t block = i / 128, in = i % 128;
        if (block < blocks * blocks && block % 23 != 7) { // else a hole to look through
            s->position[0] = ((double)(block % blocks) * 16 + in % 16 + uniform()) * 0.005 - 0.96;
            s->position[2] = ((double)(block / blocks) * 8 + in / 16 + uniform()) * 0.01 - 0.96;
            s->position[1] = -1 + 0.01 * uniform();
            s->radius = 0.012f;
        } else {
            for (int c = 0; c < 3; c++) { /* small flocks, so that whole chunks hide */
                flock[c] = in == 0 ? 1.2 * uniform() - 0.6 + (c == 1 ? 0.5 : 0) : flock[c];
                s->position[c] = flock[c] + 0.1 * uniform();
            }
            s->radius = 0.03f;
        }
        s->normal[1] = -1;
        for (int c = 0; c < 3; c++)
            s->color[c] = (uint8_t)(uniform() * 256);
    }
    struct spl_dataset *dataset = make_dataset(splats, count);
    free(splats);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    struct spl_view view = looking(origin, 3, 320, 240);
    same_images(dataset, &view, "from the side");
    const double eye[3] = {0.1, -4, 0.2}, up[3] = {0, 0, 1};
    assert_int_equal(spl_camera_look_at(&view.camera, eye, origin, up, NULL), SPL_OK);
    same_images(dataset, &view, "from the front");
    view.supersample = 2;
    same_images(dataset, &view, "from the front, supersampled");
    done(dataset);
}

/* The widest codes: dust beside large discs, far apart, need 24 bits an axis and 12 for the radius, 97 and more. */
static void the_widest_codes_match(void **state)
{
    (void)state;
    enum { count = 2048 };
    random_state = 11;
    struct make_splat *splats = calloc(count, sizeof *splats);
    for (size_t i = 0; i < count; i++) {
        double length = 0, n[3];
        for (int c = 0; c < 3; c++) {
            splats[i].position[c] = 2 * uniform() - 1;
            n[c] = uniform() - 0.5;
            length += n[c] * n[c];
            splats[i].color[c] = (uint8_t)(uniform() * 256);
        }
        for (int c = 0; c < 3; c++)
            splats[i].normal[c] = (float)(n[c] / sqrt(length));
        splats[i].radius = i % 5 ? 1e-6f : (float)(0.01 + 0.1 * uniform());
    }
    make_dataset_normal_error = 3e-4;
    struct spl_dataset *dataset = make_dataset(splats, count);
    make_dataset_normal_error = M_PI / 180;
    free(splats);
    uint64_t chunks, widest = 0;
    const struct spl_chunk *chunk = spl_dataset_get_chunks(dataset, &chunks);
    for (uint32_t i = 0; i < chunks; i++)
        widest = spl_chunk_geometry_width(&chunk[i]) > widest ? spl_chunk_geometry_width(&chunk[i]) : widest;
    assert_true(widest > 104); /* more than four words hold at most offsets */
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    struct spl_view view = looking(origin, 3, 160, 120);
    same_images(dataset, &view, "widest codes");
    done(dataset);
}

/* The eye among discs that span the image; a software driver's loop ends after 65535 rounds, done or not. */
static void inside_the_cloud_matches(void **state)
{
    (void)state;
    struct spl_view view = looking(origin, 0.3, 160, 120);
    for (uint64_t seed = 1; seed <= 6; seed++) {
        random_state = seed;
        struct spl_dataset *dataset = random_cube(3000, origin, 0.05);
        same_images(dataset, &view, "eye within the cloud");
        done(dataset);
    }
    struct spl_dataset *dataset = random_cube(3000, origin, 0.05);
    view.camera.cx += 31.7;
    view.camera.fy *= 1.3;
    view.disc.margin = 0;
    same_images(dataset, &view, "shifted principal point, no margin");
    done(dataset);
}

/* 230,400 samples a disc, 128 discs. */
static void discs_that_fill_a_large_image_match(void **state)
{
    (void)state;
    enum { count = 128 };
    struct make_splat splats[count] = {0};
    for (int i = 0; i < count; i++) {
        splats[i].position[1] = 0.4 * uniform();
        splats[i].normal[0] = (float)(0.4 * uniform() - 0.2);
        splats[i].normal[1] = -1;
        splats[i].radius = (float)(3 + uniform());
        for (int c = 0; c < 3; c++)
            splats[i].color[c] = (uint8_t)(uniform() * 256);
    }
    struct spl_dataset *dataset = make_dataset(splats, count);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    struct spl_view view = looking(origin, 3, 640, 360);
    const double eye[3] = {0, -1, 0}, up[3] = {0, 0, 1};
    assert_int_equal(spl_camera_look_at(&view.camera, eye, origin, up, NULL), SPL_OK);
    same_images(dataset, &view, "discs that fill the image");
    done(dataset);
}

static void far_coordinates_match_near_ones(void **state)
{
    (void)state;
    struct spl_frame frames[2];
    struct spl_dataset *datasets[2];
    const double *centers[2] = {origin, utm};
    for (int i = 0; i < 2; i++) {
        random_state = 77;
        datasets[i] = random_cube(2000, centers[i], 0.03);
        struct spl_view view = looking(centers[i], 3, 160, 120);
        same_images(datasets[i], &view, i ? "UTM" : "origin");
        assert_int_equal(spl_renderer_render(renderer, datasets[i], &view, &frames[i], NULL), SPL_OK);
    }
    struct tally t = compare(&frames[0], &frames[1]);
    /* The sources differ by the double's rounding at 7e6 (1e-9 m), which may move a code by one step. */
    assert_true(t.covered_differs < t.pixels / 100);
    for (int i = 0; i < 2; i++) {
        spl_frame_finish(&frames[i]);
        done(datasets[i]);
    }
}

static void a_million_splats_on_one_pixel_do_not_wrap(void **state)
{
    (void)state;
    size_t count = 1 << 20;
    struct make_splat *splats = calloc(count, sizeof *splats);
    for (size_t i = 0; i < count; i++)
        splats[i] = (struct make_splat){.position = {uniform() * 1e-3, uniform() * 1e-3, 0},
                                        .normal = {0, 0, 1},
                                        .radius = 1e-3f,
                                        .color = {255, 128, 7}};
    struct spl_dataset *dataset = make_dataset(splats, count);
    free(splats);
    assert_int_equal(spl_renderer_add(renderer, dataset, NULL), SPL_OK);
    struct spl_view view;
    spl_view_init(&view);
    view.layers = 1 << SPL_LAYER_COLOR | 1 << SPL_LAYER_DEPTH;
    view.lod = 0;
    view.camera.near = 0.1;
    view.camera.far = 100;
    const double eye[3] = {5e-4, 5e-4, 10}, target[3] = {5e-4, 5e-4, 0}, up[3] = {0, 1, 0};
    assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
    assert_int_equal(spl_camera_set_fov(&view.camera, 40, 33, 33, NULL), SPL_OK);
    struct spl_frame frame;
    assert_int_equal(spl_renderer_render(renderer, dataset, &view, &frame, NULL), SPL_OK);
    const uint8_t *pixel = (uint8_t *)frame.images[SPL_LAYER_COLOR].pixels + 4 * (33 * 16 + 16);
    assert_int_equal(pixel[0], 255);
    assert_int_equal(pixel[1], 128);
    assert_int_equal(pixel[2], 7);
    assert_true(fabsf(((float *)frame.images[SPL_LAYER_DEPTH].pixels)[33 * 16 + 16] - 10) < 1e-4f);
    spl_frame_finish(&frame);
    done(dataset);
}

static void the_same_request_gives_the_same_bytes(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_cube(3000, origin, 0.02);
    struct spl_view view = looking(origin, 2, 160, 120);
    struct spl_frame first;
    assert_int_equal(spl_renderer_render(renderer, dataset, &view, &first, NULL), SPL_OK);
    for (int i = 0; i < 100; i++) {
        struct spl_frame again;
        assert_int_equal(spl_renderer_render(renderer, dataset, &view, &again, NULL), SPL_OK);
        for (int layer = 0; layer < SPL_LAYER_COUNT; layer++)
            assert_memory_equal(first.images[layer].pixels, again.images[layer].pixels,
                                160 * 120 * spl_pixel_bytes(first.images[layer].type));
        spl_frame_finish(&again);
    }
    spl_frame_finish(&first);
    done(dataset);
}

/* Discs that cut through each other, stored in another order: chunks are whole, so that their codes stay the same. */
static void the_order_of_splats_changes_nothing(void **state)
{
    (void)state;
    enum { chunks = 24, count = chunks * SPL_CHUNK_SPLATS, width = 160, height = 120 };
    struct make_splat *splats = random_splats(count, origin, 0.05), *shuffled = calloc(count, sizeof *shuffled);
    assert_non_null(shuffled);
    for (size_t c = 0; c < chunks; c++)
        memcpy(shuffled + (c * 7 + 5) % chunks * SPL_CHUNK_SPLATS, splats + c * SPL_CHUNK_SPLATS,
               SPL_CHUNK_SPLATS * sizeof *splats);
    struct spl_dataset *datasets[2] = {make_dataset(splats, count), make_dataset(shuffled, count)};
    struct spl_frame frames[2];
    struct spl_view view = looking(origin, 2, width, height);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(spl_renderer_add(renderer, datasets[i], NULL), SPL_OK);
        assert_int_equal(spl_renderer_render(renderer, datasets[i], &view, &frames[i], NULL), SPL_OK);
    }
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
        const struct spl_image *a = &frames[0].images[layer], *b = &frames[1].images[layer];
        int differs = memcmp(a->pixels, b->pixels, (size_t)width * height * spl_pixel_bytes(a->type)) != 0;
        if (differs != (layer == SPL_LAYER_ID)) /* ids say where a splat is stored */
            fail_msg("layer %s is %s", spl_layer_name((enum spl_layer)layer), differs ? "another" : "the same");
    }
    for (int i = 0; i < 2; i++) {
        spl_frame_finish(&frames[i]);
        done(datasets[i]);
    }
    free(splats);
    free(shuffled);
}

static void a_lost_device_is_reported_and_replaced(void **state)
{
    (void)state;
    struct spl_renderer_options options = {.size = sizeof options, .device = device};
    struct spl_dataset *dataset = random_cube(500, origin, 0.05);
    struct spl_view view = looking(origin, 3, 64, 48);
    struct spl_frame frame;
    for (int i = 0; i < 3; i++) {
        struct spl_renderer *mortal;
        struct spl_error err = {0};
        assert_int_equal(spl_renderer_create(&options, &mortal, NULL), SPL_OK);
        assert_int_equal(spl_renderer_add(mortal, dataset, NULL), SPL_OK);
        assert_int_equal(spl_renderer_render(mortal, dataset, &view, &frame, NULL), SPL_OK);
        spl_frame_finish(&frame);
        spl_renderer_inject_loss(mortal);
        assert_int_equal(spl_renderer_render(mortal, dataset, &view, &frame, &err), SPL_E_DEVICE_LOST);
        assert_null(frame.images[SPL_LAYER_COLOR].pixels);
        spl_renderer_destroy(mortal);
    }
    done(dataset);
}

static void views_out_of_range_name_their_field(void **state)
{
    (void)state;
    struct spl_dataset *dataset = random_cube(10, origin, 0.05);
    const struct {
        const char *field;
        size_t offset;
        double value;
    } bad[] = {
        {"lod", offsetof(struct spl_view, lod), NAN},
        {"lod", offsetof(struct spl_view, lod), -1},
        {"margin", offsetof(struct spl_view, disc.margin), INFINITY},
    };
    struct spl_frame frame;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct spl_view view = looking(origin, 3, 16, 16);
        struct spl_error err = {0};
        memcpy((char *)&view + bad[i].offset, &bad[i].value, sizeof bad[i].value);
        assert_true(spl_renderer_render(renderer, dataset, &view, &frame, &err) < 0);
        assert_string_equal(err.field, bad[i].field);
    }
    struct spl_view view = looking(origin, 3, 16, 16);
    struct spl_error err = {0};
    view.supersample = 3;
    assert_true(spl_renderer_render(renderer, dataset, &view, &frame, &err) < 0);
    assert_string_equal(err.field, "supersample");
    done(dataset);
    spl_view_init(&view);
    assert_int_equal(spl_method_from_name("splat"), SPL_METHOD_SPLAT);
    assert_int_equal(spl_method_from_name("mesh"), -1);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        frames_test(random_splats_match),
        frames_test(a_wall_that_hides_the_rest_changes_nothing),
        frames_test(inside_the_cloud_matches),
        frames_test(discs_that_fill_a_large_image_match),
        frames_test(far_coordinates_match_near_ones),
        frames_test(a_million_splats_on_one_pixel_do_not_wrap),
        frames_test(the_same_request_gives_the_same_bytes),
        frames_test(the_order_of_splats_changes_nothing),
        frames_test(a_lost_device_is_reported_and_replaced),
        frames_test(views_out_of_range_name_their_field),
        frames_test(the_widest_codes_match),
    };
    return frames_run(argc, argv, "render", tests, sizeof tests / sizeof *tests);
}
