/* Simplified lines and rings: what stays of a square whose sides are rough. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <string.h>

#include "pack/export/simplify.h"

static void test_simplify(void **state)
{
    (void)state;
    double v[400][3] = {0};
    uint8_t kept[400];
    size_t stack[802];
    for (int i = 0; i < 400; i++) { /* around a square of 1, off by up to 4 mm */
        int side = i / 100;
        double t = i % 100 / 100.0, off = 0.004 * sin(i);
        v[i][0] = side == 0 ? t : side == 1 ? 1 + off : side == 2 ? 1 - t : off;
        v[i][1] = side == 0 ? off : side == 1 ? t : side == 2 ? 1 + off : 1 - t;
    }
    v[0][1] = 0;
    assert_int_equal(spl_simplify((const double(*)[3])v, 400, true, 0.01, kept, stack), 4);
    assert_true(kept[0] + kept[399] + kept[1] == 1 && kept[99] + kept[100] + kept[101] == 1);
    assert_true(spl_simplify((const double(*)[3])v, 400, true, 0.0005, kept, stack) > 100);
    assert_int_equal(spl_simplify((const double(*)[3])v, 99, false, 0.01, kept, stack), 2);
    assert_true(kept[0] && kept[98]);
    assert_int_equal(spl_simplify((const double(*)[3])v, 1, false, 0.01, kept, stack), 1);
    const double back[3][3] = {{0}, {2}, {1}}; /* what goes past its end and comes back is no straight line */
    assert_int_equal(spl_simplify(back, 3, false, 0.01, kept, stack), 3);
    memset(v, 0, sizeof v);
    assert_true(spl_simplify((const double(*)[3])v, 50, true, 0.01, kept, stack) <= 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_simplify)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
