/* A photograph's levels: averages weighted by alpha, odd sizes, and where a footprint looks. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "image/pyramid.h"

static struct spl_pyramid make(uint32_t width, uint32_t height, void (*color)(uint32_t x, uint32_t y, uint8_t rgba[4]))
{
    struct spl_image image = {.type = SPL_PIXEL_RGBA8, .width = width, .height = height};
    struct spl_pyramid pyramid;
    uint8_t *to = image.pixels = malloc((size_t)width * height * 4);
    assert_non_null(to);
    for (uint32_t i = 0; i < width * height; i++)
        color(i % width, i / width, to + (size_t)4 * i);
    assert_int_equal(spl_pyramid_init(&pyramid, &image, NULL), 0);
    assert_null(image.pixels);
    return pyramid;
}

static void checkered(uint32_t x, uint32_t y, uint8_t rgba[4])
{
    memset(rgba, (x + y) % 2 ? 200 : 100, 3);
    rgba[3] = 255;
}

/* Red where it is opaque, white and transparent in every other column. */
static void fence(uint32_t x, uint32_t y, uint8_t rgba[4])
{
    (void)y;
    memcpy(rgba, x % 2 ? (uint8_t[]){255, 255, 255, 0} : (uint8_t[]){90, 0, 0, 255}, 4);
}

/* 2 x 2 whose means are 10.75 and 0.5 of colour, 254.5 of alpha. */
static void odd_means(uint32_t x, uint32_t y, uint8_t rgba[4])
{
    uint8_t first = x == 0 && y == 0;
    memcpy(rgba, (uint8_t[]){first ? 10 : 11, y ? 1 : 0, 0, y ? 255 : 254}, 4);
}

static void means_are_rounded(void **state)
{
    struct spl_pyramid p = make(2, 2, odd_means);
    (void)state;
    assert_int_equal(p.texels[1][0], 11);
    assert_int_equal(p.texels[1][1], 1);
    assert_int_equal(p.texels[1][3], 255);
    spl_pyramid_finish(&p);
}

static void test_levels(void **state)
{
    struct spl_pyramid p = make(5, 3, checkered);
    (void)state;
    assert_int_equal(p.levels, 4);
    assert_int_equal(p.width[1], 3);
    assert_int_equal(p.height[1], 2);
    assert_int_equal(p.texels[1][0], 150);
    assert_int_equal(p.width[3], 1);
    spl_pyramid_finish(&p);
    assert_null(p.texels[0]);
    p = make(4, 2, fence);
    assert_int_equal(p.texels[1][0], 90); /* nothing of the transparent white */
    assert_int_equal(p.texels[1][1], 0);
    assert_in_range(p.texels[1][3], 127, 128);
    spl_pyramid_finish(&p);
    spl_pyramid_finish(&p);
}

static void test_sample(void **state)
{
    struct spl_pyramid p = make(8, 8, checkered);
    float rgb[3];
    (void)state;
    assert_true(spl_pyramid_sample(&p, (double[]){0.5, 0.5}, 1, rgb) && rgb[0] == 100);
    assert_true(spl_pyramid_sample(&p, (double[]){1.5, 0.5}, 0, rgb) && rgb[0] == 200);
    assert_true(spl_pyramid_sample(&p, (double[]){1, 0.5}, 1, rgb) && fabsf(rgb[0] - 150) < 0.01f);
    assert_true(spl_pyramid_sample(&p, (double[]){3.5, 3.5}, 2, rgb) &&
                fabsf(rgb[0] - 150) < 0.01f); /* level 1 alone */
    assert_true(spl_pyramid_sample(&p, (double[]){0.5, 0.5}, sqrt(2), rgb) && fabsf(rgb[0] - 125) < 0.01f);
    assert_true(spl_pyramid_sample(&p, (double[]){8, 8}, 1e9, rgb) && fabsf(rgb[0] - 150) < 0.01f);
    assert_false(spl_pyramid_sample(&p, (double[]){-0.01, 4}, 1, rgb));
    assert_false(spl_pyramid_sample(&p, (double[]){4, NAN}, 1, rgb));
    spl_pyramid_finish(&p);
    p = make(8, 8, fence);
    assert_true(spl_pyramid_sample(&p, (double[]){0.5, 0.5}, 1, rgb) && rgb[0] == 90 && rgb[1] == 0);
    assert_false(spl_pyramid_sample(&p, (double[]){1.5, 0.5}, 1, rgb));
    spl_pyramid_finish(&p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_levels), cmocka_unit_test(test_sample),
                                       cmocka_unit_test(means_are_rounded)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
