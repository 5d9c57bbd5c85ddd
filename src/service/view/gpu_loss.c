/* Losses of the device, on the gpu thread.
 *
 * A loss is an event: the renderer is destroyed, every view that waits is answered with "device lost", a new renderer
 * is made from the mapped datasets (gpu_datasets.c). A dataset in whose frames or pages it is lost twice within
 * `aside_window_ns` is put aside, where there are others. More than SPL_GPU_REBUILDS_MAX losses within
 * `rebuild_window_ns` that are not explained by this end the process, for its supervisor to decide.
 *
 * Tests inject losses with the environment variable SPLATD_INJECT_LOSS_AFTER=N[xK]: after every N frames the device is
 * lost, K times in all (1 when left out); of several devices the second for the first time after twice as many, … */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/clock.h"
#include "base/log.h"
#include "render/fault.h"
#include "service/view/gpu.h"

static const uint64_t rebuild_window_ns = 60 * SPL_NS_PER_S, aside_window_ns = 600 * SPL_NS_PER_S;

void spl_gpu_set_state(struct spl_pipeline *pipeline, enum spl_pipeline_state state)
{
    atomic_store(&pipeline->state, (int)state);
    pipeline->options.wake(pipeline->options.wake_context);
}

/* Answers everything that waits. */
static void refuse_waiting(struct gpu *gpu)
{
    for (;;) {
        spl_gpu_take_large(gpu);
        struct spl_job *job = spl_queue_pop(gpu->pipeline->render, 0);
        if (!job)
            job = TAILQ_FIRST(&gpu->turns.jobs);
        if (!job)
            job = gpu->behind;
        if (!job)
            return;
        spl_fail(&job->err, SPL_E_DEVICE_LOST, "the device was lost; it is being reopened");
        spl_gpu_leave(gpu, job);
    }
}

void spl_gpu_give_up(struct gpu *gpu, const struct spl_error *why)
{
    struct spl_pipeline *pipeline = gpu->pipeline;
    pipeline->failure = *why;
    spl_pipeline_close_render(pipeline);
    refuse_waiting(gpu);
    spl_gpu_set_state(pipeline, SPL_PIPELINE_FAILED);
}

/* False when the bound on losses is reached; counts this one. */
static bool may_rebuild(struct gpu *gpu)
{
    uint64_t now = spl_now_ns(), *slot = &gpu->losses_ns[gpu->losses % SPL_GPU_REBUILDS_MAX];
    bool allowed = gpu->losses < SPL_GPU_REBUILDS_MAX || now - *slot > rebuild_window_ns;
    *slot = now;
    gpu->losses++;
    spl_count(gpu->pipeline->options.counters, device_losses);
    return allowed;
}

/* The device was lost for the entry of `replica`, to which the caller has a reference, or which is loading. The second
 * time the dataset is the fault, and its losses do not count against the device. */
static void blame(struct gpu *gpu, struct spl_replica *replica)
{
    uint64_t now = spl_now_ns(), before = replica->lost_ns;
    replica->lost_ns = now;
    if (replica->aside || !before || now - before > aside_window_ns || !spl_gpu_has_others(gpu, replica))
        return;
    struct spl_error why = {0};
    spl_fail(&why, SPL_E_DEVICE_LOST,
             "the device was lost twice within %d minutes while the dataset was drawn or loaded; a changed file is "
             "tried again",
             (int)(aside_window_ns / (60 * SPL_NS_PER_S)));
    gpu->losses = 0;
    if (replica->loading) {
        spl_gpu_refuse(gpu, replica, &why);
        return;
    }
    replica->aside = true;
    replica->err = why;
    spl_catalog_entry_ref(replica->entry);
    spl_pipeline_report_change(gpu->pipeline, replica, SPL_ENTRY_ASIDE);
}

void spl_gpu_blame(struct gpu *gpu, struct spl_replica *drawn)
{
    const struct spl_dataset *dataset = gpu->renderer ? spl_renderer_get_lost_dataset(gpu->renderer) : NULL;
    struct spl_catalog_entry *held = NULL;
    struct spl_replica *replica;
    if (!dataset && drawn)
        blame(gpu, drawn);
    TAILQ_FOREACH(replica, &gpu->replicas, resident)
    if (dataset && replica->entry->dataset == dataset)
        break;
    if (!replica)
        return;
    if (!replica->loading && !(held = spl_catalog_entry_try_ref(replica->entry))) // it is about to go
        return;
    blame(gpu, replica);
    spl_catalog_entry_unref(held);
}

/* Of several, which. */
static void describe(const struct gpu *gpu, char text[32])
{
    const struct spl_pipeline_options *options = &gpu->pipeline->options;
    text[0] = '\0';
    if (options->of > 1)
        snprintf(text, 32, " %u of %u", options->number + 1, options->of);
}

bool spl_gpu_recover(struct gpu *gpu, const struct spl_error *why)
{
    struct spl_error err = *why;
    char which[32];
    describe(gpu, which);
    spl_pipeline_touch(gpu->pipeline);
    spl_gpu_set_state(gpu->pipeline, SPL_PIPELINE_REBUILDING);
    for (;;) {
        spl_log_warn("device%s lost: %s", which, err.message);
        refuse_waiting(gpu);
        spl_gpu_tear_down(gpu);
        if (!may_rebuild(gpu)) {
            struct spl_error last = {0};
            spl_fail(&last, SPL_E_DEVICE_LOST, "the device was lost more than %d times within %d s; last: %.300s",
                     (int)SPL_GPU_REBUILDS_MAX, (int)(rebuild_window_ns / SPL_NS_PER_S), err.message);
            spl_gpu_give_up(gpu, &last);
            return false;
        }
        err = (struct spl_error){0};
        if (!spl_gpu_build(gpu, &err))
            break;
        spl_gpu_blame(gpu, NULL);
    }
    spl_log_info("device%s reopened: %s", which, spl_renderer_get_device(gpu->renderer)->name);
    spl_gpu_set_state(gpu->pipeline, SPL_PIPELINE_READY);
    return true;
}

void spl_gpu_inject(struct gpu *gpu)
{
    if (!gpu->inject_left || gpu->frames < gpu->inject_at)
        return;
    gpu->inject_left--;
    gpu->inject_at = gpu->frames + gpu->inject_every;
    spl_renderer_inject_loss(gpu->renderer);
}

bool spl_gpu_reopen(struct gpu *gpu, const struct spl_error *why)
{
    spl_gpu_blame(gpu, NULL);
    return spl_gpu_recover(gpu, why);
}

void spl_gpu_plan_losses(struct gpu *gpu)
{
    const char *losses = getenv("SPLATD_INJECT_LOSS_AFTER");
    if (losses && sscanf(losses, "%" SCNu64 "x%" SCNu64, &gpu->inject_every, &gpu->inject_left) == 1)
        gpu->inject_left = 1;
    gpu->inject_at = gpu->inject_every * (gpu->pipeline->options.number + 1);
}
