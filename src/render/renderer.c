/* Life of a renderer: device, scratch, residency. See include/splatd/render.h. */
#include <stdlib.h>

#include "base/clock.h"
#include "base/memory.h"
#include "base/sized.h"
#include "render/fault.h"
#include "render/hold.h"
#include "render/renderer.h"
#include "render/slot.h"

enum { preload_ahead = 8 }; // pages that are asked for at once
enum { least_piece = 64 * 64 }; // samples
static const uint64_t patience_ns = 10 * SPL_NS_PER_S, between_looks_ns = SPL_NS_PER_S;

/* Of what a software driver takes 0.3 ns a sample for where it was scanned, and 20 where each thing hides the one
 * before: a second and a half of a core at most. GPUs take a hundredth. */
static const uint64_t software_work = 2 * SPL_BATCH_WORK, gpu_work = SPL_STEP_WORK_MOST;
static const uint64_t step_ns = 100 * SPL_NS_PER_MS;

int spl_renderer_create(const struct spl_renderer_options *given, struct spl_renderer **out, struct spl_error *err)
{
    struct spl_renderer_options known = {0}, *options = &known;
    *out = NULL;
    int rc = spl_sized_read(given, options, sizeof known, "spl_renderer_options", err);
    if (rc)
        return rc;
    struct spl_renderer *renderer = spl_alloc(1, sizeof *renderer, err);
    if (!renderer)
        return SPL_E_NOMEM;
    struct spl_gpu_options gpu = {
        .device = options->device,
        .require_gpu = options->require_gpu,
        .debug = options->debug,
        .memory_limit = options->memory_limit,
        .sharers = options->sharers,
    };
    rc = spl_gpu_open(&gpu, &renderer->gpu, err);
    if (!rc) {
        renderer->shares = !spl_gpu_get_device(renderer->gpu)->software;
        renderer->work_at_once = renderer->shares ? gpu_work : software_work;
        renderer->work_a_step = renderer->work_at_once;
        renderer->step_ns = step_ns;
        renderer->least_piece = least_piece;
        rc = spl_residency_init(&renderer->residency, renderer->gpu, options->wake, options->wake_context, err);
    }
    if (!rc) {
        uint64_t samples = options->scratch_samples ? options->scratch_samples : SPL_TILE_SAMPLES;
        rc = spl_scratch_init(&renderer->scratch, renderer->gpu, samples, options, err);
    }
    if (rc) {
        spl_renderer_destroy(renderer);
        return rc;
    }
    *out = renderer;
    return SPL_OK;
}

void spl_renderer_destroy(struct spl_renderer *renderer)
{
    if (!renderer)
        return;
    if (renderer->gpu) {
        spl_residency_finish(&renderer->residency);
        spl_scratch_finish(&renderer->scratch, renderer->gpu);
        spl_kernels_finish(&renderer->kernels, renderer->gpu);
    }
    spl_draw_list_finish(&renderer->list);
    spl_gpu_close(renderer->gpu);
    free(renderer);
}

const struct spl_device_info *spl_renderer_get_device(const struct spl_renderer *renderer)
{
    return spl_gpu_get_device(renderer->gpu);
}

int spl_renderer_add(struct spl_renderer *renderer, const struct spl_dataset *dataset, struct spl_error *err)
{
    return spl_residency_add(&renderer->residency, dataset, err);
}

void spl_renderer_remove(struct spl_renderer *renderer, const struct spl_dataset *dataset)
{
    spl_residency_remove(&renderer->residency, dataset);
}

int spl_renderer_upload(struct spl_renderer *renderer, struct spl_error *err)
{
    return spl_residency_upload(&renderer->residency, err);
}

bool spl_renderer_wait(struct spl_renderer *renderer, uint64_t deadline_ns)
{
    uint64_t look_ns = spl_now_ns() + between_looks_ns;
    return spl_io_wait(renderer->residency.io, look_ns < deadline_ns ? look_ns : deadline_ns);
}

/* As spl_renderer_preload_page(); `asker` may be NULL. */
static int preload(struct spl_renderer *renderer, const struct spl_dataset *dataset, struct spl_hold *asker,
                   uint32_t *page, bool *more, struct spl_error *err)
{
    struct spl_residency *residency = &renderer->residency;
    struct spl_resident_dataset *resident = spl_residency_get(residency, dataset);
    *more = false;
    if (!resident)
        return spl_fail(err, SPL_E_NOT_FOUND, "the dataset was not added to this renderer");
    int rc = spl_residency_upload(residency, err);
    if (rc)
        return rc;
    spl_residency_begin_walk(residency, asker);
    bool tiled = spl_dataset_get_info(dataset)->tiles;
    const uint32_t own = tiled ? spl_dataset_get_own_pages(dataset) : resident->device_slots;
    uint32_t next = *page;
    for (; next < own && next < *page + preload_ahead; next++) { // tiles' come as views need them
        bool first = next == SPL_FIRST_SLOT;
        struct spl_error why = {0};
        if (!first && (spl_dataset_is_remote(dataset) || !spl_residency_has_room(residency, resident, next)))
            break; // the rest comes as views need it
        rc = spl_residency_ask(residency, resident, next, false, &why);
        const struct spl_scratch_needs none = {.list = &(struct spl_draw_list){0}};
        if (first && rc == SPL_E_LIMIT && spl_scratch_give_back(&renderer->scratch, residency, &none, 0)) {
            why = (struct spl_error){0};
            rc = spl_residency_ask(residency, resident, next, false, &why);
        }
        if (!first && (rc == SPL_E_LIMIT || rc == SPL_E_NOMEM || rc == SPL_SLOT_CROWDED))
            break;
        if (rc < 0)
            return spl_fail(err, rc, "%s", why.message);
        if (rc == SPL_SLOT_READY && next == *page)
            ++*page;
    }
    *more = *page < next;
    return SPL_OK;
}

/* The same, that ends where pages do not come and neither do others. */
static int preload_patiently(struct spl_renderer *renderer, const struct spl_dataset *dataset, struct spl_hold *asker,
                             uint32_t *page, bool *more, struct spl_error *err)
{
    uint32_t before = *page;
    struct spl_io *io = renderer->residency.io;
    int rc = preload(renderer, dataset, asker, page, more, err);
    uint64_t moved_ns = spl_io_get_moved_ns(io, dataset);
    if (rc || !*more || *page != before || !spl_io_count(io) || spl_now_ns() - moved_ns < patience_ns)
        return rc;
    *more = false;
    return spl_fail(err, SPL_E_TIMEOUT, "no page has come for %d s; page %u of the dataset is still to come",
                    (int)(patience_ns / SPL_NS_PER_S), *page);
}

int spl_renderer_preload_page(struct spl_renderer *renderer, const struct spl_dataset *dataset, uint32_t *page,
                              bool *more, struct spl_error *err)
{
    return preload_patiently(renderer, dataset, NULL, page, more, err);
}

int spl_renderer_preload(struct spl_renderer *renderer, const struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_hold asker = {.alone = true};
    bool more = true;
    int rc = SPL_OK;
    for (uint32_t page = 0, before = 0; more && !rc; before = page) {
        rc = preload_patiently(renderer, dataset, &asker, &page, &more, err);
        if (!rc && more && page == before)
            spl_renderer_wait(renderer, SPL_NEVER);
    }
    return rc;
}

void spl_renderer_get_residency(struct spl_renderer *renderer, const struct spl_dataset *dataset,
                                struct spl_residency_info *info)
{
    struct spl_resident_dataset *resident = dataset ? spl_residency_get(&renderer->residency, dataset) : NULL;
    *info = (struct spl_residency_info){
        .bytes = resident ? spl_residency_get_bytes(resident) : 0,
        .limit_bytes = spl_gpu_get_limits(renderer->gpu)->memory_bytes,
        .taken_bytes = spl_gpu_get_memory(renderer->gpu),
        .pages_loaded = renderer->residency.pages_loaded,
        .pages_evicted = renderer->residency.pages_evicted,
        .pages_pending = spl_io_count(renderer->residency.io),
    };
}

uint64_t spl_renderer_get_memory(const struct spl_renderer *renderer)
{
    return spl_gpu_get_memory(renderer->gpu);
}

void spl_renderer_set_work_at_once(struct spl_renderer *renderer, uint64_t work)
{
    renderer->work_at_once = work;
}

void spl_renderer_set_soft_items(struct spl_renderer *renderer, uint32_t items)
{
    renderer->soft_items_most = items;
}

void spl_renderer_set_work_a_step(struct spl_renderer *renderer, uint64_t work)
{
    renderer->work_a_step = work;
    renderer->least_piece = 1;
    renderer->step_ns = 0;
}

void spl_renderer_set_pace(struct spl_renderer *renderer, uint64_t wanted_ns, double work_ns)
{
    renderer->step_ns = wanted_ns;
    for (int method = 0; method < SPL_METHOD_COUNT; method++)
        renderer->work_ns[method] = work_ns;
}

void spl_renderer_set_kernels_more(struct spl_renderer *renderer, size_t more)
{
    renderer->kernels.more = more;
}

void spl_renderer_set_shares(struct spl_renderer *renderer, bool shares)
{
    renderer->shares = shares;
}

const struct spl_dataset *spl_renderer_get_lost_dataset(const struct spl_renderer *renderer)
{
    return renderer->residency.lost_by;
}

void spl_renderer_inject_loss(struct spl_renderer *renderer)
{
    spl_gpu_inject_loss(renderer->gpu, 0);
}

void spl_renderer_inject_loss_after(struct spl_renderer *renderer, uint32_t submits)
{
    spl_gpu_inject_loss(renderer->gpu, submits);
}
