/* Clip lines: where a disc ends because the surface does. */
#ifndef SPL_PACK_CLIP_H
#define SPL_PACK_CLIP_H

#include "pack/neighbours.h"

/* Finds the line of each point that `candidate` (a byte a point) marks, and writes points->clip. Reads settled normals
 * and radii. `wide` neighbours of each candidate are asked. The result does not depend on the number of threads.
 * SPL_E_NOMEM. */
int spl_clip_lines(struct spl_points *points, const struct spl_neighbours *neighbours, unsigned wide,
                   const uint8_t *candidate, struct spl_stage *stage, struct spl_error *err);

#endif
