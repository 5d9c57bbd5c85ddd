/* Density: a grid of known spacing, its borders, and what blanking leaves. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <cmocka.h>

#include "measure/dense.h"
#include "measure/metrics.h"

enum { side = 60 };
static float points[side * side], truth[side * side];
static uint8_t dense[side * side];

static struct spl_image depth(float *pixels)
{
    return (struct spl_image){SPL_LAYER_DEPTH, SPL_PIXEL_F32, side, side, pixels};
}

/* Sky on the right quarter; points hit `hit` of 10 pixels in the left half, all in the rest. */
static int64_t mark(int hit, float off)
{
    for (int y = 0; y < side; y++) {
        for (int x = 0; x < side; x++) {
            int i = y * side + x;
            truth[i] = x < 45 ? 10 : NAN;
            points[i] = x >= 30 || (x * 3 + y * 7) % 10 < hit ? 10 * off : NAN;
        }
    }
    struct spl_image a = depth(points), b = depth(truth);
    return spl_dense_mark(&a, &b, dense, NULL);
}

static void dense_is_a_point_a_pixel(void **state)
{
    (void)state;
    assert_int_equal(mark(7, 1.01f), 45 * side);
    int64_t rest = mark(5, 1);
    assert_true(rest >= 15 * side && rest <= (15 + 4) * side); /* the right part and a rim that sees it */
    assert_true(dense[5 * side + 40] && !dense[5 * side + 20] && !dense[5 * side + 50] && dense[44] && !dense[0]);
    assert_int_equal(mark(10, 1.03f), 0); /* points of another surface */
}

static void sizes_must_agree(void **state)
{
    (void)state;
    struct spl_image a = depth(points), b = depth(truth);
    struct spl_error err = {0};
    b.width = 30;
    assert_int_equal(spl_dense_mark(&a, &b, dense, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "depth");
}

/* Wrong where it is not dense, off by `level` in one dense column: the figures see the latter alone. */
static void blanked_pictures_are_compared_where_dense(void **state)
{
    (void)state;
    int64_t count = mark(0, 1);
    static uint32_t image[side * side], right[side * side];
    static float coverage[side * side], full[side * side];
    for (int i = 0; i < side * side; i++) {
        right[i] = 0xff808080;
        image[i] = !dense[i] ? 0xff0000ff : i % side == 40 ? 0xff888888 : right[i];
        full[i] = 1;
        coverage[i] = dense[i];
    }
    struct spl_image a = {SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, side, side, image}, b = a,
                     c = {SPL_LAYER_COVERAGE, SPL_PIXEL_F32, side, side, coverage}, d = c;
    b.pixels = right;
    d.pixels = full;
    spl_dense_blank(&a, dense);
    spl_dense_blank(&b, dense);
    spl_dense_blank(&d, dense);
    struct spl_picture render = {.color = &a, .coverage = &c}, wanted = {.color = &b, .coverage = &d};
    struct spl_metrics m;
    assert_int_equal(spl_metrics_compare(&render, &wanted, 1, &m, NULL), 0);
    assert_true(m.holes == 0);
    double psnr = m.psnr - 10 * log10((double)(side * side) / (double)count);
    assert_true(fabs(psnr - 10 * log10(255.0 * 255 / (64.0 * side / (double)count))) < 1e-9);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(dense_is_a_point_a_pixel),
        cmocka_unit_test(sizes_must_agree),
        cmocka_unit_test(blanked_pictures_are_compared_where_dense),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
