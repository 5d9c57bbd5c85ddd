/* Slots in the file; see slot.h. Of a page the device takes a word more than the file has, 0: a zero-width field at its
 * very end still loads its word, and a forged mask may use it. */
#include "render/slot.h"

#include <string.h>

#include "dataset/dictionary.h"

uint32_t spl_slot_of_map(const struct spl_dataset *dataset, uint32_t map)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    return (info->atoms ? 2 * info->pages + 1 : info->pages) + map;
}

uint32_t spl_slot_count_resident(const struct spl_dataset *dataset)
{
    return spl_slot_of_map(dataset, spl_dataset_get_info(dataset)->maps);
}

uint32_t spl_slot_of_tables(const struct spl_dataset *dataset, uint32_t page)
{
    return spl_slot_count_resident(dataset) + page;
}

uint32_t spl_slot_count(const struct spl_dataset *dataset)
{
    bool by_page = !spl_dataset_keeps_all(dataset);
    return spl_slot_of_tables(dataset, by_page ? spl_dataset_get_info(dataset)->pages : 0);
}

/* Are they a page's tables? They lie behind all others. */
static bool is_tables(const struct spl_dataset *dataset, uint32_t slot)
{
    return slot >= spl_slot_count_resident(dataset);
}

size_t spl_slot_get_bytes(const struct spl_dataset *dataset, uint32_t slot)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    if (is_tables(dataset, slot))
        return spl_dataset_get_tables_bytes(dataset, slot - spl_slot_of_tables(dataset, 0));
    if (slot >= spl_slot_of_map(dataset, 0))
        return spl_dataset_get_map_bytes(dataset, slot - spl_slot_of_map(dataset, 0));
    if (slot >= 2 * info->pages)
        return info->dictionary_bytes;
    if (slot >= info->pages)
        return spl_dataset_get_texture_bytes(dataset, slot - info->pages);
    return spl_dataset_get_page_bytes(dataset, slot) + 4;
}

int spl_slot_read(const void *source, uint32_t slot, void *out, struct spl_error *err)
{
    const struct spl_dataset *dataset = source;
    uint32_t pages = spl_dataset_get_info(dataset)->pages;
    if (is_tables(dataset, slot))
        return spl_dataset_read_tables(dataset, slot - spl_slot_of_tables(dataset, 0), out, err);
    if (slot >= spl_slot_of_map(dataset, 0))
        return spl_dataset_read_map(dataset, slot - spl_slot_of_map(dataset, 0), out, err);
    if (slot < pages) {
        memset((char *)out + spl_slot_get_bytes(dataset, slot) - 4, 0, 4);
        return spl_dataset_read_page(dataset, slot, out, err);
    }
    if (slot < 2 * pages)
        return spl_dataset_read_textures(dataset, slot - pages, out, err);
    spl_dictionary_expand(spl_dataset_get_dictionary(dataset), out);
    return SPL_OK;
}

void spl_slot_hold(const void *source)
{
    spl_dataset_hold(source);
}

void spl_slot_let_go(const void *source)
{
    spl_dataset_let_go(source);
}

uint32_t spl_slot_get_part(const struct spl_dataset *dataset, uint32_t slot)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    if (!info->tiles) // whose slots are pages and their tables alone
        return 0;
    return spl_dataset_get_part(dataset, slot < info->pages ? slot : slot - spl_slot_of_tables(dataset, 0));
}

uint64_t spl_slot_get_moved_ns(const void *source, uint32_t slot)
{
    return spl_dataset_get_moved_ns(source, spl_slot_get_part(source, slot));
}
