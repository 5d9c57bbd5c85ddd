/* Fields beside position and colour: found by name in each format, read with their scale, and NaN where a file says
 * that there is none. */
#include "cloud_test.h"

#include <math.h>

#include "cloud/rows.h"
#include "las_bytes.h"

/* The first batch of a file, up to 100 points. */
struct kept {
    struct spl_keep keep;
    struct spl_cloud *cloud;
    const struct spl_cloud_info *info;
    struct spl_point_batch batch;
};

static void open_kept(const struct bytes *b, const char *columns, const char *list, struct kept *k)
{
    struct spl_error err = {0};
    const struct spl_cloud_options options = {.columns = columns, .keep = &k->keep};
    assert_int_equal(spl_keep_parse(&k->keep, list, &err), 0);
    assert_int_equal(spl_point_batch_init(&k->batch, 100, NULL), 0);
    write_scratch(b->data, b->length);
    if (spl_cloud_open(scratch_path(), &options, &k->cloud, &err) || spl_cloud_read(k->cloud, &k->batch, &err) < 0)
        fail_msg("%s", err.message);
    k->info = spl_cloud_get_info(k->cloud);
}

static void close_kept(struct kept *k)
{
    spl_point_batch_finish(&k->batch);
    spl_cloud_destroy(k->cloud);
}

static void open_kept_text(const char *text, const char *columns, const char *list, struct kept *k)
{
    static struct bytes b;
    b.length = 0;
    put_text(&b, "%s", text);
    open_kept(&b, columns, list, k);
}

static void check(const struct kept *k, int scalar, size_t point, double value)
{
    double got = k->batch.scalar[scalar][point];
    assert_true(k->info->scalars >> scalar & 1);
    if (got != value && !(isnan(got) && isnan(value)))
        fail_msg("scalar %d of point %zu is %.17g instead of %.17g", scalar, point, got, value);
}

static void lists_are_parsed(void **state)
{
    static const struct {
        const char *list, *part;
    } bad[] = {{"", "empty"},
               {"a,,b", "empty"},
               {"a,", "empty"},
               {"x", "in every dataset"},
               {"Red", "in every dataset"},
               {"a,A", "twice"},
               {"a_name_that_is_longer_than_31_byt", "longer"},
               {"a\nb", "control"},
               {"a,b,c,d,e,f,g,h,j", "more than 8"}};
    struct spl_keep keep;
    (void)state;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct spl_error err = {0};
        assert_int_equal(spl_keep_parse(&keep, bad[i].list, &err), SPL_E_USAGE);
        assert_string_equal(err.field, "keep");
        if (!strstr(err.message, bad[i].part))
            fail_msg("\"%s\": %s", bad[i].list, err.message);
    }
    assert_int_equal(spl_keep_parse(&keep, NULL, NULL), 0);
    assert_false(keep.none || keep.scan || keep.named || keep.count);
    assert_int_equal(spl_keep_parse(&keep, "none,Intensity,scan,gps_time,label", NULL), 0);
    assert_true(keep.none && keep.scan);
    assert_int_equal(keep.named, 1u << SPL_COLUMN_INTENSITY);
    assert_int_equal(keep.count, 2);
    assert_string_equal(keep.names[1], "label");
    assert_string_equal(spl_keep_find_missing(&keep, 0), "intensity");
    assert_string_equal(spl_keep_find_missing(&keep, 1u << SPL_COLUMN_INTENSITY), "gps_time");
    uint32_t columns = 1u << SPL_COLUMN_INTENSITY | 1u << SPL_COLUMN_KEPT;
    assert_string_equal(spl_keep_find_missing(&keep, columns), "label");
    assert_null(spl_keep_find_missing(&keep, columns | 1u << SPL_COLUMN_CLASS)); /* a label is a class */
}

static void fields_of_pcd(void **state)
{
    struct kept k;
    (void)state;
    open_kept_text(
        "# .PCD v.7\nFIELDS x curvature y z rgb ReturnNumber histogram\nTYPE F F F F F U F\nCOUNT 1 1 1 1 1 1 2\n"
        "WIDTH 2\nDATA ascii\n1 0.25 2 3 0 1 7 8\n4 nan 5 6 0 2 9 10\n",
        NULL, "curvature", &k);
    check(&k, SPL_SCALAR_KEPT, 0, 0.25);
    check(&k, SPL_SCALAR_KEPT, 1, NAN);
    check(&k, SPL_SCALAR_RETURN, 1, 2);
    assert_string_equal(k.info->fields, "x, curvature, y, z, rgb, ReturnNumber");
    close_kept(&k);
}

static void fields_of_las_records(void **state)
{
    static struct bytes b;
    struct kept k;
    (void)state;
    for (unsigned format = 0; format <= 10; format++) {
        struct las las = las_default(4, format, 0, 3);
        bool old = format < 6, time = format != 0 && format != 2, infrared = format == 8 || format == 10;
        las_build(&b, &las);
        for (unsigned i = 0; i < 3; i++) {
            size_t at = b.length - (3 - i) * las_record_bytes(format);
            las_set(&b, at + 14, old ? 3 | 5 << 3 : 11 | 13 << 4, 1);
            las_set(&b, at + 17, 200 + i, 1);
            las_set(&b, at + (old ? 16 : 18), (uint64_t)(-15 - (int)i), old ? 1 : 2);
            las_set(&b, at + (old ? 18 : 20), 4000 + i, 2);
            if (time)
                las_set_double(&b, at + (old ? 20 : 22), 1.5e8 + 0.25 * i);
            if (infrared)
                las_set(&b, at + 36, 65535 - i, 2);
        }
        open_kept(&b, NULL, time ? "user_data,scan_angle,Point_Source_ID,nir,gps_time" : "user_data,scan_angle,nir",
                  &k);
        for (unsigned i = 0; i < 3; i++) {
            check(&k, SPL_SCALAR_INTENSITY, i, 40 * i);
            check(&k, SPL_SCALAR_RETURN, i, old ? 3 : 11);
            check(&k, SPL_SCALAR_RETURNS, i, old ? 5 : 13);
            check(&k, SPL_SCALAR_KEPT, i, 200 + i);
            check(&k, SPL_SCALAR_KEPT + 1, i, old ? -15 - (double)i : (-15 - (double)i) * 0.006);
            if (time) {
                check(&k, SPL_SCALAR_KEPT + 2, i, 4000 + i);
                check(&k, SPL_SCALAR_KEPT + 4, i, 1.5e8 + 0.25 * i);
            }
            if (infrared)
                check(&k, SPL_SCALAR_KEPT + 3, i, 65535 - (double)i);
            assert_int_equal(k.batch.classification[i], old ? 5 : 0xe5);
        }
        const char *missing = spl_keep_find_missing(&k.keep, k.info->columns);
        assert_true(infrared ? !missing : missing && !strcmp(missing, "nir"));
        assert_true(strstr(k.info->fields, "point_source_id"));
        assert_true(time == !!strstr(k.info->fields, "gps_time"));
        close_kept(&k);
    }
}

/* Puts a record of descriptions behind the header of a file that las_build() has made for `extra` bytes. */
static void describe(struct bytes *b, const uint8_t *descriptions, size_t count)
{
    static struct bytes record;
    uint64_t header = 375, points = 0;
    record.length = 0;
    put_zeros(&record, 54);
    memcpy(record.data + 2, "LASF_Spec", 9);
    las_set(&record, 18, 4, 2);
    las_set(&record, 20, count * 192, 2);
    put(&record, descriptions, count * 192);
    memcpy(&points, b->data + 96, 4);
    assert_true(b->length + record.length < sizeof b->data);
    memmove(b->data + header + record.length, b->data + header, b->length - header);
    memcpy(b->data + header, record.data, record.length);
    b->length += record.length;
    las_set(b, 96, points + record.length, 4);
    las_set(b, 100, 1, 4);
}

static void extra_bytes_go_by_their_names(void **state)
{
    enum { u8 = 1, i16 = 4, u64 = 7, i64 = 8, f32 = 9, f64 = 10 };
    static struct bytes b, d;
    static const struct {
        const char *name;
        unsigned type, options, bytes;
    } rows[] = {{"Amplitude", i16, 1 | 8 | 16, 2},
                {"", 0, 5, 5},
                {"old", 13, 0, 4},
                {"Deviation", f32, 1, 4},
                {"big", u64, 0, 8},
                {"negative", i64, 1, 8},
                {"red", u8, 0, 1},
                {"exact ", f64, 0, 8}};
    enum { descriptions = sizeof rows / sizeof *rows };
    struct kept k;
    (void)state;
    d.length = 0;
    put_zeros(&d, descriptions * 192);
    unsigned bytes = 0, at[descriptions];
    for (size_t i = 0; i < descriptions; i++) {
        las_set(&d, 192 * i + 2, rows[i].type, 1);
        las_set(&d, 192 * i + 3, rows[i].options, 1);
        memcpy(d.data + 192 * i + 4, rows[i].name, strlen(rows[i].name));
        las_set_double(&d, 192 * i + 112, 0.25);
        las_set_double(&d, 192 * i + 136, 100);
        at[i] = bytes;
        bytes += rows[i].bytes;
    }
    las_set(&d, 40, (uint64_t)-32768, 8);
    las_set_double(&d, 192 * 3 + 40, -1);
    las_set(&d, 192 * 5 + 40, (uint64_t)-7, 8);
    struct las las = las_default(4, 6, bytes, 2);
    las_build(&b, &las);
    size_t record = 30 + bytes, first = b.length - 2 * record + 30;
    for (unsigned i = 0; i < 2; i++) {
        float v = i ? -1 : 2.5f;
        uint32_t word;
        memcpy(&word, &v, sizeof word);
        las_set(&b, first + i * record + at[0], (uint64_t)(i ? -32768 : -300), 2);
        las_set(&b, first + i * record + at[3], word, 4);
        las_set(&b, first + i * record + at[4], 1ull << 63, 8);
        las_set(&b, first + i * record + at[5], (uint64_t)(i ? -7 : -8), 8);
        las_set_double(&b, first + i * record + at[7], 0.1 * (i + 1));
    }
    describe(&b, d.data, descriptions);
    open_kept(&b, NULL, "amplitude,deviation,BIG,negative,exact,old", &k);
    assert_string_equal(spl_keep_find_missing(&k.keep, k.info->columns), "old");
    check(&k, SPL_SCALAR_KEPT, 0, -300 * 0.25 + 100);
    check(&k, SPL_SCALAR_KEPT, 1, (double)NAN);
    check(&k, SPL_SCALAR_KEPT + 1, 0, 2.5);
    check(&k, SPL_SCALAR_KEPT + 1, 1, (double)NAN);
    check(&k, SPL_SCALAR_KEPT + 2, 1, 0x1p63);
    check(&k, SPL_SCALAR_KEPT + 3, 0, -8);
    check(&k, SPL_SCALAR_KEPT + 3, 1, (double)NAN);
    check(&k, SPL_SCALAR_KEPT + 4, 1, 0.2);
    assert_int_equal(k.info->attributes & SPL_CLOUD_COLOR, SPL_CLOUD_COLOR); /* grey: "red" of extra bytes is none */
    assert_int_equal(k.batch.color[1][0], k.batch.color[1][2]);
    close_kept(&k);

    /* a scale that is none, as an offset that is none, is not said */
    for (int i = 0; i < 2; i++) {
        las_set_double(&d, 112, i ? 0 : (double)NAN);
        las_set_double(&d, 136, (double)INFINITY);
        las_build(&b, &las);
        las_set(&b, first + at[0], (uint64_t)-300, 2);
        describe(&b, d.data, descriptions);
        open_kept(&b, NULL, "amplitude", &k);
        check(&k, SPL_SCALAR_KEPT, 0, -300);
        close_kept(&k);
    }

    /* a record that is too short for what is described: what fits is there */
    las_build(&b, &las);
    las_set(&b, 105, record - 5, 2);
    b.length -= 10;
    describe(&b, d.data, descriptions);
    open_kept(&b, NULL, "big,exact", &k);
    assert_string_equal(spl_keep_find_missing(&k.keep, k.info->columns), "exact");
    close_kept(&k);
}

static void what_is_not_named_is_left_out(void **state)
{
    static struct bytes b;
    struct kept k;
    (void)state;
    struct las las = las_default(2, 3, 0, 3);
    las_build(&b, &las);
    open_kept(&b, NULL, "none", &k);
    assert_int_equal(k.info->scalars, 0);
    assert_int_equal(k.info->attributes, SPL_CLOUD_COLOR);
    assert_int_equal(k.batch.classification[0], 0);
    close_kept(&k);
    open_kept(&b, NULL, "none,class,number_of_returns", &k);
    assert_int_equal(k.info->scalars, 1u << SPL_SCALAR_RETURNS);
    assert_int_equal(k.batch.classification[0], 5);
    close_kept(&k);
    open_kept_text("1 2 3\n4 5 6\n", NULL, NULL, &k);
    assert_int_equal(k.info->scalars, 0);
    assert_string_equal(k.info->fields, "");
    close_kept(&k);
}

static void fields_of_ply_and_text(void **state)
{
    static const char ply[] = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
                              "property float z\nproperty int classification\nproperty int label\n"
                              "property float scalar_Echo\nproperty uchar return_number\nend_header\n"
                              "1 2 3 4 9 0.5 2\n4 5 nan 5 9 0.5 2\n";
    struct kept k;
    (void)state;
    open_kept_text(ply, NULL, "label,echo", &k);
    assert_int_equal(k.batch.count, 1);
    assert_int_equal(k.batch.classification[0], 4);
    check(&k, SPL_SCALAR_KEPT, 0, 9);
    check(&k, SPL_SCALAR_KEPT + 1, 0, 0.5);
    check(&k, SPL_SCALAR_RETURN, 0, 2);
    assert_string_equal(k.info->fields, "x, y, z, classification, label, scalar_Echo, return_number");
    close_kept(&k);

    open_kept_text("X;Y;Z;Time;Intensity;Note\n1;2;3;0.125;7;a\n1;2;nan;8;8;b\n4;5;6;;;c\n", NULL, "time", &k);
    assert_int_equal(k.batch.count, 2);
    check(&k, SPL_SCALAR_KEPT, 0, 0.125);
    check(&k, SPL_SCALAR_INTENSITY, 0, 7);
    check(&k, SPL_SCALAR_KEPT, 1, (double)NAN); /* an empty field */
    check(&k, SPL_SCALAR_INTENSITY, 1, (double)NAN);
    assert_string_equal(k.info->fields, "X, Y, Z, Time, Intensity, Note");
    close_kept(&k);

    open_kept_text("1 2 3 0.125\n4 5 6 nan\n", "x,y,z,sigma", "sigma", &k);
    check(&k, SPL_SCALAR_KEPT, 0, 0.125);
    check(&k, SPL_SCALAR_KEPT, 1, (double)NAN);
    close_kept(&k);

    struct spl_error err = {0};
    struct spl_cloud *cloud = NULL;
    const struct spl_cloud_options options = {.columns = "x,y,z,sigma"};
    assert_int_equal(spl_cloud_open(scratch_path(), &options, &cloud, &err), SPL_E_USAGE);
    assert_non_null(strstr(err.message, "\"sigma\" is not one of"));

    open_kept_text("1\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 2 3 0.75 9 9 9\n", NULL,
                   NULL, &k); /* PTX */
    check(&k, SPL_SCALAR_INTENSITY, 0, 0.75);
    close_kept(&k);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lists_are_parsed),
        cmocka_unit_test(fields_of_pcd),
        cmocka_unit_test(fields_of_las_records),
        cmocka_unit_test(extra_bytes_go_by_their_names),
        cmocka_unit_test(what_is_not_named_is_left_out),
        cmocka_unit_test(fields_of_ply_and_text),
    };
    return cmocka_run_group_tests(tests, NULL, remove_scratch);
}
