/* Packed files taken into memory, to be changed there and written back: for what opening must refuse. Anything that
 * goes wrong ends the test program. */
#ifndef TEST_SUPPORT_SPOIL_H
#define TEST_SUPPORT_SPOIL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "dataset/format.h"

struct spoil {
    uint8_t *bytes; // the caller's to free
    size_t size;
    struct spl_file_header *header;
    struct spl_section *table;
};

struct spoil spoil_load(const char *path);

/* The first section of a type, and its bytes. */
struct spl_section *spoil_find(const struct spoil *file, uint32_t type);
void *spoil_at(const struct spoil *file, uint32_t type);

/* Writes it back; `rehash`: with checksums that hold. */
void spoil_store(const struct spoil *file, const char *path, bool rehash);

/* Opens `path` with `verify`, which must be SPL_E_CORRUPT for a reason that has `part` in it. */
void spoil_expect(const char *path, const char *part);

#endif
