/* Scalars: arrays widen without losing a value, steps are exact where they can be, and what a dataset gives back is
 * what scans brought, on every level. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include <splatd/pack.h>

#include "dataset/chunk.h"
#include "dataset/dataset.h"
#include "dataset/rewrite.h"
#include "pack/scalars.h"
#include "support/folder.h"

enum { most = 1000 };

static double value_of(const struct spl_scalar_values *s, size_t i)
{
    uint32_t number = spl_scalar_number(s, i);
    return number == SPL_STREAM_NONE ? (double)NAN : (s->first + number) / s->steps_a_unit;
}

/* Settled, in batches of 7. */
static struct spl_scalar_values make(const double *values, size_t count)
{
    struct spl_scalar_values s = {0};
    for (size_t i = 0; i < count; i += 7)
        assert_int_equal(spl_scalar_add(&s, count, i, values + i, count - i < 7 ? count - i : 7, NULL), 0);
    assert_int_equal(spl_scalar_settle(&s, count, NULL), 0);
    return s;
}

static bool is_same(double a, double b)
{
    return a == b || (isnan(a) && isnan(b));
}

static void arrays_take_the_smallest_type(void **state)
{
    (void)state;
    static const struct {
        double values[4];
        uint8_t storage;
        bool plain;
    } rows[] = {
        {{0, 255, 7, 7}, SPL_STORE_U8, true},
        {{0, 1, 256, 255}, SPL_STORE_U16, true},
        {{0, -1, 65535, 65536}, SPL_STORE_I32, false},
        {{0, 1, 65536, 16777217}, SPL_STORE_I32, true},
        {{0, 1, 65536, 4294967290.0}, SPL_STORE_F64, true},
        {{0, 1, 0.5, 2}, SPL_STORE_F32, false},
        {{0, 1, (double)NAN, 2}, SPL_STORE_F32, false},
        {{0, 1, INFINITY, 0.1}, SPL_STORE_F64, false},
        {{0, 1e300, 1, 3}, SPL_STORE_U8, true}, /* 10^300 is no value */
        {{16777217, -1, (double)NAN, 0}, SPL_STORE_F64, false},
        {{2.9999999999999996, 1, 2, 0}, SPL_STORE_U8, true},
    };
    for (size_t row = 0; row < sizeof rows / sizeof *rows; row++) {
        double values[most];
        for (size_t i = 0; i < most; i++) /* each after many of those before it */
            values[i] = rows[row].values[i / (most / 4)];
        struct spl_scalar_values s = make(values, most);
        bool beyond = row == 8;
        if (s.storage != (beyond ? SPL_STORE_F32 : rows[row].storage) || s.plain != (rows[row].plain && !beyond))
            fail_msg("row %zu: storage %d, plain %d", row, s.storage, s.plain);
        for (size_t i = 0; i < most; i++) {
            double want = fabs(values[i]) <= 0x1p900 ? values[i] : (double)NAN, got = value_of(&s, i);
            if (!is_same(got, want) && !(row == 10 && got == rint(want)))
                fail_msg("row %zu, %zu: %.17g instead of %.17g", row, i, got, want);
        }
        free(s.values);
    }
}

static void steps_follow_from_the_values(void **state)
{
    (void)state;
    static const struct {
        double low, step, steps_a_unit;
        bool floats, exact;
    } rows[] = {
        {-90, 1, 1, false, true},
        {-3, 0.1, 10, false, true},
        {-3, 0.1, 10, true, true},
        {0, 0.006, 1000, false, true},
        {1.5e8, 0.000001, 1e6, false, true},
        {0, 0x1p-11, 0x1p11, false, true},      /* no decimals of six places, but binary */
        {9e15, 1, 1, false, true},              /* beyond 2^52: halves are not counted; see below */
        {1e18, 1e12, 0x1p-18, false, false},    /* 64 bit numbers: as many steps as fit */
        {-7e9, 123457.0 * 64, 0, false, false}, /* wide whole numbers */
        {0, 0.0123456789, 0, false, false},     /* 2^24 steps at least over the range */
        {0, 0.0123456789, 0, true, false},      /* 2^16 */
        {5e-320, 0, 0, false, false},
        {-1e270, 1e268, 0, false, false},
        {0.123456789, 0, 0, false, true},
    };
    for (size_t row = 0; row < sizeof rows / sizeof *rows; row++) {
        double values[most], range = rows[row].step * (most - 1);
        for (size_t i = 0; i < most; i++) {
            values[i] = rows[row].low + rows[row].step * (double)i;
            values[i] = rows[row].floats ? (double)(float)values[i] : values[i];
        }
        struct spl_scalar_values s = make(values, most);
        double least = range / (rows[row].floats ? 0x1p16 : 0x1p24), worst = 0;
        assert_null(spl_stream_judge_steps(s.first, s.steps_a_unit));
        for (size_t i = 0; i < most; i++)
            worst = fmax(worst, fabs(value_of(&s, i) - values[i]));
        if (rows[row].steps_a_unit > 0 && row != 6 && s.steps_a_unit != rows[row].steps_a_unit)
            fail_msg("row %zu: %.17g steps a unit", row, s.steps_a_unit);
        double size = fmax(fabs(values[0]), fabs(values[most - 1]));
        double bound = rows[row].exact ? (rows[row].floats ? 1e-7 : 0x1p-50) * size : least;
        if (row == 6)
            bound = 2;
        if (worst > fmax(bound, 0x1p-900)) /* below it a value is 0 */
            fail_msg("row %zu: wrong by %g, more than %g", row, worst, bound);
        free(s.values);
    }
}

static void a_stray_value_does_not_coarsen_the_others(void **state)
{
    (void)state;
    double values[most];
    for (size_t i = 0; i < most; i++)
        values[i] = (double)(float)(i * 0.0123456789);
    values[500] = 1e9;
    struct spl_scalar_values s = make(values, most);
    double error = 0;
    for (size_t i = 0; i < most; i++)
        error = fmax(error, i == 500 ? 0 : fabs(value_of(&s, i) - values[i]));
    assert_true(error < 0.5); /* 2^32 steps over all, where 2^16 would be 15259 wide */
    assert_true(fabs(value_of(&s, 500) / 1e9 - 1) < 1e-6);
    free(s.values);
    values[500] = 500;
    s = make(values, most);
    error = 0;
    for (size_t i = 0; i < most; i++)
        error = fmax(error, fabs(value_of(&s, i) - values[i]));
    assert_true(error < 12.4 / 0x1p16); /* 500 costs nothing */
    free(s.values);
}

static void points_without_any(void **state)
{
    (void)state;
    const double late[3] = {5, 6, 7};
    struct spl_scalar_values s = {0};
    assert_int_equal(spl_scalar_add(&s, 100, 4, late, 3, NULL), 0);
    assert_int_equal(spl_scalar_add(&s, 100, 7, NULL, 2, NULL), 0);
    assert_false(spl_scalar_is_constant(&s));
    assert_int_equal(spl_scalar_settle(&s, 9, NULL), 0);
    for (size_t i = 0; i < 9; i++)
        assert_true(is_same(value_of(&s, i), i >= 4 && i < 7 ? late[i - 4] : (double)NAN));
    free(s.values);
    const double none[2] = {(double)NAN, (double)NAN};
    s = make(none, 2);
    assert_true(spl_scalar_is_constant(&s) && isnan(value_of(&s, 1)));
    free(s.values);
}

enum { side = 200, points = side * side };

static double time_of(unsigned i)
{
    return i % 5 == 0 ? (double)NAN : 1e5 + i * 0.25;
}

/* A plane of points; the number of each is its red and green. */
static const char *write_csv(const char *name, double z, bool attributes)
{
    const char *path = in_folder(name);
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    fprintf(f, "x,y,z,red,green,blue%s\n", attributes ? ",intensity,return_number,number_of_returns,Time,flat" : "");
    for (unsigned i = 0; i < points; i++) {
        fprintf(f, "%g,%g,%g,%u,%u,0", 0.01 * (i % side), 0.01 * (i / side), z, i & 255, i >> 8);
        if (attributes) {
            fprintf(f, ",%u,%u,3,", i % 3000, 1 + (i % side) / 100);
            if (!isnan(time_of(i)))
                fprintf(f, "%.17g", time_of(i));
            fprintf(f, ",9");
        }
        fputc('\n', f);
    }
    assert_int_equal(fclose(f), 0);
    return path;
}

static char said[1024];

static void hear(void *context, const char *text)
{
    (void)context;
    strncat(said, text, sizeof said - strlen(said) - 1);
}

static enum spl_pack_primitives primitives; /* of the next packs */

static int pack(const char *const *inputs, size_t count, const char *keep, const char *output, struct spl_error *err)
{
    struct spl_pack_options options;
    spl_pack_options_init(&options);
    options.primitives = primitives;
    options.inputs = inputs;
    options.input_count = count;
    options.output = output;
    options.keep = keep;
    options.warn = hear;
    return spl_pack(&options, NULL, err);
}

static struct spl_dataset *open_packed(const char *const *inputs, size_t count, const char *keep)
{
    struct spl_dataset *dataset = NULL;
    struct spl_error err = {0};
    const char *output = in_folder("out.spld");
    if (pack(inputs, count, keep, output, &err) || spl_dataset_open_whole(output, true, &dataset, &err))
        fail_msg("%s", err.message);
    return dataset;
}

static double value(const struct spl_dataset *dataset, const char *name, uint64_t id)
{
    double v = -1;
    int stream = spl_dataset_find_stream(dataset, name);
    if (stream < 0 || !spl_dataset_find_value(dataset, stream, id, &v))
        fail_msg("splat %llu has no %s", (unsigned long long)id, name);
    return v;
}

static void check_packed(const struct spl_dataset *dataset)
{
    uint64_t nodes, chunks, leaves = 0, means = 0;
    const struct spl_node *node = spl_dataset_get_nodes(dataset, &nodes);
    const struct spl_chunk *all = spl_dataset_get_chunks(dataset, &chunks);
    for (uint64_t n = 0; n < nodes; n++)
        for (uint64_t c = node[n].first_chunk; c < node[n].first_chunk + node[n].chunk_count; c++)
            for (uint64_t id = all[c].first_id; id < all[c].first_id + all[c].count; id += 13) {
                struct spl_splat splat;
                assert_true(spl_dataset_find_splat(dataset, id, &splat));
                double intensity = value(dataset, "intensity", id), time = value(dataset, "time", id);
                double number = value(dataset, "return_number", id);
                assert_true(value(dataset, "flat", id) == 9);
                if (node[n].child_count) { /* means lie between, votes are one of those that there are */
                    assert_true(intensity >= 0 && intensity < 3000 && intensity == rint(intensity));
                    assert_true(time >= 1e5 && time < 1e5 + points * 0.25);
                    assert_true(number == 1 || number == 2);
                    double x = node[n].origin[0] + (double)splat.position[0];
                    if (fabs(x - 1) > 0.2)
                        assert_true(number == (x < 1 ? 1 : 2));
                    means++;
                    continue;
                }
                unsigned i = (unsigned)splat.color[0] | (unsigned)splat.color[1] << 8;
                assert_true(intensity == i % 3000 && number == 1 + (i % side) / 100 && is_same(time, time_of(i)));
                leaves++;
            }
    assert_true(leaves > points / 14 && means > 100);
}

static void a_dataset_has_what_scans_brought(void **state)
{
    (void)state;
    struct spl_error err = {0};
    const char *scan = write_csv("scan.csv", 0, true);
    struct spl_dataset *dataset = open_packed(&scan, 1, "time,flat");
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    assert_int_equal(info->stream_count, 5); /* 3 returns everywhere say nothing, "flat" is named */
    assert_string_equal(info->streams[3].name, "time");
    assert_string_equal(info->streams[3].type, "steps");
    assert_string_equal(info->streams[1].type, "uint");
    assert_int_equal(info->streams[4].bits, 0);
    double ignored;
    assert_false(spl_dataset_find_value(dataset, 5, 0, &ignored) || spl_dataset_find_value(dataset, -1, 0, &ignored));
    check_packed(dataset);
    /* photographs change the colours alone */
    struct spl_rewrite rewrite = {.from = dataset};
    assert_int_equal(spl_dataset_rewrite(&rewrite, in_folder("again.spld"), &err), 0);
    spl_dataset_close(dataset);
    assert_int_equal(spl_dataset_open_whole(in_folder("again.spld"), true, &dataset, &err), 0);
    check_packed(dataset);
    spl_dataset_close(dataset);

    dataset = open_packed(&scan, 1, "none,number_of_returns");
    assert_int_equal(spl_dataset_get_info(dataset)->stream_count, 2);
    assert_true(value(dataset, "number_of_returns", 77) == 3);
    spl_dataset_close(dataset);
    assert_int_equal(pack(&scan, 1, "tiem", in_folder("no.spld"), &err), SPL_E_USAGE);
    assert_string_equal(err.field, "keep");
    assert_non_null(strstr(err.message, "\"tiem\" in scan.csv, which has: x, y, z, red, green, blue, intensity"));
    assert_int_equal(access(in_folder("no.spld"), F_OK), -1);
    const char *const bad[] = {"linear", "total", "uncertainty", "\xff", "x"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        err = (struct spl_error){0};
        assert_int_equal(pack(&scan, 1, bad[i], in_folder("no.spld"), &err), SPL_E_USAGE);
        assert_string_equal(err.field, "keep");
    }
}

static void several_scans_are_numbered(void **state)
{
    (void)state;
    const char *const scans[2] = {write_csv("a.csv", 0, true), write_csv("b.csv", 1, false)};
    said[0] = 0;
    struct spl_dataset *dataset = open_packed(scans, 2, NULL);
    assert_non_null(strstr(said, "intensity is given in 1 (a.csv), points of the others (b.csv) have none"));
    assert_null(strstr(said, "kept"));
    struct spl_splat splat;
    uint64_t nodes, chunks;
    const struct spl_node *node = spl_dataset_get_nodes(dataset, &nodes);
    const struct spl_chunk *chunk = spl_dataset_get_chunks(dataset, &chunks);
    int seen[2] = {0};
    for (uint64_t n = 0; n < nodes; n++) {
        uint64_t id = chunk[node[n].first_chunk].first_id;
        assert_true(spl_dataset_find_splat(dataset, id, &splat));
        bool second = node[n].origin[2] + (double)splat.position[2] > 0.5;
        assert_true(value(dataset, "scan", id) == second);
        assert_true(isnan(value(dataset, "intensity", id)) == second);
        seen[second]++;
    }
    assert_true(seen[0] && seen[1]);
    spl_dataset_close(dataset);
    said[0] = 0;
    dataset = open_packed(scans, 2, "none");
    assert_string_equal(said, "");
    assert_int_equal(spl_dataset_get_info(dataset)->stream_count, 1);
    spl_dataset_close(dataset);
    dataset = open_packed(scans + 1, 1, "scan"); /* named: there though it is 0 everywhere */
    assert_true(value(dataset, "scan", 0) == 0);
    spl_dataset_close(dataset);
}

/* The panel with this id: its points are a patch of the plane, whose middle says what they have. */
static void check_panel(const struct spl_dataset *dataset, const struct spl_node *node, uint64_t id)
{
    struct spl_splat splat;
    assert_true(spl_dataset_find_splat(dataset, id, &splat));
    double x = node->origin[0] + (double)splat.position[0], y = node->origin[1] + (double)splat.position[1];
    double time = value(dataset, "time", id), intensity = value(dataset, "intensity", id);
    double uncertainty = value(dataset, "uncertainty", id);
    assert_true(value(dataset, "flat", id) == 9);
    assert_true(intensity >= 0 && intensity < 3000 && intensity == rint(intensity));
    assert_true(uncertainty > 0.009 && uncertainty < 0.03); /* about the spacing */
    /* a row is 50; cells reach over the points by one or two, where a node's border cuts through them */
    assert_true(fabs(time - (1e5 + 0.25 * (side * 100 * y + 100 * x))) < 2.5 * 50);
    if (fabs(x - 1) > (double)splat.radius)
        assert_true(value(dataset, "return_number", id) == (x < 1 ? 1 : 2));
}

static void panels_have_what_their_points_have(void **state)
{
    (void)state;
    const char *scan = write_csv("flat.csv", 0, true);
    primitives = SPL_PRIMITIVES_ALL;
    struct spl_dataset *dataset = open_packed(&scan, 1, "time,flat");
    primitives = SPL_PRIMITIVES_OFF;
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    uint64_t nodes, chunks, panels[2] = {0};
    const struct spl_node *node = spl_dataset_get_nodes(dataset, &nodes);
    const struct spl_chunk *all = spl_dataset_get_chunks(dataset, &chunks);
    assert_true(info->panel_points > 0.95 * points);
    for (uint64_t n = 0; n < nodes; n++)
        for (uint64_t c = node[n].first_chunk; c < node[n].first_chunk + node[n].chunk_count; c++)
            for (uint32_t i = 0; i < all[c].count && spl_chunk_kind(&all[c]) == SPL_CHUNK_PANELS; i++) {
                check_panel(dataset, &node[n], all[c].first_id + i);
                panels[node[n].child_count > 0]++;
            }
    assert_true(panels[0] > points / 400 && panels[1] > 10);
    spl_dataset_close(dataset);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(arrays_take_the_smallest_type),
        cmocka_unit_test(steps_follow_from_the_values),
        cmocka_unit_test(a_stray_value_does_not_coarsen_the_others),
        cmocka_unit_test(points_without_any),
        cmocka_unit_test(a_dataset_has_what_scans_brought),
        cmocka_unit_test(several_scans_are_numbered),
        cmocka_unit_test(panels_have_what_their_points_have),
    };
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
