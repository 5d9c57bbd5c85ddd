/* What a dataset has to put on the device, in slots: its pages; where it has textures, as many of their codes by page, and
 * one of the dictionary. Pure but for reading; any thread. */
#ifndef SPL_RENDER_SLOT_H
#define SPL_RENDER_SLOT_H

#include <stddef.h>
#include <stdint.h>

#include "base/error.h"
#include "dataset/dataset.h"

/* The page that a dataset has no picture without: its root's. */
enum { SPL_FIRST_SLOT = 0 };

uint32_t spl_slot_count(const struct spl_dataset *dataset);

/* What the device takes for it. */
size_t spl_slot_get_bytes(const struct spl_dataset *dataset, uint32_t slot);

/* Fills `out` with as many bytes, held against their checksum where the dataset is. `source` is the dataset, so that this
 * is a spl_io_what.read. SPL_E_IO, SPL_E_CORRUPT. Blocks on disk. */
int spl_slot_read(const void *source, uint32_t slot, void *out, struct spl_error *err);

/* spl_dataset_hold() and spl_dataset_let_go(), for spl_io_what. */
void spl_slot_hold(const void *source);
void spl_slot_let_go(const void *source);

#endif
