/* Range headers: what is asked for, what is ignored, what cannot be had. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "service/range.h"

static void test_ranges(void **state)
{
    (void)state;
    static const struct {
        const char *header;
        uint64_t size;
        enum spl_range range;
        uint64_t first, length;
    } cases[] = {
        {NULL, 10, SPL_RANGE_ALL, 0, 10},
        {"", 10, SPL_RANGE_ALL, 0, 10},
        {"bytes=0-9", 10, SPL_RANGE_PART, 0, 10},
        {"bytes=0-0", 10, SPL_RANGE_PART, 0, 1},
        {"Bytes=3-", 10, SPL_RANGE_PART, 3, 7},
        {"bytes=9-9", 10, SPL_RANGE_PART, 9, 1},
        {"bytes=5-500", 10, SPL_RANGE_PART, 5, 5},
        {"bytes=5-99999999999999999999999", 10, SPL_RANGE_PART, 5, 5},
        {"bytes=5-18446744073709551615", 10, SPL_RANGE_PART, 5, 5},
        {"bytes=-3", 10, SPL_RANGE_PART, 7, 3},
        {"bytes=-300", 10, SPL_RANGE_PART, 0, 10},
        {"bytes=10-", 10, SPL_RANGE_UNSATISFIABLE, 0, 10},
        {"bytes=99999999999999999999999-", 10, SPL_RANGE_UNSATISFIABLE, 0, 10},
        {"bytes=-0", 10, SPL_RANGE_UNSATISFIABLE, 0, 10},
        {"bytes=0-", 0, SPL_RANGE_UNSATISFIABLE, 0, 0},
        {"bytes=-5", 0, SPL_RANGE_UNSATISFIABLE, 0, 0},
        {"bytes=5-4", 10, SPL_RANGE_ALL, 0, 10},
        {"bytes=-", 10, SPL_RANGE_ALL, 0, 10},
        {"bytes=", 10, SPL_RANGE_ALL, 0, 10},
        {"bytes=1", 10, SPL_RANGE_ALL, 0, 10},
        {"bytes=+1-2", 10, SPL_RANGE_ALL, 0, 10},
        {"bytes=1-2,4-5", 10, SPL_RANGE_ALL, 0, 10},
        {"bytes=1-2x", 10, SPL_RANGE_ALL, 0, 10},
        {"bytes= 1-2", 10, SPL_RANGE_ALL, 0, 10},
        {"lines=1-2", 10, SPL_RANGE_ALL, 0, 10},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        uint64_t first, length;
        enum spl_range range = spl_range_parse(cases[i].header, cases[i].size, &first, &length);
        if (range != cases[i].range || first != cases[i].first || length != cases[i].length)
            fail_msg("'%s' of %llu: %d, %llu + %llu", cases[i].header ? cases[i].header : "(none)",
                     (unsigned long long)cases[i].size, (int)range, (unsigned long long)first,
                     (unsigned long long)length);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_ranges)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
