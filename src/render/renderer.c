/* Life of a renderer: device, scratch, residency. See include/splatd/render.h. */
#include <stdlib.h>

#include "base/memory.h"
#include "render/renderer.h"

int spl_renderer_create(const struct spl_renderer_options *options, struct spl_renderer **out, struct spl_error *err)
{
    *out = NULL;
    struct spl_renderer *renderer = spl_alloc(1, sizeof *renderer, err);
    if (!renderer)
        return SPL_E_NOMEM;
    struct spl_gpu_options gpu = {
        .device = options->device,
        .require_gpu = options->require_gpu,
        .debug = options->debug,
        .memory_limit = options->memory_limit,
    };
    int rc = spl_gpu_open(&gpu, &renderer->gpu, err);
    if (!rc) {
        spl_residency_init(&renderer->residency, renderer->gpu);
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

int spl_renderer_preload_page(struct spl_renderer *renderer, const struct spl_dataset *dataset, uint32_t page,
                              bool *more, struct spl_error *err)
{
    struct spl_resident_dataset *resident = spl_residency_get(&renderer->residency, dataset);
    *more = false;
    if (!resident)
        return spl_fail(err, SPL_E_NOT_FOUND, "the dataset was not added to this renderer");
    if (page >= resident->slot_count || (page > 0 && !spl_residency_has_room(&renderer->residency, resident, page)))
        return SPL_OK; /* the rest comes as views need it */
    spl_residency_begin_frame(&renderer->residency);
    struct spl_error why = {0};
    int rc = spl_residency_ask(&renderer->residency, resident, page, &why);
    if (page > 0 && (rc == SPL_E_LIMIT || rc == SPL_E_NOMEM))
        return SPL_OK;
    *more = !rc && page + 1 < resident->slot_count;
    return rc ? spl_fail(err, rc, "%s", why.message) : SPL_OK;
}

int spl_renderer_preload(struct spl_renderer *renderer, const struct spl_dataset *dataset, struct spl_error *err)
{
    bool more = true;
    int rc = SPL_OK;
    for (uint32_t page = 0; more && !rc; page++)
        rc = spl_renderer_preload_page(renderer, dataset, page, &more, err);
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
        .pages_evicted = renderer->residency.pages_evicted,
    };
}

uint64_t spl_renderer_get_memory(const struct spl_renderer *renderer)
{
    return spl_gpu_get_memory(renderer->gpu);
}

void spl_renderer_inject_loss(struct spl_renderer *renderer)
{
    spl_gpu_inject_loss(renderer->gpu);
}
