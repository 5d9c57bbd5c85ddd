/* Numbers that people write: where they end, and what strtod would take besides. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/decimal.h"

static void numbers_end_where_their_digits_do(void **state)
{
    (void)state;
    static const struct {
        const char *text, *rest;
        double value;
    } rows[] = {
        {"0", "", 0},          {"-12", "", -12},     {"+.5", "", 0.5},    {"3.", "", 3},          {"007.25", "", 7.25},
        {"1e3", "", 1000},     {"1E-2x", "x", 0.01}, {"10mm", "mm", 10},  {"2.5 m", " m", 2.5},   {"1,2", ",2", 1},
        {"4e", "e", 4},        {"4e+", "e+", 4},     {"4em", "em", 4},    {"1.2.3", ".3", 1.2},   {"5x10", "x10", 5},
        {"1e-999", "", 0},     {"0 x", " x", 0},     {"1e3.5", ".5", 1e3}, {"00x1", "x1", 0},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        double value = -1;
        const char *end = spl_decimal_parse(rows[i].text, &value);
        if (!end || strcmp(end, rows[i].rest) || !(value == rows[i].value))
            fail_msg("'%s': %g, then '%s'", rows[i].text, value, end ? end : "nothing");
    }
}

static void what_is_no_decimal_number_is_none(void **state)
{
    (void)state;
    static const char *const rows[] = {
        "",    " 1",  "\t1",  "+",    "-",   ".",      "e5",    "-.e5",  "x",   "nan", "-nan", "inf",
        "INF", "-inf", "0x10", "0X1", "0x.8", "0x1p-3", "-0x.8", "1e999", "--1", "+-1", "nan(", "infinity"};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        double value = 7;
        if (spl_decimal_parse(rows[i], &value) || value != 7)
            fail_msg("'%s' is taken as %g", rows[i], value);
    }
}

static void numbers_are_written_in_as_few_digits_as_they_take(void **state)
{
    (void)state;
    static const struct {
        double value;
        const char *text;
    } rows[] = {{0.2, "0.2"}, {0.1 + 0.2, "0.30000000000000004"}, {1.0 / 3, "0.3333333333333333"}, {0, "0"}, {1, "1"},
                {-2.5, "-2.5"}, {1e9, "1000000000"}, {1e-300, "1e-300"}, {640010.125, "640010.125"}};
    char text[SPL_DECIMAL_MAX];
    unsigned short seed[3] = {1, 2, 3};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        assert_string_equal(spl_decimal_print(rows[i].value, text), rows[i].text);
    for (int i = 0; i < 2000; i++) {
        double value = (erand48(seed) - 0.5) * exp(40 * (erand48(seed) - 0.5)), back = 0;
        assert_true(!*spl_decimal_parse(spl_decimal_print(value, text), &back) && back == value);
    }
}

static void json_is_shortened_where_it_is_numbers(void **state)
{
    (void)state;
    static const struct {
        const char *before, *after;
    } rows[] = {
        {"{\"a\": 0.20000000000000001, \"b\": [1.0, -0.10000000000000001, 17]}",
         "{\"a\": 0.2, \"b\": [1.0, -0.1, 17]}"},
        {"[\"0.20000000000000001\", \"\\\"0.20000000000000001\", 0.30000000000000004]",
         "[\"0.20000000000000001\", \"\\\"0.20000000000000001\", 0.30000000000000004]"},
        {"[12345678901234567890, 1.0000000000000001e-05, true, false, null]",
         "[12345678901234567890, 1e-05, true, false, null]"},
        {"0.59999999999999998", "0.6"},
        {"", ""},
        {"\"open 0.20000000000000001\\", "\"open 0.20000000000000001\\"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char text[160];
        snprintf(text, sizeof text, "%s", rows[i].before);
        assert_string_equal(spl_decimal_shorten(text), rows[i].after);
    }
    assert_null(spl_decimal_shorten(NULL));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(numbers_end_where_their_digits_do),
        cmocka_unit_test(what_is_no_decimal_number_is_none),
        cmocka_unit_test(numbers_are_written_in_as_few_digits_as_they_take),
        cmocka_unit_test(json_is_shortened_where_it_is_numbers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
