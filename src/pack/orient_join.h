/* Signs of normals over all blocks: which components of blocks are turned. */
#ifndef SPL_PACK_ORIENT_JOIN_H
#define SPL_PACK_ORIENT_JOIN_H

#include "pack/orient.h"

/* In the spill: as many as there are, which is far fewer than there can be. Those of the same ends come one after the
 * other mostly, so where the last one of each remainder lies is looked up: one edge has the votes of many. */
enum { SPL_ORIENT_RECENT = 8191 };
struct spl_orient_edges {
    struct spl_forest_edge *list;
    size_t count, capacity;
    uint32_t recent[SPL_ORIENT_RECENT];
};

struct spl_orient_join {
    struct spl_component *components; /* the caller's */
    size_t count;
    struct spl_forest forest;
    struct spl_orient_edges seams, edges; /* between what is one level piece; all */
    struct spl_spill *spill;              /* may be NULL */
};

/* Of `count` components, numbered over all blocks. SPL_E_NOMEM; finish it in any case. */
int spl_orient_join_init(struct spl_orient_join *join, struct spl_component *components, size_t count,
                         struct spl_spill *spill, struct spl_error *err);
void spl_orient_join_finish(struct spl_orient_join *join);

/* Neighbours of components a and b agree so (spl_orient_agreement()); `seam`: in two blocks, both points of level
 * pieces that go on there. SPL_E_NOMEM, SPL_E_IO. */
int spl_orient_join_add(struct spl_orient_join *join, uint32_t a, uint32_t b, float agreement, bool seam,
                        struct spl_error *err);

/* Decides component.flip: anchored components stay, the others show outwards on the whole. Once. SPL_E_NOMEM,
 * SPL_E_IO. */
int spl_orient_join_decide(struct spl_orient_join *join, struct spl_error *err);

#endif
