/* What the files of spl_points_order() share: order.c moves points, in the order that order_sort.c finds by their keys
 * and order_equal.c within one key. */
#ifndef SPL_PACK_ORDER_PARTS_H
#define SPL_PACK_ORDER_PARTS_H

#include "pack/points.h"

enum { SPL_ORDER_GRAIN = 1 << 16 };
/* Each element of these may be in a page of its own, which comes with fifteen others. */
enum { SPL_ORDER_RANDOM_GRAIN = 256 };

#define SPL_ORDER_DROPPED UINT32_MAX /* in an index: a duplicate */

struct spl_order_pair {
    uint64_t key;
    uint32_t index;
};

/* Fills `index` with the numbers of all points in order, duplicates as SPL_ORDER_DROPPED, and sets the points' bounds
 * and cube. SPL_E_NOMEM. Parallel loops end before it returns. */
int spl_order_sort(struct spl_points *points, uint32_t *index, struct spl_stage *stage, struct spl_error *err);

/* Orders points of one key; `index` is ascending at first. false: no memory. Any thread. */
bool spl_order_equal(const struct spl_points *points, uint32_t *index, size_t n);

/* The same of points at one place: the first is the one that stays. */
void spl_order_keep_one(const struct spl_points *points, uint32_t *index, size_t n);

#endif
