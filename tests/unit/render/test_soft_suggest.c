/* What a file's counts and quantiles say of terms: how much they take, why they take nothing, which to begin with, and
 * which name was meant. No dataset is opened: what a file would say is written here. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "render/terms_hints.h"
#include "render/soft/share.h"
#include "render/soft/suggest.h"

enum { points = 100000 };

static struct spl_stream_values values[SPL_STREAMS_MAX];

static struct spl_dataset_info begin(void)
{
    memset(values, 0, sizeof values);
    return (struct spl_dataset_info){.id = "hall",
                                     .leaf_splats = points,
                                     .bounds_min = {640000.123, -20, 100},
                                     .bounds_max = {640040.123, 20, 110},
                                     .default_up = {0, 0, 1},
                                     .stream_values = values};
}

static struct spl_stream_values *add(struct spl_dataset_info *info, const char *name, const char *type)
{
    struct spl_stream_info *stream = &info->streams[info->stream_count];
    snprintf(stream->name, sizeof stream->name, "%s", name);
    snprintf(stream->type, sizeof stream->type, "%s", type);
    values[info->stream_count].count = points;
    return &values[info->stream_count++];
}

/* Pairs of a value and the points that have it. */
static void add_kinds(struct spl_dataset_info *info, const char *name, size_t count, const int pairs[][2])
{
    struct spl_stream_values *v = add(info, name, "uint");
    for (size_t i = 0; i < count; i++)
        v->kinds[v->kind_count++] = (struct spl_value_count){pairs[i][0], (uint64_t)pairs[i][1]};
    v->quantiles[SPL_VALUES_QUANTILES] = pairs[count - 1][0];
}

/* Evenly from 0 to `most`. */
static void add_even(struct spl_dataset_info *info, const char *name, double most)
{
    struct spl_stream_values *v = add(info, name, !strcmp(name, "uncertainty") ? "half-octaves" : "uint");
    for (int i = 0; i <= SPL_VALUES_QUANTILES; i++)
        v->quantiles[i] = most * i / SPL_VALUES_QUANTILES;
    v->p99 = 0.99 * most;
}

static struct spl_dataset_info make_hall(void)
{
    static const int classes[][2] = {{2, 60000}, {3, 50}, {5, 20000}, {6, 19000}, {18, 450}, {26, 500}};
    struct spl_dataset_info info = begin();
    add_even(&info, "uncertainty", 2);
    add_kinds(&info, "class", 6, classes);
    add_even(&info, "intensity", 256);
    return info;
}

static struct spl_soft_params read_terms(const char *text)
{
    struct spl_soft_params soft = {0};
    assert_int_equal(spl_soft_parse(text, &soft, NULL), 0);
    return soft;
}

static void test_shares_are_those_of_the_file(void **state)
{
    (void)state;
    static const struct {
        const char *terms;
        double share;
    } rows[] = {
        {"class:5", 0.2}, {"class:3-5", 0.2005}, {"class:77", 0}, {"class:4", 0}, {"class>5", 0.1995},
        {"class>=5", 0.3995},
        {"class:*", 1}, {"intensity>128", 0.5}, {"intensity>256", 0}, {"intensity>=256", 0.5 / 64}, {"intensity<0", 0},
        {"intensity:64..128", 0.25}, {"uncertainty>q0.75", 0.25}, {"uncertainty>0.5", 1 - 0.495},
        {"uncertainty>1.02", 0},
        {"plane:640000,0,111,0,0,1>0", 0}, {"plane:640000,0,111,0,0,1<0", 1}, {"plane:640000,0,105,0,0,3>0", NAN},
        {"plane:640000,0,111,0,0,1>-2", NAN}, {"box:0,0,0,1,1,1", 0}, {"box:640010,0,100,640011,1,101", NAN},
        {"box:640010,30,100,640011,31,101", 0}, {"box:640010,30,100,640011,31,101<11", NAN},
        {"axis:640200,0,0,0,0,1<100", 0}, {"axis:640020,0,0,0,0,1<100", 1}, {"axis:640020,0,0,0,0,1<4", NAN},
        {"class:5 or class:18", 0.2045}, {"class:2-6 or class:2", 1}, {"class:5 or axis:640020,0,0,0,0,1<4", NAN},
        {"smell>1", NAN},
    };
    struct spl_dataset_info info = make_hall();
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_soft_params soft = read_terms(rows[i].terms);
        double share = spl_soft_share_of_all(&soft, &info);
        if (isnan(share) != isnan(rows[i].share) || fabs(share - rows[i].share) > 1e-6)
            fail_msg("%s: %g, not %g", rows[i].terms, share, rows[i].share);
    }
    info.stream_values = NULL; /* a file from before */
    struct spl_soft_params soft = read_terms("class:5");
    assert_true(isnan(spl_soft_share_of_all(&soft, &info)));
}

static void test_nothing_has_a_reason(void **state)
{
    (void)state;
    static const struct {
        const char *terms, *says;
    } rows[] = {
        {"class:77", "class in 'hall' is 2, 3, 5, 6, 18 or 26"},
        {"intensity>300", "intensity in 'hall' is 0 to 256"},
        {"uncertainty>2", "uncertainty in 'hall' is 0 to 1.0101"},
        {"plane:0,0,111,0,0,1>0", "'hall' lies beside it: its bounds are 640000.123,-20,100 to"},
        {"class:5", ""}, {"plane:0,0,105,0,0,1>0", ""}, {"smell>1", ""},
    };
    struct spl_dataset_info info = make_hall();
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char reason[SPL_SOFT_REASON_MAX];
        spl_soft_explain(&read_terms(rows[i].terms).what.terms[0], &info, reason);
        if (strncmp(reason, rows[i].says, strlen(rows[i].says)) || (!*rows[i].says && *reason))
            fail_msg("%s: %s", rows[i].terms, reason);
    }
}

static void expect(const struct spl_dataset_info *info, const char *wanted)
{
    char terms[SPL_SUGGESTIONS_MAX][SPL_SUGGESTION_MAX], all[4096] = "";
    uint32_t count = spl_soft_suggest(info, terms);
    for (uint32_t i = 0; i < count; i++) {
        struct spl_soft_params soft = read_terms(terms[i]);
        assert_int_equal(spl_marks_resolve(&soft, info, NULL, NULL), 0);
        assert_false(spl_soft_share_of_all(&soft, info) == 0);
        assert_false(spl_soft_share_of_all(&soft, info) == 1);
        strcat(strcat(all, i ? " | " : ""), terms[i]);
    }
    assert_string_equal(all, wanted);
}

#define SHAPES                                                                                                         \
    "plane:640020.1,0,107.5,0,0,1>0 | box:640010.1,-10,105,640030.1,10,110 | axis:640020.1,0,107.5,0,0,1<5"

static void test_what_stands_before_others_comes_first(void **state)
{
    (void)state;
    struct spl_dataset_info info = make_hall();
    expect(&info, "class:5 | class:18 | " SHAPES " | intensity>q0.95 | uncertainty>q0.95");
    static const int flown[][2] = {{1, 30000}, {3, 10000},  {4, 10000},  {5, 10000},
                                   {7, 100},   {13, 20000}, {14, 19000}, {64, 900}},
                     returns[][2] = {{1, 80000}, {2, 19000}, {4, 1000}};
    info = begin();
    add_kinds(&info, "number_of_returns", 3, returns);
    add_kinds(&info, "return_number", 3, returns);
    add_kinds(&info, "class", 8, flown);
    expect(&info, "class:3-5 | class:7 | class:13-14 | class:64 | number_of_returns>1 | " SHAPES);
}

static void test_what_most_or_next_to_none_have_is_no_beginning(void **state)
{
    (void)state;
    static const int wood[][2] = {{5, 99950}, {7, 50}}, nothing[][2] = {{0, points}},
                     faint[][2] = {{0, 99000}, {1, 1000}}, both[][2] = {{3, 40000}, {5, 60000}};
    struct spl_dataset_info info = begin();
    add_kinds(&info, "class", 2, wood);
    add_kinds(&info, "intensity", 2, faint); /* no quantity: two values */
    add_kinds(&info, "number_of_returns", 1, nothing);
    expect(&info, SHAPES);
    info = begin();
    add_kinds(&info, "class", 2, both);
    add_even(&info, "user_data", 100); /* names, not amounts */
    expect(&info, "class:3 | " SHAPES);
    info = begin();
    expect(&info, SHAPES);
    info = begin();
    values[0] = *add(&info, "intensity", "uint");
    for (int i = 0; i <= SPL_VALUES_QUANTILES; i++)
        values[0].quantiles[i] = i == SPL_VALUES_QUANTILES; /* all but a few are 0 */
    expect(&info, SHAPES);
}

static void test_planes_lie_across_what_is_up(void **state)
{
    (void)state;
    struct spl_dataset_info info = begin();
    memcpy(info.bounds_min, (double[]){-0.5, -8, 0}, sizeof info.bounds_min);
    memcpy(info.bounds_max, (double[]){0.5, 0, 4000}, sizeof info.bounds_max);
    memcpy(info.default_up, (double[]){0, -1, 0}, sizeof info.default_up);
    expect(&info, "plane:0,-6,2000,0,-1,0>0 | box:-0.25,-8,1000,0.25,-4,3000 | axis:0,-6,2000,0,1,0<500");
    memcpy(info.bounds_max, info.bounds_min, sizeof info.bounds_max); /* a single point: nothing is inside */
    char terms[SPL_SUGGESTIONS_MAX][SPL_SUGGESTION_MAX];
    for (uint32_t i = 0, count = spl_soft_suggest(&info, terms); i < count; i++)
        (void)read_terms(terms[i]);
}

static void test_names_are_guessed(void **state)
{
    (void)state;
    static const struct {
        const char *term, *hint; /* NULL = none */
    } rows[] = {
        {"uncertanty>0.4", "did you mean 'uncertainty'?"},
        {"Uncertainty>0.4", "did you mean 'uncertainty'?"},
        {"classification:5", "did you mean 'class'?"},
        {"clas:5", "did you mean 'class'?"},
        {"int>5", "did you mean 'intensity'?"},
        {"smell>1", NULL},
        {"elevation>20.5", "coordinates are x, y and z: write 'z>20.5'"},
        {"height<2", "coordinates are x, y and z: write 'z<2'"},
        {"X:1..2", "coordinates are x, y and z: write 'x>1'"},
        {"Y<q0.5", "coordinates are x, y and z: write 'y<0'"},
    };
    struct spl_dataset_info info = make_hall();
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_error err = {0};
        struct spl_soft_params soft = read_terms(rows[i].term);
        assert_int_equal(spl_marks_resolve(&soft, &info, NULL, &err), SPL_E_INPUT);
        assert_string_equal(err.field, "soft");
        assert_non_null(strstr(err.message, "it has uncertainty, class, intensity"));
        const char *behind = strstr(err.message, "; ");
        if (rows[i].hint ? !behind || strcmp(behind + 2, rows[i].hint) : behind != NULL)
            fail_msg("%s: %s", rows[i].term, err.message);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_shares_are_those_of_the_file),
        cmocka_unit_test(test_nothing_has_a_reason),
        cmocka_unit_test(test_what_stands_before_others_comes_first),
        cmocka_unit_test(test_what_most_or_next_to_none_have_is_no_beginning),
        cmocka_unit_test(test_planes_lie_across_what_is_up),
        cmocka_unit_test(test_names_are_guessed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
