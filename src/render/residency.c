/* Pages on the device; see residency.h. A software device draws from host-visible memory, so its pages are filled by
 * one read of the file; a GPU's go through a staging buffer. */
#include "render/residency.h"

#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "dataset/dictionary.h"

#define UPLOAD_DEADLINE_NS (10 * SPL_NS_PER_S)

void spl_residency_init(struct spl_residency *residency, struct spl_gpu *gpu)
{
    *residency = (struct spl_residency){.gpu = gpu, .frame = 1};
}

static void drop_page(struct spl_residency *residency, struct spl_resident_page *page)
{
    spl_gpu_buffer_destroy(residency->gpu, page->buffer);
    page->buffer = NULL;
}

static void drop_dataset(struct spl_residency *residency, struct spl_resident_dataset *resident)
{
    for (uint32_t i = 0; i < resident->slot_count; i++)
        drop_page(residency, &resident->pages[i]);
    free(resident->pages);
}

void spl_residency_finish(struct spl_residency *residency)
{
    for (size_t i = 0; i < residency->dataset_count; i++)
        drop_dataset(residency, &residency->datasets[i]);
    if (residency->gpu)
        spl_gpu_buffer_destroy(residency->gpu, residency->staging);
    free(residency->datasets);
    *residency = (struct spl_residency){0};
}

int spl_residency_add(struct spl_residency *residency, const struct spl_dataset *dataset, struct spl_error *err)
{
    if (spl_residency_get(residency, dataset))
        return SPL_OK;
    if (residency->dataset_count == residency->dataset_capacity) {
        size_t capacity = residency->dataset_capacity * 2 + 4;
        void *larger = spl_realloc(residency->datasets, capacity, sizeof *residency->datasets, err);
        if (!larger)
            return SPL_E_NOMEM;
        residency->datasets = larger;
        residency->dataset_capacity = capacity;
    }
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    struct spl_resident_dataset resident = {.dataset = dataset, .page_count = info->pages};
    resident.slot_count = info->atoms ? 2 * info->pages + 1 : info->pages;
    resident.pages = spl_alloc(resident.slot_count, sizeof *resident.pages, err);
    if (!resident.pages)
        return SPL_E_NOMEM;
    residency->datasets[residency->dataset_count++] = resident;
    return SPL_OK;
}

void spl_residency_remove(struct spl_residency *residency, const struct spl_dataset *dataset)
{
    struct spl_resident_dataset *resident = spl_residency_get(residency, dataset);
    if (!resident)
        return;
    drop_dataset(residency, resident);
    *resident = residency->datasets[--residency->dataset_count];
}

struct spl_resident_dataset *spl_residency_get(struct spl_residency *residency, const struct spl_dataset *dataset)
{
    for (size_t i = 0; i < residency->dataset_count; i++)
        if (residency->datasets[i].dataset == dataset)
            return &residency->datasets[i];
    return NULL;
}

void spl_residency_begin_frame(struct spl_residency *residency)
{
    residency->frame++;
}

static bool evict_one(struct spl_residency *residency)
{
    struct spl_resident_page *oldest = NULL;
    for (size_t i = 0; i < residency->dataset_count; i++) {
        struct spl_resident_dataset *resident = &residency->datasets[i];
        for (uint32_t p = 0; p < resident->slot_count; p++) {
            struct spl_resident_page *page = &resident->pages[p];
            if (page->buffer && page->last_frame < residency->frame &&
                (!oldest || page->last_frame < oldest->last_frame))
                oldest = page;
        }
    }
    if (!oldest)
        return false;
    drop_page(residency, oldest);
    residency->pages_evicted++;
    return true;
}

int spl_residency_make_buffer(struct spl_residency *residency, enum spl_gpu_buffer_kind kind, uint64_t bytes,
                              struct spl_gpu_buffer **out, struct spl_error *err)
{
    for (;;) {
        struct spl_error why = {0};
        int rc = spl_gpu_buffer_create(residency->gpu, kind, bytes, out, &why);
        if (!rc)
            return SPL_OK;
        if ((rc != SPL_E_LIMIT && rc != SPL_E_NOMEM) || !evict_one(residency))
            return spl_fail(err, rc, "%s", why.message);
    }
}

/* What the file has of a slot; of a page the device takes a word more, 0: a zero-width field at its very end still
 * loads its word, and a forged mask may use it. */
static size_t bytes_of(const struct spl_resident_dataset *resident, uint32_t slot)
{
    if (slot >= spl_dictionary_slot(resident))
        return spl_dataset_get_info(resident->dataset)->dictionary_bytes;
    if (slot >= resident->page_count)
        return spl_dataset_get_texture_bytes(resident->dataset, slot - resident->page_count);
    return spl_dataset_get_page_bytes(resident->dataset, slot) + 4;
}

static int read_slot(const struct spl_resident_dataset *resident, uint32_t slot, void *out, struct spl_error *err)
{
    if (slot < resident->page_count) {
        memset((char *)out + bytes_of(resident, slot) - 4, 0, 4);
        return spl_dataset_read_page(resident->dataset, slot, out, err);
    }
    if (slot < spl_dictionary_slot(resident))
        return spl_dataset_read_textures(resident->dataset, slot - resident->page_count, out, err);
    spl_dictionary_expand(spl_dataset_get_dictionary(resident->dataset), out);
    return SPL_OK;
}

static int fill_through_staging(struct spl_residency *residency, struct spl_gpu_buffer *target,
                                const struct spl_resident_dataset *resident, uint32_t slot, struct spl_error *err)
{
    size_t bytes = bytes_of(resident, slot);
    if (residency->staging && spl_gpu_buffer_get_bytes(residency->staging) < bytes) {
        spl_gpu_buffer_destroy(residency->gpu, residency->staging);
        residency->staging = NULL;
    }
    int rc = residency->staging ? SPL_OK
                                : spl_residency_make_buffer(residency, SPL_GPU_UPLOAD, bytes, &residency->staging, err);
    if (rc)
        return rc;
    uint64_t ticket;
    if (!(rc = read_slot(resident, slot, spl_gpu_buffer_map(residency->staging), err)))
        rc = spl_gpu_begin(residency->gpu, err);
    if (rc)
        return rc;
    spl_gpu_copy(residency->gpu, residency->staging, 0, target, 0, bytes);
    spl_gpu_barrier(residency->gpu);
    rc = spl_gpu_submit(residency->gpu, &ticket, err);
    return rc ? rc : spl_gpu_wait(residency->gpu, ticket, spl_now_ns() + UPLOAD_DEADLINE_NS, err);
}

bool spl_residency_has_room(const struct spl_residency *residency, const struct spl_resident_dataset *resident,
                            uint32_t page)
{
    bool staged = !spl_gpu_get_device(residency->gpu)->software && !residency->staging;
    uint64_t needed = (bytes_of(resident, page) + 15) / 16 * 16 * (staged ? 2 : 1);
    return resident->pages[page].buffer ||
           spl_gpu_get_memory(residency->gpu) + needed <= spl_gpu_get_limits(residency->gpu)->memory_bytes;
}

uint64_t spl_residency_get_reserve(const struct spl_residency *residency)
{
    uint64_t most = 0;
    for (size_t i = 0; i < residency->dataset_count; i++) {
        uint64_t bytes = (bytes_of(&residency->datasets[i], 0) + 15) / 16 * 16;
        most = bytes > most ? bytes : most;
    }
    return most * (spl_gpu_get_device(residency->gpu)->software ? 1 : 2);
}

uint64_t spl_residency_get_bytes(const struct spl_resident_dataset *resident)
{
    uint64_t bytes = 0;
    for (uint32_t page = 0; page < resident->slot_count; page++)
        bytes += resident->pages[page].buffer ? bytes_of(resident, page) : 0;
    return bytes;
}

int spl_residency_ask(struct spl_residency *residency, struct spl_resident_dataset *resident, uint32_t page,
                      struct spl_error *err)
{
    struct spl_resident_page *slot = &resident->pages[page];
    slot->last_frame = residency->frame;
    if (slot->buffer)
        return SPL_OK;
    bool software = spl_gpu_get_device(residency->gpu)->software;
    int rc = spl_residency_make_buffer(residency, software ? SPL_GPU_UPLOAD : SPL_GPU_DEVICE, bytes_of(resident, page),
                                       &slot->buffer, err);
    if (rc)
        return rc;
    if (software)
        rc = read_slot(resident, page, spl_gpu_buffer_map(slot->buffer), err);
    else
        rc = fill_through_staging(residency, slot->buffer, resident, page, err);
    if (rc)
        drop_page(residency, slot);
    else
        residency->pages_loaded++;
    return rc;
}
