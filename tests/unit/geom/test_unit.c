/* Names of units and what they are worth, both ways. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "geom/unit.h"

static void names_and_factors(void **state)
{
    (void)state;
    static const struct {
        double metres;
        const char *name;
    } rows[] = {{0, "unknown"},          {1, "m"},           {0.3048, "ft"},     {1200.0 / 3937, "us-ft"},
                {0.3048006, "us-ft"},    {1000, "km"},       {0.9144, "yd"},     {0.0254, "in"},
                {0.201168, "0.201168 m"}, {0.3048003, "0.3048003 m"}, {1e9, "1000000000 m"}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char text[SPL_UNIT_TEXT_MAX];
        double back = -1;
        assert_string_equal(spl_unit_print(rows[i].metres, text), rows[i].name);
        assert_true(spl_unit_parse(text, &back));
        assert_true(rows[i].metres == 0 ? back == 0 : spl_unit_is_same(back, rows[i].metres));
    }
    assert_false(spl_unit_is_same(0.3048, 1200.0 / 3937));
}

static void what_is_no_unit(void **state)
{
    (void)state;
    static const char *const rows[] = {"",    "M",     "Metre", "0.3048", "0 m",   "-1 m", "1e-7 m", "nan m",
                                       "1 m ", "1  m", "inf m", "0x10m", "1e10 m", "0x1 mm", "m m",  "1 ft",   "ft "};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        double metres = 7;
        if (spl_unit_parse(rows[i], &metres) || metres != 7)
            fail_msg("'%s' is no unit", rows[i]);
    }
    double metres;
    assert_true(spl_unit_parse("0.2m", &metres) && metres == 0.2);
    static const char *const words[] = {"meter", "metre", "meters", "metres", "foot", "feet"};
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        assert_true(spl_unit_parse(words[i], &metres) && metres == (i < 4 ? 1 : 0.3048));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(names_and_factors), cmocka_unit_test(what_is_no_unit)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
