/* One node's splats, cut into compact chunks and put in pruning order. */
#ifndef SPL_PACK_CHUNKS_H
#define SPL_PACK_CHUNKS_H

#include <stddef.h>
#include <stdint.h>

struct spl_cut {
    float position[3];
    uint32_t index; /* of the caller */
};

/* Reorders `items` so that each run of SPL_CHUNK_SPLATS (the last one shorter) is a chunk: compact in space, and every
 * prefix of it an even subsample. Pure function; any thread. */
void spl_chunks_cut(struct spl_cut *items, size_t count);

#endif
