/* What the pipeline's threads share; only pipeline.c, admission.c, gpu_thread.c, encode_thread.c and far_picks.c
 * include it. */
#ifndef SPL_SERVICE_STAGES_H
#define SPL_SERVICE_STAGES_H

#include <pthread.h>

#include "base/queue.h"
#include "service/view/pipeline.h"

enum { ENCODERS_MAX = 16, SPL_FAR_PICKS_MAX = 48 /* inside */, SPL_FAR_PICKS_READ = 8 /* at a time */ };

/* What is inside on one of the ways that are let in by work. */
struct spl_load {
    size_t jobs;
    uint64_t samples, bytes;
};

/* Picks of datasets from servers; far_picks.c. */
struct spl_far_picks {
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    TAILQ_HEAD(, spl_job) waiting;                         // guarded by: mutex, as all but `threads`
    const struct spl_dataset *reading[SPL_FAR_PICKS_READ]; // compared, not looked at; NULL = none
    size_t inside;                                         /* waiting or being read */
    bool closed;
    size_t started;
    pthread_t threads[SPL_FAR_PICKS_READ + 1];
};

struct spl_pipeline {
    struct spl_pipeline_options options;       // read-only
    struct spl_queue *render, *large, *behind; /* to the gpu thread, which waits on the first and is interrupted for the
                                                  others */
    struct spl_queue *encode, *encode_large, *done;
    struct spl_load large_load, behind_load; // owned by: loop
    pthread_t gpu_thread, encode_threads[ENCODERS_MAX], large_thread;
    size_t encode_started;
    struct spl_far_picks far;
    bool gpu_started, large_started, stopped;
    atomic_size_t in_flight; /* jobs inside; bounded, so that `done` always has room */
    _Atomic uint64_t device_bytes, device_limit_bytes, pages_pending, renderer;
    _Atomic uint64_t frames;            /* that were drawn */
    _Atomic uint64_t frame_ns, turn_ns; /* moving means: of a frame, and of a turn, a tile at most */
    _Atomic uint64_t moved_ns;          /* when a thread last began or ended a step of its work */
    atomic_int state;                   /* enum spl_pipeline_state */
    struct spl_error failure;           /* written by the gpu thread before state becomes FAILED */
    atomic_bool ended;                  /* the gpu thread has done its last, and looks at no entry any more */
    uint64_t samples_inside;            // owned by: loop; of all jobs from submit() to take(), but for those behind
    pthread_mutex_t mutex;
    struct spl_device_info device;      // guarded by: mutex
    STAILQ_HEAD(, spl_replica) orders;  // guarded by: mutex; for the gpu thread: LOADING or LEAVING
    STAILQ_HEAD(, spl_replica) changes; // guarded by: mutex; for the loop
};

/* Thread bodies; `argument` is the pipeline. */
void *spl_gpu_thread_run(void *argument);
void *spl_encode_thread_run(void *argument);
void *spl_encode_large_thread_run(void *argument);

/* Fills `encoded` of a rendered job, or sets its error. Reads what a pick is of: from a server it may block for
 * long. */
void spl_encode_job(struct spl_job *job);

/* far_picks.c: finish ends what is inside first. On failure, with the job's error set, the caller keeps the job. */
void spl_far_picks_init(struct spl_far_picks *far);
int spl_far_picks_take(struct spl_pipeline *pipeline, struct spl_job *job);
void spl_far_picks_finish(struct spl_far_picks *far);

/* admission.c: lets the job in on its way to the gpu thread and counts it, until it is let out. Where there is no room,
 * those go first that wait there although nobody waits for them. Loop's thread. */
int spl_pipeline_let_in(struct spl_pipeline *pipeline, struct spl_job *job, struct spl_error *err);
void spl_pipeline_let_out(struct spl_pipeline *pipeline, struct spl_job *job); /* idempotent */

/* Is the image more than is encoded in no time? */
bool spl_pipeline_image_is_large(const struct spl_view *view);

/* Refuses further jobs; those inside can still be popped. */
void spl_pipeline_close_render(struct spl_pipeline *pipeline);

/* Hands a rendered job to the encoders of its kind. Waits for room among the small ones, until its deadline: those
 * never wait for a server. */
int spl_pipeline_pass_on(struct spl_pipeline *pipeline, struct spl_job *job);

/* Hands an entry's replica back to the loop. */
void spl_pipeline_report_change(struct spl_pipeline *pipeline, struct spl_replica *replica, enum spl_entry_state state);

/* Says that work goes on; called at every step that could hang. */
void spl_pipeline_touch(struct spl_pipeline *pipeline);

/* Hands a job back to the loop, with `err` set or `encoded` filled. */
void spl_pipeline_finish_job(struct spl_pipeline *pipeline, struct spl_job *job);

/* The same for one that has not begun; says nothing of whether work goes on. */
void spl_pipeline_hand_back(struct spl_pipeline *pipeline, struct spl_job *job);

/* Sets the error of a job that nobody waits for, or whose deadline has passed; true then. */
bool spl_job_is_over(struct spl_job *job);

#endif
