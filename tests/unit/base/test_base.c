/* The ground floor: errors keep the first message, allocation refuses overflow and injected failures, loops cover. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/parallel.h"

static void first_error_wins(void **state)
{
    (void)state;
    struct spl_error err = {0};
    assert_int_equal(spl_fail_field(&err, SPL_E_INPUT, "fov", "fov %d", 7), SPL_E_INPUT);
    assert_int_equal(spl_fail(&err, SPL_E_IO, "later"), SPL_E_IO);
    assert_int_equal(err.code, SPL_E_INPUT);
    assert_string_equal(err.field, "fov");
    assert_string_equal(err.message, "fov 7");
    assert_int_equal(spl_fail(NULL, SPL_E_BUSY, "nobody listens"), SPL_E_BUSY);
}

static void every_code_has_a_row(void **state)
{
    (void)state;
    for (int code = SPL_E_INTERNAL; code <= SPL_OK; code++)
        assert_non_null(spl_code_get_info(code)->name);
    assert_string_equal(spl_code_get_info(-999)->name, "internal");
    assert_string_equal(spl_code_get_info(5)->name, "internal");
}

static void bytes_have_suffixes_and_no_overflow(void **state)
{
    (void)state;
    static const char *const refused[] = {
        "", "G", "-1", " 1", "+1", "1 ", "1X", "1GB", "1k", "1.5G", "0x10", "16777216T", "18446744073709551616"};
    uint64_t bytes = 0;
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++)
        assert_false(spl_bytes_from_text(refused[i], 1, &bytes));
    assert_true(spl_bytes_from_text("18446744073709551615", 1, &bytes) && bytes == UINT64_MAX);
    assert_false(spl_bytes_from_text("18446744073709551615", 2, &bytes));
    assert_true(spl_bytes_from_text("16777215T", 1, &bytes) && bytes == UINT64_C(16777215) << 40);
    assert_true(spl_bytes_from_text("3", 1 << 20, &bytes) && bytes == 3 << 20);
    assert_true(spl_bytes_from_text("3K", 1 << 20, &bytes) && bytes == 3 << 10); /* a suffix is of bytes */
}

static void allocation_refuses_overflow_and_injection(void **state)
{
    (void)state;
    struct spl_error err = {0};
    assert_null(spl_alloc_raw(SIZE_MAX / 2, 3, &err));
    assert_int_equal(err.code, SPL_E_NOMEM);
    spl_memory_fail_after(2);
    void *first = spl_alloc(1, 1, NULL), *second = spl_alloc(1, 1, NULL), *third = spl_alloc(1, 1, NULL);
    assert_non_null(first);
    assert_null(second);
    assert_non_null(third);
    free(first);
    free(third);
}

static void count_visits(void *context, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    uint8_t *visits = context;
    for (size_t i = begin; i < end; i++)
        visits[i]++;
}

static void loop_visits_everything_once(void **state)
{
    (void)state;
    enum { n = 10007 };
    static uint8_t visits[n + 64]; /* the last piece is a part of one */
    spl_parallel_for(4, n, 64, count_visits, visits);
    for (size_t i = 0; i < n; i++)
        assert_int_equal(visits[i], 1);
    for (size_t i = n; i < n + 64; i++)
        assert_int_equal(visits[i], 0);
    spl_parallel_for(0, 0, 1, count_visits, NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(first_error_wins),
        cmocka_unit_test(every_code_has_a_row),
        cmocka_unit_test(bytes_have_suffixes_and_no_overflow),
        cmocka_unit_test(allocation_refuses_overflow_and_injection),
        cmocka_unit_test(loop_visits_everything_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
