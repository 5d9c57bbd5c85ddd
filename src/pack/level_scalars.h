/* Scalars of an inner node's splats, from those of its children. */
#ifndef SPL_PACK_LEVEL_SCALARS_H
#define SPL_PACK_LEVEL_SCALARS_H

#include "pack/tree.h"

/* What a worker needs for it, zeroed at first. */
struct spl_scalar_mixer {
    struct spl_scalar_mix *mixes; // owned
    size_t capacity;
};

/* Makes node->numbers: of its splats, which stand for those of its children, taken child by child. `of` says for each
 * of these which splat, counted from 1, and `inputs` how large it is. False when memory is refused. */
bool spl_scalars_mix(struct spl_scalar_mixer *mixer, const struct spl_points *points, const struct spl_tree *tree,
                     struct spl_tree_node *node, const uint32_t *of, const struct spl_inner_splat *inputs);

void spl_scalar_mixer_finish(struct spl_scalar_mixer *mixer);

#endif
