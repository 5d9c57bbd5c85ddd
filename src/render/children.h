/* Where a walk of the tree finds a node's children: in tables that the dataset keeps, or that it asks for by page. The
 * renderer's thread. */
#ifndef SPL_RENDER_CHILDREN_H
#define SPL_RENDER_CHILDREN_H

#include "render/select.h"

/* A node, and the tables that have it. */
struct spl_found_node {
    const struct spl_node *node;
    const struct spl_tables *tables;
};

static inline const struct spl_chunk *spl_found_get_chunks(const struct spl_found_node *found)
{
    return found->tables->chunks + (found->node->first_chunk - found->tables->first_chunk);
}

/* Sets node->child_count children where *answer becomes SPL_SELECT_YES. SPL_E_CORRUPT where one of them does not fit
 * its parent, which opening has left unchecked where it did not read all tables. */
int spl_children_find(const struct spl_select_params *params, const struct spl_node *node,
                      struct spl_found_node children[8], enum spl_select_answer *answer, struct spl_error *err);

#endif
