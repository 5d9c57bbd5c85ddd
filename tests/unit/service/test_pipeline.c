/* The pipeline without HTTP, on a fake renderer: every job comes back once, with bytes or a reason. */
#include <stdio.h>

#include "dataset/dataset.h"
#include "dataset/source.h"
#include "pipelines.h"
#include "support/make_dataset.h"

static uint64_t samples_max, frame_bytes_max;

static uint64_t turn_ns; /* of the pipelines that are started */

static struct spl_pipeline *start(size_t queue)
{
    return start_pipeline((struct spl_pipeline_options){.queue = queue,
                                                        .samples_max = samples_max,
                                                        .frame_bytes_max = frame_bytes_max,
                                                        .turn_ns = turn_ns});
}

static struct spl_job *make_job(unsigned deadline_ms)
{
    return make_view("width=8&height=4&format=raw", deadline_ms);
}

/* Samples of what a test has without end beside what comes to its own: 16 tiles. */
enum { large_px = 16 << 22 };

/* A small picture of many samples, SPL_TILE_SAMPLES a tile. */
static struct spl_job *make_large(unsigned tiles)
{
    char query[64];
    snprintf(query, sizeof query, "width=2048&height=%u&supersample=4", 128 * tiles);
    return make_view(query, 600000);
}

static void jobs_come_back_with_bytes(void **state)
{
    (void)state;
    struct spl_pipeline *pipeline = start(8);
    for (int i = 0; i < 8; i++)
        assert_int_equal(spl_pipeline_submit(pipeline, make_job(600000), NULL), 0);
    for (int i = 0; i < 8; i++) {
        struct spl_job *job = take(pipeline);
        assert_int_equal(job->err.code, 0);
        assert_int_equal(job->encoded.length, 8 * 4 * 4);
        spl_job_destroy(job);
    }
    assert_int_equal(counters.frames, 8);
    spl_pipeline_destroy(pipeline);
}

static void large_views_are_let_in_by_their_work(void **state)
{
    (void)state;
    for (int by_bytes = 0; by_bytes < 2; by_bytes++) {
        samples_max = by_bytes ? 0 : 40 << 20;    // of 32 Mi: one
        frame_bytes_max = by_bytes ? 8 << 20 : 0; // less than one of 8 MiB and another
        struct spl_pipeline *pipeline = start(4);
        struct spl_job *refused = make_large(8);
        struct spl_error err = {0};
        struct spl_pipeline_status status;
        hold_frames(true);
        assert_int_equal(spl_pipeline_submit(pipeline, make_large(8), NULL), 0);
        assert_int_equal(spl_pipeline_submit(pipeline, refused, &err), SPL_E_BUSY);
        assert_non_null(strstr(err.message, "large views"));
        for (int i = 0; i < 4; i++)
            assert_int_equal(spl_pipeline_submit(pipeline, make_job(600000), NULL), 0);
        spl_pipeline_get_status(pipeline, &status);
        assert_int_equal(status.large_length, 1);
        assert_int_equal(status.large_samples, 32 << 20);
        hold_frames(false);
        for (int i = 0; i < 5; i++) {
            struct spl_job *job = take(pipeline);
            assert_int_equal(job->err.code, 0);
            spl_job_destroy(job);
        }
        assert_int_equal(spl_pipeline_submit(pipeline, refused, NULL), 0); // there is room again
        spl_job_destroy(take(pipeline));
        spl_pipeline_get_status(pipeline, &status);
        assert_int_equal(status.large_length + status.large_samples + status.large_bytes, 0);
        spl_pipeline_destroy(pipeline);
    }
    samples_max = frame_bytes_max = 0;
}

static void as_many_large_views_as_small_ones_at_most(void **state)
{
    (void)state;
    struct spl_pipeline *pipeline = start(2);
    hold_frames(true);
    struct spl_job *refused = make_large(2);
    for (int i = 0; i < 2; i++)
        assert_int_equal(spl_pipeline_submit(pipeline, make_large(2), NULL), 0);
    assert_int_equal(spl_pipeline_submit(pipeline, refused, NULL), SPL_E_BUSY);
    assert_int_equal(spl_pipeline_submit(pipeline, make_job(600000), NULL), 0);
    spl_job_destroy(refused);
    hold_frames(false);
    spl_pipeline_destroy(pipeline);
    assert_int_equal(counters.frames, 3);
}

static void small_views_go_between_tiles_and_cost_the_large_one_waiting_only(void **state)
{
    (void)state;
    fake_setenv("FAKE_MPX_MS", "10");
    fake_setenv("FAKE_FRAME_MS", "5");
    struct spl_pipeline *pipeline = start(8);
    struct spl_job *large = make_large(16), *larger = make_large(32), *jobs[9];
    uint64_t others_ns = 0;
    hold_frames(true); // the first, until all are there
    assert_int_equal(spl_pipeline_submit(pipeline, jobs[0] = make_job(600000), NULL), 0);
    await_at_least(&fake_frames.drawing, 1);
    assert_int_equal(spl_pipeline_submit(pipeline, larger, NULL), 0);
    assert_int_equal(spl_pipeline_submit(pipeline, large, NULL), 0);
    for (int i = 0; i < 6; i++)
        assert_int_equal(spl_pipeline_submit(pipeline, make_job(60000), NULL), 0);
    hold_frames(false);
    const struct spl_job *first = jobs[0];
    for (int i = 0; i < 9; i++) // as encoders have done with them, side by side
        jobs[i] = take(pipeline);
    for (int i = 0; i < 9; i++) {
        if (jobs[i] == large || jobs[i] == larger)
            continue;
        assert_true(jobs[i]->rendered_ns < large->rendered_ns); // first of all, though they came last
        others_ns += jobs[i] == first ? 0 : jobs[i]->frame_ns;
        spl_job_destroy(jobs[i]);
    }
    assert_true(large->rendered_ns < larger->rendered_ns); // less was left of it
    uint64_t waited_ns = (uint64_t)(large->queue_ms * SPL_NS_PER_MS);
    assert_true(waited_ns >= others_ns);
    assert_true(large->rendered_ns - large->began_ns <= large->rendered_ns - large->accepted_ns - waited_ns + 1000);
    assert_true(large->frame_ns <= large->rendered_ns - large->began_ns);
    assert_int_equal(large->err.code + larger->err.code, 0);
    spl_job_destroy(large);
    spl_job_destroy(larger);
    fake_unsetenv("FAKE_FRAME_MS");
    fake_unsetenv("FAKE_MPX_MS");
    spl_pipeline_destroy(pipeline);
}

static void a_large_view_ends_between_tiles_when_nobody_waits(void **state)
{
    (void)state;
    fake_setenv("FAKE_MPX_MS", "2");
    struct spl_pipeline *pipeline = start(8);
    struct spl_job *left = make_large(64), *late = make_large(64), *job;
    atomic_store(&fake_frames.endless_px, large_px);
    assert_int_equal(spl_pipeline_submit(pipeline, left, NULL), 0);
    assert_int_equal(spl_pipeline_submit(pipeline, late, NULL), 0);
    struct spl_job *small = make_job(60000);
    assert_int_equal(spl_pipeline_submit(pipeline, small, NULL), 0);
    job = take(pipeline); // now one of the others is begun
    assert_ptr_equal(job, small);
    spl_job_destroy(job);
    spl_cancel_set(&left->dropped);
    late->deadline_ns = spl_now_ns(); // the loop may
    for (int i = 0; i < 2; i++) {
        job = take(pipeline);
        assert_int_equal(job->err.code, job == left ? SPL_E_CANCELLED : SPL_E_TIMEOUT);
        assert_null(job->steps);
        spl_job_destroy(job);
    }
    assert_int_equal(counters.frames, 1);
    atomic_store(&fake_frames.endless_px, 0);
    fake_unsetenv("FAKE_MPX_MS");
    spl_pipeline_destroy(pipeline);
}

static void a_loss_between_tiles_ends_the_large_view_too(void **state)
{
    (void)state;
    fake_setenv("FAKE_MPX_MS", "10");
    fake_setenv("SPLATD_INJECT_LOSS_AFTER", "6x1");
    struct spl_pipeline *pipeline = start(8);
    struct spl_job *large = make_large(64), *job;
    atomic_store(&fake_frames.endless_px, large_px);
    assert_int_equal(spl_pipeline_submit(pipeline, large, NULL), 0);
    for (int i = 0; i < 6; i++) { // every fourth turn is the large one's, so it has begun
        assert_int_equal(spl_pipeline_submit(pipeline, make_job(60000), NULL), 0);
        job = take(pipeline);
        assert_int_equal(job->err.code, 0);
        spl_job_destroy(job);
    }
    assert_int_equal(spl_pipeline_submit(pipeline, make_job(60000), NULL), 0); // meets the loss
    for (int i = 0; i < 2; i++) {
        job = take(pipeline);
        assert_int_equal(job->err.code, SPL_E_DEVICE_LOST);
        spl_job_destroy(job);
    }
    while (!counters.device_losses || spl_pipeline_get_state(pipeline) != SPL_PIPELINE_READY)
        usleep(1000);
    fake_unsetenv("SPLATD_INJECT_LOSS_AFTER");
    atomic_store(&fake_frames.endless_px, 0);
    assert_int_equal(spl_pipeline_submit(pipeline, make_large(2), NULL), 0);
    job = take(pipeline);
    assert_int_equal(job->err.code, 0);
    spl_job_destroy(job);
    fake_unsetenv("FAKE_MPX_MS");
    spl_pipeline_destroy(pipeline);
}

static void a_view_ends_within_its_tile_when_nobody_waits(void **state)
{
    (void)state;
    struct spl_pipeline *pipeline = start(8);
    struct spl_job *left = make_job(60000);
    hold_frames(true); // it has no other end
    assert_int_equal(spl_pipeline_submit(pipeline, left, NULL), 0);
    await_at_least(&fake_frames.drawing, 1);
    spl_cancel_set(&left->dropped);
    assert_ptr_equal(take(pipeline), left);
    assert_int_equal(left->err.code, SPL_E_CANCELLED);
    assert_int_equal(counters.frames, 0);
    spl_job_destroy(left);
    hold_frames(false);
    spl_pipeline_destroy(pipeline);
}

/* Of a tour: it has no deadline, but no tile of it keeps views waiting without end. */
static void a_tile_behind_is_given_up(void **state)
{
    (void)state;
    hold_frames(true);
    turn_ns = 30 * SPL_NS_PER_MS;
    struct spl_pipeline *pipeline = start(8);
    struct spl_job *behind = make_job(600000), *view = make_job(200);
    behind->behind = true;
    behind->deadline_ns = SPL_NEVER;
    assert_int_equal(spl_pipeline_submit(pipeline, behind, NULL), 0);
    assert_ptr_equal(take(pipeline), behind);
    assert_int_equal(behind->err.code, SPL_E_TIMEOUT);
    assert_int_equal(spl_pipeline_submit(pipeline, view, NULL), 0); // has all of its time
    assert_ptr_equal(take(pipeline), view);
    assert_true(spl_now_ns() - view->accepted_ns >= 200 * SPL_NS_PER_MS);
    spl_job_destroy(behind);
    spl_job_destroy(view);
    turn_ns = 0;
    hold_frames(false);
    spl_pipeline_destroy(pipeline);
}

/* Of a tour; the next start makes it. */
static void a_frame_behind_does_not_hold_up_the_end(void **state)
{
    (void)state;
    fake_setenv("FAKE_MPX_MS", "2");
    struct spl_pipeline *pipeline = start(8);
    struct spl_job *behind = make_large(64);
    atomic_store(&fake_frames.endless_px, large_px);
    behind->behind = true;
    behind->deadline_ns = SPL_NEVER;
    assert_int_equal(spl_pipeline_submit(pipeline, behind, NULL), 0);
    assert_int_equal(spl_pipeline_submit(pipeline, make_large(2), NULL), 0); // goes first, or between its tiles
    struct spl_job *job = take(pipeline);
    assert_true(job != behind && !job->err.code);
    spl_job_destroy(job);
    spl_pipeline_destroy(pipeline);
    fake_unsetenv("FAKE_MPX_MS");
    atomic_store(&fake_frames.endless_px, 0);
    assert_int_equal(counters.frames, 1);
}

/* With pages that take a while, or never come. */
static void views_that_wait_for_pages_end(void **state)
{
    (void)state;
    fake_setenv("FAKE_PAGES_MS", "300");
    struct spl_pipeline *pipeline = start(8);
    for (int i = 0; i < 3; i++)
        assert_int_equal(spl_pipeline_submit(pipeline, i ? make_job(60000) : make_large(2), NULL), 0);
    spl_pipeline_destroy(pipeline); // they are finished, side by side
    assert_int_equal(counters.frames, 3);

    fake_setenv("FAKE_PAGES_MS", "3600000");
    pipeline = start(8);
    struct spl_job *left = make_job(3600000), *late = make_job(100), *behind = make_job(3600000);
    behind->behind = true;
    assert_int_equal(spl_pipeline_submit(pipeline, left, NULL), 0);
    assert_int_equal(spl_pipeline_submit(pipeline, late, NULL), 0);
    assert_int_equal(spl_pipeline_submit(pipeline, behind, NULL), 0);
    struct spl_job *job = take(pipeline);
    assert_ptr_equal(job, late);
    assert_int_equal(job->err.code, SPL_E_TIMEOUT);
    spl_job_destroy(job);
    spl_cancel_set(&left->dropped);
    job = take(pipeline);
    assert_ptr_equal(job, left);
    assert_int_equal(job->err.code, SPL_E_CANCELLED);
    spl_job_destroy(job);
    fake_unsetenv("FAKE_PAGES_MS");
    job = make_job(600000);
    assert_int_equal(spl_pipeline_submit(pipeline, job, NULL), 0); // the one behind still waits
    assert_ptr_equal(take(pipeline), job);
    assert_int_equal(job->err.code, 0);
    spl_job_destroy(job);
    spl_pipeline_destroy(pipeline);
    assert_int_equal(counters.frames, 1);
}

/* Many pages have been read and no more will wake anybody: they are put on the device one after the other, without
 * rests. */
static void what_was_read_is_uploaded_without_rests(void **state)
{
    (void)state;
    fake_setenv("FAKE_UPLOADS", "1000"); // with a rest each they take minutes
    struct spl_pipeline *pipeline = start(8);
    struct spl_job *job = make_job(60000);
    assert_int_equal(spl_pipeline_submit(pipeline, job, NULL), 0);
    assert_ptr_equal(take(pipeline), job);
    assert_int_equal(job->err.code, 0);
    spl_job_destroy(job);
    spl_pipeline_destroy(pipeline);
    fake_unsetenv("FAKE_UPLOADS");
}

static void a_full_queue_refuses(void **state)
{
    (void)state;
    struct spl_pipeline *pipeline = start(2);
    struct spl_error err = {0};
    int accepted = 0, rc;
    hold_frames(true);
    struct spl_job *job;
    while (!(rc = spl_pipeline_submit(pipeline, job = make_job(600000), &err)))
        accepted++;
    assert_int_equal(rc, SPL_E_BUSY);
    assert_in_range(accepted, 2, 3);
    assert_in_range(spl_pipeline_get_retry_after(pipeline, false), 1, 60);
    spl_job_destroy(job);
    hold_frames(false);
    spl_pipeline_destroy(pipeline); // what was accepted is finished and released
    assert_int_equal(counters.frames, accepted);
}

static void dropped_and_late_jobs_are_not_rendered(void **state)
{
    (void)state;
    struct spl_pipeline *pipeline = start(8);
    struct spl_job *first = make_job(600000), *late = make_job(20), *left = make_job(600000), *job;
    hold_frames(true);
    assert_int_equal(spl_pipeline_submit(pipeline, first, NULL), 0);
    assert_int_equal(spl_pipeline_submit(pipeline, late, NULL), 0);
    assert_int_equal(spl_pipeline_submit(pipeline, left, NULL), 0);
    spl_cancel_set(&left->dropped);
    while (spl_remaining_ns(late->deadline_ns))
        usleep(1000);
    hold_frames(false);
    for (int i = 0; i < 3; i++) {
        job = take(pipeline);
        assert_int_equal(job->err.code, job == late ? SPL_E_TIMEOUT : job == left ? SPL_E_CANCELLED : 0);
        spl_job_destroy(job);
    }
    assert_int_equal(counters.frames, 1);
    spl_pipeline_destroy(pipeline);
}

static void a_lost_device_is_reopened(void **state)
{
    (void)state;
    fake_setenv("SPLATD_INJECT_LOSS_AFTER", "2");
    struct spl_pipeline *pipeline = start(8);
    int lost = 0, drawn = 0;
    for (int i = 0; i < 6; i++) {
        assert_int_equal(spl_pipeline_submit(pipeline, make_job(600000), NULL), 0);
        struct spl_job *job = take(pipeline);
        lost += job->err.code == SPL_E_DEVICE_LOST;
        drawn += job->err.code == 0;
        spl_job_destroy(job);
        /* A job that comes while the device is reopened is refused as well. */
        for (int ms = 0; ms < 60000 && (counters.device_losses < (uint64_t)lost ||
                                        spl_pipeline_get_state(pipeline) != SPL_PIPELINE_READY);
             ms++)
            usleep(1000);
    }
    assert_int_equal(lost, 1);
    assert_int_equal(drawn, 5);
    assert_int_equal(counters.device_losses, 1);
    assert_int_equal(spl_pipeline_get_state(pipeline), SPL_PIPELINE_READY);
    fake_unsetenv("SPLATD_INJECT_LOSS_AFTER");
    spl_pipeline_destroy(pipeline);
}

static void losses_are_bounded(void **state)
{
    (void)state;
    fake_setenv("SPLATD_INJECT_LOSS_AFTER", "1x100");
    struct spl_pipeline *pipeline = start(8);
    for (int i = 0; i < 20; i++) {
        struct spl_job *job = make_job(600000);
        if (spl_pipeline_submit(pipeline, job, NULL)) {
            spl_job_destroy(job);
            break;
        }
        spl_job_destroy(take(pipeline));
    }
    while (spl_pipeline_get_state(pipeline) != SPL_PIPELINE_FAILED)
        usleep(1000);
    assert_int_equal(spl_pipeline_get_failure(pipeline)->code, SPL_E_DEVICE_LOST);
    assert_int_equal(counters.device_losses, 4);
    fake_unsetenv("SPLATD_INJECT_LOSS_AFTER");
    spl_pipeline_destroy(pipeline);
}

static void a_device_that_does_not_open_is_a_failure(void **state)
{
    (void)state;
    fake_setenv("FAKE_OPEN_LIMIT", "0");
    struct spl_pipeline *pipeline = start(8);
    assert_int_equal(spl_pipeline_get_state(pipeline), SPL_PIPELINE_FAILED);
    assert_int_equal(spl_pipeline_get_failure(pipeline)->code, SPL_E_NO_DEVICE);
    struct spl_job *job = make_job(1000);
    assert_int_equal(spl_pipeline_submit(pipeline, job, NULL), SPL_E_BUSY);
    spl_job_destroy(job);
    fake_unsetenv("FAKE_OPEN_LIMIT");
    spl_pipeline_destroy(pipeline);
}

/* A small dataset on a server that stops answering. */
static struct server {
    char *bytes;
    uint64_t size;
    atomic_bool hangs, fails;
    atomic_uint asked;
} server;

static int fetch(void *context, uint64_t offset, void *out, size_t bytes, struct spl_error *err)
{
    struct server *s = context;
    atomic_fetch_add(&s->asked, 1);
    while (atomic_load(&s->hangs))
        usleep(1000);
    if (atomic_load(&s->fails))
        return spl_fail(err, SPL_E_TIMEOUT, "it was given up");
    memcpy(out, s->bytes + offset, bytes);
    return 0;
}

static void expect_or_forget(void *context, uint64_t offset, uint64_t bytes)
{
    (void)context, (void)offset, (void)bytes;
}

static uint64_t get_moved_ns(void *context)
{
    (void)context;
    return 0;
}

static bool has_changed(void *context)
{
    (void)context;
    return false;
}

static struct spl_dataset *open_far(void)
{
    static const struct spl_source_far far = {fetch, expect_or_forget, expect_or_forget, get_moved_ns, has_changed};
    const struct make_splat splats[2] = {{.normal = {1, 0, 0}, .radius = 1, .classification = 6},
                                         {.position = {1, 0, 0}, .normal = {1, 0, 0}, .radius = 1}};
    char path[256] = "";
    struct spl_dataset *dataset = NULL;
    struct spl_dataset_opening how = {.verify = true, .tables_bytes = SPL_TABLES_BYTES};
    make_folder(path);
    strcat(path, "/far.spld");
    make_dataset_file(path, splats, 2, 1);
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    free(server.bytes);
    server = (struct server){.bytes = malloc(1 << 20)};
    server.size = fread(server.bytes, 1, 1 << 20, file);
    fclose(file);
    unlink(path);
    *strrchr(path, '/') = '\0';
    rmdir(path);
    const struct spl_dataset_source source = {.size = server.size, .context = &server, .far = &far, .owned = true};
    assert_int_equal(spl_dataset_open_source_as(&source, "far.spld", &how, &dataset, NULL), 0);
    return dataset;
}

/* Of splat 0, which is what depth 0 has the bits of. */
static struct spl_job *make_pick(const struct spl_dataset *dataset, double x, unsigned deadline_ms)
{
    static const struct spl_camera_defaults defaults = {
        .eye = {10, 0, -100}, .target = {0, 0, -100}, .up = {0, 0, 1}, .fov = 60, .near = 1, .far = 100};
    static const struct spl_camera_limits limits = {.side_px = 8192, .pixels = 64 << 20};
    struct spl_job *job = calloc(1, sizeof *job);
    char query[80];
    snprintf(query, sizeof query, "width=64&height=64&x=%g&y=1", x);
    assert_int_equal(spl_pick_request_from_query(query, strlen(query), &defaults, &limits, &job->request, NULL), 0);
    job->dataset = dataset;
    job->accepted_ns = spl_now_ns();
    job->deadline_ns = job->accepted_ns + deadline_ms * SPL_NS_PER_MS;
    return job;
}

static void picks_of_a_server_that_hangs_hold_up_nobody(void **state)
{
    (void)state;
    enum { picks = 20 /* 16 may be inside */, late = 3 /* of them have no time left when it answers */ };
    struct spl_job *latest[late];
    int refused = 0;
    struct spl_dataset *far = open_far();
    struct spl_pipeline *pipeline = start(32);
    assert_int_equal(spl_pipeline_submit(pipeline, make_pick(far, 1, 10000), NULL), 0);
    struct spl_job *job = take(pipeline);
    assert_int_equal(job->err.code, 0);
    assert_non_null(strstr((const char *)job->encoded.bytes, "\"class\": 6"));
    spl_job_destroy(job);

    atomic_store(&server.hangs, true);
    server.asked = 0;
    for (int i = 0; i < picks; i++) {
        struct spl_job *pick = make_pick(far, i + 1, 600000);
        if (i >= 2 && i < 2 + late)
            latest[i - 2] = pick;
        assert_int_equal(spl_pipeline_submit(pipeline, pick, NULL), 0);
    }
    while (server.asked < 2)
        usleep(500);
    for (int i = 0; i < picks - 16 + 4; i++) { // what is refused, or of other datasets
        if (i < 4)
            assert_int_equal(spl_pipeline_submit(pipeline, make_job(600000), NULL), 0);
        job = take(pipeline);
        assert_true(job->err.code == SPL_E_BUSY || !job->request.picks);
        refused += job->err.code == SPL_E_BUSY;
        spl_job_destroy(job);
    }
    assert_int_equal(refused, picks - 16);
    for (int i = 0; i < late; i++)
        latest[i]->deadline_ns = spl_now_ns(); // the loop may
    for (int i = 0; i < late; i++) {
        job = take(pipeline);
        assert_int_equal(job->err.code, SPL_E_TIMEOUT);
        assert_true(job == latest[0] || job == latest[1] || job == latest[2]);
        spl_job_destroy(job);
    }
    assert_int_equal(server.asked, 2); // at a time
    while (spl_pipeline_get_still_ns(pipeline) >= SPL_NS_PER_S / 2) // which who waits for it says again and again
        usleep(1000);
    atomic_store(&server.fails, true); // which is no answer: nobody keeps that there is no class
    atomic_store(&server.hangs, false);
    for (int i = 0; i < 16 - late; i++) {
        job = take(pipeline);
        assert_int_equal(job->err.code, SPL_E_TIMEOUT);
        assert_non_null(strstr(job->err.message, "far"));
        spl_job_destroy(job);
    }
    atomic_store(&server.hangs, true); // what is inside at the end comes out first
    assert_int_equal(spl_pipeline_submit(pipeline, make_pick(far, 1, 600000), NULL), 0);
    while (server.asked < 17)
        usleep(500);
    atomic_store(&server.hangs, false);
    spl_pipeline_destroy(pipeline);
    spl_dataset_close(far);
    free(server.bytes);
    server.bytes = NULL;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(jobs_come_back_with_bytes),
        cmocka_unit_test(large_views_are_let_in_by_their_work),
        cmocka_unit_test(as_many_large_views_as_small_ones_at_most),
        cmocka_unit_test(small_views_go_between_tiles_and_cost_the_large_one_waiting_only),
        cmocka_unit_test(a_large_view_ends_between_tiles_when_nobody_waits),
        cmocka_unit_test(a_loss_between_tiles_ends_the_large_view_too),
        cmocka_unit_test(a_frame_behind_does_not_hold_up_the_end),
        cmocka_unit_test(views_that_wait_for_pages_end),
        cmocka_unit_test(what_was_read_is_uploaded_without_rests),
        cmocka_unit_test(a_full_queue_refuses),
        cmocka_unit_test(picks_of_a_server_that_hangs_hold_up_nobody),
        cmocka_unit_test(a_view_ends_within_its_tile_when_nobody_waits),
        cmocka_unit_test(a_tile_behind_is_given_up),
        cmocka_unit_test(dropped_and_late_jobs_are_not_rendered),
        cmocka_unit_test(a_lost_device_is_reopened),
        cmocka_unit_test(losses_are_bounded),
        cmocka_unit_test(a_device_that_does_not_open_is_a_failure),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
