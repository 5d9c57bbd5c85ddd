/* Photographs left out of packing: figures of images whose errors are known. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "measure/left_out.h"
#include "support/make_dataset.h"

enum { W = 40, H = 36, R = SPL_LEFT_OUT_SHIFT, INSIDE = (W - 2 * R) * (H - 2 * R) };

static uint8_t photograph[4 * W * H], render[2][4 * W * H];
static float width_px[W * H];
static struct spl_image pictures[3] = {
    {SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, W, H, photograph},
    {SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, W, H, render[0]},
    {SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, W, H, render[1]},
};
static const struct spl_left_out_images images = {&pictures[0], {&pictures[1], &pictures[2]}, width_px};

/* No two places look alike. */
static uint8_t pattern(int x, int y, int c)
{
    uint32_t h = (uint32_t)(x * 73 + y * 1999 + c * 7) * 2654435761u;
    return (uint8_t)(20 + (h >> 24) % 80);
}

static int fill(void **state)
{
    (void)state;
    for (int i = 0; i < W * H; i++) {
        width_px[i] = i % W < W / 2 ? 1.5f : 6;
        for (int c = 0; c < 4; c++)
            photograph[4 * i + c] = render[0][4 * i + c] = render[1][4 * i + c] =
                c == 3 ? 255 : pattern(i % W, i / W, c);
    }
    return 0;
}

static struct spl_left_out compare(unsigned threads)
{
    struct spl_left_out sums;
    struct spl_error err = {0};
    assert_int_equal(spl_left_out_compare(&images, threads, &sums, &err), 0);
    return sums;
}

static void sizes_and_types_are_refused(void **state)
{
    (void)state;
    struct spl_image small = pictures[1], depth = pictures[1];
    struct spl_left_out_images wrong = images;
    struct spl_left_out sums;
    struct spl_error err = {0};
    small.width--;
    depth.type = SPL_PIXEL_F32;
    wrong.render[1] = &small;
    assert_int_equal(spl_left_out_compare(&wrong, 1, &sums, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "width");
    err = (struct spl_error){0};
    wrong.render[1] = &depth;
    assert_int_equal(spl_left_out_compare(&wrong, 1, &sums, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "color");
}

static void nothing_compared_is_no_figure(void **state)
{
    (void)state;
    for (int i = 0; i < W * H; i++)
        width_px[i] = NAN;
    struct spl_left_out sums = compare(1);
    assert_int_equal(sums.pixels[0] + sums.pixels[1] + sums.pixels[2], 0);
    assert_true(isnan(spl_left_out_psnr(&sums, SPL_LEFT_OUT_WIDE, SPL_LEFT_OUT_TEXTURED, SPL_LEFT_OUT_PLAIN)));
}

/* The coloured render is off by 10 everywhere in one channel, the textured one by 5 on narrow splats alone. */
static void errors_are_told_apart_by_width(void **state)
{
    (void)state;
    for (int i = 0; i < W * H; i++) {
        render[0][4 * i] += 10;
        render[1][4 * i + 1] += width_px[i] > 2 ? 0 : 5;
    }
    struct spl_left_out sums = compare(1);
    assert_int_equal(sums.pixels[SPL_LEFT_OUT_NARROW], INSIDE / 2);
    assert_int_equal(sums.pixels[SPL_LEFT_OUT_WIDE], INSIDE / 2);
    for (int w = 0; w < SPL_LEFT_OUT_BROAD; w++) {
        assert_float_equal(sums.squared[w][SPL_LEFT_OUT_COLORED][SPL_LEFT_OUT_PLAIN], 100.0 * INSIDE / 2, 1e-6);
        assert_float_equal(sums.squared[w][SPL_LEFT_OUT_COLORED][SPL_LEFT_OUT_LEVELLED], 0, 20.0 * INSIDE);
    }
    assert_int_equal(sums.pixels[SPL_LEFT_OUT_BROAD], 0);
    assert_float_equal(sums.squared[SPL_LEFT_OUT_NARROW][SPL_LEFT_OUT_TEXTURED][0], 25.0 * INSIDE / 2, 1e-6);
    assert_float_equal(sums.squared[SPL_LEFT_OUT_WIDE][SPL_LEFT_OUT_TEXTURED][0], 0, 1e-6);
    double psnr = spl_left_out_psnr(&sums, SPL_LEFT_OUT_WIDE, SPL_LEFT_OUT_COLORED, SPL_LEFT_OUT_PLAIN);
    assert_float_equal(psnr, 10 * log10(3 * 255 * 255 / 100.0), 1e-9);
}

/* What is transparent, and what a move could reach beyond, does not count. */
static void only_what_the_photograph_shows_counts(void **state)
{
    (void)state;
    photograph[4 * (10 * W + 10) + 3] = 254;
    struct spl_left_out sums = compare(1);
    assert_int_equal(sums.pixels[SPL_LEFT_OUT_NARROW], INSIDE / 2 - (2 * R + 1) * (2 * R + 1));
    assert_int_equal(sums.pixels[SPL_LEFT_OUT_WIDE], INSIDE / 2);
}

static void a_darker_render_is_matched(void **state)
{
    (void)state;
    for (int i = 0; i < 4 * W * H; i++)
        if (i % 4 != 3)
            photograph[i] = (uint8_t)(2 * render[0][i]);
    struct spl_left_out sums = compare(1);
    assert_true(spl_left_out_psnr(&sums, SPL_LEFT_OUT_WIDE, SPL_LEFT_OUT_COLORED, SPL_LEFT_OUT_PLAIN) < 20);
    assert_float_equal(sums.squared[SPL_LEFT_OUT_WIDE][SPL_LEFT_OUT_COLORED][SPL_LEFT_OUT_MATCHED], 0, 1e-6);
}

/* A render that is 2 right and 1 up of the photograph is misplaced, one without detail is not. */
static void misplacement_is_told_from_blur(void **state)
{
    (void)state;
    for (int i = 0; i < 4 * W * H; i++)
        if (i % 4 != 3) {
            render[1][i] = pattern(i / 4 % W + 2, i / 4 / W - 1, i % 4);
            render[0][i] = 60;
        }
    struct spl_left_out sums = compare(1);
    const double *misplaced = sums.squared[SPL_LEFT_OUT_WIDE][SPL_LEFT_OUT_TEXTURED];
    const double *blurred = sums.squared[SPL_LEFT_OUT_WIDE][SPL_LEFT_OUT_COLORED];
    assert_true(misplaced[SPL_LEFT_OUT_MATCHED] > blurred[SPL_LEFT_OUT_MATCHED]);
    assert_true(misplaced[SPL_LEFT_OUT_REGISTERED] < 0.02 * misplaced[SPL_LEFT_OUT_MATCHED]);
    assert_true(blurred[SPL_LEFT_OUT_REGISTERED] > 0.8 * blurred[SPL_LEFT_OUT_MATCHED]);
    assert_true(sums.worse[SPL_LEFT_OUT_WIDE] > INSIDE / 4);
}

/* Light that differs from block to block is no detail: levelled it is gone, and nothing is gained or lost. */
static void light_is_told_from_detail(void **state)
{
    (void)state;
    for (int i = 0; i < 4 * W * H; i++)
        if (i % 4 != 3)
            render[0][i] = render[1][i] =
                (uint8_t)(photograph[i] + 30 * ((i / 4 % W / SPL_LEFT_OUT_BLOCK + i / 4 / W / SPL_LEFT_OUT_BLOCK) % 2));
    for (int i = 0; i < W * H; i++)
        width_px[i] = 9;
    const struct spl_left_out sums = compare(1);
    assert_int_equal(sums.pixels[SPL_LEFT_OUT_BROAD], INSIDE);
    const double *squared = sums.squared[SPL_LEFT_OUT_BROAD][SPL_LEFT_OUT_TEXTURED];
    assert_true(squared[SPL_LEFT_OUT_MATCHED] > 100.0 * INSIDE);
    assert_true(squared[SPL_LEFT_OUT_LEVELLED] < 0.2 * squared[SPL_LEFT_OUT_MATCHED]);
    assert_int_equal(sums.worse[SPL_LEFT_OUT_BROAD], 0);
}

static void any_number_of_threads_finds_the_same(void **state)
{
    (void)state;
    for (int i = 0; i < W * H; i++)
        render[1][4 * i] = pattern(i, 0, 3);
    struct spl_left_out one = compare(1), four = compare(4);
    for (int i = 0; i < SPL_LEFT_OUT_WIDTHS * SPL_LEFT_OUT_KINDS * SPL_LEFT_OUT_STEPS; i++)
        assert_true((&one.squared[0][0][0])[i] == (&four.squared[0][0][0])[i]);
}

/* Barrel distortion: a pixel shows what the photograph has nearer to its middle. */
static void the_lens_is_taken_out(void **state)
{
    (void)state;
    char folder[256], path[300], command[300];
    struct spl_error err = {0};
    struct spl_encoded encoded = {0};
    for (int i = 0; i < W * H; i++)
        for (int c = 0; c < 3; c++)
            photograph[4 * i + c] = (uint8_t)(5 * (i % W));
    make_folder(folder);
    snprintf(path, sizeof path, "%s/ramp.png", folder);
    assert_int_equal(
        spl_image_encode(&pictures[0], &SPL_SIZED(spl_encode_options, .format = SPL_FORMAT_PNG), &encoded, &err), 0);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(encoded.bytes, 1, encoded.length, file), encoded.length);
    fclose(file);
    spl_encoded_finish(&encoded);
    struct spl_named_view view = {.name = (char *)"ramp", .photograph = path};
    view.camera = (struct spl_camera){
        .fx = W / 2, .fy = W / 2, .cx = W / 2, .cy = H / 2, .width = W, .height = H, .near = 0.01, .far = INFINITY};
    view.distortion = (struct spl_distortion){.kind = SPL_DISTORTION_RADIAL, .k = {-0.2}};
    assert_int_equal(spl_distortion_init(&view.distortion, &err), 0);
    struct spl_image out;
    assert_int_equal(spl_left_out_load(&view, &out, &err), 0);
    /* pixel (29, 18): x = 9.5 / 20, y = 0.5 / 20; the image of it is (1 - 0.2 r^2) times as far out */
    double x = 9.5 / 20, y = 0.5 / 20, place = 20 + 9.5 * (1 - 0.2 * (x * x + y * y)) - 0.5;
    assert_float_equal(((const uint8_t *)out.pixels)[4 * (18 * W + 29)], 5 * place, 0.51);
    spl_image_finish(&out);
    view.camera.width = W + 1;
    assert_int_equal(spl_left_out_load(&view, &out, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "width");
    snprintf(command, sizeof command, "rm -r '%s'", folder);
    assert_int_equal(system(command), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(sizes_and_types_are_refused, fill),
        cmocka_unit_test_setup(nothing_compared_is_no_figure, fill),
        cmocka_unit_test_setup(errors_are_told_apart_by_width, fill),
        cmocka_unit_test_setup(only_what_the_photograph_shows_counts, fill),
        cmocka_unit_test_setup(a_darker_render_is_matched, fill),
        cmocka_unit_test_setup(misplacement_is_told_from_blur, fill),
        cmocka_unit_test_setup(light_is_told_from_detail, fill),
        cmocka_unit_test_setup(any_number_of_threads_finds_the_same, fill),
        cmocka_unit_test_setup(the_lens_is_taken_out, fill),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
