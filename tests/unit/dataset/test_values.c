/* Distributions of values: exact of few, near of many, kinds and weights, what a file may not say; and what datasets
 * have of theirs, whole, of two levels, with panels, rewritten and pruned. */
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

#include "dataset/dataset.h"
#include "dataset/rewrite.h"
#include "dataset/values.h"
#include "support/make_dataset.h"

static void few_are_exact(void **state)
{
    struct spl_values values = {0};
    struct spl_stream_values out;
    (void)state;
    for (int i = 0; i < 6400; i++) /* 0..6399 in an order of their own */
        assert_int_equal(spl_values_add(&values, i * 37 % 6400, 1, NULL), 0);
    assert_int_equal(spl_values_add(&values, (double)NAN, 1, NULL), 0);
    assert_int_equal(spl_values_add(&values, 1e9, 0, NULL), 0);
    spl_values_sum_up(&values, &out);
    assert_int_equal(out.count, 6400);
    for (int q = 0; q < SPL_VALUES_QUANTILES; q++)
        assert_true(out.quantiles[q] == 100 * q);
    assert_true(out.quantiles[SPL_VALUES_QUANTILES] == 6399 && out.p99 == 6336);
    assert_int_equal(out.kind_count, 0);
    spl_values_finish(&values);
}

/* Of either sign, fractions, as large and as small as there are: by their values, not by their bits. */
static void all_kinds_of_numbers_are_in_order(void **state)
{
    struct spl_values values = {0};
    struct spl_stream_values out;
    (void)state;
    for (int i = 0; i < 640; i++) {
        int n = i * 37 % 640 - 320; /* -320..319 */
        double value = n < -160 ? -ldexp(1, -160 - n) : n < 0 ? n / 1024.0 : n < 160 ? ldexp(n, -1060) : n;
        assert_int_equal(spl_values_add(&values, value, 1, NULL), 0);
    }
    spl_values_sum_up(&values, &out);
    for (int q = 0; q < SPL_VALUES_QUANTILES; q++) {
        int n = 10 * q - 320;
        assert_true(out.quantiles[q] ==
                    (n < -160 ? -ldexp(1, -160 - n) : n < 0 ? n / 1024.0 : n < 160 ? ldexp(n, -1060) : n));
    }
    spl_values_finish(&values);
}

static void many_are_near(void **state)
{
    enum { count = 3000000 };
    struct spl_values values = {0}, again = {0};
    struct spl_stream_values out, same;
    (void)state;
    for (int i = 0; i < count; i++) /* sorted: what a sample of every n-th would see, too, but for its beat */
        assert_int_equal(spl_values_add(&values, i % 64 == 0 ? -1 : (double)i / count, 1, NULL), 0);
    for (int i = 0; i < count; i++)
        assert_int_equal(spl_values_add(&again, i % 64 == 0 ? -1 : (double)i / count, 1, NULL), 0);
    spl_values_sum_up(&values, &out);
    spl_values_sum_up(&again, &same);
    assert_memory_equal(&out, &same, sizeof out);
    assert_int_equal(out.count, count);
    assert_true(out.quantiles[0] == -1 && out.quantiles[SPL_VALUES_QUANTILES] == (count - 1.0) / count);
    for (int q = 2; q < SPL_VALUES_QUANTILES; q++)
        assert_true(fabs(out.quantiles[q] - (q / 64.0 - 1 / 64.0) * 64 / 63) < 0.01);
    assert_true(fabs(out.p99 - 0.99) < 0.003);
    spl_values_finish(&values);
    spl_values_finish(&again);
}

static void kinds_have_weights(void **state)
{
    struct spl_values values = {0};
    struct spl_stream_values out, back;
    (void)state;
    for (int i = 0; i < 1000; i++)
        assert_int_equal(spl_values_add(&values, (i * 7 % 3) + 2, i % 3 ? 1 : 10, NULL), 0);
    spl_values_sum_up(&values, &out);
    assert_int_equal(out.kind_count, 3);
    assert_true(out.kinds[0].value == 2 && out.kinds[2].value == 4);
    assert_int_equal(out.kinds[0].count, 3340);
    assert_int_equal(out.count, 3340 + 666);
    assert_true(out.quantiles[50] == 2 && out.quantiles[54] == 3);
    json_t *json = spl_values_to_json(&out);
    assert_null(spl_values_from_json(json, 4006, &back));
    assert_memory_equal(&back, &out, sizeof out);
    json_decref(json);
    spl_values_finish(&values);
}

/* Every number of a good one made bad: none passes, none is read. */
static void forged_ones_are_refused(void **state)
{
    struct spl_values values = {0};
    struct spl_stream_values out, back;
    (void)state;
    for (int i = 0; i < 1000; i++)
        assert_int_equal(spl_values_add(&values, i % 5, 1, NULL), 0);
    spl_values_sum_up(&values, &out);
    json_t *good = spl_values_to_json(&out);
    assert_null(spl_values_from_json(good, 1000, &back));
    assert_non_null(spl_values_from_json(good, 999, &back));
    static const struct {
        const char *key, *value;
    } bad[] = {{"count", "0"}, {"count", "1.5"}, {"count", "-4"}, {"count", "999"}, {"count", "\"many\""},
               {"p99", "5"}, {"p99", "null"}, {"p99", "-1"}, {"quantiles", "[1, 2]"}, {"quantiles", "7"},
               {"kinds", "[]"}, {"kinds", "{}"}, {"kinds", "[[0, 1000, 3]]"}, {"kinds", "[[0, 500], [0, 500]]"},
               {"kinds", "[[0, 9223372036854775807], [1, 9223372036854775807]]"}, {"kinds", "[[7, 1000]]"},
               {"kinds", "[[0, 0], [1, 1000]]"}, {"kinds", "[[0, 999]]"}, {"kinds", "[\"a\"]"}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        json_t *json = json_deep_copy(good);
        json_object_set_new(json, bad[i].key, json_loads(bad[i].value, JSON_DECODE_ANY, NULL));
        if (!spl_values_from_json(json, 1000, &back))
            fail_msg("%s %s passes", bad[i].key, bad[i].value);
        json_decref(json);
    }
    for (size_t q = 0; q <= SPL_VALUES_QUANTILES; q++) { /* one that falls, or is none */
        json_t *json = json_deep_copy(good), *array = json_object_get(json, "quantiles");
        json_array_set_new(array, q, q % 2 ? json_real(q < 32 ? 99 : -99) : json_string("0"));
        assert_non_null(spl_values_from_json(json, 1000, &back));
        json_decref(json);
    }
    assert_non_null(spl_values_from_json(json_null(), 1000, &back));
    json_decref(good);
    spl_values_finish(&values);
}

static struct make_splat *splats_of(size_t count)
{
    struct make_splat *splats = calloc(count, sizeof *splats);
    assert_non_null(splats);
    for (size_t i = 0; i < count; i++)
        splats[i] = (struct make_splat){.position = {(double)(i % 40), (double)(i / 40 % 40), (double)(i / 1600)},
                                        .normal = {0, 0, 1},
                                        .radius = 0.5f,
                                        .classification = i < count / 4 ? 2 : 5,
                                        .uncertainty = (float)(1 + i % 2)};
    return splats;
}

/* Leaves alone count, and what is pruned has values of its own. */
static void datasets_have_theirs(void **state)
{
    enum { count = 8000 };
    struct make_splat *splats = splats_of(count);
    (void)state;
    for (int levels = 1; levels <= 2; levels++) {
        struct spl_dataset *dataset = make_dataset_levels(splats, count, levels);
        const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
        const struct spl_stream_values *classes = spl_dataset_info_get_values(info, SPL_STREAM_CLASS);
        const struct spl_stream_values *uncertain = spl_dataset_info_get_values(info, SPL_STREAM_UNCERTAINTY);
        assert_true(classes && uncertain && !spl_dataset_info_get_values(info, 2));
        assert_int_equal(classes->count, count);
        assert_int_equal(classes->kind_count, 2);
        assert_int_equal(classes->kinds[0].count, count / 4);
        assert_true(classes->kinds[1].value == 5 && classes->quantiles[15] == 2 && classes->quantiles[17] == 5);
        const struct spl_stream_values *heights = info->heights; /* 0 to 4, each of as many */
        assert_true(heights && heights->count == count && !heights->kind_count);
        for (int q = 0; q <= SPL_VALUES_QUANTILES; q++)
            assert_true(fabs(heights->quantiles[q] - fmin(q * 5 / SPL_VALUES_QUANTILES, 4)) < 0.05);
        assert_true(uncertain->quantiles[0] == 1 && uncertain->p99 == 2 && uncertain->quantiles[32] == 2);
        spl_dataset_close(dataset);
    }
    char folder[256], path[300], other[300];
    make_folder(folder);
    snprintf(path, sizeof path, "%s/a.spld", folder);
    snprintf(other, sizeof other, "%s/b.spld", folder);
    make_dataset_file(path, splats, count, 2);
    struct spl_dataset *whole, *pruned;
    struct spl_error err = {0};
    assert_int_equal(spl_dataset_open_whole(path, true, &whole, &err), SPL_OK);
    uint64_t nodes;
    spl_dataset_get_nodes(whole, &nodes);
    bool *leaf = calloc(nodes, sizeof *leaf);
    leaf[0] = true; /* the root alone stays: every eighth */
    const struct spl_rewrite rewrite = {.from = whole, .leaf = leaf};
    assert_int_equal(spl_dataset_rewrite(&rewrite, other, &err), SPL_OK);
    assert_int_equal(spl_dataset_open(other, true, &pruned, &err), SPL_OK);
    const struct spl_stream_values *classes =
        spl_dataset_info_get_values(spl_dataset_get_info(pruned), SPL_STREAM_CLASS);
    assert_true(classes && classes->count == count / 8 && classes->kinds[0].count == count / 32);
    assert_true(spl_dataset_get_info(pruned)->heights->count == count / 8);
    spl_dataset_close(pruned);
    spl_dataset_close(whole);
    unlink(path);
    unlink(other);
    rmdir(folder);
    free(leaf);
    free(splats);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(few_are_exact), cmocka_unit_test(all_kinds_of_numbers_are_in_order),
        cmocka_unit_test(many_are_near), cmocka_unit_test(kinds_have_weights),
        cmocka_unit_test(forged_ones_are_refused), cmocka_unit_test(datasets_have_theirs)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
