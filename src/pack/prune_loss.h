/* What a node loses of the leaf splats below it (the sum of w of prune.h), were it drawn in their place. */
#ifndef SPL_PACK_PRUNE_LOSS_H
#define SPL_PACK_PRUNE_LOSS_H

#include "pack/prune.h"

struct spl_prune_shapes; /* of a node: scratch of one worker, owned */

struct spl_prune_loss {
    const struct spl_dataset *dataset; // borrowed, as the rest
    const struct spl_prune_options *options;
    const struct spl_node *nodes;
    const struct spl_chunk *chunks;
};

/* NULL and `err` where memory is refused. */
struct spl_prune_shapes *spl_prune_shapes_create(struct spl_error *err);
void spl_prune_shapes_destroy(struct spl_prune_shapes *shapes);

/* The node's splats, and what its panels are worth of them. */
uint64_t spl_prune_count(const struct spl_prune_loss *loss, uint64_t node);

/* What a dataset counts as its leaf splats of a node that is one of its leaves: as above, but of a node without
 * children the points that its panels stand for. */
uint64_t spl_prune_left(const struct spl_prune_loss *loss, uint64_t node);

/* The loss of a node that has children; of `below` leaf splats. Looks at an even part of them, in proportion to its
 * own splats, so that all nodes of a level together cost the same. Less than 0: SPL_E_NOMEM. Any thread. */
double spl_prune_get_loss(const struct spl_prune_loss *loss, uint64_t node, uint64_t below,
                          struct spl_prune_shapes *shapes);

#endif
