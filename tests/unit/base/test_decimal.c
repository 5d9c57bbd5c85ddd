/* Numbers that people write: where they end, and what strtod would take besides. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(numbers_end_where_their_digits_do),
        cmocka_unit_test(what_is_no_decimal_number_is_none),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
