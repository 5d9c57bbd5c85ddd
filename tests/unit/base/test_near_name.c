/* What was meant by a name that there is not. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "base/near_name.h"

static void a_few_letters_off_is_near(void **state)
{
    (void)state;
    static const char *const names[] = {"render", "serve", "bench", "synth", "fov", NULL};
    static const char *const rows[][2] = {
        {"rendr", "render"}, {"--sevre=x", "serve"}, {"snyth", "synth"}, {"bench", "bench"}, {"SERVE", "serve"},
        {"pack", NULL},      {"", NULL},             {"fo", NULL},       {"fox", "fov"},     {"f", NULL},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const char *found = spl_near_name_find(rows[i][0], names);
        if (!found != !rows[i][1] || (found && strcmp(found, rows[i][1]) != 0))
            fail_msg("'%s' is taken for %s", rows[i][0], found ? found : "nothing");
    }
}

static void a_beginning_is_near(void **state)
{
    (void)state;
    static const char *const names[] = {"background", "supersample", "lod", NULL};
    assert_string_equal(spl_near_name_find("back", names), "background");
    assert_string_equal(spl_near_name_find("SuperSampling", names), "supersample");
    assert_string_equal(spl_near_name_find("lod-of-a-name-that-is-far-longer-than-any-parameter", names), "lod");
    assert_null(spl_near_name_find("ba", names));
    assert_null(spl_near_name_find("a-name-that-is-far-longer-than-any-option-that-there-is", names));
}

static void the_nearest_of_several_counts(void **state)
{
    (void)state;
    char text[SPL_NEAR_NAME_TEXT_MAX];
    struct spl_near_name near = spl_near_name_of("widht");
    assert_string_equal(spl_near_name_say(&near, text), "");
    spl_near_name_offer(&near, "light");
    spl_near_name_offer(&near, "width");
    spl_near_name_offer(&near, "eight");
    assert_string_equal(spl_near_name_say(&near, text), "did you mean 'width'? ");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_few_letters_off_is_near),
        cmocka_unit_test(a_beginning_is_near),
        cmocka_unit_test(the_nearest_of_several_counts),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
