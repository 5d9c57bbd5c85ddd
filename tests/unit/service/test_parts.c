/* A large view that several devices draw together, on fake renderers: who has nothing to do takes part, and whatever
 * becomes of a part, the view comes back once, as one. */
#include "fleets.h"
#include "service/view/parts.h"

/* Eight pieces for two devices. */
static struct spl_job *make_large(unsigned deadline_ms)
{
    return make_view("width=1280&height=1024&format=raw", deadline_ms);
}

static struct spl_job *make_small(void)
{
    return make_view("width=8&height=4&format=raw", 600000);
}

static void submit(struct spl_fleet *fleet, struct spl_job *job)
{
    assert_int_equal(spl_fleet_submit(fleet, job, NULL), 0);
}

/* The code of a job that has come back as it must. */
static int finish(struct spl_fleet *fleet, struct spl_job *job)
{
    assert_ptr_equal(take_job(fleet), job);
    int code = job->err.code;
    if (!code) {
        const struct spl_camera *camera = &job->request.view.camera;
        assert_true(job->encoded.length >= 4ull * camera->width * camera->height);
        assert_true(job->stats.complete && job->rendered_ns && job->renderer && job->device[0]);
    }
    spl_job_destroy(job);
    return code;
}

static struct spl_pipeline_status look(struct spl_fleet *fleet, size_t device)
{
    struct spl_pipeline_status status;
    spl_pipeline_get_status(spl_fleet_get(fleet, device), &status);
    return status;
}

static void assert_idle(struct spl_fleet *fleet)
{
    for (size_t i = 0; i < spl_fleet_get_count(fleet); i++)
        while (look(fleet, i).samples_inside) { // who has nothing left to do is on its way back
            assert_null(spl_fleet_take(fleet));
            usleep(500);
        }
}

static void wait_until_ready(struct spl_fleet *fleet)
{
    for (size_t i = 0; i < spl_fleet_get_count(fleet); i++)
        while (spl_pipeline_get_state(spl_fleet_get(fleet, i)) != SPL_PIPELINE_READY)
            usleep(500);
}

/* At the same time, as one frame that counts once, and each device has half of it inside. */
static void idle_devices_draw_it_together(void **state)
{
    (void)state;
    struct spl_fleet *one = start_fleet("fake:0", 8);
    struct spl_job *job = make_large(600000), *alone;
    submit(one, job);
    alone = take_job(one);
    spl_fleet_destroy(one);
    struct spl_fleet *two = start_fleet("fake:0,fake:1", 8);
    job = make_large(600000);
    hold_frames(true);
    submit(two, job);
    assert_int_equal(look(two, 0).samples_inside, 1280 * 1024 / 2);
    assert_int_equal(look(two, 1).samples_inside, 1280 * 1024 / 2);
    await_at_least(&fake_frames.drawing, 2); // pieces of it, while neither has ended
    hold_frames(false);
    assert_ptr_equal(take_job(two), job);
    assert_int_equal(job->err.code, 0);
    assert_int_equal(job->encoded.length, alone->encoded.length);
    assert_memory_equal(job->encoded.bytes, alone->encoded.bytes, alone->encoded.length);
    assert_int_equal(counters.frames, 1);
    assert_idle(two);
    assert_int_equal(look(two, 0).frames + look(two, 1).frames, 1);
    spl_job_destroy(job);
    spl_job_destroy(alone);
    spl_fleet_destroy(two);
}

/* Small views, those of a plan and tours' frames have one device; so has a large one where no two are idle. */
static void others_have_one_device(void **state)
{
    (void)state;
    fake_setenv("FAKE_FRAME_MS", "300");
    struct spl_fleet *fleet = start_fleet("fake:0,fake:1", 8);
    struct spl_job *jobs[4] = {make_view("width=1280&height=720&format=raw", 600000), make_large(600000),
                               make_large(600000), make_large(600000)};
    jobs[1]->behind = true;
    jobs[2]->request.planned = true;
    for (int i = 0; i < 3; i++) {
        submit(fleet, jobs[i]);
        assert_null(jobs[i]->spread.frame);
        finish(fleet, jobs[i]);
    }
    struct spl_job *small = make_small();
    submit(fleet, small);
    submit(fleet, jobs[3]);
    assert_null(jobs[3]->spread.frame);
    assert_int_equal(look(fleet, 1).samples_inside, 1280 * 1024);
    for (int i = 0; i < 2; i++)
        spl_job_destroy(take_job(fleet));
    spl_fleet_destroy(fleet);
    fake_unsetenv("FAKE_FRAME_MS");
}

/* Before it has drawn anything; and in the middle of a piece, when all others are drawn. */
static void what_a_lost_device_had_others_draw(void **state)
{
    (void)state;
    fake_setenv("SPLATD_INJECT_LOSS_AFTER", "1x1");
    struct spl_fleet *fleet = start_fleet("fake:0,fake:1", 8);
    struct spl_job *job = make_small();
    submit(fleet, job);
    assert_int_equal(finish(fleet, job), 0); // by the first device, which is lost in its next frame
    job = make_large(600000);
    hold_frames(true); // until it has come to its loss
    submit(fleet, job);
    assert_non_null(job->spread.frame);
    await_losses(1);
    hold_frames(false);
    assert_int_equal(finish(fleet, job), 0);
    assert_int_equal(counters.device_losses, 1);
    fake_unsetenv("SPLATD_INJECT_LOSS_AFTER");
    spl_fleet_destroy(fleet);

    fleet = start_fleet("fake:0,fake:1", 8);
    job = make_small();
    submit(fleet, job);
    assert_int_equal(finish(fleet, job), 0);
    job = make_large(600000);
    hold_frames(true);
    atomic_store(&fake_frames.hang, true);
    submit(fleet, job);
    await_at_least(&fake_frames.hanging, 1); // with its first piece
    hold_frames(false);
    while (look(fleet, 0).samples_inside) { // the first has drawn all but what the second hangs in
        assert_null(spl_fleet_take(fleet));
        usleep(1000);
    }
    fake_setenv("FAKE_LOSE_FRAME", "1");
    atomic_store(&fake_frames.hang, false);
    await_losses(1);
    fake_unsetenv("FAKE_LOSE_FRAME");
    assert_int_equal(finish(fleet, job), 0);
    assert_int_equal(counters.device_losses, 1);
    spl_fleet_destroy(fleet);
}

/* Then it is refused, as any view in whose frame a device is lost; the fleet goes on. */
static void all_may_be_lost(void **state)
{
    (void)state;
    struct spl_fleet *fleet = start_fleet("fake:0,fake:1", 8);
    fake_setenv("FAKE_LOSE_FRAME", "1");
    struct spl_job *job = make_large(600000);
    submit(fleet, job);
    assert_int_equal(finish(fleet, job), SPL_E_DEVICE_LOST);
    await_losses(2);
    fake_unsetenv("FAKE_LOSE_FRAME");
    assert_idle(fleet);
    wait_until_ready(fleet);
    job = make_large(600000);
    submit(fleet, job);
    assert_int_equal(finish(fleet, job), 0);
    spl_fleet_destroy(fleet);
}

/* At once, though parts are inside still; these end, too, and whoever comes next has the devices. */
static void its_deadline_is_that_of_its_parts(void **state)
{
    (void)state;
    hold_frames(true);
    struct spl_fleet *fleet = start_fleet("fake:0,fake:1", 8);
    struct spl_job *job = make_large(150);
    submit(fleet, job);
    job->deadline_ns += 150 * SPL_NS_PER_MS; // the loop may
    assert_int_equal(finish(fleet, job), SPL_E_TIMEOUT);
    assert_idle(fleet);
    hold_frames(false);
    job = make_large(600000);
    submit(fleet, job);
    assert_int_equal(finish(fleet, job), 0);
    spl_fleet_destroy(fleet);
}

static void who_leaves_ends_all_parts(void **state)
{
    (void)state;
    hold_frames(true); // it has no other end
    struct spl_fleet *fleet = start_fleet("fake:0,fake:1,fake:2", 9);
    struct spl_job *job = make_large(60000);
    submit(fleet, job);
    await_at_least(&fake_frames.drawing, 3);
    spl_cancel_set(&job->dropped);
    assert_int_equal(finish(fleet, job), SPL_E_CANCELLED);
    assert_idle(fleet);
    hold_frames(false);
    spl_fleet_destroy(fleet);
}

/* Leak checkers see what is left. */
static void a_fleet_ends_with_parts_inside(void **state)
{
    (void)state;
    fake_setenv("FAKE_FRAME_MS", "30");
    for (int taken = 0; taken < 3; taken++) {
        struct spl_fleet *fleet = start_fleet("fake:0,fake:1", 8);
        for (int i = 0; i < 3; i++)
            submit(fleet, make_large(600000));
        for (int i = 0; i < taken; i++)
            spl_job_destroy(take_job(fleet));
        spl_fleet_destroy(fleet);
    }
    fake_unsetenv("FAKE_FRAME_MS");
}

/* What parts count for is let out with them, and a full queue refuses the view, not half of it. */
static void many_come_and_go(void **state)
{
    (void)state;
    fake_setenv("SPLATD_INJECT_LOSS_AFTER", "5x3");
    struct spl_fleet *fleet = start_fleet("fake:0,fake:1,fake:2", 6);
    int inside = 0, good = 0;
    for (int i = 0; i < 200 || good <= 20 || inside; i++) { /* how many find room is a matter of the machine */
        struct spl_job *job = i % 3 ? make_large(600000) : make_small();
        const bool more = i < 200 || good <= 20;
        if (!more || spl_fleet_submit(fleet, job, NULL))
            spl_job_destroy(job);
        else
            inside++;
        if (i % 7 < 4 && more)
            continue;
        for (usleep(3000); (job = spl_fleet_take(fleet)); inside--) {
            assert_true(!job->err.code || job->err.code == SPL_E_DEVICE_LOST);
            good += !job->err.code;
            spl_job_destroy(job);
        }
    }
    assert_idle(fleet);
    assert_int_equal(counters.frames, good);
    for (size_t i = 0; i < 3; i++)
        assert_int_equal(look(fleet, i).large_length, 0);
    fake_unsetenv("SPLATD_INJECT_LOSS_AFTER");
    spl_fleet_destroy(fleet);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(idle_devices_draw_it_together),      cmocka_unit_test(others_have_one_device),
        cmocka_unit_test(what_a_lost_device_had_others_draw), cmocka_unit_test(all_may_be_lost),
        cmocka_unit_test(its_deadline_is_that_of_its_parts),  cmocka_unit_test(who_leaves_ends_all_parts),
        cmocka_unit_test(a_fleet_ends_with_parts_inside),     cmocka_unit_test(many_come_and_go),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
