/* LAS: every version, point format and record length; broken headers are refused by field. */
#include "cloud_test.h"

#include <math.h>

#include "las_bytes.h"

static void every_format_version_and_record_length(void **state)
{
    static struct bytes b;
    struct loaded l;
    (void)state;
    for (unsigned format = 0; format <= 10; format++)
        for (unsigned extra = 0; extra < 30; extra += 13)
            for (unsigned minor = 0; minor <= 5; minor++) {
                struct las las = las_default(minor, format, extra, 600);
                las_build(&b, &las);
                load_bytes(&b, NULL, 100, &l);
                if (l.code < 0)
                    fail_msg("1.%u format %u extra %u: %s", minor, format, extra, l.err.message);
                assert_string_equal(l.format, "LAS");
                assert_int_equal(l.points, 600);
                assert_int_equal(l.expected, 600);
                assert_int_equal(l.attributes, SPL_CLOUD_COLOR | SPL_CLOUD_CLASS);
                for (int i = 0; i < 3; i++) {
                    assert_point(&l, (size_t)i, (1000 * i - 7) * 0.001 + 406000, (500 - i) * 0.001 + 7405000.5,
                                 -123456789 * 0.001 + 0.25);
                    /* flags share the byte of the old formats' class */
                    assert_int_equal(l.first.classification[i], format < 6 ? 5 : 0xe5);
                }
                if (las_color_offset(format))
                    assert_color(&l, 1, 1, 200, 100);
                else
                    assert_int_equal(l.first.color[1][0], l.first.color[1][2]); /* grey */
                loaded_finish(&l);
            }
}

static void colour_bits_are_counted_over_all_points(void **state)
{
    static struct bytes b;
    struct loaded l;
    (void)state;
    struct las las = las_default(2, 2, 0, 900);
    las.color_scale = 1;
    las_build(&b, &las);
    load_bytes(&b, NULL, 50, &l);
    assert_color(&l, 1, 1, 200, 100);
    loaded_finish(&l);
    /* one bright value at the very end, and everything before was 16 bits */
    memcpy(b.data + b.length - 6, "\xff\xff", 2);
    load_bytes(&b, NULL, 50, &l);
    assert_color(&l, 1, 0, 1, 0);
    loaded_finish(&l);
    las.color_scale = 0; /* nobody filled the fields: the intensity serves */
    las_build(&b, &las);
    load_bytes(&b, NULL, 50, &l);
    assert_int_equal(l.attributes, SPL_CLOUD_COLOR | SPL_CLOUD_CLASS);
    assert_color(&l, 0, 0, 0, 0);
    assert_int_equal(l.first.color[63][0], l.first.color[63][1]);
    assert_true(l.first.color[63][0] > l.first.color[30][0]);
    loaded_finish(&l);
}

static void counts_of_1_4_and_before(void **state)
{
    static struct bytes b;
    struct loaded l;
    (void)state;
    struct las las = las_default(4, 3, 0, 10);
    las_build(&b, &las);
    las_set(&b, 107, 0, 4); /* 64-bit count alone */
    load_bytes(&b, NULL, 50, &l);
    assert_int_equal(l.points, 10);
    loaded_finish(&l);
    las_build(&b, &las);
    las_set(&b, 247, 0, 8); /* legacy count alone */
    load_bytes(&b, NULL, 50, &l);
    assert_int_equal(l.points, 10);
    loaded_finish(&l);
    las_set(&b, 107, 4, 4); /* fewer than there are: records after them are none of ours */
    load_bytes(&b, NULL, 50, &l);
    assert_int_equal(l.points, 4);
    loaded_finish(&l);
    las_set(&b, 107, 0, 4);
    load_bytes(&b, NULL, 50, &l);
    assert_int_equal(l.code, 0);
    assert_int_equal(l.points, 0);
    assert_int_equal(l.behind, 10);
    loaded_finish(&l);
    las_set(&b, 235, 1ull << 40, 8); /* records that lie nowhere */
    las_set(&b, 243, 2, 4);
    load_bytes(&b, NULL, 50, &l);
    assert_int_equal(l.behind, 10);
    loaded_finish(&l);
    las_set(&b, 235, b.length - 6 * 34, 8); /* behind the fourth */
    load_bytes(&b, NULL, 50, &l);
    assert_int_equal(l.behind, 4);
    loaded_finish(&l);
}

static void broken_headers_are_refused(void **state)
{
    static const struct {
        unsigned at, bytes;
        uint64_t value;
        const char *field;
    } rows[] = {
        {24, 1, 2, "version"},
        {94, 2, 226, "header size"},
        {94, 2, 65535, "header size"},
        {96, 4, 100, "offset to point data"},
        {96, 4, 0xffffffff, "offset to point data"},
        {104, 1, 11, "point data record format"},
        {104, 1, 63, "point data record format"},
        {105, 2, 33, "point data record length"},
        {105, 2, 0, "point data record length"},
        {107, 4, 4000000000, "number of point records"},
        {131, 8, 0, "x scale"},                   /* zero */
        {139, 8, 0x7ff8000000000000, "y scale"},  /* NaN */
        {147, 8, 0xbf50624dd2f1a9fc, "z scale"},  /* -0.001 */
        {155, 8, 0x7ff0000000000000, "x offset"}, /* inf */
        {171, 8, 0xfff8000000000000, "z offset"},
    };
    static struct bytes b;
    struct las las = las_default(2, 3, 0, 5);
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char place[32];
        las_build(&b, &las);
        las_set(&b, rows[i].at, rows[i].value, rows[i].bytes);
        snprintf(place, sizeof place, "offset %u: %s", rows[i].at, rows[i].field);
        refused(&b, NULL, SPL_E_INPUT, rows[i].field, place);
    }
    las_build(&b, &las);
    las_set(&b, 25, 6, 1);
    refused(&b, NULL, SPL_E_INPUT, "version", "1.6");
    las = las_default(4, 6, 0, 5);
    las_build(&b, &las);
    las_set(&b, 247, UINT64_MAX, 8);
    refused(&b, NULL, SPL_E_INPUT, "number of point records", "offset 247");
    las_build(&b, &las);
    las_set(&b, 94, 227, 2);
    refused(&b, NULL, SPL_E_INPUT, "header size", "needs 375");
    las_build(&b, &las);
    b.length -= 1;
    refused(&b, NULL, SPL_E_INPUT, "number of point records", "truncated");
}

static void what_says_it_is_compressed_and_is_not(void **state)
{
    static struct bytes b;
    (void)state;
    struct las las = las_default(2, 3, 0, 5);
    las_build(&b, &las);
    las_set(&b, 104, 3 | 0x80, 1);
    refused(&b, NULL, SPL_E_INPUT, "point data record format", "offset 104");
    las.vlr_user = "laszip encoded"; /* of another number */
    las_build(&b, &las);
    las_set(&b, 104, 3 | 0x80, 1);
    refused(&b, NULL, SPL_E_INPUT, "point data record format", "no LASzip record");
    las_set(&b, 227 + 18, 22204, 2);
    refused(&b, NULL, SPL_E_INPUT, "LASzip record", "10 bytes");
}

static void the_chain_of_vlrs_may_be_broken(void **state)
{
    static struct bytes b;
    struct loaded l;
    struct las las = las_default(2, 3, 0, 5);
    (void)state;
    las.vlr_user = "LASF_Projection";
    las_build(&b, &las);
    las_set(&b, 100, 0xffffffff, 4); /* their number */
    las_set(&b, 227 + 20, 65535, 2); /* one's length */
    load_bytes(&b, NULL, 50, &l);
    assert_int_equal(l.points, 5);
    loaded_finish(&l);
}

static void overflowing_coordinates_are_skipped(void **state)
{
    static struct bytes b;
    struct loaded l;
    struct las las = las_default(2, 0, 0, 5);
    (void)state;
    las_build(&b, &las);
    las_set(&b, 147, 0x7fe0000000000000, 8); /* z scale 2^1023 */
    load_bytes(&b, NULL, 50, &l);
    assert_int_equal(l.code, 0);
    assert_int_equal(l.points, 0);
    assert_int_equal(l.skipped, 5);
    loaded_finish(&l);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_format_version_and_record_length),
        cmocka_unit_test(colour_bits_are_counted_over_all_points),
        cmocka_unit_test(counts_of_1_4_and_before),
        cmocka_unit_test(broken_headers_are_refused),
        cmocka_unit_test(what_says_it_is_compressed_and_is_not),
        cmocka_unit_test(the_chain_of_vlrs_may_be_broken),
        cmocka_unit_test(overflowing_coordinates_are_skipped),
    };
    return cmocka_run_group_tests(tests, NULL, remove_scratch);
}
