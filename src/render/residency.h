/* Which pages of which datasets are on the device. Pages are loaded when a view asks for them and evicted, least
 * recently drawn first, when the device's memory limit refuses another. Bookkeeping of the renderer's thread. */
#ifndef SPL_RENDER_RESIDENCY_H
#define SPL_RENDER_RESIDENCY_H

#include <stdbool.h>
#include <stdint.h>

#include "base/error.h"
#include "dataset/dataset.h"
#include "gpu/gpu.h"

struct spl_resident_page {
    struct spl_gpu_buffer *buffer; /* NULL = not resident */
    uint64_t last_frame;           /* when it was last asked for */
};

/* A dataset's slots: its pages; where it has textures, as many of their codes by page, and one of the dictionary. Each
 * comes and goes on its own. */
struct spl_resident_dataset {
    const struct spl_dataset *dataset;  /* borrowed */
    struct spl_resident_page *pages;    /* slot_count of them */
    uint32_t page_count, slot_count;
};

static inline uint32_t spl_textures_slot(const struct spl_resident_dataset *resident, uint32_t page)
{
    return resident->page_count + page;
}

static inline uint32_t spl_dictionary_slot(const struct spl_resident_dataset *resident)
{
    return 2 * resident->page_count;
}

struct spl_residency {
    struct spl_gpu *gpu;
    struct spl_gpu_buffer *staging;     /* hardware only: software draws from mapped memory */
    struct spl_resident_dataset *datasets;
    size_t dataset_count, dataset_capacity;
    uint64_t frame;                     /* pages asked for in this frame are never evicted */
    uint64_t pages_loaded, pages_evicted; /* since init */
};

void spl_residency_init(struct spl_residency *residency, struct spl_gpu *gpu);
void spl_residency_finish(struct spl_residency *residency);

int spl_residency_add(struct spl_residency *residency, const struct spl_dataset *dataset, struct spl_error *err);
void spl_residency_remove(struct spl_residency *residency, const struct spl_dataset *dataset);

/* NULL when `dataset` was not added. Valid until the next add or remove. */
struct spl_resident_dataset *spl_residency_get(struct spl_residency *residency, const struct spl_dataset *dataset);

/* Is slot `page` resident, or does it fit without evicting another? */
bool spl_residency_has_room(const struct spl_residency *residency, const struct spl_resident_dataset *resident,
                            uint32_t page);

/* Bytes of the slots of `resident` that are on the device. */
uint64_t spl_residency_get_bytes(const struct spl_resident_dataset *resident);

/* Starts a frame: what was asked for before may be evicted again. */
void spl_residency_begin_frame(struct spl_residency *residency);

/* A buffer of `bytes` for the renderer itself, evicting pages that this frame has not asked for as the limit demands.
 */
int spl_residency_make_buffer(struct spl_residency *residency, enum spl_gpu_buffer_kind kind, uint64_t bytes,
                              struct spl_gpu_buffer **out, struct spl_error *err);

/* What the largest first page takes, on its way too: without it a dataset has no picture at all. */
uint64_t spl_residency_get_reserve(const struct spl_residency *residency);

/* Makes slot `page` resident for this frame. SPL_E_LIMIT when the memory limit leaves no room even after evictions. */
int spl_residency_ask(struct spl_residency *residency, struct spl_resident_dataset *resident, uint32_t page,
                      struct spl_error *err);

#endif
