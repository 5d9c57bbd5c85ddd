/* The K nearest neighbours of sorted points, exactly, for any distribution of points. */
#ifndef SPL_PACK_NEIGHBOURS_H
#define SPL_PACK_NEIGHBOURS_H

#include "pack/boxes.h"

struct spl_neighbours;

enum { SPL_NEAR_LEAVES = 64, SPL_NEAR_ROOM = SPL_NEIGHBOURS_MAX + 8 }; /* vectors are stored whole */

/* What a search found, unsorted, and what the searches for the points beside it in order share: spl_nearest_init() it,
 * then reuse it. */
struct spl_nearest {
    unsigned count;
    uint32_t index[SPL_NEAR_ROOM];
    double squared[SPL_NEAR_ROOM]; /* distances, squared */
    double farthest;               /* distance of the farthest one */
    /* Private: the leaf of the last point, squared bounds for its points, and the leaves around it where they are few.
     */
    size_t leaf;
    unsigned leaves;
    bool crowded;
    uint32_t leaf_index[SPL_NEAR_LEAVES];
    double bound[SPL_BOXES_LEAF], found[SPL_BOXES_LEAF]; /* what `farthest` was of each, infinite where not asked for */
    double low[3][SPL_NEAR_LEAVES], high[3][SPL_NEAR_LEAVES];
};

static inline void spl_nearest_init(struct spl_nearest *nearest)
{
    nearest->leaf = SIZE_MAX;
}

/* Indexes `points` (borrowed, sorted, at least 2, no two equal); memory: 3.5 bytes a point. NULL on SPL_E_NOMEM. */
struct spl_neighbours *spl_neighbours_create(const struct spl_points *points, unsigned threads, struct spl_error *err);

/* The min(k, points - 1) points nearest to point `i`, itself excluded; among equally far ones, some. Any thread. */
void spl_neighbours_find(const struct spl_neighbours *neighbours, size_t i, unsigned k, struct spl_nearest *nearest);

/* The k points nearest to point `i` of those that `takes` takes, nearest first, as far as they lie within 2, 4, 8 times
 * `distance`, the first of these that has them, up to `most`, and SPL_NEAR_LOOKED or so that were looked at have them.
 * Sets count, index, squared and farthest alone. Any thread. */
enum { SPL_NEAR_LOOKED = 2048 };
typedef bool spl_neighbours_takes(const void *context, size_t point);
void spl_neighbours_find_some(const struct spl_neighbours *neighbours, size_t i, unsigned k, double distance,
                              double most, spl_neighbours_takes *takes, const void *context,
                              struct spl_nearest *nearest);

/* NULL-safe. */
void spl_neighbours_destroy(struct spl_neighbours *neighbours);

/* What searches are compiled for; they find the same. */
enum spl_neighbours_set { SPL_NEIGHBOURS_BASE, SPL_NEIGHBOURS_AVX2, SPL_NEIGHBOURS_AVX512 };

/* From now on searches made take this at most; says what this processor has of it. Tests only. */
enum spl_neighbours_set spl_neighbours_limit(enum spl_neighbours_set most);

#endif
