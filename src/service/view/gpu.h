/* What a gpu thread has, of which each device has one: turns (gpu_thread.c), the datasets on its device
 * (gpu_datasets.c), losses of that (gpu_loss.c). Only these include it; everything is owned by that thread. */
#ifndef SPL_SERVICE_GPU_H
#define SPL_SERVICE_GPU_H

#include "service/view/stages.h"
#include "service/view/turns.h"

enum { SPL_GPU_REBUILDS_MAX = 3 };

struct gpu {
    struct spl_pipeline *pipeline;
    struct spl_renderer *renderer;            // may be NULL
    uint64_t losses_ns[SPL_GPU_REBUILDS_MAX]; /* times of the latest losses, ring */
    uint64_t losses;
    uint64_t frames, inject_every, inject_left, inject_at;
    struct spl_turns turns;                  /* large views */
    const struct spl_job *drawn;             // whose turn it is; NULL between turns
    struct spl_job *behind;                  // may be NULL: the tour's frame that is being made, or is next
    TAILQ_HEAD(, spl_replica) replicas;      /* of entries that the renderer knows, or will after a rebuild */
    uint64_t pages_loaded, pages_evicted;    /* of this renderer, as published */
    uint64_t working_bytes;                  /* of the device's memory, whatever is drawn */
    bool loading_waits;                      /* for a page to be read */
    bool uploads_left;                       /* pages that have been read and are not on the device yet */
};

/* A renderer with the entries, and their pages on the device. What has no room is refused at start, when nobody has
 * asked for it yet; later its views fail and say why. */
int spl_gpu_build(struct gpu *gpu, struct spl_error *err);
void spl_gpu_tear_down(struct gpu *gpu); /* idempotent; the entries stay */

/* Takes up what the loop wants added and lets go of what nobody refers to any more. Never blocks. */
void spl_gpu_take_orders(struct gpu *gpu);

/* Does the renderer know any that is drawn beside the one of `replica`? */
bool spl_gpu_has_others(const struct gpu *gpu, const struct spl_replica *replica);

/* The one whose pages are to be loaded next, or NULL. */
struct spl_replica *spl_gpu_find_loading(struct gpu *gpu);

/* Takes up those that have come, asks for the next and reports the replica with the last. SPL_E_DEVICE_LOST; everything
 * else is the entry's fault. */
int spl_gpu_load_page(struct gpu *gpu, struct spl_replica *replica, struct spl_error *err);

/* Gives back one that is being loaded, with the reason. */
void spl_gpu_refuse(struct gpu *gpu, struct spl_replica *replica, const struct spl_error *why);

/* Gives back what is still to be loaded when the service stops. */
void spl_gpu_refuse_loading(struct gpu *gpu);

/* Publishes what is on the device; a page that came may have driven out those of any dataset. */
void spl_gpu_publish_residency(struct gpu *gpu);

/* Puts on the device what has been read since, or some of it, and publishes it. SPL_E_DEVICE_LOST. */
int spl_gpu_upload(struct gpu *gpu, struct spl_error *err);

/* Takes over what waits beside small views. */
void spl_gpu_take_large(struct gpu *gpu);

/* Hands a job back that has ended, wherever it waited. */
void spl_gpu_leave(struct gpu *gpu, struct spl_job *job);

void spl_gpu_set_state(struct spl_pipeline *pipeline, enum spl_pipeline_state state);

/* Finds who the device was lost for: the dataset of the page that was on its way to it, whoever's turn it was, else
 * that of the frame, `drawn`, which may be NULL. */
void spl_gpu_blame(struct gpu *gpu, struct spl_replica *drawn);

/* Makes a new renderer after a loss; false when the process had better end. */
bool spl_gpu_recover(struct gpu *gpu, const struct spl_error *why);

/* Both, after a loss in no frame. */
bool spl_gpu_reopen(struct gpu *gpu, const struct spl_error *why);

/* Refuses everything from now on: the service has failed. */
void spl_gpu_give_up(struct gpu *gpu, const struct spl_error *why);

/* The losses that tests want: when, and then one if it is time. */
void spl_gpu_plan_losses(struct gpu *gpu);
void spl_gpu_inject(struct gpu *gpu);

#endif
