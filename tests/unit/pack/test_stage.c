/* What is said to be left: from the plan at first, from measured speed once something is done. A clock of the test's
 * own is put into the stage, so that no machine is too slow. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <math.h>

#include <cmocka.h>

#include "base/clock.h"
#include "pack/stage.h"

/* The part at work began at 1000 s; those before it took `before`. */
static void set_clock(struct spl_stage *stage, double before)
{
    stage->part_begin_ns = 1000 * SPL_NS_PER_S;
    stage->seconds_done = before;
}

static double left(const struct spl_stage *stage, double seconds)
{
    return spl_stage_left_s(stage, 1000 * SPL_NS_PER_S + (uint64_t)(seconds * 1e9));
}

static void plan(struct spl_stage *stage)
{
    *stage = (struct spl_stage){.threads = 1};
    assert_true(spl_stage_left_s(stage, 1) == 0); /* nothing planned: unknown */
    spl_stage_plan(stage, "reading", 10, 100);
    spl_stage_plan(stage, "training", 20, 0);
    spl_stage_plan(stage, "coding", 30, 0);
}

static void test_the_plan_is_what_is_left_at_first(void **state)
{
    (void)state;
    struct spl_stage stage;
    plan(&stage);
    assert_true(fabs(left(&stage, 0) - 60) < 1e-9);
    spl_stage_begin(&stage, "reading a.ply", "points", 50);
    set_clock(&stage, 0);
    assert_true(fabs(left(&stage, 0) - 60) < 1e-9);
    spl_stage_plan(&stage, "coding", 300, 0); /* a part that is known better */
    assert_true(fabs(left(&stage, 0) - 330) < 1e-9);
}

static void test_speed_corrects_the_plan(void **state)
{
    (void)state;
    for (int slow = 1; slow <= 8; slow *= 2) {
        struct spl_stage stage;
        plan(&stage);
        spl_stage_begin(&stage, "reading a.ply", "points", 50);
        spl_stage_add(&stage, 50, 1);
        spl_stage_begin(&stage, "reading b.ply", "points", 50); /* the same part goes on */
        spl_stage_add(&stage, 25, 1);
        set_clock(&stage, 0);
        double truth = 52.5 * slow, said = left(&stage, 7.5 * slow);
        assert_true(said > 0.85 * truth && said < 1.01 * truth);
        spl_stage_begin(&stage, "training", NULL, 100);
        set_clock(&stage, 10 * slow);
        truth = 50 * slow;
        assert_true(left(&stage, 0) > 0.9 * truth && left(&stage, 0) < 1.01 * truth);
        double before = INFINITY;
        for (int i = 1; i <= 100; i++) { /* it takes three times what was planned: said more and more */
            atomic_store(&stage.done, (uint64_t)i);
            double now = left(&stage, 0.6 * slow * i);
            assert_true(now > 0 && now < 300 * slow);
            before = now;
        }
        assert_true(before > 30 * slow * 0.9); /* what is left is coding, on a machine that seems slower */
    }
}

static void note(void *context, const struct spl_progress *progress)
{
    *(struct spl_progress *)context = *progress;
}

/* 1000 times slower than planned: the plan's guess, which still counts, is less than the stage itself takes. */
static void test_a_stage_does_not_outlast_the_whole(void **state)
{
    (void)state;
    struct spl_progress said = {0};
    struct spl_stage stage = {.threads = 1, .callback = note, .context = &said};
    spl_stage_plan(&stage, "photographs", 1e-3, 0);
    spl_stage_begin(&stage, "photographs", NULL, 1000);
    uint64_t before = 100 * SPL_NS_PER_S;
    stage.begin_ns -= before; /* as if it had gone on for that long; the plan's part has only begun */
    stage.reported_ns = 0;
    spl_stage_add(&stage, 10, 0);
    assert_int_equal(said.done, 10);
    assert_true(said.rate > 0 && said.left_s >= 990 / said.rate * (1 - 1e-9));
}

static void test_stages_out_of_plan(void **state)
{
    (void)state;
    struct spl_stage stage;
    plan(&stage);
    spl_stage_begin(&stage, "coding", "points", 0); /* training was not needed; this one does not count */
    set_clock(&stage, 0);
    assert_true(fabs(left(&stage, 0) - 30) < 1e-9 && fabs(left(&stage, 12) - 18) < 1e-9);
    assert_true(left(&stage, 1e6) == 0);
    spl_stage_begin(&stage, "writing", NULL, 0);
    assert_int_equal(stage.part, 2);
    for (int i = 0; i < 2 * SPL_STAGE_PARTS_MAX; i++) {
        static char names[2 * SPL_STAGE_PARTS_MAX][4];
        names[i][0] = (char)('A' + i);
        spl_stage_plan(&stage, names[i], 1, 0);
    }
    assert_int_equal(stage.part_count, SPL_STAGE_PARTS_MAX);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_plan_is_what_is_left_at_first),
        cmocka_unit_test(test_speed_corrects_the_plan),
        cmocka_unit_test(test_a_stage_does_not_outlast_the_whole),
        cmocka_unit_test(test_stages_out_of_plan),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
