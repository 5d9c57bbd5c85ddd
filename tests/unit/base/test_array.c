/* Arrays that grow: every element stays, room comes by doubling, and a refusal changes nothing. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <cmocka.h>

#include "base/array.h"
#include "base/memory.h"

static void keeps_what_was_added(void **state)
{
    (void)state;
    uint32_t *items = NULL;
    size_t count = 0, capacity = 0, moves = 0;
    for (uint32_t i = 0; i < 10000; i++) {
        size_t before = capacity;
        assert_int_equal(spl_array_reserve(items, capacity, count + 1, NULL), SPL_OK);
        assert_true(capacity > count);
        moves += capacity != before;
        items[count++] = 7 * i;
    }
    for (uint32_t i = 0; i < 10000; i++)
        assert_int_equal(items[i], 7 * i);
    assert_in_range(moves, 1, 14); // not once an element
    free(items);
}

static void makes_as_much_room_as_is_wanted(void **state)
{
    (void)state;
    struct {
        char *bytes;
        size_t capacity;
    } a = {0};
    assert_int_equal(spl_array_reserve(a.bytes, a.capacity, 0, NULL), SPL_OK);
    assert_non_null(a.bytes);
    assert_int_equal(spl_array_reserve(a.bytes, a.capacity, 1000, NULL), SPL_OK);
    assert_int_equal(a.capacity, 1000);
    char *same = a.bytes;
    assert_int_equal(spl_array_reserve(a.bytes, a.capacity, 999, NULL), SPL_OK);
    assert_ptr_equal(a.bytes, same);
    assert_int_equal(a.capacity, 1000);
    assert_int_equal(spl_array_reserve(a.bytes, a.capacity, 1001, NULL), SPL_OK);
    assert_int_equal(a.capacity, 2000);
    free(a.bytes);
}

static void a_refusal_changes_nothing(void **state)
{
    (void)state;
    double *items = NULL;
    size_t capacity = 0;
    struct spl_error err = {0};
    assert_int_equal(spl_array_reserve(items, capacity, 4, NULL), SPL_OK);
    items[3] = 0.25;
    double *before = items;
    size_t room = capacity;
    spl_memory_fail_after(1);
    assert_int_equal(spl_array_reserve(items, capacity, room + 1, &err), SPL_E_NOMEM);
    assert_int_equal(err.code, SPL_E_NOMEM);
    // elements whose bytes no size_t can count
    assert_int_equal(spl_array_reserve(items, capacity, SIZE_MAX / sizeof *items + 2, NULL), SPL_E_NOMEM);
    assert_int_equal(spl_array_reserve(items, capacity, SIZE_MAX, NULL), SPL_E_NOMEM);
    assert_ptr_equal(items, before);
    assert_int_equal(capacity, room);
    assert_true(items[3] == 0.25);
    free(items);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(keeps_what_was_added),
        cmocka_unit_test(makes_as_much_room_as_is_wanted),
        cmocka_unit_test(a_refusal_changes_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
