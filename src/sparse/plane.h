/* The widths and the step of one plane of a chunk. */
#ifndef SPL_SPARSE_PLANE_H
#define SPL_SPARSE_PLANE_H

#include "sparse/code.h"

enum { SPL_INDEX_WIDTHS = 17 }; /* 0..16 bits */

/* Splats that may take a further atom: with an index of b bits the best one is atom[b], which matches as match[b]. */
struct spl_candidates {
    uint32_t count, index_bits; /* index_bits: of the whole dictionary */
    uint32_t mask_bits;         /* of the plane: splats that have the one before, or SPL_CHUNK_SPLATS */
    bool last;                  /* no plane can follow */
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

/* Bits of a splat's taking the atom: its code, and its bit in the next plane's mask. */
static inline float spl_plane_atom_bits(const struct spl_candidates *c, uint32_t index_bits, uint32_t weight_bits)
{
    return (float)(index_bits + weight_bits + !c->last);
}

/* Chooses `out` for `candidates`: with settings->lambda the widths and the step of the smallest error + lambda · bits,
 * where a splat takes the atom if that pays for its bits; else the full index, settings->weight_bits and the step of
 * the smallest error. Returns false if no plane is worth its bits. */
bool spl_plane_choose(const struct spl_candidates *candidates, const struct spl_code_settings *settings,
                      struct spl_code_plane *out);

/* Sets weight_bits, step and gap of `out` for weights that are all to be coded: the smallest error + lambda · bits. */
void spl_plane_fit(const float *weight, uint32_t count, const struct spl_code_settings *settings,
                   struct spl_code_plane *out);

#endif
