/* Life of the pipeline and the loop's side of it; the threads are in gpu_thread.c and encode_thread.c.
 *
 * Invariant: in_flight counts the jobs between submit() and take(); it never exceeds the capacity of the done queue,
 * so finishing a job never waits. Closing runs downstream: the render queue first, the encode queue once the gpu
 * thread has gone, so every job inside comes out. */
#include "service/view/pipeline.h"

#include <stdlib.h>

#include "base/clock.h"
#include "base/memory.h"
#include "service/view/stages.h"

void spl_job_destroy(struct spl_job *job)
{
    if (!job)
        return;
    spl_frame_finish(&job->frame);
    spl_encoded_finish(&job->encoded);
    spl_catalog_entry_unref(job->entry);
    free(job);
}

bool spl_job_is_over(struct spl_job *job)
{
    if (atomic_load(&job->dropped))
        spl_fail(&job->err, SPL_E_CANCELLED, "the client has left");
    else if (!spl_remaining_ns(job->deadline_ns))
        spl_fail(&job->err, SPL_E_TIMEOUT, "the deadline of %.0f ms passed before the view was ready",
                 (double)(job->deadline_ns - job->accepted_ns) / SPL_NS_PER_MS);
    return job->err.code != SPL_OK;
}

static size_t frame_bytes(const struct spl_view *view)
{
    size_t pixel = 4 * (size_t)__builtin_popcount(view->layers) + (view->layers & 1u << SPL_LAYER_NORMAL ? 8 : 0);
    return pixel * view->camera.width * view->camera.height;
}

int spl_pipeline_reserve_frame(struct spl_pipeline *pipeline, struct spl_job *job)
{
    size_t bytes = frame_bytes(&job->request.view);
    int rc = 0;
    pthread_mutex_lock(&pipeline->mutex);
    while (!rc && pipeline->frame_bytes && pipeline->frame_bytes + bytes > pipeline->options.frame_bytes_max) {
        struct timespec t = {.tv_sec = (time_t)(job->deadline_ns / SPL_NS_PER_S),
                             .tv_nsec = (long)(job->deadline_ns % SPL_NS_PER_S)};
        if (pthread_cond_timedwait(&pipeline->released, &pipeline->mutex, &t))
            rc = spl_fail(&job->err, SPL_E_TIMEOUT, "the deadline passed while earlier images were being encoded");
    }
    if (!rc)
        pipeline->frame_bytes += job->frame_bytes = bytes;
    pthread_mutex_unlock(&pipeline->mutex);
    return rc;
}

static void release_frame(struct spl_pipeline *pipeline, struct spl_job *job)
{
    spl_frame_finish(&job->frame);
    pthread_mutex_lock(&pipeline->mutex);
    pipeline->frame_bytes -= job->frame_bytes;
    job->frame_bytes = 0;
    pthread_cond_signal(&pipeline->released); // only the gpu thread waits
    pthread_mutex_unlock(&pipeline->mutex);
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

void spl_pipeline_finish_job(struct spl_pipeline *pipeline, struct spl_job *job)
{
    spl_pipeline_touch(pipeline);
    release_frame(pipeline, job);
    bool room = spl_queue_try_push(pipeline->done, job);
    spl_assert(room);
    pipeline->options.wake(pipeline->options.wake_context);
}

static void order(struct spl_pipeline *pipeline, struct spl_catalog_entry *entry, enum spl_entry_state state)
{
    pthread_mutex_lock(&pipeline->mutex);
    entry->state = state;
    STAILQ_INSERT_TAIL(&pipeline->orders, entry, link);
    pthread_mutex_unlock(&pipeline->mutex);
    spl_queue_interrupt(pipeline->render);
}

static void on_released(struct spl_catalog_entry *entry, void *context)
{
    order(context, entry, SPL_ENTRY_LEAVING);
}

void spl_pipeline_add(struct spl_pipeline *pipeline, struct spl_catalog_entry *entry)
{
    entry->release = on_released;
    entry->release_context = pipeline;
    order(pipeline, entry, SPL_ENTRY_LOADING);
}

struct spl_catalog_entry *spl_pipeline_take_order(struct spl_pipeline *pipeline)
{
    pthread_mutex_lock(&pipeline->mutex);
    struct spl_catalog_entry *entry = STAILQ_FIRST(&pipeline->orders);
    if (entry)
        STAILQ_REMOVE_HEAD(&pipeline->orders, link);
    pthread_mutex_unlock(&pipeline->mutex);
    return entry;
}

void spl_pipeline_report_change(struct spl_pipeline *pipeline, struct spl_catalog_entry *entry,
                                enum spl_entry_state state)
{
    pthread_mutex_lock(&pipeline->mutex);
    entry->state = state;
    STAILQ_INSERT_TAIL(&pipeline->changes, entry, link);
    pthread_mutex_unlock(&pipeline->mutex);
    pipeline->options.wake(pipeline->options.wake_context);
}

struct spl_catalog_entry *spl_pipeline_take_change(struct spl_pipeline *pipeline)
{
    pthread_mutex_lock(&pipeline->mutex);
    struct spl_catalog_entry *entry = STAILQ_FIRST(&pipeline->changes);
    if (entry)
        STAILQ_REMOVE_HEAD(&pipeline->changes, link);
    pthread_mutex_unlock(&pipeline->mutex);
    return entry;
}

int spl_pipeline_create(const struct spl_pipeline_options *options, struct spl_pipeline **out, struct spl_error *err)
{
    spl_assert(options->queue && options->encoders && options->encoders <= ENCODERS_MAX);
    struct spl_pipeline *pipeline = spl_alloc(1, sizeof *pipeline, err);
    if (!pipeline)
        return SPL_E_NOMEM;
    pipeline->options = *options;
    if (!options->frame_bytes_max)
        pipeline->options.frame_bytes_max = (size_t)1 << 30;
    STAILQ_INIT(&pipeline->orders);
    STAILQ_INIT(&pipeline->changes);
    pthread_mutex_init(&pipeline->mutex, NULL);
    pthread_condattr_t monotonic;
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&pipeline->released, &monotonic);
    pthread_condattr_destroy(&monotonic);
    int rc;
    if ((rc = spl_queue_create(options->queue, &pipeline->render, err)) ||
        (rc = spl_queue_create(options->encoders, &pipeline->encode, err)) ||
        (rc = spl_queue_create(2 * options->queue + 2 * options->encoders + 2 * SPL_QUEUE_BEHIND + 1, &pipeline->done,
                               err)))
        goto fail;
    for (; pipeline->encode_started < options->encoders; pipeline->encode_started++) {
        pthread_t *thread = &pipeline->encode_threads[pipeline->encode_started];
        if ((rc = pthread_create(thread, NULL, spl_encode_thread_run, pipeline))) {
            rc = spl_fail_errno(err, rc, "cannot start an encode thread");
            goto fail;
        }
    }
    for (size_t i = 0; i < options->entry_count; i++) {
        options->entries[i]->release = on_released;
        options->entries[i]->release_context = pipeline;
    }
    if ((rc = pthread_create(&pipeline->gpu_thread, NULL, spl_gpu_thread_run, pipeline))) {
        rc = spl_fail_errno(err, rc, "cannot start the gpu thread");
        goto fail;
    }
    pipeline->gpu_started = true;
    *out = pipeline;
    return 0;
fail:
    for (size_t i = 0; i < options->entry_count; i++)
        options->entries[i]->release = NULL;
    spl_pipeline_destroy(pipeline);
    return rc;
}

/* Once the gpu thread has gone. The last unref() of one that was on its way adds it to the orders. */
static void destroy_entries(struct spl_pipeline *pipeline)
{
    for (struct spl_catalog_entry *entry;
         (entry = spl_pipeline_take_order(pipeline)) || (entry = spl_pipeline_take_change(pipeline));) {
        if (entry->state == SPL_ENTRY_LEAVING || entry->state == SPL_ENTRY_GONE)
            spl_catalog_entry_destroy(entry);
        else
            spl_catalog_entry_unref(entry);
    }
}

void spl_pipeline_destroy(struct spl_pipeline *pipeline)
{
    if (!pipeline)
        return;
    if (pipeline->render)
        spl_queue_close(pipeline->render);
    if (pipeline->gpu_started)
        pthread_join(pipeline->gpu_thread, NULL);
    if (pipeline->encode)
        spl_queue_close(pipeline->encode);
    for (size_t i = 0; i < pipeline->encode_started; i++)
        pthread_join(pipeline->encode_threads[i], NULL);
    if (pipeline->done)
        for (struct spl_job *job; (job = spl_pipeline_take(pipeline));)
            spl_job_destroy(job);
    destroy_entries(pipeline);
    spl_queue_destroy(pipeline->done);
    spl_queue_destroy(pipeline->encode);
    spl_queue_destroy(pipeline->render);
    pthread_cond_destroy(&pipeline->released);
    pthread_mutex_destroy(&pipeline->mutex);
    free(pipeline);
}

int spl_pipeline_submit(struct spl_pipeline *pipeline, struct spl_job *job, struct spl_error *err)
{
    if (!atomic_load(&pipeline->in_flight))
        spl_pipeline_touch(pipeline); // the end of idleness is no hang
    if (atomic_fetch_add(&pipeline->in_flight, 1) < spl_queue_get_capacity(pipeline->done) &&
        (job->behind ? spl_queue_try_push_behind(pipeline->render, job) : spl_queue_try_push(pipeline->render, job)))
        return 0;
    atomic_fetch_sub(&pipeline->in_flight, 1);
    return spl_fail(err, SPL_E_BUSY, "the queue of %zu views is full; come back later",
                    spl_queue_get_capacity(pipeline->render));
}

struct spl_job *spl_pipeline_take(struct spl_pipeline *pipeline)
{
    struct spl_job *job = spl_queue_pop(pipeline->done, 0);
    if (job)
        atomic_fetch_sub(&pipeline->in_flight, 1);
    return job;
}

enum spl_pipeline_state spl_pipeline_get_state(struct spl_pipeline *pipeline)
{
    return (enum spl_pipeline_state)atomic_load(&pipeline->state);
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
        .render_length = spl_queue_get_length(pipeline->render),
        .render_capacity = spl_queue_get_capacity(pipeline->render),
        .encode_length = spl_queue_get_length(pipeline->encode),
        .encode_capacity = spl_queue_get_capacity(pipeline->encode),
        .frame_ms = (double)atomic_load(&pipeline->frame_ns) / SPL_NS_PER_MS,
    };
    pthread_mutex_lock(&pipeline->mutex);
    status->device = pipeline->device;
    pthread_mutex_unlock(&pipeline->mutex);
}

unsigned spl_pipeline_get_retry_after(struct spl_pipeline *pipeline)
{
    enum { longest_s = 60 };
    uint64_t waiting = spl_queue_get_length(pipeline->render) + 1;
    uint64_t seconds = waiting * atomic_load(&pipeline->frame_ns) / SPL_NS_PER_S + 1;
    return seconds < longest_s ? (unsigned)seconds : longest_s;
}
