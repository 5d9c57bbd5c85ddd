/* Enlarging, and means of squares that pixels do not divide: values by hand, empty pixels, edges of depth, sizes that
 * do not divide. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

#include "image/resample.h"

static struct spl_image image(enum spl_layer layer, enum spl_pixel_type type, uint32_t width, uint32_t height,
                              void *pixels)
{
    return (struct spl_image){.layer = layer, .type = type, .width = width, .height = height, .pixels = pixels};
}

/* A linear ramp stays one between the outermost centres: pixel x of 8 lies at (x + 0.5) / 2 - 0.5 of 4. */
static void a_ramp_of_depth_stays_a_ramp(void **state)
{
    (void)state;
    float small[4] = {10, 10.01f, 10.02f, 10.03f}, large[8];
    struct spl_image from = image(SPL_LAYER_DEPTH, SPL_PIXEL_F32, 4, 1, small);
    struct spl_image to = image(SPL_LAYER_DEPTH, SPL_PIXEL_F32, 8, 1, large);
    spl_image_resample(&from, 0.5, 0, &to, 0, to.height);
    for (int x = 1; x < 7; x++)
        assert_true(fabs(large[x] - (10 + 0.01 * ((x + 0.5) / 2 - 0.5))) < 1e-5);
    assert_true(large[0] == 10 && fabsf(large[7] - 10.03f) < 1e-5f);
}

static void an_edge_of_depth_has_no_value_in_between(void **state)
{
    (void)state;
    float small[4] = {2, 2, 7, NAN}, large[16];
    struct spl_image from = image(SPL_LAYER_RANGE, SPL_PIXEL_F32, 4, 1, small);
    struct spl_image to = image(SPL_LAYER_RANGE, SPL_PIXEL_F32, 16, 1, large);
    spl_image_resample(&from, 0.25, 0, &to, 0, to.height);
    for (int x = 0; x < 16; x++) {
        if (x < 8)
            assert_true(large[x] == 2);
        else if (x < 12)
            assert_true(large[x] == 7);
        else
            assert_true(isnan(large[x]));
    }
}

static void transparent_pixels_lend_no_colour(void **state)
{
    (void)state;
    uint8_t small[] = {200, 100, 50, 255, 0, 255, 0, 0}, large[16];
    struct spl_image from = image(SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, 2, 1, small);
    struct spl_image to = image(SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, 4, 1, large);
    spl_image_resample(&from, 0.5, 0, &to, 0, to.height);
    const uint8_t alphas[] = {255, 191, 64, 0};
    for (int x = 0; x < 4; x++) {
        assert_int_equal(large[4 * x + 3], alphas[x]);
        const uint8_t rgb[3] = {200, 100, 50}, none[3] = {0};
        assert_memory_equal(large + 4 * x, x < 3 ? rgb : none, 3);
    }
}

/* Quarters of the way from 10 to 11 and from an alpha of 254 to 255. */
static void colours_are_rounded(void **state)
{
    (void)state;
    uint8_t small[] = {10, 20, 30, 254, 11, 20, 30, 255}, large[16];
    struct spl_image from = image(SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, 2, 1, small);
    struct spl_image to = image(SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, 4, 1, large);
    spl_image_resample(&from, 0.5, 0, &to, 0, to.height);
    const uint8_t red[] = {10, 10, 11, 11}, alpha[] = {254, 254, 255, 255};
    for (int x = 0; x < 4; x++) {
        assert_int_equal(large[4 * x], red[x]);
        assert_int_equal(large[4 * x + 3], alpha[x]);
    }
}

static void normals_are_unit_and_ids_are_whole(void **state)
{
    (void)state;
    float normals[] = {1, 0, 0, 0, 1, 0, 0, 0, 0}, out[18];
    struct spl_image from = image(SPL_LAYER_NORMAL, SPL_PIXEL_F32X3, 3, 1, normals);
    struct spl_image to = image(SPL_LAYER_NORMAL, SPL_PIXEL_F32X3, 6, 1, out);
    spl_image_resample(&from, 0.5, 0, &to, 0, to.height);
    for (int x = 0; x < 4; x++)
        assert_true(fabs(hypot(hypot(out[3 * x], out[3 * x + 1]), out[3 * x + 2]) - 1) < 1e-6);
    assert_true(fabsf(out[3] / out[4] - 3) < 1e-5f); /* a quarter of the way from x to y */
    assert_true(out[9] == 0 && out[10] == 1 && out[15] == 0 && out[16] == 0 && out[17] == 0);

    uint32_t ids[] = {7, UINT32_MAX, 9}, large[5 * 2];
    from = image(SPL_LAYER_ID, SPL_PIXEL_U32, 3, 1, ids);
    to = image(SPL_LAYER_ID, SPL_PIXEL_U32, 5, 2, large); /* odd: the last coarse pixel is half used */
    spl_image_resample(&from, 0.5, 0, &to, 0, to.height);
    const uint32_t wanted[] = {7, 7, UINT32_MAX, UINT32_MAX, 9, 7, 7, UINT32_MAX, UINT32_MAX, 9};
    assert_memory_equal(large, wanted, sizeof wanted);
    from.layer = to.layer = SPL_LAYER_PRIMITIVE;
    memset(large, 0, sizeof large);
    spl_image_resample(&from, 0.5, 0, &to, 0, to.height);
    assert_memory_equal(large, wanted, sizeof wanted);
}

static void coverage_fades(void **state)
{
    (void)state;
    float small[] = {1, 0, 0, 0}, large[16];
    struct spl_image from = image(SPL_LAYER_COVERAGE, SPL_PIXEL_F32, 2, 2, small);
    struct spl_image to = image(SPL_LAYER_COVERAGE, SPL_PIXEL_F32, 4, 4, large);
    spl_image_resample(&from, 0.5, 0, &to, 0, to.height);
    assert_true(large[0] == 1 && large[5] == 0.75f * 0.75f && large[10] == 0.25f * 0.25f && large[15] == 0);
}

/* Five pixels become four: shares 4 : 1, 3 : 2, 2 : 3, 1 : 4; six become four by 2 : 1 and 1 : 2. */
static void squares_have_the_mean_of_what_they_cover(void **state)
{
    (void)state;
    float five[25], six[6] = {0, 3, 6, 9, 12, 15}, out[16];
    for (int i = 0; i < 25; i++)
        five[i] = (float)(10 * (i % 5) + 100 * (i / 5));
    struct spl_image from = image(SPL_LAYER_COVERAGE, SPL_PIXEL_F32, 5, 5, five);
    struct spl_image to = image(SPL_LAYER_COVERAGE, SPL_PIXEL_F32, 4, 4, out);
    spl_image_resample(&from, 1.25, 0, &to, 0, 2);
    spl_image_resample(&from, 1.25, 0, &to, 2, 4); /* rows by any steps */
    for (int y = 0; y < 4; y++)
        for (int x = 0; x < 4; x++)
            assert_true(fabs(out[4 * y + x] - (12.0 * x + 2 + 120.0 * y + 20)) < 1e-4);
    from = image(SPL_LAYER_COVERAGE, SPL_PIXEL_F32, 6, 1, six);
    to = image(SPL_LAYER_COVERAGE, SPL_PIXEL_F32, 4, 1, out);
    spl_image_resample(&from, 1.5, 0, &to, 0, 1);
    const float thirds[] = {1, 5, 10, 14};
    for (int x = 0; x < 4; x++)
        assert_true(fabsf(out[x] - thirds[x]) < 1e-5f);
}

/* A piece with a pixel around it is enlarged as the whole. */
static void a_rim_is_what_lies_beyond(void **state)
{
    (void)state;
    float whole[64], piece[16], large[1024], part[64];
    for (int i = 0; i < 64; i++)
        whole[i] = (float)((i * 37) % 64);
    for (int i = 0; i < 16; i++)
        piece[i] = whole[8 * (2 + i / 4) + 3 + i % 4]; /* from (4, 3) on two of them a side, and one around */
    for (int quarter = 0; quarter < 2; quarter++) {
        const uint32_t each = quarter ? 4 : 2; /* pixels that one becomes, a side */
        struct spl_image from = image(SPL_LAYER_COVERAGE, SPL_PIXEL_F32, 8, 8, whole);
        struct spl_image to = image(SPL_LAYER_COVERAGE, SPL_PIXEL_F32, 8 * each, 8 * each, large);
        spl_image_resample(&from, 1.0 / each, 0, &to, 0, to.height);
        from = image(SPL_LAYER_COVERAGE, SPL_PIXEL_F32, 4, 4, piece);
        to = image(SPL_LAYER_COVERAGE, SPL_PIXEL_F32, 2 * each, 2 * each, part);
        spl_image_resample(&from, 1.0 / each, 1, &to, 0, to.height);
        for (uint32_t y = 0; y < 2 * each; y++)
            assert_memory_equal(part + 2 * each * y, large + 8 * each * (3 * each + y) + 4 * each,
                                2 * each * sizeof *part);
    }
}

/* Of an edge the nearer side, of numbers the one with most of the square that is any; a transparent side lends no
 * colour, and sizes that the factor does not divide end at the last pixel. */
static void squares_keep_edges(void **state)
{
    (void)state;
    float depths[] = {2, 2, 7, 7, NAN}, out[4];
    struct spl_image from = image(SPL_LAYER_DEPTH, SPL_PIXEL_F32, 5, 1, depths);
    struct spl_image to = image(SPL_LAYER_DEPTH, SPL_PIXEL_F32, 4, 1, out);
    spl_image_resample(&from, 1.25, 0, &to, 0, 1);
    const float sides[] = {2, 2, 7}; /* the first of 2 and 7 where both are in it */
    for (int x = 0; x < 3; x++)
        assert_true(fabsf(out[x] - sides[x]) < 1e-5f);
    assert_true(fabsf(out[3] - 7) < 1e-5f); /* a fifth of it */
    uint32_t ids[] = {1, 2, UINT32_MAX, 4}, id[3];
    from = image(SPL_LAYER_ID, SPL_PIXEL_U32, 4, 1, ids);
    to = image(SPL_LAYER_ID, SPL_PIXEL_U32, 3, 1, id);
    spl_image_resample(&from, 1.25, 0, &to, 0, 1);
    assert_true(id[0] == 1 && id[1] == 2 && id[2] == 4);
    float normals[] = {1, 0, 0, 0, 0, 0}, mean[3];
    from = image(SPL_LAYER_NORMAL, SPL_PIXEL_F32X3, 2, 1, normals);
    to = image(SPL_LAYER_NORMAL, SPL_PIXEL_F32X3, 1, 1, mean);
    spl_image_resample(&from, 1.5, 0, &to, 0, 1);
    assert_true(fabsf(mean[0] - 1) < 1e-5f && mean[1] == 0);
    uint8_t colors[] = {200, 100, 50, 255, 0, 255, 0, 0, 9, 9, 9, 255}, color[8];
    from = image(SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, 3, 1, colors);
    to = image(SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, 2, 1, color);
    spl_image_resample(&from, 1.5, 0, &to, 0, 1);
    const uint8_t wanted[] = {200, 100, 50, 170, 9, 9, 9, 170};
    assert_memory_equal(color, wanted, sizeof wanted);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_ramp_of_depth_stays_a_ramp),
        cmocka_unit_test(an_edge_of_depth_has_no_value_in_between),
        cmocka_unit_test(transparent_pixels_lend_no_colour),
        cmocka_unit_test(normals_are_unit_and_ids_are_whole),
        cmocka_unit_test(coverage_fades),
        cmocka_unit_test(colours_are_rounded),
        cmocka_unit_test(squares_have_the_mean_of_what_they_cover),
        cmocka_unit_test(a_rim_is_what_lies_beyond),
        cmocka_unit_test(squares_keep_edges),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
