/* What the pipeline's threads share; only pipeline.c, gpu_thread.c and encode_thread.c include it. */
#ifndef SPL_SERVICE_STAGES_H
#define SPL_SERVICE_STAGES_H

#include <pthread.h>

#include "base/queue.h"
#include "service/view/pipeline.h"

enum { ENCODERS_MAX = 16 };

struct spl_pipeline {
    struct spl_pipeline_options options; // read-only
    struct spl_queue *render, *encode, *done;
    pthread_t gpu_thread, encode_threads[ENCODERS_MAX];
    size_t encode_started;
    bool gpu_started;
    atomic_size_t in_flight; /* jobs inside; bounded, so that `done` always has room */
    _Atomic uint64_t device_bytes, device_limit_bytes, frame_ns, renderer;
    _Atomic uint64_t moved_ns; /* when a thread last began or ended a step of its work */
    atomic_int state;          /* enum spl_pipeline_state */
    struct spl_error failure;  /* written by the gpu thread before state becomes FAILED */
    pthread_mutex_t mutex;
    pthread_cond_t released;
    size_t frame_bytes;                       // guarded by: mutex; pixels of all frames between gpu and encode
    struct spl_device_info device;            // guarded by: mutex
    STAILQ_HEAD(, spl_catalog_entry) orders;  // guarded by: mutex; for the gpu thread: LOADING or LEAVING
    STAILQ_HEAD(, spl_catalog_entry) changes; // guarded by: mutex; for the loop
};

/* Thread bodies; `argument` is the pipeline. */
void *spl_gpu_thread_run(void *argument);
void *spl_encode_thread_run(void *argument);

/* The oldest entry that the gpu thread is to add or to let go of, or NULL. */
struct spl_catalog_entry *spl_pipeline_take_order(struct spl_pipeline *pipeline);

/* Hands an entry back to the loop. */
void spl_pipeline_report_change(struct spl_pipeline *pipeline, struct spl_catalog_entry *entry,
                                enum spl_entry_state state);

/* Says that work goes on; called at every step that could hang. */
void spl_pipeline_touch(struct spl_pipeline *pipeline);

/* Hands a job back to the loop, with `err` set or `encoded` filled. */
void spl_pipeline_finish_job(struct spl_pipeline *pipeline, struct spl_job *job);

/* Accounts for the job's pixels before they are rendered; waits until the encoders have released enough of others', at
 * most to the job's deadline. A frame larger than the whole budget is let through alone. */
int spl_pipeline_reserve_frame(struct spl_pipeline *pipeline, struct spl_job *job);

/* Sets the error of a job that nobody waits for, or whose deadline has passed; true then. */
bool spl_job_is_over(struct spl_job *job);

#endif
