/* Room on the host for tables that a dataset does not keep: counted in before their read begins, the least recently
 * asked for out, within what the dataset's tables may take; what it keeps itself is of it; none for what has no room in
 * the end, as device_room.c has it. What a walk has asked for stays until the next one begins, so that it may look at
 * it. The renderer's thread. */
#include "render/residency.h"
#include "render/slot.h"

/* There is one. Its bytes. */
static uint64_t evict_one(struct spl_residency *residency, struct spl_resident_dataset *resident, bool evict_held)
{
    struct spl_resident_page *first = NULL;
    for (uint32_t s = resident->device_slots; s < resident->slot_count; s++) {
        struct spl_resident_page *page = &resident->pages[s];
        if (page->host_bytes && page->last_frame < residency->frame &&
            (evict_held || !spl_resident_is_kept(resident, page)) &&
            (!first || spl_resident_gives_way_before(resident, page, resident, first)))
            first = page;
    }
    spl_assert(first);
    uint64_t bytes = first->host_bytes;
    spl_residency_drop_slot(residency, first);
    return bytes;
}

int spl_residency_take_host_room(struct spl_residency *residency, struct spl_resident_dataset *resident, uint32_t slot,
                                 bool evict_held, struct spl_error *err)
{
    const uint64_t limit = spl_dataset_get_tables_limit(resident->dataset);
    const size_t bytes = spl_slot_get_bytes(resident->dataset, slot);
    uint64_t used = spl_dataset_get_tables_bytes(resident->dataset, 0), gives_way = 0, held = 0;
    for (uint32_t s = resident->device_slots; s < resident->slot_count; s++) {
        const struct spl_resident_page *page = &resident->pages[s];
        used += page->host_bytes;
        if (page->last_frame < residency->frame)
            *(evict_held || !spl_resident_is_kept(resident, page) ? &gives_way : &held) += page->host_bytes;
    }
    if (used - gives_way + bytes > limit && used - gives_way - held + bytes <= limit)
        return SPL_SLOT_CROWDED;
    if (used - gives_way + bytes > limit)
        return spl_fail(err, SPL_E_LIMIT, "the tables of %s take more than %llu MiB",
                        spl_dataset_get_info(resident->dataset)->id, (unsigned long long)(limit >> 20));
    while (used + bytes > limit)
        used -= evict_one(residency, resident, evict_held);
    resident->pages[slot].host_bytes = bytes;
    return SPL_OK;
}
