/* Life of the pipeline and the loop's side of it; the threads are in gpu_thread.c and encode_thread.c.
 *
 * Invariant: in_flight counts the jobs between submit() and take(); it never exceeds the capacity of the done queue,
 * so finishing a job never waits. Closing runs downstream: the render queue first, the encode queue once the gpu
 * thread has gone, so every job inside comes out. */
#include "service/view/pipeline.h"

#include <stdlib.h>

#include "base/clock.h"
#include "base/memory.h"
#include "dataset/dataset.h"
#include "geom/ray_list.h"
#include "render/spread.h"
#include "service/view/stages.h"

void spl_job_destroy(struct spl_job *job)
{
    if (!job)
        return;
    if (job->spread.parts) {
        job->spread.given_up = true;
        spl_cancel_set(&job->dropped);
        return;
    }
    struct spl_job *whole = job->part.whole;
    spl_spread_destroy(job->spread.frame);
    spl_frame_finish(&job->frame);
    spl_encoded_finish(&job->encoded);
    spl_catalog_entry_unref(job->entry);
    spl_rays_destroy((struct spl_rays *)job->request.view.rays);
    free(job);
    if (whole && !--whole->spread.parts && (whole->spread.given_up || whole->spread.away))
        spl_job_destroy(whole);
}

void spl_view_fail_late(const struct spl_view *view, const struct spl_dataset *dataset, uint32_t awaited,
                        double deadline_ms, struct spl_error *err)
{
    char why[sizeof err->message] = "";
    const bool whole = view && dataset && !view->partial && !view->without_late_tiles;
    const bool told = whole && spl_dataset_tell_late(dataset, awaited, why, sizeof why);
    spl_fail(err, SPL_E_TIMEOUT, "the deadline of %.0f ms passed before the view was ready%s%s", deadline_ms,
             told ? ": " : "", why);
}

bool spl_job_is_over(struct spl_job *job)
{
    struct spl_job *whole = spl_job_get_whole(job);
    if (spl_cancel_is_set(&whole->dropped))
        spl_fail(&job->err, SPL_E_CANCELLED, "the client has left");
    else if (!spl_remaining_ns(whole->deadline_ns))
        spl_view_fail_late(&job->request.view, job->dataset, atomic_load(&whole->awaited),
                           (double)(whole->deadline_ns - job->accepted_ns) / SPL_NS_PER_MS, &job->err);
    return job->err.code != SPL_OK;
}

void spl_pipeline_touch(struct spl_pipeline *pipeline)
{
    atomic_store(&pipeline->moved_ns, spl_now_ns());
}

uint64_t spl_pipeline_get_still_ns(struct spl_pipeline *pipeline)
{
    uint64_t moved = atomic_load(&pipeline->moved_ns), now = spl_now_ns();
    bool busy = atomic_load(&pipeline->in_flight) || spl_pipeline_get_state(pipeline) == SPL_PIPELINE_REBUILDING;
    return busy && now > moved ? now - moved : 0;
}

int spl_pipeline_pass_on(struct spl_pipeline *pipeline, struct spl_job *job)
{
    if (job->request.picks && job->dataset && spl_dataset_is_remote(job->dataset))
        return spl_far_picks_take(pipeline, job);
    if (!spl_pipeline_image_is_large(&job->request.view))
        return spl_queue_push(pipeline->encode, job, spl_job_get_whole(job)->deadline_ns, &job->err);
    bool room = spl_queue_try_push(pipeline->encode_large, job);
    spl_assert(room); // for all jobs that can be inside; it is closed after the gpu thread has gone
    return 0;
}

void spl_pipeline_finish_job(struct spl_pipeline *pipeline, struct spl_job *job)
{
    spl_pipeline_touch(pipeline);
    spl_frame_end(job->steps, NULL);
    job->steps = NULL;
    spl_frame_finish(&job->frame);
    spl_pipeline_hand_back(pipeline, job);
}

void spl_pipeline_hand_back(struct spl_pipeline *pipeline, struct spl_job *job)
{
    bool room = spl_queue_try_push(pipeline->done, job);
    spl_assert(room);
    pipeline->options.wake(pipeline->options.wake_context);
}

struct spl_replica *spl_pipeline_get_replica(const struct spl_pipeline *pipeline, struct spl_catalog_entry *entry)
{
    return entry ? &entry->replicas[pipeline->options.number] : NULL;
}

static void order(struct spl_pipeline *pipeline, struct spl_catalog_entry *entry, enum spl_entry_state state)
{
    struct spl_replica *replica = spl_pipeline_get_replica(pipeline, entry);
    pthread_mutex_lock(&pipeline->mutex);
    replica->state = state;
    STAILQ_INSERT_TAIL(&pipeline->orders, replica, link);
    pthread_mutex_unlock(&pipeline->mutex);
    spl_queue_interrupt(pipeline->render);
}

void spl_pipeline_add(struct spl_pipeline *pipeline, struct spl_catalog_entry *entry)
{
    order(pipeline, entry, SPL_ENTRY_LOADING);
}

void spl_pipeline_drop(struct spl_pipeline *pipeline, struct spl_catalog_entry *entry)
{
    order(pipeline, entry, SPL_ENTRY_LEAVING);
}

struct spl_replica *spl_pipeline_take_order(struct spl_pipeline *pipeline)
{
    pthread_mutex_lock(&pipeline->mutex);
    struct spl_replica *replica = STAILQ_FIRST(&pipeline->orders);
    if (replica)
        STAILQ_REMOVE_HEAD(&pipeline->orders, link);
    pthread_mutex_unlock(&pipeline->mutex);
    return replica;
}

void spl_pipeline_report_change(struct spl_pipeline *pipeline, struct spl_replica *replica, enum spl_entry_state state)
{
    pthread_mutex_lock(&pipeline->mutex);
    replica->state = state;
    STAILQ_INSERT_TAIL(&pipeline->changes, replica, link);
    pthread_mutex_unlock(&pipeline->mutex);
    pipeline->options.wake(pipeline->options.wake_context);
}

struct spl_replica *spl_pipeline_take_change(struct spl_pipeline *pipeline)
{
    pthread_mutex_lock(&pipeline->mutex);
    struct spl_replica *replica = STAILQ_FIRST(&pipeline->changes);
    if (replica)
        STAILQ_REMOVE_HEAD(&pipeline->changes, link);
    pthread_mutex_unlock(&pipeline->mutex);
    return replica;
}

/* The queue to the large encoder has room for every job that can be inside, as `done` has, so nothing waits for it. */
static int create_queues(struct spl_pipeline *pipeline, struct spl_error *err)
{
    size_t queue = pipeline->options.queue, encoders = pipeline->options.encoders;
    size_t inside = 3 * queue + 2 * encoders + 2 * SPL_PIPELINE_BEHIND + SPL_FAR_PICKS_MAX + 1;
    const struct {
        struct spl_queue **queue;
        size_t capacity;
    } table[] = {
        {&pipeline->render, queue},    {&pipeline->large, queue},         {&pipeline->behind, SPL_PIPELINE_BEHIND},
        {&pipeline->encode, encoders}, {&pipeline->encode_large, inside}, {&pipeline->done, inside}};
    int rc = 0;
    for (size_t i = 0; !rc && i < sizeof table / sizeof *table; i++)
        rc = spl_queue_create(table[i].capacity, table[i].queue, err);
    return rc;
}

static int start_encoders(struct spl_pipeline *pipeline, struct spl_error *err)
{
    int rc = pthread_create(&pipeline->large_thread, NULL, spl_encode_large_thread_run, pipeline);
    pipeline->large_started = !rc;
    for (; !rc && pipeline->encode_started < pipeline->options.encoders; pipeline->encode_started += !rc)
        rc = pthread_create(&pipeline->encode_threads[pipeline->encode_started], NULL, spl_encode_thread_run, pipeline);
    return rc ? spl_fail_errno(err, rc, "cannot start an encode thread") : 0;
}

int spl_pipeline_create(const struct spl_pipeline_options *options, struct spl_pipeline **out, struct spl_error *err)
{
    spl_assert(options->queue && options->encoders && options->encoders <= ENCODERS_MAX);
    struct spl_pipeline *pipeline = spl_alloc(1, sizeof *pipeline, err);
    if (!pipeline)
        return SPL_E_NOMEM;
    pipeline->options = *options;
    if (!options->frame_bytes_max)
        pipeline->options.frame_bytes_max = SPL_FRAME_BYTES_MAX;
    if (!options->samples_max)
        pipeline->options.samples_max = (uint64_t)1 << 30;
    STAILQ_INIT(&pipeline->orders);
    STAILQ_INIT(&pipeline->changes);
    pthread_mutex_init(&pipeline->mutex, NULL);
    spl_far_picks_init(&pipeline->far);
    int rc = create_queues(pipeline, err);
    if (!rc)
        rc = start_encoders(pipeline, err);
    if (rc)
        goto fail;
    if ((rc = pthread_create(&pipeline->gpu_thread, NULL, spl_gpu_thread_run, pipeline))) {
        rc = spl_fail_errno(err, rc, "cannot start the gpu thread");
        goto fail;
    }
    pipeline->gpu_started = true;
    *out = pipeline;
    return 0;
fail:
    spl_pipeline_destroy(pipeline);
    return rc;
}

static void close_queue(struct spl_queue *queue)
{
    if (queue)
        spl_queue_close(queue);
}

void spl_pipeline_close_render(struct spl_pipeline *pipeline)
{
    close_queue(pipeline->large);
    close_queue(pipeline->behind);
    close_queue(pipeline->render); // last: the gpu thread ends when it finds it closed and empty
}

void spl_pipeline_stop(struct spl_pipeline *pipeline)
{
    if (pipeline->stopped)
        return;
    pipeline->stopped = true;
    spl_pipeline_close_render(pipeline);
    if (pipeline->gpu_started)
        pthread_join(pipeline->gpu_thread, NULL);
    close_queue(pipeline->encode);
    close_queue(pipeline->encode_large);
    for (size_t i = 0; i < pipeline->encode_started; i++)
        pthread_join(pipeline->encode_threads[i], NULL);
    if (pipeline->large_started)
        pthread_join(pipeline->large_thread, NULL);
    spl_far_picks_finish(&pipeline->far);
    if (pipeline->done)
        for (struct spl_job *job; (job = spl_pipeline_take(pipeline));)
            spl_job_destroy(job);
}

void spl_pipeline_destroy(struct spl_pipeline *pipeline)
{
    if (!pipeline)
        return;
    spl_pipeline_stop(pipeline);
    spl_queue_destroy(pipeline->done);
    spl_queue_destroy(pipeline->encode_large);
    spl_queue_destroy(pipeline->encode);
    spl_queue_destroy(pipeline->behind);
    spl_queue_destroy(pipeline->large);
    spl_queue_destroy(pipeline->render);
    pthread_mutex_destroy(&pipeline->mutex);
    free(pipeline);
}

int spl_pipeline_submit(struct spl_pipeline *pipeline, struct spl_job *job, struct spl_error *err)
{
    if (!atomic_load(&pipeline->in_flight))
        spl_pipeline_touch(pipeline); // the end of idleness is no hang
    int rc = SPL_E_BUSY;
    if (atomic_fetch_add(&pipeline->in_flight, 1) < spl_queue_get_capacity(pipeline->done))
        rc = spl_pipeline_let_in(pipeline, job, err);
    else
        spl_fail(err, rc, "%zu views are on their way; come back later", spl_queue_get_capacity(pipeline->done));
    if (rc)
        atomic_fetch_sub(&pipeline->in_flight, 1);
    else if (!job->behind)
        pipeline->samples_inside += job->samples; // which nobody changes
    return rc;
}

struct spl_job *spl_pipeline_take(struct spl_pipeline *pipeline)
{
    struct spl_job *job = spl_queue_pop(pipeline->done, 0);
    if (job) {
        atomic_fetch_sub(&pipeline->in_flight, 1);
        pipeline->samples_inside -= job->behind ? 0 : job->samples;
        spl_pipeline_let_out(pipeline, job);
    }
    return job;
}

enum spl_pipeline_state spl_pipeline_get_state(struct spl_pipeline *pipeline)
{
    return (enum spl_pipeline_state)atomic_load(&pipeline->state);
}

bool spl_pipeline_has_ended(struct spl_pipeline *pipeline)
{
    return pipeline->stopped || atomic_load(&pipeline->ended);
}

uint64_t spl_pipeline_get_renderer(struct spl_pipeline *pipeline)
{
    return atomic_load(&pipeline->renderer);
}

const struct spl_error *spl_pipeline_get_failure(struct spl_pipeline *pipeline)
{
    spl_assert(spl_pipeline_get_state(pipeline) == SPL_PIPELINE_FAILED);
    return &pipeline->failure;
}

void spl_pipeline_get_status(struct spl_pipeline *pipeline, struct spl_pipeline_status *status)
{
    *status = (struct spl_pipeline_status){
        .device_bytes = atomic_load(&pipeline->device_bytes),
        .device_limit_bytes = atomic_load(&pipeline->device_limit_bytes),
        .pages_pending = atomic_load(&pipeline->pages_pending),
        .samples_inside = pipeline->samples_inside,
        .behind_length = pipeline->behind_load.jobs,
        .render_length = spl_queue_get_length(pipeline->render),
        .render_capacity = spl_queue_get_capacity(pipeline->render),
        .encode_length = spl_queue_get_length(pipeline->encode),
        .encode_capacity = spl_queue_get_capacity(pipeline->encode),
        .large_length = pipeline->large_load.jobs,
        .large_samples = pipeline->large_load.samples,
        .large_samples_max = pipeline->options.samples_max,
        .large_bytes = pipeline->large_load.bytes,
        .frames = atomic_load(&pipeline->frames),
        .frame_ms = (double)atomic_load(&pipeline->frame_ns) / SPL_NS_PER_MS,
    };
    pthread_mutex_lock(&pipeline->mutex);
    status->device = pipeline->device;
    pthread_mutex_unlock(&pipeline->mutex);
}
