/* The K nearest neighbours of sorted points, exactly, for any distribution of points. */
#ifndef SPL_PACK_NEIGHBOURS_H
#define SPL_PACK_NEIGHBOURS_H

#include "pack/points.h"

struct spl_neighbours;

/* What a search found, and a hint for the next one: zero before the first, then reuse it for points that lie in order.
 * Unsorted. */
struct spl_nearest {
    unsigned count;
    uint32_t index[SPL_NEIGHBOURS_MAX + 1];
    double squared[SPL_NEIGHBOURS_MAX + 1];  /* distances, squared */
    double farthest;                         /* distance of the farthest one */
    bool warm;
    double at[3];
};

/* Indexes `points` (borrowed, sorted, at least 2, no two equal); memory: 3.5 bytes a point. NULL on SPL_E_NOMEM. */
struct spl_neighbours *spl_neighbours_create(const struct spl_points *points, unsigned threads, struct spl_error *err);

/* The min(k, points - 1) points nearest to point `i`, itself excluded; among equally far ones, some. Any thread. */
void spl_neighbours_find(const struct spl_neighbours *neighbours, size_t i, unsigned k, struct spl_nearest *nearest);

/* NULL-safe. */
void spl_neighbours_destroy(struct spl_neighbours *neighbours);

#endif
