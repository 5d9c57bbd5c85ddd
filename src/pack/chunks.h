/* One node's splats, cut into compact chunks and put in pruning order, and that into the order in which lanes draw. */
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

/* Reorders the items of a chunk (count <= SPL_CHUNK_SPLATS), of radii `radius` (> 0) in their order, within each run of
 * SPL_RUN_SPLATS: the SPL_LANES that are drawn at a time are of about one size, so that none waits for a large one.
 * Views draw a run or more of a chunk, by SPL_LANES, and what they draw of a run is neither small nor large. Pure
 * function; any thread. */
void spl_chunk_match_lanes(struct spl_cut *items, const float *radius, size_t count);

#endif
