/* Positions, normals and radii of a chunk as codes: the part of its quantisation that loses something, and how much. */
#ifndef SPL_DATASET_CHUNK_GEOMETRY_H
#define SPL_DATASET_CHUNK_GEOMETRY_H

#include "dataset/chunk.h"

struct spl_geometry_codes {
    int32_t position[3][SPL_CHUNK_SPLATS];
    int32_t u[SPL_CHUNK_SPLATS], v[SPL_CHUNK_SPLATS], radius[SPL_CHUNK_SPLATS];
};

/* Chooses widths, steps and codes as spl_chunk_encode() says. Sets of *chunk what decoding positions, normals and radii
 * needs, radius_mean, and geometry_bits but for SPL_GEOMETRY_LINEAR. Pure. */
void spl_geometry_quantise(const struct spl_splat *splats, const double (*position)[3], uint32_t count,
                           const struct spl_chunk_options *options, struct spl_chunk *chunk,
                           struct spl_geometry_codes *codes, struct spl_chunk_error *error);

#endif
