/* What of a dataset is read for frames, in slots: its pages; where it has textures, as many of their codes by page, and
 * one of the dictionary; the maps of its stations; where it does not keep all tables, those by page, which stay on the
 * host. Pure but for reading; any thread. */
#ifndef SPL_RENDER_SLOT_H
#define SPL_RENDER_SLOT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"
#include "dataset/dataset.h"

/* The page that a dataset has no picture without: its root's. */
enum { SPL_FIRST_SLOT = 0 };

uint32_t spl_slot_count(const struct spl_dataset *dataset);

/* How many slots are for the device, the slot of a station's map, and that of a page's tables. */
uint32_t spl_slot_count_resident(const struct spl_dataset *dataset);
uint32_t spl_slot_of_map(const struct spl_dataset *dataset, uint32_t map);
uint32_t spl_slot_of_tables(const struct spl_dataset *dataset, uint32_t page);

/* What the device takes for it, or of tables the host. */
size_t spl_slot_get_bytes(const struct spl_dataset *dataset, uint32_t slot);

/* Fills `out` with as many bytes, held against their checksum where the dataset is. `source` is the dataset, so that
 * this is a spl_io_what.read. SPL_E_IO, SPL_E_CORRUPT. Blocks on disk. */
int spl_slot_read(const void *source, uint32_t slot, void *out, struct spl_error *err);

/* spl_dataset_hold() and spl_dataset_let_go(), for spl_io_what. */
void spl_slot_hold(const void *source);
void spl_slot_let_go(const void *source);
uint32_t spl_slot_get_part(const struct spl_dataset *dataset, uint32_t slot);
/* Is it of a tile, whose leaf stands in for it where reading it fails so? */
static inline bool spl_slot_may_miss(const struct spl_dataset *dataset, uint32_t slot, int code)
{
    return code == SPL_E_CORRUPT && spl_slot_get_part(dataset, slot);
}
uint64_t spl_slot_get_moved_ns(const void *source, uint32_t slot); /* spl_dataset_get_moved_ns() */

#endif
