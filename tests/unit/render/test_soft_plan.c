/* Windows of depth: every item is in one, in order; each fits or is a single place; nothing is cut that fits; buckets
 * that are too full are refined, and equal depths are cut by their slots. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "render/soft/plan.h"

struct thing {
    uint64_t place;
    uint32_t entries;
};

static struct thing *things;
static size_t count;
static int measured, fails_at;

static uint32_t random_word(void)
{
    static uint64_t state = 1;
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(state >> 32);
}

static int measure(void *context, const struct spl_soft_range *range, uint32_t shift, struct spl_soft_sum *sums,
                   struct spl_error *err)
{
    (void)context;
    if (++measured == fails_at)
        return spl_fail(err, SPL_E_DEVICE_LOST, "lost");
    assert_true(range->end > range->first);
    if (shift >= 32)
        assert_true(!(uint32_t)range->first && !(uint32_t)range->end);
    else
        assert_true(range->first >> 32 == (range->end - 1) >> 32);
    uint64_t buckets = ((range->end - range->first - 1) >> shift) + 1;
    assert_true(buckets <= SPL_SOFT_BUCKETS);
    memset(sums, 0, buckets * sizeof *sums);
    for (size_t i = 0; i < count; i++)
        if (things[i].place >= range->first && things[i].place < range->end) {
            struct spl_soft_sum *sum = &sums[(things[i].place - range->first) >> shift];
            sum->items++;
            sum->entries += things[i].entries;
        }
    return SPL_OK;
}

/* Plans all that there is and returns the number of windows. */
static size_t plan_all(uint32_t items, uint32_t entries)
{
    static struct spl_soft_plan plan;
    plan = (struct spl_soft_plan){.room = {items, entries}, .measure = measure};
    struct spl_soft_range window, all = {0, UINT64_C(0x7f800000) << 32};
    struct spl_soft_sum sum;
    uint64_t end = 0, planned = 0;
    size_t windows = 0;
    measured = 0;
    assert_int_equal(spl_soft_plan_begin(&plan, &all, NULL), SPL_OK);
    for (int rc; (rc = spl_soft_plan_next(&plan, &window, &sum, NULL)) != 0; windows++) {
        assert_int_equal(rc, 1);
        assert_true(window.first >= end && window.end > window.first);
        end = window.end;
        struct spl_soft_sum own = {0};
        for (size_t i = 0; i < count; i++)
            if (things[i].place >= window.first && things[i].place < window.end) {
                own.items++;
                own.entries += things[i].entries;
            }
        assert_memory_equal(&own, &sum, sizeof own);
        assert_true(own.items > 0);
        assert_true((own.items <= items && own.entries <= entries) || window.end == window.first + 1);
        planned += own.items;
    }
    assert_int_equal(planned, count);
    return windows;
}

static void fill(size_t n, uint64_t (*place)(size_t i))
{
    free(things);
    things = calloc(n + 1, sizeof *things);
    assert_non_null(things);
    count = n;
    for (size_t i = 0; i < n; i++)
        things[i] = (struct thing){place(i), 1 + random_word() % 4};
}

static uint64_t anywhere(size_t i)
{
    float z = 0.5f + (float)(random_word() >> 8) * 1e-6f;
    uint32_t key;
    memcpy(&key, &z, 4);
    return (uint64_t)key << 32 | i;
}

static uint64_t at_one_depth(size_t i)
{
    return UINT64_C(0x40400000) << 32 | i / 2;
}

static uint64_t at_one_place(size_t i)
{
    (void)i;
    return UINT64_C(0x40400000) << 32 | 77;
}

static void what_fits_is_one_window(void **state)
{
    (void)state;
    fill(0, anywhere);
    assert_int_equal(plan_all(10, 40), 0);
    fill(1000, anywhere);
    assert_int_equal(plan_all(1000, 4000), 1);
    assert_int_equal(measured, 1);
    assert_true(plan_all(999, 4000) <= 3);
}

static void full_buckets_are_refined(void **state)
{
    (void)state;
    fill(2000, anywhere);
    for (uint32_t room = 1; room < 300; room = room * 3 + 1) {
        size_t windows = plan_all(room, 5 * room);
        assert_true(windows >= 2000 / room && windows <= 4 * 2000 / room + 1);
    }
    assert_true(plan_all(1000, 40) >= 2000 / 40);
}

static void equal_depths_are_cut_by_their_slots(void **state)
{
    (void)state;
    fill(5000, at_one_depth);
    size_t windows = plan_all(100, 1000);
    assert_true(windows >= 50 && windows <= 110);
    assert_int_equal(plan_all(1, 1000), 2500); /* two of a place are not told apart */
    fill(50, at_one_place);
    assert_int_equal(plan_all(10, 1000), 1);
}

static void failures_are_told(void **state)
{
    (void)state;
    static struct spl_soft_plan plan;
    plan = (struct spl_soft_plan){.room = {10, 40}, .measure = measure};
    struct spl_soft_range window, all = {0, UINT64_C(0x7f800000) << 32};
    struct spl_soft_sum sum;
    fill(5000, at_one_depth);
    for (fails_at = 1; fails_at < 4; fails_at++) {
        measured = 0;
        int rc = spl_soft_plan_begin(&plan, &all, NULL);
        while (!rc && (rc = spl_soft_plan_next(&plan, &window, &sum, NULL)) == 1)
            rc = 0;
        assert_int_equal(rc, SPL_E_DEVICE_LOST);
    }
    fails_at = 0;
    free(things);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_fits_is_one_window),
        cmocka_unit_test(full_buckets_are_refined),
        cmocka_unit_test(equal_depths_are_cut_by_their_slots),
        cmocka_unit_test(failures_are_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
