/* Which points lie on wires, poles and cables. */
#ifndef SPL_PACK_LINEAR_H
#define SPL_PACK_LINEAR_H

#include "pack/points.h"

/* Sets points->linear, one byte a point, and what lines ask of their points' radii, or leaves both NULL where there are
 * none. `points` are sorted. Memory while it runs: about 24 bytes a point, and 20 more where every cell of five is a
 * line. Parallel; the result does not depend on the number of threads. */
int spl_linear_find(struct spl_points *points, struct spl_stage *stage, struct spl_error *err);

#endif
