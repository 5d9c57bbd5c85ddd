/* The gpu thread of a device: the only one that touches its renderer, for its whole life.
 *
 * It renders a tile at a time, or a piece of one that is much work, and then asks again whose turn it is (turns.h), so
 * a view of many tiles is interrupted by others, ends between two of its tiles when nobody waits for it any more, and
 * finishes with the bytes that it would have had alone. A frame that takes long in the middle of a piece gives way
 * there, where others wait (render/turns.h). Frames of tours have the turns that nobody wants. What comes of a device
 * that is lost is in gpu_loss.c. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "render/spread.h"
#include "render/turns.h"
#include "service/view/gpu.h"

static const uint64_t behind_turn_ns = 10 * SPL_NS_PER_S;
static const uint64_t small_turn_ns = 250 * SPL_NS_PER_MS; // a small view of several pieces has so long at first
static const uint64_t walk_turn_ns = 100 * SPL_NS_PER_MS; // of a piece that gives way in its middle, at least
static const uint64_t slow_ns = 1000;                        // a sample: several times what views take
static const uint64_t look_around_ns = 250 * SPL_NS_PER_MS; // while views wait for pages: somebody may have left

void spl_gpu_take_large(struct gpu *gpu)
{
    for (struct spl_job *job; (job = spl_queue_pop(gpu->pipeline->large, 0));)
        spl_turns_add(&gpu->turns, job);
    if (!gpu->behind)
        gpu->behind = spl_queue_pop(gpu->pipeline->behind, 0);
}

/* The job waits for no further turn. */
static void detach(struct gpu *gpu, struct spl_job *job)
{
    if (job == gpu->behind)
        gpu->behind = NULL;
    else if (job->in_turns)
        spl_turns_remove(&gpu->turns, job);
}

void spl_gpu_leave(struct gpu *gpu, struct spl_job *job)
{
    detach(gpu, job);
    spl_pipeline_finish_job(gpu->pipeline, job);
}

/* Sets the view to what its demand is best met with. A job that lacks the time is refused before it is planned. */
static int plan(struct spl_job *job)
{
    if (!job->plan || !job->request.planned)
        return 0;
    double left_ms = (double)spl_remaining_ns(job->deadline_ns) / SPL_NS_PER_MS;
    return spl_plan_apply(job->plan, &job->request, left_ms, &job->choice, &job->promised_ms, &job->err);
}

/* Nobody waits for it any more; the error says why. */
static bool is_over(const struct gpu *gpu, struct spl_job *job)
{
    if (job->behind && spl_queue_is_closed(gpu->pipeline->render)) // the next start makes it
        return spl_fail(&job->err, SPL_E_CANCELLED, "the service is stopping") != 0;
    return spl_job_is_over(job);
}

/* Would others have a turn if this one ended? */
static bool others_wait(struct gpu *gpu)
{
    const struct spl_job *job;
    if (spl_queue_get_length(gpu->pipeline->render) || spl_queue_get_length(gpu->pipeline->large))
        return true;
    TAILQ_FOREACH(job, &gpu->turns.jobs, turn)
    if (job != gpu->drawn && !(job->waits && spl_frame_is_waiting(job->steps)))
        return true;
    return false;
}

/* What was prepared is prepared again after that: at most half of the time goes there. */
static bool gives_way(void *context, uint64_t walked_ns, uint64_t prepared_ns)
{
    return walked_ns >= walk_turn_ns && walked_ns >= prepared_ns && others_wait(context);
}

static int begin(struct gpu *gpu, struct spl_job *job)
{
    const struct spl_replica *replica = spl_pipeline_get_replica(gpu->pipeline, job->entry);
    if (replica && replica->aside)
        return spl_fail(&job->err, replica->err.code, "%s", replica->err.message);
    spl_gpu_inject(gpu);
    const struct spl_view *view = &job->request.view;
    const struct spl_job_part *part = &job->part;
    int rc = part->whole ? spl_frame_begin_spread(gpu->renderer, job->dataset, view, part->whole->spread.frame,
                                                  part->number, &job->steps, &job->err)
                         : spl_frame_begin(gpu->renderer, job->dataset, view, &job->steps, &job->err);
    if (!rc) {
        spl_frame_set_cancel(job->steps, &spl_job_get_whole(job)->dropped);
        spl_frame_set_gives_way(job->steps, gives_way, gpu);
    }
    return rc;
}

/* What others took, before the first tile and between tiles, was waiting, no part of the frame; what pages took is. */
static void resume(struct spl_job *job)
{
    uint64_t now = spl_now_ns(), waited = now - (job->steps ? job->paused_ns : job->accepted_ns);
    job->queue_ms += (double)waited / SPL_NS_PER_MS;
    job->began_ns = job->steps ? job->began_ns + waited : now;
}

static void follow(_Atomic uint64_t *mean, uint64_t took)
{
    uint64_t old = atomic_load(mean);
    atomic_store(mean, old ? (7 * old + took) / 8 : took);
}

/* After the last tile, or what there was of it for a part: the frame is that of who drew the last piece. */
static void complete(struct gpu *gpu, struct spl_job *job)
{
    struct spl_pipeline *pipeline = gpu->pipeline;
    job->part.drew_last = job->part.whole && spl_frame_drew_last(job->steps);
    spl_frame_end(job->steps, &job->frame);
    job->steps = NULL;
    if (!job->part.whole || job->part.drew_last) {
        gpu->frames++;
        atomic_store(&pipeline->frames, gpu->frames);
        spl_count(pipeline->options.counters, frames);
        follow(&pipeline->frame_ns, job->frame_ns);
    }
    if (job->part.whole || job->frame.stats.pages_loaded)
        spl_gpu_publish_residency(gpu);
    else
        atomic_store(&pipeline->device_bytes, spl_renderer_get_memory(gpu->renderer));
    job->rendered_ns = spl_now_ns();
    job->stats = job->frame.stats;
    const struct spl_device_info *device = spl_renderer_get_device(gpu->renderer);
    job->renderer = atomic_load(&pipeline->renderer);
    snprintf(job->device, sizeof job->device, "%s: %s", device->backend, device->name);
    bool usual = !job->request.picks && !job->request.container;
    bool cut_short = job->request.view.partial && !job->stats.complete;
    // loading is no property of the setting, nor is what a view is the first to need
    const double drawn_ms = (double)job->frame_ns / SPL_NS_PER_MS - job->stats.kernels_ms;
    if (job->plan && usual && !job->stats.pages_loaded && !cut_short)
        spl_plan_learn(job->plan, &job->request, drawn_ms, job->stats.soft_ms);
}

/* Whose samples take much longer than others' counts for as many as have the time: what is forged to be slow goes
 * behind what is large, and what gave way in the middle of a piece behind all that did not, who had less before who had
 * more. */
static uint64_t count_left(const struct spl_job *job)
{
    if (spl_frame_is_paused(job->steps))
        return UINT64_MAX / 2 + job->frame_ns;
    uint64_t left = spl_frame_get_samples_left(job->steps), drawn = job->samples > left ? job->samples - left : 0;
    uint64_t slow = drawn ? job->frame_ns / drawn / slow_ns : 0;
    return slow > 1 ? (left < UINT64_MAX / slow ? left * slow : UINT64_MAX) : left;
}

/* The job waits for its next turn, or for pages first, where it waited before or, if it was small, among the large
 * ones. */
static void put_aside(struct gpu *gpu, struct spl_job *job)
{
    job->waits = spl_frame_is_waiting(job->steps);
    job->paused_ns = spl_now_ns();
    job->samples_left = count_left(job);
    if (!job->behind && !job->in_turns)
        spl_turns_add(&gpu->turns, job);
}

/* Who stands behind others has no deadline, but does not take longer for a piece than a view may. */
static uint64_t get_turn_end(const struct gpu *gpu, struct spl_job *job)
{
    const uint64_t given = gpu->pipeline->options.turn_ns, now = spl_now_ns();
    const uint64_t deadline = spl_job_get_whole(job)->deadline_ns;
    const uint64_t longest = given ? given : behind_turn_ns;
    uint64_t end = now + (job->piece_ns < longest ? longest - job->piece_ns : 0);
    return job->behind && end < deadline ? end : deadline;
}

/* A small view that is in pieces goes on without a turn between, unless it takes long. */
static bool goes_on(const struct spl_job *job, uint64_t since)
{
    return !job->large && !job->behind && !job->in_turns && !spl_frame_is_waiting(job->steps) &&
           !spl_frame_is_paused(job->steps) && spl_now_ns() - since < small_turn_ns;
}

/* Renders a tile of one job, or a piece of it, and passes it on after the last; false when the thread must end. */
static bool serve(struct gpu *gpu, struct spl_job *job)
{
    struct spl_pipeline *pipeline = gpu->pipeline;
    bool more = false;
    spl_pipeline_touch(pipeline);
    if (is_over(gpu, job)) {
        spl_gpu_leave(gpu, job);
        return true;
    }
    resume(job);
    int rc = job->steps ? 0 : plan(job);
    uint64_t clock = spl_now_ns();
    if (!rc && !job->steps)
        rc = begin(gpu, job);
    gpu->drawn = job;
    if (!rc)
        do
            rc = spl_frame_step(job->steps, get_turn_end(gpu, job), &more, &job->err);
        while (!rc && more && goes_on(job, clock));
    uint64_t took = spl_now_ns() - clock;
    gpu->drawn = NULL;
    job->frame_ns += took;
    job->piece_ns = !rc && spl_frame_is_paused(job->steps) ? job->piece_ns + took : 0;
    spl_pipeline_touch(pipeline);
    struct spl_error err = job->err;
    if (rc) {
        struct spl_replica *replica = spl_pipeline_get_replica(pipeline, job->entry);
        bool lost = err.code == SPL_E_DEVICE_LOST && !(replica && replica->aside);
        if (lost)
            spl_gpu_blame(gpu, replica);
        spl_gpu_leave(gpu, job);
        return !lost || spl_gpu_recover(gpu, &err);
    }
    if (!spl_frame_is_waiting(job->steps))
        follow(&pipeline->turn_ns, took);
    if (more) {
        put_aside(gpu, job);
        return true;
    }
    complete(gpu, job);
    detach(gpu, job);
    if ((job->part.whole && !job->part.drew_last) || spl_pipeline_pass_on(pipeline, job))
        spl_pipeline_finish_job(pipeline, job);
    return true;
}

/* Views that nobody waits for give back their memory, and pages on their way, whether it is their turn or not. */
static void drop_over(struct gpu *gpu)
{
    struct spl_job *job, *next;
    for (job = TAILQ_FIRST(&gpu->turns.jobs); job; job = next) {
        next = TAILQ_NEXT(job, turn);
        if (is_over(gpu, job))
            spl_gpu_leave(gpu, job);
    }
    if (gpu->behind && gpu->behind->waits && is_over(gpu, gpu->behind))
        spl_gpu_leave(gpu, gpu->behind);
}

/* Three quarters of its time are over: the rest is for drawing what there is. */
static bool is_near_deadline(const struct spl_job *job)
{
    const struct spl_job *whole = spl_job_get_whole((struct spl_job *)(uintptr_t)job);
    return spl_remaining_ns(whole->deadline_ns) <= (whole->deadline_ns - whole->accepted_ns) / 4;
}

/* Has the job what it waited for, or to do without? */
static void look_after(struct spl_job *job)
{
    if (job->waits && is_near_deadline(job))
        atomic_store(&spl_job_get_whole(job)->awaited, spl_frame_stop_waiting(job->steps));
    if (!job->waits || spl_frame_is_waiting(job->steps))
        return;
    uint64_t now = spl_now_ns();
    job->pages_ms += (double)(now - job->paused_ns) / SPL_NS_PER_MS;
    job->paused_ns = now;
    job->waits = false;
}

/* When there is something to do at the latest if nothing comes: SPL_NEVER where no view waits for pages. */
static uint64_t look_after_all(struct gpu *gpu)
{
    struct spl_job *job;
    uint64_t until = SPL_NEVER, soon = spl_now_ns() + look_around_ns;
    TAILQ_FOREACH(job, &gpu->turns.jobs, turn)
    {
        look_after(job);
        if (job->waits && until > soon)
            until = soon;
        const uint64_t deadline = spl_job_get_whole(job)->deadline_ns;
        if (job->waits && until > deadline)
            until = deadline;
    }
    if (gpu->behind)
        look_after(gpu->behind);
    return gpu->behind && gpu->behind->waits && until > soon ? soon : until;
}

/* Waits for a job, unless there is something else to do. NULL: there is, or somebody or a page has come. */
static struct spl_job *choose(struct gpu *gpu, bool idle)
{
    struct spl_queue *render = gpu->pipeline->render;
    spl_gpu_take_large(gpu);
    drop_over(gpu);
    uint64_t until = look_after_all(gpu);
    struct spl_job *behind = gpu->behind && !gpu->behind->waits ? gpu->behind : NULL;
    struct spl_job *job = spl_turns_next(&gpu->turns, spl_queue_get_length(render) > 0);
    if (!job)
        job = spl_queue_pop(render, idle && !behind ? until : 0);
    return job ? job : behind;
}

/* Do views wait for pages that are inside? Once the queue is closed, it no longer waits with them. */
static bool wait_for_pages(struct gpu *gpu)
{
    if (TAILQ_EMPTY(&gpu->turns.jobs) && !gpu->behind)
        return false;
    spl_renderer_wait(gpu->renderer, spl_now_ns() + look_around_ns);
    return true;
}

static void run(struct gpu *gpu)
{
    for (;;) {
        struct spl_error err = {0};
        spl_gpu_take_orders(gpu);
        if (spl_gpu_upload(gpu, &err) && !spl_gpu_reopen(gpu, &err))
            break;
        struct spl_replica *loading = spl_gpu_find_loading(gpu);
        bool closed = spl_queue_is_closed(gpu->pipeline->render); // asked first: nothing comes by any way from then on
        struct spl_job *job = choose(gpu, (!loading || gpu->loading_waits) && !gpu->uploads_left);
        if (!job && closed) {
            if (!wait_for_pages(gpu))
                break;
            continue;
        }
        if (job && !serve(gpu, job))
            break;
        if (loading && spl_gpu_load_page(gpu, loading, &err) && !spl_gpu_reopen(gpu, &err))
            break;
    }
}

void *spl_gpu_thread_run(void *argument)
{
    struct gpu gpu = {.pipeline = argument};
    const struct spl_pipeline_options *options = &gpu.pipeline->options;
    struct spl_error err = {0};
    spl_gpu_plan_losses(&gpu);
    TAILQ_INIT(&gpu.replicas);
    spl_turns_init(&gpu.turns);
    for (size_t i = 0; i < options->entry_count; i++)
        TAILQ_INSERT_TAIL(&gpu.replicas, spl_pipeline_get_replica(gpu.pipeline, options->entries[i]), resident);
    if (spl_gpu_build(&gpu, &err)) {
        spl_gpu_give_up(&gpu, &err);
    } else {
        spl_gpu_set_state(gpu.pipeline, SPL_PIPELINE_READY);
        run(&gpu);
    }
    spl_gpu_tear_down(&gpu);
    spl_gpu_refuse_loading(&gpu);
    atomic_store(&gpu.pipeline->ended, true);
    options->wake(options->wake_context);
    return NULL;
}
