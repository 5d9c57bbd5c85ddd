/* Relief: heights over a panel's plane, with which it becomes a mesh. A lattice of (2^k + 1)^2 of them, 16 / 2^k cells
 * apart, each square of which is cut in two along the diagonal from its least to its greatest corner; neighbouring
 * panels of a plane meet where they have the same heights along their common edge. Cells, masks and colours are as of a
 * panel without: panels.h. api/format.md and shaders/shared.h say how a chunk holds them, shaders/common/relief.glsl
 * reads the same. Pure functions; any thread. */
#ifndef SPL_DATASET_RELIEF_H
#define SPL_DATASET_RELIEF_H

#include <stdint.h>

#include "shared.h"

enum {
    SPL_RELIEF_POINTS_MAX = SPL_RELIEF_POINTS(SPL_RELIEF_LEVEL_MAX),
    SPL_RELIEF_STEP_MAX = 24,
    SPL_RELIEF_MOST = SPL_RELIEF_ZERO - 1 /* steps up or down that are written; a file may have one more down */
};

struct spl_relief {
    unsigned level;                      /* k, 0..SPL_RELIEF_LEVEL_MAX */
    float height[SPL_RELIEF_POINTS_MAX]; /* above the plane along its normal, metres; [j (2^k + 1) + i] is the height of
                                            point (i, j), at cell 16 / 2^k (i, j) of the panel */
};

/* What a code of step 0..SPL_RELIEF_STEP_MAX is worth, metres: cell 2^(-step / 2). And the finest step whose
 * SPL_RELIEF_MOST codes reach `most` (metres, >= 0; 0 where none does). Chunks of one plane that meet agree at their
 * common points where they have the same step. */
float spl_relief_worth(float cell, unsigned step);
unsigned spl_relief_choose_step(float cell, float most);

/* The bytes of the lattice, by codes that are worth `worth`, into SPL_RELIEF_WORDS(level) words; heights beyond
 * SPL_RELIEF_MOST codes become that. */
void spl_relief_encode(const struct spl_relief *relief, float worth, uint32_t *words);

/* The height that byte `code` says. */
static inline float spl_relief_decode(uint32_t code, float worth)
{
    return (float)((int)code - SPL_RELIEF_ZERO) * worth;
}

/* The surface's height at (x, y), 0..16, cells of the panel, metres; and, where `slope` is not NULL, how it rises by a
 * cell along x and y. With q = (x, y) 2^k / 16 in square floor(q) of corners h00, h10, h01, h11 and f = q - floor(q):
 *     h00 + f.x (h10 - h00) + f.y (h11 - h10)    where f.x >= f.y
 *     h00 + f.y (h01 - h00) + f.x (h11 - h01)    else */
float spl_relief_height(const struct spl_relief *relief, float x, float y, float slope[2]);

#endif
