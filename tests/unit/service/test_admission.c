/* Who is let into a full pipeline, on a fake renderer: views that are over make room, once and at once. */
#include "pipelines.h"

/* A large one is a small picture of many samples. */
static struct spl_job *make_job(bool large)
{
    return make_view(large ? "width=2048&height=256&supersample=4" : "width=8&height=4&format=raw", 600000);
}

static size_t get_waiting(struct spl_pipeline *pipeline, size_t *large)
{
    struct spl_pipeline_status status;
    spl_pipeline_get_status(pipeline, &status);
    if (large)
        *large = status.large_length;
    return status.render_length;
}

/* While another view takes long; nobody else does. */
static void check_room(bool large)
{
    hold_frames(true);
    struct spl_pipeline *pipeline = start_pipeline((struct spl_pipeline_options){.queue = 2});
    struct spl_job *drawn = make_job(false), *next[5], *job;
    size_t counted;
    for (int i = 0; i < 5; i++)
        next[i] = make_job(large);
    assert_int_equal(spl_pipeline_submit(pipeline, drawn, NULL), 0);
    await_at_least(&fake_frames.drawing, 1);
    for (int i = 0; i < 3; i++)
        assert_int_equal(spl_pipeline_submit(pipeline, next[i], NULL), i < 2 ? 0 : SPL_E_BUSY);
    assert_null(spl_pipeline_take(pipeline));
    spl_cancel_set(&next[0]->dropped);
    usleep(20000);
    uint64_t still = spl_pipeline_get_still_ns(pipeline);
    assert_int_equal(spl_pipeline_submit(pipeline, next[2], NULL), 0);
    assert_true(spl_pipeline_get_still_ns(pipeline) >= still); // a device that hangs does not seem to move
    assert_int_equal(spl_pipeline_submit(pipeline, next[3], NULL), SPL_E_BUSY);
    next[1]->deadline_ns = spl_now_ns();
    assert_int_equal(spl_pipeline_submit(pipeline, next[3], NULL), 0);
    assert_int_equal(spl_pipeline_submit(pipeline, next[4], NULL), SPL_E_BUSY);
    assert_int_equal(get_waiting(pipeline, &counted), large ? 0 : 2);
    assert_int_equal(counted, large ? 2 : 0);
    for (int i = 0; i < 2; i++) {
        job = spl_pipeline_take(pipeline);
        assert_ptr_equal(job, next[i]);
        assert_int_equal(job->err.code, i ? SPL_E_TIMEOUT : SPL_E_CANCELLED);
        spl_job_destroy(job);
    }
    assert_null(spl_pipeline_take(pipeline));
    get_waiting(pipeline, &counted);
    assert_int_equal(counted, large ? 2 : 0); // let out once
    spl_cancel_set(&drawn->dropped);
    assert_ptr_equal(take(pipeline), drawn);
    assert_int_equal(drawn->err.code, SPL_E_CANCELLED);
    spl_job_destroy(drawn);
    hold_frames(false);
    struct spl_job *last[2] = {take(pipeline), take(pipeline)}; // as their encoders have done with them
    assert_true((last[0] == next[2] && last[1] == next[3]) || (last[0] == next[3] && last[1] == next[2]));
    for (int i = 0; i < 2; i++) {
        assert_int_equal(last[i]->err.code, 0);
        spl_job_destroy(last[i]);
    }
    get_waiting(pipeline, &counted);
    assert_int_equal(counted, 0);
    spl_job_destroy(next[4]);
    spl_pipeline_destroy(pipeline);
    assert_int_equal(counters.frames, 2);
}

static void views_that_are_over_make_room(void **state)
{
    (void)state;
    check_room(false);
}

static void large_views_that_are_over_make_room(void **state)
{
    (void)state;
    check_room(true);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(views_that_are_over_make_room),
        cmocka_unit_test(large_views_that_are_over_make_room),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
