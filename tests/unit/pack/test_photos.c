/* Photographs onto splats without a device: sampling, the best candidates, exposures, the choice of colours. Bad input
 * first. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "base/memory.h"
#include "geom/tangent.h"
#include "pack/texture/resample.h"
#include "pack/texture/colors.h"
#include "support/make_dataset.h"
#include "support/sanitised.h"

enum { side = 64 };

static struct spl_named_view make_view(void)
{
    struct spl_named_view view = {.name = (char *)"a", .photograph = (char *)"a.png"};
    view.camera = (struct spl_camera){.near = 0.01, .far = INFINITY};
    assert_int_equal(spl_camera_set_fov(&view.camera, 60, side, side, NULL), 0);
    assert_int_equal(
        spl_camera_look_at(&view.camera, (double[]){0, -2, 0}, (double[]){0, 0, 0}, (double[]){0, 0, 1}, NULL), 0);
    return view;
}

static struct spl_image make_image(uint32_t width, uint32_t height, uint8_t left, uint8_t right)
{
    struct spl_image image = {.type = SPL_PIXEL_RGBA8, .width = width, .height = height};
    uint8_t *p = image.pixels = malloc((size_t)width * height * 4);
    assert_non_null(p);
    for (uint32_t i = 0; i < width * height; i++, p += 4) {
        p[0] = p[1] = p[2] = i % width < width / 2 ? left : right;
        p[3] = 255;
    }
    return image;
}

static void what_is_no_photograph_of_the_camera_is_refused(void **state)
{
    (void)state;
    struct spl_named_view view = make_view();
    struct spl_photo photo;
    struct spl_error err = {0};
    struct spl_image image = make_image(side, side - 1, 9, 9);
    assert_int_equal(spl_photo_init(&photo, &view, &image, &err), SPL_E_INPUT);
    assert_non_null(strstr(err.message, "a.png: 64 x 63"));
    assert_null(photo.pixels.texels[0]);
    err = (struct spl_error){0};
    image = make_image(side, side, 3, 3);
    assert_int_equal(spl_photo_init(&photo, &view, &image, &err), SPL_E_INPUT);
    assert_non_null(strstr(err.message, "black"));
    for (int n = 1;; n++) {
        image = make_image(side, side, 90, 90);
        spl_memory_fail_after(n);
        int rc = spl_photo_init(&photo, &view, &image, NULL);
        spl_memory_fail_after(0);
        assert_true(rc == 0 || rc == SPL_E_NOMEM);
        spl_photo_close(&photo);
        if (!rc)
            break;
    }
}

static void samples_follow_the_footprint_and_leave_the_sky_out(void **state)
{
    (void)state;
    skip_under_tsan();
    struct spl_named_view view = make_view();
    struct spl_photo photo;
    struct spl_image image = make_image(side, side, 40, 200);
    uint8_t *pixels = image.pixels;
    for (int i = 0; i < side * side / 2; i++) { /* the upper half is sky, of a colour that must not show */
        pixels[4 * i] = 255;
        pixels[4 * i + 3] = 0;
    }
    assert_int_equal(spl_photo_init(&photo, &view, &image, NULL), 0);
    float rgb[3];
    assert_true(spl_pyramid_sample(&photo.pixels, (double[]){10.5, 50.5}, 1, rgb) && rgb[0] == 40);
    assert_true(spl_pyramid_sample(&photo.pixels, (double[]){50.5, 50.5}, 1, rgb) && rgb[0] == 200);
    assert_true(spl_pyramid_sample(&photo.pixels, (double[]){32, 50}, 1, rgb) && fabsf(rgb[0] - 120) < 0.01f);
    assert_true(spl_pyramid_sample(&photo.pixels, (double[]){34.5, 50}, 16, rgb) && rgb[0] > 110 && rgb[0] < 180);
    assert_true(spl_pyramid_sample(&photo.pixels, (double[]){10.5, 32.2}, 1, rgb) && rgb[0] == 40);
    assert_false(spl_pyramid_sample(&photo.pixels, (double[]){10.5, 10.5}, 1, rgb));
    assert_false(spl_pyramid_sample(&photo.pixels, (double[]){-0.1, 50}, 1, rgb));
    assert_false(spl_pyramid_sample(&photo.pixels, (double[]){10, NAN}, 1, rgb));
    spl_photo_close(&photo);
}

static void what_hides_a_splat_is_seen(void **state)
{
    (void)state;
    skip_under_tsan();
    struct spl_named_view view = make_view();
    struct spl_image image = make_image(side, side, 90, 90);
    struct spl_photo photo;
    assert_int_equal(spl_photo_init(&photo, &view, &image, NULL), 0);
    photo.depth_camera = view.camera;
    photo.depth = (struct spl_image){.type = SPL_PIXEL_F32, .width = side, .height = side};
    float *depth = photo.depth.pixels = malloc(side * side * sizeof *depth);
    for (int i = 0; i < side * side; i++)
        depth[i] = i % side < side / 2   ? 1
                   : i % side < side - 8 ? 2
                                         : NAN;        /* an occluder on the left, sky on the right */
    const double pixel = 2 * tan(M_PI / 6) * 2 / side; /* at depth 2 */
    assert_int_equal(spl_photo_see(&photo, (double[]){-0.5, 0, 0}, 0.05), SPL_SIGHT_HIDDEN);
    assert_int_equal(spl_photo_see(&photo, (double[]){0.5 * pixel, 0, 0}, 0.05), SPL_SIGHT_HIDDEN);
    assert_int_equal(spl_photo_see(&photo, (double[]){1.5 * pixel, 0, 0}, 0.05), SPL_SIGHT_EDGE);
    assert_int_equal(spl_photo_see(&photo, (double[]){4.5 * pixel, 0, 0}, 0.05), SPL_SIGHT_CLEAR);
    assert_int_equal(spl_photo_see(&photo, (double[]){4.5 * pixel, -1, 0}, 0.05), SPL_SIGHT_BEYOND);
    assert_int_equal(spl_photo_see(&photo, (double[]){30 * pixel, 0, 0}, 0.05), SPL_SIGHT_BEYOND);
    assert_int_equal(spl_photo_see(&photo, (double[]){0, -3, 0}, 0.05), SPL_SIGHT_HIDDEN); /* behind the eye */
    /* a splat that is hidden is no candidate, one in the clear is, one seen from the side is not */
    struct spl_world_splat splat = {.position = {0.4, 0, 0}, .splat = {.normal = {0, 1, 0}, .radius = 0.02f}};
    struct spl_candidate color;
    double clear = spl_candidate_judge(&photo, &splat, &color);
    assert_true(clear > 0 && color.color[0] == 90 && color.place[1] == 128 && color.place[0] > 128);
    splat.position[0] = -0.4;
    assert_true(spl_candidate_judge(&photo, &splat, &color) == 0);
    splat.position[0] = 0.4;
    memcpy(splat.splat.normal, (float[]){0.70710678f, 0.70710678f, 0}, sizeof splat.splat.normal);
    double slanted = spl_candidate_judge(&photo, &splat, &color);
    assert_true(slanted > 0 && slanted < clear);
    memcpy(splat.splat.normal, (float[]){0, 0, 1}, sizeof splat.splat.normal);
    assert_true(spl_candidate_judge(&photo, &splat, &color) == 0);
    spl_photo_close(&photo);
}

static void the_best_are_kept_in_any_order(void **state)
{
    (void)state;
    skip_under_tsan();
    static const uint16_t scores[6] = {500, 900, 100, 900, 700, 800};
    for (int turn = 0; turn < 6; turn++) {
        struct spl_candidates candidates;
        assert_int_equal(spl_candidates_init(&candidates, 2, 4, NULL), 0);
        for (int i = 0; i < 6; i++) {
            uint16_t n = (uint16_t)((i * (turn % 2 ? 5 : 1) + turn) % 6);
            spl_candidates_add(&candidates, 1, &(struct spl_candidate){.photo = n, .score = scores[n]});
        }
        const uint16_t wanted[4] = {1, 3, 5, 4};
        for (int i = 0; i < 4; i++) {
            assert_int_equal(candidates.list[4 + i].photo, wanted[i]);
            assert_int_equal(candidates.list[i].photo, SPL_NO_PHOTO);
        }
        spl_candidates_finish(&candidates);
    }
    for (double w = 1e-6; w < 1e6; w *= 3)
        assert_true(fabs(spl_candidate_weight(spl_candidate_score(w)) / w - 1) < 0.001);
}

static struct spl_gain flat_gain(float r, float g, float b)
{
    struct spl_gain gain = {0};
    for (int n = 0; n < SPL_GAIN_NODES; n++) {
        gain.factor[n][0] = r;
        gain.factor[n][1] = g;
        gain.factor[n][2] = b;
    }
    return gain;
}

/* Glare on one corner of one photograph is taken off it, and off nothing else. */
static void glare_is_found_where_it_is(void **state)
{
    (void)state;
    struct spl_candidates candidates;
    struct spl_gain gains[4];
    float factor[3];
    assert_int_equal(spl_candidates_init(&candidates, 30000, 3, NULL), 0);
    for (uint64_t s = 0; s < candidates.splats; s++)
        for (uint16_t photo = 0; photo < 3; photo++) {
            uint8_t x = (uint8_t)(s * 7 % 256), y = (uint8_t)(s / 36 * 13 % 256);
            bool glare = photo == 1 && x > 153 && y > 127;
            struct spl_candidate c = {.photo = photo, .score = (uint16_t)(33000 - (s + photo) % 3), .place = {x, y}};
            memset(c.color, (int)(50 + s % 61), 3);
            c.color[0] = (uint8_t)(c.color[0] * (glare ? 1.6 : 1));
            spl_candidates_add(&candidates, s, &c);
        }
    assert_int_equal(spl_gains_find(&candidates, NULL, 3, gains, 2, NULL), 0);
    float clear[3];
    spl_gain_get(&gains[1], (uint8_t[]){240, 230}, factor);
    spl_gain_get(&gains[0], (uint8_t[]){240, 230}, clear);
    assert_true(fabsf(factor[0] / clear[0] * 1.6f - 1) < 0.08f && fabsf(factor[1] / clear[1] - 1) < 0.02f);
    spl_gain_get(&gains[1], (uint8_t[]){20, 20}, factor);
    spl_gain_get(&gains[0], (uint8_t[]){20, 20}, clear);
    assert_true(fabsf(factor[0] / clear[0] - 1) < 0.05f);
    spl_candidates_finish(&candidates);
}

/* Splat s is seen by photographs s % photos and the next, which saw it by their factors; every tenth wrongly. */
static void fill(struct spl_candidates *candidates, uint32_t photos, const double *factor, bool contradicting)
{
    for (uint64_t s = 0; s < candidates->splats; s++) {
        double truth = 60 + (double)(s * 2654435761u % 97);
        for (uint32_t k = 0; k < 2; k++) {
            uint32_t photo = (uint32_t)(s + k) % photos;
            double value = truth / factor[photo];
            if (s % 10 == 0 && k == 0)
                value = 230;
            if (contradicting && photo == 2)
                value = 40 + (double)((s * 40503 + 7) % 151);
            struct spl_candidate c = {.photo = (uint16_t)photo, .score = (uint16_t)(33000 - k)};
            memset(c.color, (int)(value + 0.5), 3);
            spl_candidates_add(candidates, s, &c);
        }
    }
}

static void exposures_are_found_among_outliers(void **state)
{
    (void)state;
    const double factor[5] = {0.8, 1, 1.25, 0.9, 1 / 0.9};
    struct spl_candidates candidates;
    struct spl_gain gains[6];
    assert_int_equal(spl_candidates_init(&candidates, TEST_SIZE(20000, 5000), 4, NULL), 0);
    assert_int_equal(spl_gains_find(&candidates, NULL, 5, gains, 2, NULL), 0); /* nothing is seen: nothing changes */
    for (int i = 0; i < 6; i++)
        assert_true(gains[i].factor[0][0] == 1 && gains[i].shared == 0 && !spl_gain_contradicts(&gains[i]));
    fill(&candidates, 5, factor, false);
    assert_int_equal(spl_gains_find(&candidates, NULL, 5, gains, 2, NULL), 0);
    for (int i = 0; i < 5; i++) {
        assert_true(fabs((double)gains[i].factor[7][1] / factor[i] - 1) < 0.03);
        assert_false(spl_gain_contradicts(&gains[i]) || spl_gain_doubtful(&gains[i]));
    }
    spl_candidates_finish(&candidates);
    assert_int_equal(spl_candidates_init(&candidates, TEST_SIZE(20000, 5000), 4, NULL), 0);
    fill(&candidates, 5, factor, true);
    assert_int_equal(spl_gains_find(&candidates, NULL, 5, gains, 2, NULL), 0);
    assert_true(spl_gain_contradicts(&gains[2]) && spl_gain_doubtful(&gains[2]));
    assert_true(gains[0].agreement > gains[2].agreement && gains[4].agreement > gains[2].agreement);
    spl_candidates_finish(&candidates);
}

/* On print a scan's points have the paper's colour, photographs the mean of paper and ink: no photograph is brightened
 * for it. Where photographs meet none, the scan is what evens them out. */
static void a_scan_of_print_brightens_nothing(void **state)
{
    (void)state;
    skip_under_tsan();
    struct spl_candidates candidates;
    struct spl_gain gains[3];
    enum { splats = 20000 };
    static uint8_t own[splats][3];
    for (int apart = 0; apart < 2; apart++) {
        assert_int_equal(spl_candidates_init(&candidates, splats, 2, NULL), 0);
        for (uint64_t s = 0; s < splats; s++) {
            bool print = !apart && s % 2;
            uint8_t across = (uint8_t)(s * 7 % 120 + (print ? 130 : 0));
            memset(own[s], print ? s % 8 == 1 ? 40 : 200 : 120, 3);
            for (uint16_t photo = 0; photo < 2; photo++) {
                struct spl_candidate c = {.photo = photo,
                                          .score = (uint16_t)(33000 - (s + photo) % 2),
                                          .place = {across, (uint8_t)(s % 256)}};
                memset(c.color, print ? 150 : apart && photo ? 96 : 120, 3);
                if (!apart || photo == s % 2)
                    spl_candidates_add(&candidates, s, &c);
            }
        }
        assert_int_equal(spl_gains_find(&candidates, (const uint8_t(*)[3])own, 2, gains, 2, NULL), 0);
        float left[2][3], right[3];
        for (int photo = 0; photo < 2; photo++) {
            spl_gain_get(&gains[photo], (uint8_t[]){30, 128}, left[photo]);
            spl_gain_get(&gains[photo], (uint8_t[]){220, 128}, right);
            if (!apart)
                assert_true(fabsf(right[1] / left[photo][1] - 1) < 0.015f);
        }
        assert_true(fabsf(left[1][1] / left[0][1] / (apart ? 1.25f : 1) - 1) < 0.02f);
        spl_candidates_finish(&candidates);
    }
}

static void the_majority_gives_the_colour_and_neighbours_lend(void **state)
{
    (void)state;
    enum { count = 200 };
    static struct make_splat made[count];
    for (int i = 0; i < count; i++)
        made[i] =
            (struct make_splat){.position = {0.01 * i, 0, 0}, .normal = {0, 0, 1}, .radius = 0.01f, .color = {1, 2, 3}};
    struct spl_dataset *dataset = make_dataset(made, count);
    struct spl_splats splats;
    struct spl_candidates candidates;
    struct spl_chosen chosen;
    struct spl_stage stage = {.threads = 2};
    struct spl_gain gains[4];
    for (int i = 0; i < 4; i++)
        gains[i] = flat_gain(1, 1, 1);
    assert_int_equal(spl_splats_init(&splats, dataset, NULL), 0);
    assert_int_equal(spl_candidates_init(&candidates, splats.count, 4, NULL), 0);
    /* splat 0: the best is a passer-by, two others agree; splat 1: all agree, the best gives the detail; 2 to 9: none
     */
    static const struct spl_candidate seen[2][3] = {
        {{0, 33200, {250, 0, 0}, {0, 0}}, {1, 33100, {100, 100, 100}, {0, 0}}, {2, 33000, {110, 100, 100}, {0, 0}}},
        {{0, 34000, {100, 100, 100}, {0, 0}}, {1, 33000, {120, 100, 100}, {0, 0}}, {2, 31000, {90, 100, 100}, {0, 0}}},
    };
    for (uint64_t s = 0; s < 2; s++)
        for (int k = 0; k < 3; k++)
            spl_candidates_add(&candidates, s, &seen[s][k]);
    assert_int_equal(spl_chosen_init(&chosen, &splats, &candidates, gains, 3, NULL, &stage, NULL), 0);
    assert_int_equal(chosen.photo[0], 1);
    assert_true(chosen.color[0][0] >= 100 && chosen.color[0][0] <= 110 && chosen.color[0][1] == 100);
    assert_int_equal(chosen.photo[1], 0);
    assert_true(chosen.color[1][0] >= 100 && chosen.color[1][0] < 110);
    assert_int_equal(chosen.unseen, count - 2);
    assert_int_equal(chosen.photo[5], SPL_NO_PHOTO);
    assert_true(abs(chosen.color[5][0] - chosen.color[1][0]) <= 6 && chosen.color[5][1] == 100); /* lent by 0 and 1 */
    assert_true(chosen.color[199][1] == 100); /* another chunk: the node's mean */
    spl_chosen_finish(&chosen);
    uint8_t(*own)[3] = calloc(splats.count, 3);
    memset(own, 80, splats.count * 3);
    gains[3] = flat_gain(1.5f, 1, 1);
    assert_int_equal(spl_chosen_init(&chosen, &splats, &candidates, gains, 3, (const uint8_t(*)[3])own, &stage, NULL),
                     0);
    assert_true(chosen.color[5][0] == 120 && chosen.color[5][1] == 80); /* its own, evened out */
    free(own);
    spl_chosen_finish(&chosen);
    spl_candidates_finish(&candidates);
    spl_splats_finish(&splats);
    spl_dataset_close(dataset);
}

static float smooth(double x, double y)
{
    return (float)(128 + 50 * sin(x * 7) + 40 * cos(y * 5));
}

/* A photograph of a smooth pattern on the plane y = 0, seen slantwise: textures are that pattern, whatever the view. */
static void textures_show_the_plane_and_not_the_view(void **state)
{
    (void)state;
    skip_under_tsan();
    struct spl_named_view view = make_view();
    assert_int_equal(
        spl_camera_look_at(&view.camera, (double[]){0.6, -1.5, 0.4}, (double[]){0, 0, 0}, (double[]){0, 0, 1}, NULL),
        0);
    view.camera.fx = view.camera.fy = 200;
    view.camera.width = view.camera.height = 200;
    view.camera.cx = view.camera.cy = 100;
    struct spl_image image = make_image(200, 200, 0, 0);
    uint8_t *pixels = image.pixels;
    for (int i = 0; i < 200 * 200; i++) {
        double ray[3], c[3] = {(i % 200 + 0.5 - 100) / 200, (i / 200 + 0.5 - 100) / 200, 1}; /* place to ray to plane */
        for (int a = 0; a < 3; a++)
            ray[a] = c[0] * view.camera.rotation[a] + c[1] * view.camera.rotation[3 + a] + view.camera.rotation[6 + a];
        double t = -view.camera.eye[1] / ray[1];
        for (int a = 0; a < 3; a++)
            pixels[4 * i + a] =
                (uint8_t)(smooth(view.camera.eye[0] + t * ray[0], view.camera.eye[2] + t * ray[2]) + 0.5f);
    }
    struct spl_photo photo;
    assert_int_equal(spl_photo_init(&photo, &view, &image, NULL), 0);
    const struct spl_world_splat splat = {.position = {0.1, 0, 0.05}, .splat = {.normal = {0, -1, 0}, .radius = 0.12f}};
    const struct spl_gain gain = flat_gain(1, 1, 0.5f);
    const struct spl_candidate seen = {.color = {100, 100, 100}};
    const uint8_t color[3] = {100, 110, 50};
    const struct spl_tone tone = spl_tone_find(&gain, &seen, color);
    assert_true(tone.offset[0] == 0 && tone.offset[1] == 10 && tone.offset[2] == 0);
    static uint8_t texture[SPL_TEXTURE_VALUES_MAX];
    float u[3], v[3];
    spl_tangent_frame(splat.splat.normal, u, v);
    for (uint32_t size = 8; size <= 32; size *= 2) {
        assert_true(spl_texture_resample(&photo, &tone, &splat, size, texture));
        for (uint32_t i = 0; i < size * size; i++) {
            float a = 0.12f * ((2 * (float)(i % size) + 1) / (float)size - 1);
            float b = 0.12f * ((2 * (float)(i / size) + 1) / (float)size - 1);
            float wanted = smooth(0.1 + (double)(a * u[0] + b * v[0]), 0.05 + (double)(a * u[2] + b * v[2]));
            assert_true(fabsf((float)texture[i] - wanted) < 2);
            assert_true(fabsf((float)texture[size * size + i] - wanted - 10) < 2);
            assert_true(fabsf((float)texture[2 * size * size + i] - wanted / 2) < 2);
        }
    }
    struct spl_resample_error error = {0}, coarse = {0};
    spl_texture_compare(&photo, &tone, &splat, 32, texture, &error);
    assert_true(error.values > 3 * 300 && 10 * log10(65025 * (double)error.values / error.squared) > 50);
    double pixels_of_disc = (double)error.values / 3; /* pi / 4 of its square's */
    assert_true(error.splats == 1 && fabs(error.sides - sqrt(pixels_of_disc * 4 / 3.14159)) < 0.2 * error.sides);
    memset(texture, 128, 3 * 64);
    spl_texture_compare(&photo, &tone, &splat, 8, texture, &coarse);
    assert_true(coarse.values == error.values && coarse.squared > 100 * error.squared);

    /* what the photograph does not show is filled from beside it: the right half is hidden by something nearer */
    photo.depth_camera = view.camera;
    photo.depth = (struct spl_image){.type = SPL_PIXEL_F32, .width = 200, .height = 200};
    float *depth = photo.depth.pixels = malloc(200 * 200 * sizeof *depth);
    double middle[2], at;
    assert_true(spl_camera_project(&view.camera, splat.position, middle, &at));
    for (int i = 0; i < 200 * 200; i++) {
        depth[i] = i % 200 > (int)middle[0] + 4 ? 0.5f : (float)at;
        if (i % 200 > (int)middle[0] + 4)
            pixels = photo.pixels.texels[0] + 4 * (size_t)i, pixels[0] = pixels[1] = pixels[2] = 255;
    }
    assert_true(spl_texture_resample(&photo, &tone, &splat, 16, texture));
    for (int i = 0; i < 256; i++)
        assert_true(texture[i] < 230); /* the occluder's white is on no texel */
    for (int i = 0; i < 200 * 200; i++)
        depth[i] = 0.5f;
    assert_false(spl_texture_resample(&photo, &tone, &splat, 16, texture));
    spl_photo_close(&photo);
}

/* Through a lens that bends them, pixels are compared with the places of the plane that they show. */
static void resampling_is_measured_through_a_lens(void **state)
{
    (void)state;
    skip_under_tsan();
    struct spl_named_view view = make_view();
    view.camera.fx = view.camera.fy = 200;
    view.camera.width = view.camera.height = 200;
    view.camera.cx = view.camera.cy = 100;
    const struct spl_distortion lenses[] = {
        {0},
        {.kind = SPL_DISTORTION_RADIAL, .k = {-0.25}},
        {.kind = SPL_DISTORTION_RADIAL, .k = {0.1, 0.02}, .p = {0.004, -0.003}},
        {.kind = SPL_DISTORTION_FISHEYE, .k = {0.02}},
    };
    const struct spl_world_splat splat = {.position = {0.5, 0, 0.4}, .splat = {.normal = {0, -1, 0}, .radius = 0.12f}};
    const struct spl_gain gain = flat_gain(1, 1, 1);
    const struct spl_candidate seen = {.color = {100, 100, 100}};
    const struct spl_tone tone = spl_tone_find(&gain, &seen, seen.color);
    static uint8_t texture[SPL_TEXTURE_VALUES_MAX];
    uint64_t straight = 0;
    for (size_t l = 0; l < sizeof lenses / sizeof *lenses; l++) {
        view.distortion = lenses[l];
        assert_int_equal(spl_distortion_init(&view.distortion, NULL), 0);
        struct spl_image image = make_image(200, 200, 0, 0);
        uint8_t *pixels = image.pixels;
        for (int i = 0; i < 200 * 200; i++) /* finer than 8 texels across the disc, not than 32 */
            memset(pixels + 4 * i, (int)(128 + 60 * sin(i % 200 * 1.2) + 50 * cos(i / 200 * 1.1)), 3);
        struct spl_photo photo;
        assert_int_equal(spl_photo_init(&photo, &view, &image, NULL), 0);
        struct spl_resample_error error[3] = {0};
        for (uint32_t k = 0; k < 3; k++) {
            assert_true(spl_texture_resample(&photo, &tone, &splat, 8u << k, texture));
            spl_texture_compare(&photo, &tone, &splat, 8u << k, texture, &error[k]);
            assert_true(isfinite(error[k].squared) && error[k].values == error[0].values);
        }
        straight = l ? straight : error[0].values;
        assert_true(error[0].values > straight / 2 && error[0].values < 2 * straight && straight > 3 * 300);
        assert_true(error[0].squared > 4 * error[2].squared);
        spl_photo_close(&photo);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_no_photograph_of_the_camera_is_refused),
        cmocka_unit_test(samples_follow_the_footprint_and_leave_the_sky_out),
        cmocka_unit_test(what_hides_a_splat_is_seen),
        cmocka_unit_test(the_best_are_kept_in_any_order),
        cmocka_unit_test(exposures_are_found_among_outliers),
        cmocka_unit_test(a_scan_of_print_brightens_nothing),
        cmocka_unit_test(glare_is_found_where_it_is),
        cmocka_unit_test(textures_show_the_plane_and_not_the_view),
        cmocka_unit_test(resampling_is_measured_through_a_lens),
        cmocka_unit_test(the_majority_gives_the_colour_and_neighbours_lend),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
