/* Room on the device for slots, and for the renderer itself: the least recently asked for give way.
 *
 * Invariant: nothing gives way for what has no room in the end. So whether a slot has room in a walk follows from what
 * the walk has asked for before it, and what others hold: a walk that is made again, once its slots have come, finds
 * all of them, and refuses what it refused. Only a device that is out of memory below its limit may break this
 * (SPL_E_NOMEM). The renderer's thread. */
#include <inttypes.h>

#include "render/residency.h"
#include "render/slot.h"

static bool is_software(const struct spl_residency *residency)
{
    return spl_gpu_get_device(residency->gpu)->software;
}

/* What the account of device memory takes for a buffer. */
static uint64_t taken(uint64_t bytes)
{
    return (bytes + 15) / 16 * 16;
}

static uint64_t taken_by(const struct spl_gpu_buffer *buffer)
{
    return buffer ? taken(spl_gpu_buffer_get_bytes(buffer)) : 0;
}

static bool evict_one(struct spl_residency *residency, bool evict_held)
{
    struct spl_resident_page *first = NULL;
    const struct spl_resident_dataset *of_first = NULL;
    for (size_t i = 0; i < residency->dataset_count; i++) {
        struct spl_resident_dataset *resident = &residency->datasets[i];
        for (uint32_t p = 0; p < resident->device_slots; p++) {
            struct spl_resident_page *page = &resident->pages[p];
            if (page->buffer && page->last_frame < residency->frame &&
                (evict_held || !spl_resident_is_kept(resident, page)) &&
                (!first || spl_resident_gives_way_before(resident, page, of_first, first))) {
                first = page;
                of_first = resident;
            }
        }
    }
    if (!first)
        return false;
    residency->pages_evicted += first->filled;
    spl_residency_drop_slot(residency, first);
    return true;
}

/* Evicts until so many bytes are free, or nothing: SPL_SLOT_CROWDED where they would be but for what others hold,
 * SPL_E_LIMIT. */
static int make_room(struct spl_residency *residency, bool evict_held, uint64_t bytes, struct spl_error *err)
{
    const uint64_t limit = spl_gpu_get_limits(residency->gpu)->memory_bytes, used = spl_gpu_get_memory(residency->gpu);
    uint64_t gives_way = 0, held = 0;
    if (bytes <= limit - used)
        return SPL_OK;
    for (size_t i = 0; i < residency->dataset_count; i++) {
        const struct spl_resident_dataset *resident = &residency->datasets[i];
        for (uint32_t p = 0; p < resident->device_slots; p++) {
            const struct spl_resident_page *page = &resident->pages[p];
            if (page->last_frame < residency->frame)
                *(evict_held || !spl_resident_is_kept(resident, page) ? &gives_way : &held) += taken_by(page->buffer);
        }
    }
    if (bytes > limit - used + gives_way && bytes <= limit - used + gives_way + held)
        return SPL_SLOT_CROWDED;
    if (bytes > limit - used + gives_way) {
        const uint64_t lacking = bytes - (limit - used + gives_way);
        residency->lacking = residency->lacking && residency->lacking < lacking ? residency->lacking : lacking;
        return spl_fail(err, SPL_E_LIMIT, "%" PRIu64 " bytes have no room: of the memory limit, %" PRIu64 ", %" PRIu64
                        " are taken by what does not give way", bytes, limit, used - gives_way);
    }
    while (bytes > limit - spl_gpu_get_memory(residency->gpu)) {
        bool gone = evict_one(residency, evict_held);
        spl_assert(gone);
    }
    return SPL_OK;
}

/* As make_room(), for a buffer. */
static int make_buffer(struct spl_residency *residency, bool evict_held, enum spl_gpu_buffer_kind kind, uint64_t bytes,
                       struct spl_gpu_buffer **out, struct spl_error *err)
{
    int rc = make_room(residency, evict_held, taken(bytes), err);
    while (!rc) {
        struct spl_error why = {0};
        rc = spl_gpu_buffer_create(residency->gpu, kind, bytes, out, &why);
        if (!rc)
            return SPL_OK;
        if (rc != SPL_E_NOMEM || !evict_one(residency, evict_held))
            return spl_fail(err, rc, "%s", why.message);
        rc = SPL_OK;
    }
    return rc;
}

int spl_residency_make_buffer(struct spl_residency *residency, enum spl_gpu_buffer_kind kind, uint64_t bytes,
                              struct spl_gpu_buffer **out, struct spl_error *err)
{
    return make_buffer(residency, true, kind, bytes, out, err);
}

bool spl_residency_has_room(const struct spl_residency *residency, const struct spl_resident_dataset *resident,
                            uint32_t slot)
{
    bool staged = !is_software(residency) && !residency->staging;
    uint64_t needed = taken(spl_slot_get_bytes(resident->dataset, slot)) * (staged ? 2 : 1);
    return resident->pages[slot].buffer ||
           spl_gpu_get_memory(residency->gpu) + needed <= spl_gpu_get_limits(residency->gpu)->memory_bytes;
}

uint64_t spl_residency_get_reserve(const struct spl_residency *residency)
{
    uint64_t most = 0;
    for (size_t i = 0; i < residency->dataset_count; i++) {
        uint64_t bytes = taken(spl_slot_get_bytes(residency->datasets[i].dataset, SPL_FIRST_SLOT));
        most = bytes > most ? bytes : most;
    }
    return most * (is_software(residency) ? 1 : 2);
}

static int grow_staging(struct spl_residency *residency, bool evict_held, size_t bytes, struct spl_error *err)
{
    if (residency->staging && spl_gpu_buffer_get_bytes(residency->staging) >= bytes)
        return SPL_OK;
    uint64_t had = residency->staging ? spl_gpu_buffer_get_bytes(residency->staging) : 0;
    spl_gpu_buffer_destroy(residency->gpu, residency->staging);
    residency->staging = NULL;
    int rc = make_buffer(residency, evict_held, SPL_GPU_UPLOAD, bytes, &residency->staging, err);
    if (rc && had) /* reads under way count on it */
        spl_gpu_buffer_create(residency->gpu, SPL_GPU_UPLOAD, had, &residency->staging, NULL);
    return rc;
}

int spl_residency_grow_staging(struct spl_residency *residency, size_t bytes, struct spl_error *err)
{
    return grow_staging(residency, true, bytes, err);
}

int spl_residency_take_device_room(struct spl_residency *residency, struct spl_resident_dataset *resident,
                                   uint32_t slot, bool evict_held, struct spl_error *err)
{
    const bool software = is_software(residency);
    const size_t bytes = spl_slot_get_bytes(resident->dataset, slot);
    const uint64_t staging = software ? taken(bytes) : taken_by(residency->staging);
    struct spl_gpu_buffer *buffer = NULL;
    uint64_t needed = taken(bytes) + (taken(bytes) > staging ? taken(bytes) - staging : 0);
    int rc = make_room(residency, evict_held, needed, err);
    if (rc)
        return rc;
    rc = make_buffer(residency, evict_held, software ? SPL_GPU_UPLOAD : SPL_GPU_DEVICE, bytes, &buffer, err);
    if (!rc && !software)
        rc = grow_staging(residency, evict_held, bytes, err);
    if (rc) {
        spl_gpu_buffer_destroy(residency->gpu, buffer);
        return rc;
    }
    resident->pages[slot].buffer = buffer;
    return SPL_OK;
}
