/* Every name is found, in order, in any case; digits are read whole. The values are those of CSS Color 4. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <ctype.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

#include "image/color.h"

static void every_name_is_found(void **state)
{
    (void)state;
    const char *name, *before = "";
    uint64_t sum = 0;
    size_t count = 0;
    for (; (name = spl_color_name(count)); before = name, count++) {
        char upper[32];
        uint8_t rgba[4], again[4];
        if (strcmp(before, name) >= 0)
            fail_msg("'%s' does not lie behind '%s'", name, before);
        if (!spl_color_from_text(name, rgba) || rgba[3] != 255)
            fail_msg("'%s' is not found", name);
        for (size_t i = 0; i < sizeof upper && (!i || name[i - 1]); i++)
            upper[i] = (char)toupper(name[i]);
        assert_true(spl_color_from_text(upper, again));
        assert_memory_equal(rgba, again, 4);
        sum += (uint64_t)rgba[0] << 16 | (uint64_t)rgba[1] << 8 | rgba[2];
    }
    assert_int_equal(count, 148);
    assert_int_equal(sum, 1579864000); /* of all values as one number each: a slip in the table changes it */
}

static void digits_are_read_whole(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        uint8_t rgba[4];
    } rows[] = {
        {"102030", {16, 32, 48, 255}},      {"#10203040", {16, 32, 48, 64}}, {"0xFFfffe", {255, 255, 254, 255}},
        {"transparent", {0, 0, 0, 0}},      {"red", {255, 0, 0, 255}},       {"#000000", {0, 0, 0, 255}},
        {"FFFFFFFF", {255, 255, 255, 255}},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        uint8_t rgba[4] = {1, 2, 3, 4};
        assert_true(spl_color_from_text(rows[i].text, rgba));
        assert_memory_equal(rgba, rows[i].rgba, 4);
    }
    static const char *const bad[] = {"",       "#",        "0x",       "12345",   "1234567", "123456789", "#12345g",
                                      "+12345", " 102030",  "102030 ",  "#red",    "0xred",   "re",        "redd",
                                      "red ",   "0x0x1020", "##102030", "-0xabcd", "none"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        uint8_t rgba[4] = {1, 2, 3, 4};
        if (spl_color_from_text(bad[i], rgba))
            fail_msg("'%s' is taken", bad[i]);
        assert_memory_equal(rgba, ((const uint8_t[]){1, 2, 3, 4}), 4);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_name_is_found),
        cmocka_unit_test(digits_are_read_whole),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
