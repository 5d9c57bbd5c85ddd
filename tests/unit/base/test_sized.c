/* Structs that grow: an older program's and a newer program's, and those that nobody has set. And what else the public
 * ground floor has: the version, the flag that cancels. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "base/sized.h"
#include "base/work.h"

struct first {
    size_t size;
    int a;
};

struct second { /* the same, grown */
    size_t size;
    int a, b;
    double c;
};

static void an_older_programs_struct_has_defaults_where_it_ends(void **state)
{
    (void)state;
    struct first *given = malloc(sizeof *given); // on the heap, where a sanitizer sees what is read beyond it
    struct second known = {.a = 1, .b = 2, .c = 3};
    struct spl_error err = {0};
    assert_non_null(given);
    spl_sized_init(given, sizeof *given);
    assert_int_equal(given->size, sizeof *given);
    assert_int_equal(given->a, 0);
    given->a = 7;
    assert_int_equal(spl_sized_read(given, &known, sizeof known, "spl_things", &err), SPL_OK);
    assert_int_equal(known.size, sizeof known);
    assert_int_equal(known.a, 7);
    assert_true(known.c == 3);
    free(given);
}

static void a_newer_programs_struct_is_read_as_far_as_it_is_known(void **state)
{
    (void)state;
    struct second given;
    struct {
        struct first known;
        char after[64];
    } storage;
    struct spl_error err = {0};
    memset(&storage, 0x55, sizeof storage);
    spl_sized_init(&given, sizeof given);
    given.a = 7;
    assert_int_equal(spl_sized_read(&given, &storage.known, sizeof storage.known, "spl_things", &err), SPL_OK);
    assert_int_equal(storage.known.a, 7);
    assert_int_equal(storage.known.size, sizeof storage.known);
    for (size_t i = 0; i < sizeof storage.after; i++)
        assert_int_equal(storage.after[i], 0x55);
    given.c = 1;
    assert_int_equal(spl_sized_read(&given, &storage.known, sizeof storage.known, "spl_things", &err),
                     SPL_E_UNSUPPORTED);
    assert_string_equal(err.field, "size");
    assert_non_null(strstr(err.message, "spl_things"));
}

static void a_struct_that_nobody_has_set_is_refused(void **state)
{
    (void)state;
    static const size_t sizes[] = {0, 1, sizeof(size_t) - 1, (1 << 16) + 1, SIZE_MAX};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        struct first given = {.size = sizes[i]}, known = {0};
        struct spl_error err = {0};
        assert_int_equal(spl_sized_read(&given, &known, sizeof known, "spl_things", &err), SPL_E_USAGE);
        assert_string_equal(err.field, "size");
        assert_non_null(strstr(err.message, "spl_things_init()"));
    }
}

static void the_version_is_that_of_the_headers(void **state)
{
    (void)state;
    char text[32];
    snprintf(text, sizeof text, "%d.%d.%d", SPL_VERSION_MAJOR, SPL_VERSION_MINOR, SPL_VERSION_PATCH);
    assert_string_equal(spl_version(), text);
    assert_int_equal(spl_version_number(), SPL_VERSION_NUMBER);
}

static void the_flag_that_cancels_is_the_one_that_is_polled(void **state)
{
    (void)state;
    struct spl_cancel cancel = {0};
    const atomic_bool *flag = spl_cancel_get_flag(&cancel);
    assert_null(spl_cancel_get_flag(NULL));
    assert_false(spl_is_cancelled(flag));
    spl_cancel_set(&cancel);
    assert_true(spl_is_cancelled(flag) && spl_cancel_is_set(&cancel));
    spl_cancel_clear(&cancel);
    assert_false(spl_is_cancelled(flag) || spl_cancel_is_set(&cancel));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_older_programs_struct_has_defaults_where_it_ends),
        cmocka_unit_test(a_newer_programs_struct_is_read_as_far_as_it_is_known),
        cmocka_unit_test(a_struct_that_nobody_has_set_is_refused),
        cmocka_unit_test(the_version_is_that_of_the_headers),
        cmocka_unit_test(the_flag_that_cancels_is_the_one_that_is_polled),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
