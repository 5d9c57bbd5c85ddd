/* The widths and the step of one plane of a chunk. */
#ifndef SPL_SPARSE_PLANE_H
#define SPL_SPARSE_PLANE_H

#include "sparse/code.h"

enum { SPL_INDEX_WIDTHS = 17 }; /* 0..16 bits */

/* Splats that may take a further atom: with an index of b bits the best one is atom[b], which matches as match[b]. */
struct spl_candidates {
    uint32_t count, index_bits; /* index_bits: of the whole dictionary */
    float match[SPL_INDEX_WIDTHS][SPL_CHUNK_SPLATS];
    uint16_t atom[SPL_INDEX_WIDTHS][SPL_CHUNK_SPLATS];
};

/* The code whose weight is nearest to `weight`, and what the squared error falls by when a residual that matches
 * `match` with an atom of norm 1 loses weight · atom. */
int16_t spl_plane_quantise(const struct spl_code_plane *plane, float weight);

static inline float spl_plane_gain(float match, float weight)
{
    return weight * (2 * match - weight);
}

/* Chooses `out` for `candidates`: with settings->lambda the widths and the step of the smallest error + lambda · bits,
 * where a splat takes the atom if that pays for its bits; else the full index, settings->weight_bits and the step of
 * the smallest error. Returns false if no plane is worth its bits. */
bool spl_plane_choose(const struct spl_candidates *candidates, const struct spl_code_settings *settings,
                      struct spl_code_plane *out);

#endif
