/* A bounding volume hierarchy over a scene's primitives. Immutable once built; hits are thread-safe. */
#ifndef SPL_SYNTH_BVH_H
#define SPL_SYNTH_BVH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"
#include "synth/primitive.h"

struct spl_bvh_node {
    double bounds[2][3];
    uint32_t first;      /* leaf: its first primitive; else the second child (the first one follows the node) */
    uint16_t count;      /* primitives of a leaf, 0 for an inner node */
    uint16_t axis;       /* along which the children were parted */
};

/* Reorders `primitives` (count >= 1) so that each leaf's lie together. *nodes belongs to the caller, released
 * with free(). */
int spl_bvh_build(struct spl_primitive *primitives, size_t count, struct spl_bvh_node **nodes, struct spl_error *err);

/* The nearest hit with 0 < t < *t: updates *t and the index. */
bool spl_bvh_hit(const struct spl_bvh_node *nodes, const struct spl_primitive *primitives, const double origin[3],
                 const double direction[3], double *t, uint32_t *index);

#endif
