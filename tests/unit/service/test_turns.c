/* Turns at the device: the least left goes first, small views before large ones, and nobody is passed over for ever. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "service/view/turns.h"

static void the_least_left_goes_first(void **state)
{
    (void)state;
    struct spl_turns turns;
    struct spl_job jobs[3] = {{.accepted_ns = 1, .samples_left = 30},
                              {.accepted_ns = 2, .samples_left = 10},
                              {.accepted_ns = 3, .samples_left = 10}};
    spl_turns_init(&turns);
    assert_null(spl_turns_next(&turns, false));
    for (int i = 2; i >= 0; i--) // whatever order they come in, they stand by their age
        spl_turns_add(&turns, &jobs[i]);
    assert_ptr_equal(spl_turns_next(&turns, false), &jobs[1]);
    assert_null(spl_turns_next(&turns, true));
    spl_turns_remove(&turns, &jobs[1]);
    assert_ptr_equal(spl_turns_next(&turns, false), &jobs[2]);
    spl_turns_remove(&turns, &jobs[2]);
    assert_ptr_equal(spl_turns_next(&turns, false), &jobs[0]);
    spl_turns_remove(&turns, &jobs[0]);
    assert_null(spl_turns_next(&turns, false));
}

static void who_waits_for_pages_has_no_turn(void **state)
{
    (void)state;
    struct spl_turns turns;
    struct spl_job jobs[2] = {{.accepted_ns = 1, .samples_left = 10, .waits = true},
                              {.accepted_ns = 2, .samples_left = 20}};
    spl_turns_init(&turns);
    spl_turns_add(&turns, &jobs[0]);
    for (int i = 0; i < 4 * SPL_TURNS_EVERY; i++) // nor does it count as one
        assert_null(spl_turns_next(&turns, true));
    spl_turns_add(&turns, &jobs[1]);
    for (int i = 0; i < 4 * SPL_TURNS_EVERY; i++) // not even as the oldest
        assert_ptr_equal(spl_turns_next(&turns, false), &jobs[1]);
    jobs[0].waits = false;
    assert_ptr_equal(spl_turns_next(&turns, false), &jobs[0]);
}

/* However many small and nearly finished ones come, the oldest has every eighth turn; those between have as many. */
static void nobody_is_starved(void **state)
{
    (void)state;
    struct spl_turns turns;
    struct spl_job oldest = {.accepted_ns = 1, .samples_left = 60}, other = {.accepted_ns = 2, .samples_left = 1};
    enum { rounds = 60, turns_each = 2 * SPL_TURNS_EVERY };
    for (int small_waits = 0; small_waits < 2; small_waits++) {
        int oldest_had = 0, other_had = 0, small_had = 0;
        spl_turns_init(&turns);
        spl_turns_add(&turns, &oldest);
        spl_turns_add(&turns, &other);
        for (int turn = 0; turn < rounds * turns_each; turn++) {
            struct spl_job *next = spl_turns_next(&turns, small_waits);
            oldest_had += next == &oldest;
            other_had += next == &other;
            small_had += !next;
        }
        assert_int_equal(oldest_had, rounds);
        assert_int_equal(other_had, small_waits ? rounds : rounds * (turns_each - 1));
        assert_int_equal(small_had, small_waits ? rounds * (turns_each - 2) : 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_least_left_goes_first),
        cmocka_unit_test(who_waits_for_pages_has_no_turn),
        cmocka_unit_test(nobody_is_starved),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
