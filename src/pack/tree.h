/* The octree over sorted points, and the splats of its inner nodes. */
#ifndef SPL_PACK_TREE_H
#define SPL_PACK_TREE_H

#include <math.h>

#include "pack/panels/panels.h"
#include "pack/points.h"

struct spl_early;

/* Most points of a leaf, and of one where nodes are what pruning chooses among: there are enough of them to choose. */
enum { SPL_LEAF_POINTS = 8192, SPL_PRUNED_LEAF_POINTS = 512, SPL_PRUNED_LEAF_LEAST = 32 };

/* A splat of an inner node; position relative to the node's origin. */
struct spl_inner_splat {
    float position[3], normal[3];
    float radius, uncertainty; /* the latter with a sign: see below */
    uint32_t color_class;      /* as in struct spl_points */
};

/* Whether most of what it stands for is on a wire, a pole or a cable, is the sign of its uncertainty. */
static inline void spl_inner_set(struct spl_inner_splat *splat, float uncertainty, bool linear)
{
    splat->uncertainty = copysignf(uncertainty, linear ? -1 : 1);
}

static inline bool spl_inner_is_linear(const struct spl_inner_splat *splat)
{
    return signbit(splat->uncertainty);
}

static inline float spl_inner_get_uncertainty(const struct spl_inner_splat *splat)
{
    return fabsf(splat->uncertainty);
}

struct spl_tree_node {
    double origin[3]; /* least corner of its cube */
    double size;
    double frame_low[3], frame_size;   /* the cube that its points' keys are counted in, see pack/order.h */
    size_t begin, end;                 /* points below it, in Morton order */
    uint32_t first_child, child_count; /* 0 children: a leaf */
    uint32_t parent;
    uint32_t depth;                 /* of the tree: cubes that hold all points of their parent are skipped */
    struct spl_inner_splat *splats; /* of an inner node, made by spl_levels_build() */
    uint32_t *numbers;    /* likewise, splat by splat: of the scalars that the points have; NULL = they have none */
    uint32_t splat_count; /* leaf: end - begin, without the points that panels stand for */
    struct spl_node_panels *panels; /* made by spl_panels_make_leaves() and spl_levels_build(); NULL = none */
};

/* Are its splats points? A node of clusters whose children are left out of a file is a leaf there with clusters. */
static inline bool spl_tree_node_has_points(const struct spl_tree_node *node)
{
    return !node->child_count && !node->splats;
}

struct spl_tree {
    struct spl_spill *spill;     /* where splats and numbers lie: the points' */
    struct spl_tree_node *nodes; /* breadth first, siblings consecutive */
    uint32_t count, levels;
    size_t pruned_to; /* said before it is built: about so many splats are to be left of it, and inner nodes are drawn
                         for good, see levels.c; 0: nothing is pruned */
    struct spl_early *early; /* encodes the nodes whose parents are built, borrowed; NULL: they are once all are */
    struct spl_panel_maker *panels; /* of points on planes, borrowed while levels are built; NULL: none are made */
};

/* Splits until no leaf has more than SPL_LEAF_POINTS points, for pruning SPL_PRUNED_LEAF_POINTS or, of a small scan
 * without panels, a sixteenth of what is to be left, or is too wide for floats. `points` are sorted, with radii. */
int spl_tree_build(struct spl_tree *tree, const struct spl_points *points, struct spl_error *err);

/* Fills the inner nodes, deepest first: clusters of their children's splats, at most about 28 % as many. */
int spl_levels_build(struct spl_tree *tree, const struct spl_points *points, struct spl_stage *stage,
                     struct spl_error *err);

/* Frees the splats of a node, which nobody reads any more; how many they were stays. */
void spl_tree_drop_splats(struct spl_tree *tree, uint32_t node);

void spl_tree_finish(struct spl_tree *tree);

#endif
