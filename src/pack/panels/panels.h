/* Panels of a dataset's nodes: points on planes become cells, so that what is flat costs less than a disc a point.
 *
 * Leaves come first: the points of a plane become cells as large as they lie apart, unless discs would cost less; then
 * levels.c makes inner nodes from below, with cells twice as large as their children's. Cells of one plane are counted
 * from its origin at each of its sizes (half octaves of its mean spacing), so those of neighbouring nodes meet. */
#ifndef SPL_PACK_PANELS_PANELS_H
#define SPL_PACK_PANELS_PANELS_H

#include "dataset/panels.h"
#include "pack/clip.h"
#include "pack/planes/planes.h"
#include "pack/stage.h"

struct spl_tree;
struct spl_tree_node;

/* What a panel's points have beside colour; of those whose discs reach into it, where none lies in it. */
struct spl_panel_values {
    double uncertainty;     /* the mean by area */
    uint8_t classification; /* what most have */
};

/* What a node has of panels. */
struct spl_node_panels {
    struct spl_spill *spill;  /* where the arrays lie once all are made; NULL: on the heap */
    struct spl_chunk *chunks; /* geometry_word: from `words` on */
    uint32_t *cells;          /* of each chunk: how many it has */
    uint32_t *words;
    struct spl_panel_values *values; /* by panel, in the order of the chunks */
    uint32_t *numbers; /* likewise: of the scalars that the points have, as struct spl_tree_node has them */
    uint32_t chunk_count;
    size_t panel_count, word_count;
    size_t chunk_capacity, cells_capacity, word_capacity, value_capacity, number_capacity;
    float box_min[3], box_max[3]; /* around the discs that its cells stand for, from the node's origin */
};

void spl_node_panels_finish(struct spl_node_panels *panels);

/* Puts the arrays where they can leave memory: nothing is added to them afterwards. `spill` may be NULL: they stay. */
bool spl_node_panels_settle(struct spl_node_panels *panels, struct spl_spill *spill);

struct spl_panel_scratch; /* of one worker */

/* Of the whole scan while its nodes are made. Zeroed before it is initialised. */
struct spl_panel_maker {
    struct spl_points *points;
    const struct spl_planes *planes; /* borrowed, as the points */
    float *base;                     /* by plane: cells of level SPL_PANEL_LEVEL_BASE */
    uint8_t *level; /* by point: its cells are base * 2^((level - SPL_PANEL_LEVEL_BASE) / 2); 0: it is a disc */
    struct spl_neighbours *neighbours; /* of the points; NULL: they have no clip lines */
    uint32_t *crease;                  /* by point: the plane at which its own ends there, or SPL_NO_PLANE; likewise */
    struct spl_clip_turns turns;
    struct spl_panel_scratch *scratch;
    unsigned workers;
};

enum { SPL_PANEL_LEVEL_BASE = 64 };

/* `points` have been through spl_planes_find(). On failure too, `maker` is finished by the caller. SPL_E_NOMEM. */
int spl_panel_maker_init(struct spl_panel_maker *maker, struct spl_points *points, const struct spl_planes *planes,
                         unsigned threads, struct spl_error *err);
void spl_panel_maker_finish(struct spl_panel_maker *maker);

/* Makes the panels of all leaves. Afterwards points->plane is SPL_NO_PLANE of those points that stay discs, and a
 * leaf's splat_count is how many these are. Parallel; the result does not depend on the number of threads. SPL_E_NOMEM,
 * SPL_E_CANCELLED. */
int spl_panels_make_leaves(struct spl_panel_maker *maker, struct spl_tree *tree, struct spl_stage *stage,
                           struct spl_error *err);

/* Points that are in panels of the nodes below, but for which discs cost less in this one and those above. */
struct spl_panel_left {
    uint32_t *points; /* owned */
    size_t count, capacity;
    double cell; /* of the panels below: how far apart the discs that they become may lie */
};

/* Makes those of an inner node, whose children have been made; *left, zeroed at first, is filled anew. Any thread, as
 * long as no other one has the worker or a node above or below. False: no memory. */
bool spl_panels_make_inner(struct spl_panel_maker *maker, struct spl_tree_node *node, unsigned worker,
                           struct spl_panel_left *left);

/* Whether the point is in a panel of its leaf. */
static inline bool spl_panels_has_point(const struct spl_points *points, size_t i)
{
    return points->plane && points->plane[i] != SPL_NO_PLANE;
}

#endif
