/* The root that is left alone of a dataset pruned so far that no cut of whole nodes is small enough: its cell is found
 * by doubling and halving, then by halving the logarithm between one that is too fine and one that is too coarse. The
 * number of clusters falls unevenly with the cell, and may rise in places, so the nearest of those tried is taken, not
 * the last. The caller's thread. */
#include "pack/prune.h"

#include <math.h>

enum { steps_most = 24 };
static const double near_enough = 0.01; /* of the logarithm */

double spl_prune_find_cell(spl_prune_clusters *clusters_of, void *context, size_t aim, double first)
{
    double cell = first, fine = 0, coarse = INFINITY, best = first, best_off = INFINITY;
    for (int i = 0; i < steps_most && best_off > near_enough; i++) {
        double clusters = (double)clusters_of(context, cell), off = fabs(log(clusters / (double)aim));
        if (off < best_off) {
            best_off = off;
            best = cell;
        }
        *(clusters > (double)aim ? &fine : &coarse) = cell;
        cell = isinf(coarse) ? 2 * fine : fine > 0 ? sqrt(fine * coarse) : coarse / 2;
    }
    return best;
}
