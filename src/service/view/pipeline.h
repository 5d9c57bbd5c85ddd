/* From a checked view to encoded bytes on one device: its gpu thread and encode threads, tied by bounded queues.
 *
 *     submit → [render queue] → gpu → [encode queue] → encode → [done queue] → take
 *
 * There are three ways to the device. Small views, of one tile, are counted. Large ones are let in by the samples and
 * bytes of those inside, take turns with them tile by tile (turns.h) and have an encode thread of their own, so that
 * they fill nothing that small ones need. Frames of tours stand behind both.
 *
 * A job belongs to whoever holds its pointer: the caller until submit() succeeds, the pipeline until take() gives it
 * back, always with either `encoded` filled or `err` set. Versions of datasets come and go beside them: add() and
 * drop() send their replicas to the gpu thread, take_change() brings them back. Several are a fleet (fleet.h),
 * which may have several draw one view (parts.h). */
#ifndef SPL_SERVICE_PIPELINE_H
#define SPL_SERVICE_PIPELINE_H

#include <stdatomic.h>
#include <sys/queue.h>

#include <splatd/render.h>

#include "base/error.h"
#include "service/datasets/entry.h"
#include "service/ops/counters.h"
#include "service/request/request.h"
#include "service/view/plan.h"

struct spl_job;

/* Of a part of a view that several devices draw, see parts.h. */
struct spl_job_part {
    struct spl_job *whole; // which holds it; NULL: it is none
    unsigned number;       /* of its stretch of the image, below the whole's `of` */
    bool drew_last;        /* it has the whole's frame, or bytes of it */
};

/* Of a whole. Owned by the loop but for the frame, which parts draw into. */
struct spl_job_spread {
    struct spl_spread *frame; // NULL: it is none
    unsigned of, parts;       /* how many draw it; parts that there are */
    unsigned inside;          /* parts in pipelines */
    bool away, given_up;      /* it is with its parts; it was destroyed, and goes with them */
    uint32_t lost;            /* bit per device that a part of it was lost with */
    bool again;               /* a part was made anew */
};

struct spl_job {
    struct spl_catalog_entry *entry;   /* one reference; may be NULL in tests, as may `plan` */
    const struct spl_dataset *dataset; /* of it */
    struct spl_view_request request;   /* with a reference to its rays, if it has some */
    uint64_t accepted_ns;
    _Atomic uint64_t deadline_ns;      /* the loop may raise it at any time */
    struct spl_cancel dropped;         /* set by the loop at any time: nobody waits for it, skip the work */
    bool behind;                       /* a tour's frame: made while nobody's view waits */
    size_t frame_number;               /* of it */
    void *owner;                       // owned by: loop
    void (*done)(struct spl_job *job); /* takes the job when it has come back to the loop; NULL: it is destroyed */
    struct spl_job_part part;
    struct spl_job_spread spread;

    TAILQ_ENTRY(spl_job) turn; // owned by: gpu, as the next three; while it waits for one
    bool in_turns;
    bool waits; /* for pages */
    struct spl_frame_steps *steps; // may be NULL: not begun, or done
    uint64_t samples_left;         /* of the frame, for its turns; more where they take long */
    _Atomic uint32_t awaited;      /* near its deadline: which tile of a collection it waits for; of a whole; 0: none */
    uint64_t paused_ns;            /* when its last tile was done, or its pages had come */
    struct spl_frame frame;        /* between gpu and encode */
    struct spl_frame_stats stats;
    struct spl_encoded encoded;
    bool large; /* the way that it goes; set by submit(), with what it counts for there */
    bool counted;
    uint64_t samples, bytes;
    double queue_ms, encode_ms;     /* queue: what it waited for the device, between its tiles too */
    double pages_ms;                /* what it waited for pages */
    uint64_t renderer;              /* spl_renderer_hash() of what rendered it */
    char device[300];               /* the same in words */
    const char *route;              /* for statistics; static, NULL: none */
    struct spl_plan *plan;          /* of `entry`; NULL: nothing is planned */
    struct spl_choice choice;       /* where request.planned */
    double promised_ms;             /* the same */
    uint64_t began_ns, rendered_ns; /* of the frame, planning included; began_ns moves on by what others took between */
    uint64_t frame_ns;              /* of its tiles */
    uint64_t piece_ns;              /* of the piece in which it gave way */
    struct spl_error err;
};

/* Releases everything and the job itself, of a whole once its last part is destroyed; NULL-safe. The loop's thread. */
void spl_job_destroy(struct spl_job *job);

/* Why a view of the dataset is not there though its deadline of so many ms has passed: with the name of the tile that
 * it waited for, 0: of one that is late, where it does not do without. Both may be NULL. */
void spl_view_fail_late(const struct spl_view *view, const struct spl_dataset *dataset, uint32_t awaited,
                        double deadline_ms, struct spl_error *err);

/* Who says whether it is dropped, and how long it has: the job, or what it is part of. */
static inline struct spl_job *spl_job_get_whole(struct spl_job *job)
{
    return job->part.whole ? job->part.whole : job;
}

struct spl_pipeline_options {
    unsigned number; /* of the device, below SPL_DEVICES_MAX: which replica of an entry is its own */
    unsigned of;     /* how many there are; 0 = 1 */
    struct spl_renderer_options renderer;
    struct spl_catalog_entry *const *entries; /* resident before the state becomes READY; the caller's references */
    size_t entry_count;
    size_t queue, encoders;
    uint64_t samples_max;     /* of large views inside, 0 = four of 256 Mi; a view alone may have more */
    uint64_t frame_bytes_max; /* host memory for the frames of those, 0 = SPL_FRAME_BYTES_MAX; the same */
    uint64_t turn_ns;         /* a tile of a tour's frame may take so long, for views wait meanwhile; 0 = 10 s */
    struct spl_counters *counters;
    void (*wake)(void *context); /* called from any thread: a job is done, or the state changed */
    void *wake_context;
};

enum spl_pipeline_state {
    SPL_PIPELINE_STARTING, /* device and datasets are being loaded */
    SPL_PIPELINE_READY,
    SPL_PIPELINE_REBUILDING, /* the device was lost */
    SPL_PIPELINE_FAILED,     /* for good; see spl_pipeline_get_failure() */
};

#define SPL_FRAME_BYTES_MAX ((uint64_t)1 << 30)
enum { SPL_PIPELINE_BEHIND = 4 }; /* frames of tours that may be inside */

struct spl_pipeline;

/* Does it go the large views' way? A planned one is judged by what its plan may choose. */
bool spl_request_is_large(const struct spl_view_request *request);

/* Starts the threads; the gpu thread makes renderer and residency and reports through `wake`. */
int spl_pipeline_create(const struct spl_pipeline_options *options, struct spl_pipeline **out, struct spl_error *err);

/* Stops taking jobs, finishes those inside, joins the threads, destroys the jobs that were not taken. Idempotent. What
 * of entries is to be taken still can be. */
void spl_pipeline_stop(struct spl_pipeline *pipeline);
void spl_pipeline_destroy(struct spl_pipeline *pipeline); /* stops it first; NULL-safe */

/* Loop thread, as take(); never blocks. SPL_E_BUSY when what waits on the job's way is as much as may; jobs that wait
 * for the device and are over, dropped or past their deadline, do not count then: they are finished with that error. */
int spl_pipeline_submit(struct spl_pipeline *pipeline, struct spl_job *job, struct spl_error *err);

/* A finished job or NULL; never blocks. */
struct spl_job *spl_pipeline_take(struct spl_pipeline *pipeline);

/* The entry's own on this device; NULL of NULL. */
struct spl_replica *spl_pipeline_get_replica(const struct spl_pipeline *pipeline, struct spl_catalog_entry *entry);

/* Makes `entry` resident, page by page between frames; it must stay until take_change() gives back its replica, which
 * then is SPL_ENTRY_RESIDENT, or SPL_ENTRY_REFUSED with an error; later, with a reference of its own, maybe
 * SPL_ENTRY_ASIDE. drop() lets go of one that is resident and that nobody refers to any more: its replica comes back as
 * SPL_ENTRY_GONE. Those of the options are resident without a word, or refused before the pipeline is ready. Any
 * thread. */
void spl_pipeline_add(struct spl_pipeline *pipeline, struct spl_catalog_entry *entry);
void spl_pipeline_drop(struct spl_pipeline *pipeline, struct spl_catalog_entry *entry);

/* A replica whose state has changed, or NULL; never blocks. Loop thread. */
struct spl_replica *spl_pipeline_take_change(struct spl_pipeline *pipeline);

/* The oldest that is to be added or let go of, or NULL: for the gpu thread, and once that has ended for the loop. */
struct spl_replica *spl_pipeline_take_order(struct spl_pipeline *pipeline);

/* Does the device look at no entry any more? So it is after stop(), and soon after it has failed. */
bool spl_pipeline_has_ended(struct spl_pipeline *pipeline);

enum spl_pipeline_state spl_pipeline_get_state(struct spl_pipeline *pipeline);

/* spl_renderer_hash() of what renders at present; 0 before the first. */
uint64_t spl_pipeline_get_renderer(struct spl_pipeline *pipeline);

/* Why it failed; only once the state is SPL_PIPELINE_FAILED. */
const struct spl_error *spl_pipeline_get_failure(struct spl_pipeline *pipeline);

struct spl_pipeline_status {
    struct spl_device_info device; /* of the last renderer that worked; zero before the first */
    uint64_t device_bytes, device_limit_bytes, pages_pending;
    uint64_t samples_inside; /* of views, from submit() to take() */
    size_t behind_length;    /* frames of tours, the same */
    size_t render_length, render_capacity, encode_length, encode_capacity;
    size_t large_length;                                    /* views, from submit() to take() */
    uint64_t large_samples, large_samples_max, large_bytes; /* theirs */
    uint64_t frames;                                        /* that were drawn */
    double frame_ms;                                        /* moving mean */
};
void spl_pipeline_get_status(struct spl_pipeline *pipeline, struct spl_pipeline_status *status);

/* For how long nothing has moved although there is work: a job inside, or a device that is being reopened. 0 when idle.
 * A pulse for health checks. Any thread. */
uint64_t spl_pipeline_get_still_ns(struct spl_pipeline *pipeline);

/* Seconds after which a refused view may be repeated with hope, at least 1. */
unsigned spl_pipeline_get_retry_after(struct spl_pipeline *pipeline, bool large);

#endif
