/* Which nodes of a packed dataset may lose their children for good: pack --prune.
 *
 * A cut through the octree is drawn as it is. What a splat of the leaves loses where only those of a node above it are
 * left is, as a share of that splat's part of an image,
 *     w = 1 - (1 - g) (1 - (1 - s) c)        g = u^2 / (1 + u^2), u = distance to the nearest disc / own radius
 *                                            c = min(1, squared difference of colours / SPL_PRUNE_CONTRAST^2)
 * where s is the share that maps show: those put the colour right, but only on a surface that is where it was. A scan's
 * points lie evenly over the directions that it was made from, and so do their radii: a splat is a piece of the image
 * there, u is an error in its own widths, on a wall far away as on a near one, and a hole is a distance too. Vertices
 * of lines count as splats do, from the nearest piece. Two cells of a panel count as a splat, and lose what the disc
 * does that a cell stands for: panels and discs of a node together are its picture.
 *
 * The cut is the one that loses least, sum of w over all leaf splats, among those of its number of splats: of every
 * node that is kept, its children save less than `slope` a splat, of every node that is split, they save more (optimal
 * pruning of trees: Chou, Lookabaugh and Gray, "Optimal pruning with applications to tree-structured source coding and
 * modeling", 1989). Flat walls so give up far more than the factor, and foliage, wires and edges keep more. */
#ifndef SPL_PACK_PRUNE_H
#define SPL_PACK_PRUNE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "dataset/dataset.h"
#include "pack/stage.h"

#define SPL_PRUNE_FACTOR_MAX 1000
#define SPL_PRUNE_CONTRAST 64.0 /* levels, RMS: colours that differ so much have nothing to do with each other */

struct spl_prune_options {
    double factor;     /* about 1 / factor of the leaf splats stay; 1..SPL_PRUNE_FACTOR_MAX */
    const float *seen; /* by chunk: how much of its discs some map shows, 0..1; NULL = as no_maps says */
    bool no_maps;      /* no map shows anything: colours are the splats' own; else everything is shown */
};

enum { SPL_PRUNE_STEPS = 16 };
struct spl_prune_report {
    uint64_t before, after;            /* leaf splats as the dataset counts them: of panels of its leaves points, of
                                          those of a coarser level, now leaves, half the cells; not lines */
    uint64_t by_steps[SPL_PRUNE_STEPS]; /* of those after: by how many levels their node lies above its lowest leaf */
    uint64_t dense;                    /* of those after: in nodes that keep more than twice 1 / factor */
    double slope;                      /* w that a splat saved costs, at the cut's edge; 0 = nothing was dropped */
    double lost;                       /* sum of w / leaf splats before, 0..1 */
};

/* Sets leaf[node] of each node that stays and loses its children; `leaf` has room for info.nodes. The number of splats
 * comes as close to 1 / factor as whole nodes allow; a root is never dropped. The same for any number of threads.
 * `dataset` keeps all its tables. SPL_E_USAGE, SPL_E_NOMEM, SPL_E_CANCELLED. */
int spl_prune_plan(const struct spl_dataset *dataset, const struct spl_prune_options *options, bool *leaf,
                   struct spl_prune_report *report, struct spl_stage *stage, struct spl_error *err);

/* What the radii of discs that are the finest from now on are multiplied by (spl_rewrite.leaf_radius): those of a level
 * reach over each other as scanned points must, which lie at random, while clusters lie evenly. */
float spl_prune_leaf_radius(const struct spl_dataset *dataset);

/* Into how many clusters a cell of this size puts the splats of `context`. */
typedef size_t spl_prune_clusters(void *context, double cell);

/* The cell, of those tried from `first` on, whose number of clusters comes nearest to `aim`, at least 1: of a root that
 * is to be left alone (pack/tree.h, pruned_to). */
double spl_prune_find_cell(spl_prune_clusters *clusters_of, void *context, size_t aim, double first);

/* Writes `output`, `dataset` without what is dropped where no maps show colours. `report` may be NULL. As
 * spl_prune_plan() and spl_dataset_rewrite(). */
int spl_prune_apply(const struct spl_dataset *dataset, double factor, const char *output,
                    struct spl_prune_report *report, struct spl_stage *stage, struct spl_error *err);

#endif
