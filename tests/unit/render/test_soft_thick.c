/* Windows of depth that overlap: each holds every sphere that overlaps it, and no more than there is room for; they
 * follow one another without a gap to the end, none thinner than asked for; where too much overlaps that is said; what
 * fits is one window, and rooms are filled. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "render/soft/thick.h"

struct sphere {
    float depth, radius;
    uint32_t entries;
};

static struct sphere *spheres;
static size_t count;
static int measured, fails_at;
static float reach;

static double uniform(void)
{
    static uint64_t state = 1;
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) / 9007199254740992.0;
}

static uint64_t place(float depth)
{
    uint32_t key;
    memcpy(&key, &depth, 4);
    return (uint64_t)key << 32;
}

static int measure(void *context, const struct spl_soft_range *range, uint32_t shift, struct spl_soft_sum *sums,
                   struct spl_error *err)
{
    (void)context;
    if (++measured == fails_at)
        return spl_fail(err, SPL_E_DEVICE_LOST, "lost");
    assert_true(range->end > range->first && shift >= 32 && !(uint32_t)range->first && !(uint32_t)range->end);
    uint64_t buckets = ((range->end - range->first - 1) >> shift) + 1;
    assert_true(buckets <= SPL_SOFT_BUCKETS);
    memset(sums, 0, buckets * sizeof *sums);
    for (size_t i = 0; i < count; i++) {
        uint64_t at = place(spheres[i].depth);
        if (at >= range->first && at < range->end) {
            sums[(at - range->first) >> shift].items++;
            sums[(at - range->first) >> shift].entries += spheres[i].entries;
        }
    }
    return SPL_OK;
}

static void make(size_t n, double near, double far, double radius)
{
    free(spheres);
    spheres = calloc(n + 1, sizeof *spheres);
    assert_non_null(spheres);
    count = n;
    reach = 0;
    for (size_t i = 0; i < n; i++) {
        spheres[i] = (struct sphere){(float)(near + (far - near) * uniform()), (float)(radius * uniform()),
                                     1 + (uint32_t)(4 * uniform())};
        reach = fmaxf(reach, spheres[i].radius);
    }
}

/* Checks all windows; how many they are, 0 where it ends before the last. */
static size_t plan_all(uint32_t items, uint32_t entries, float least)
{
    static struct spl_soft_thick plan;
    plan = (struct spl_soft_thick){.room = {items, entries}, .all = {place(0.1f), place(1000)}, .reach = reach,
                                   .least = least, .measure = measure};
    struct spl_soft_window window;
    float from = 0, until = 0;
    size_t windows = 0;
    measured = 0;
    for (int rc; (rc = spl_soft_thick_next(&plan, &window, NULL)) != 0; windows++) {
        if (rc == SPL_SOFT_TOO_THICK)
            return 0;
        assert_int_equal(rc, 1);
        from = until;
        until = window.until;
        assert_true(until > from + (windows ? least : 0) && from < SPL_SOFT_NO_END);
        struct spl_soft_sum own = {0};
        for (size_t i = 0; i < count; i++) {
            const struct sphere *s = &spheres[i];
            bool held = place(s->depth) >= window.held.first && place(s->depth) < window.held.end;
            bool overlaps = (double)s->depth - (double)s->radius < (double)until &&
                            (double)s->depth + (double)s->radius >= (double)from;
            assert_true(held || !overlaps);
            own.items += held;
            own.entries += held ? s->entries : 0;
        }
        assert_memory_equal(&own, &window.sum, sizeof own);
        assert_true(own.items <= items && own.entries <= entries);
    }
    assert_true(until >= SPL_SOFT_NO_END);
    return windows;
}

static void what_fits_is_one_window(void **state)
{
    (void)state;
    make(0, 1, 2, 1);
    assert_int_equal(plan_all(10, 40, 0), 1);
    make(1000, 0.2, 100, 0.5);
    assert_int_equal(plan_all(1000, 4000, 0), 1);
    assert_int_equal(measured, 1);
    assert_true(plan_all(999, 4000, 0) > 1);
}

static void windows_hold_what_overlaps(void **state)
{
    (void)state;
    static const double radii[] = {1e-6, 0.01, 0.5, 2};
    for (size_t i = 0; i < sizeof radii / sizeof *radii; i++) {
        make(4000, 0.2, 500, radii[i]);
        for (uint32_t room = 100; room < 2000; room *= 3) {
            const double again = 2 * radii[i] / 500 * 4000; /* that the next window holds, too */
            size_t windows = plan_all(room, 4 * room, 0);
            assert_true(windows > 4000 / room);
            if (room > 4 * again) /* at least half full */
                assert_true((double)windows <= 3 + 4000 / (0.4 * room - again));
        }
    }
    make(4000, 0.2, 500, 0.5);
    assert_true(plan_all(4000, 1000, 0) > 10); /* lists are full before items are */
}

static void crowds_are_told(void **state)
{
    (void)state;
    make(5000, 3, 3, 0.25);
    assert_int_equal(plan_all(4999, 1 << 30, 0), 0);
    assert_int_equal(plan_all(5000, 4 * 5000, 0), 1);
    make(5000, 1, 11, 1);
    assert_int_equal(plan_all(900, 1 << 30, 0), 0); /* some thousand overlap */
    assert_true(plan_all(1200, 1 << 30, 0) > 5);
    assert_int_equal(plan_all(1200, 1 << 30, 2), 0); /* not so thick */
    assert_true(plan_all(2600, 1 << 30, 0.1f) > 2);
}

static void failures_are_told(void **state)
{
    (void)state;
    make(4000, 0.2, 500, 0.5);
    for (fails_at = 1; fails_at < 6; fails_at++) {
        struct spl_soft_thick plan = {.room = {50, 200}, .all = {place(0.1f), place(1000)}, .reach = reach,
                                      .measure = measure};
        struct spl_soft_window window;
        int rc;
        measured = 0;
        while ((rc = spl_soft_thick_next(&plan, &window, NULL)) == 1)
            ;
        assert_int_equal(rc, SPL_E_DEVICE_LOST);
    }
    fails_at = 0;
    free(spheres);
    spheres = NULL;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_fits_is_one_window),
        cmocka_unit_test(windows_hold_what_overlaps),
        cmocka_unit_test(crowds_are_told),
        cmocka_unit_test(failures_are_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
