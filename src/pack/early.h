/* Nodes that are encoded as soon as their parents are built, where memory is bounded: so that points and splats need no
 * room on disk for longer than that. */
#ifndef SPL_PACK_EARLY_H
#define SPL_PACK_EARLY_H

#include "pack/emit.h"

struct spl_early;

/* For the nodes of `tree`, whose leaves are built; `points`, `wires` and `options` are borrowed, `emitted` gets its
 * nodes and streams. The caller destroys it before them. SPL_E_NOMEM. */
int spl_early_create(struct spl_tree *tree, struct spl_points *points, const struct spl_wires *wires,
                     const struct spl_chunk_options *options, unsigned threads, struct spl_emitted *emitted,
                     struct spl_early **out, struct spl_error *err);
void spl_early_destroy(struct spl_early *early);

/* Encodes the children of `node`, which is built, and drops what they were made of: their splats, or what their points
 * have, which nobody may read any more. Any thread that has the number `worker` to itself. False: no memory. */
bool spl_early_encode_children(struct spl_early *early, const struct spl_tree_node *node, unsigned worker);

/* What node `index` became; NULL where it was not encoded. Given back once it is written. */
struct spl_encoded_node *spl_early_get(struct spl_early *early, size_t index);
void spl_early_give(struct spl_early *early, size_t index);

#endif
