/* The boxes are as narrow as Morton order makes runs of points: a run that jumps over the curve's far ends has a wide
 * one, which costs searches time and no result. Leaves are made in parallel; all levels above are an eighth of them. */
#include "pack/boxes.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "base/parallel.h"

struct leaves {
    const struct spl_points *points;
    struct spl_box_group *groups;
};

static void bound_points(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct leaves *leaves = context;
    const struct spl_points *p = leaves->points;
    (void)worker;
    spl_spill_keep_bound(p->spill);
    for (size_t box = begin; box < end; box++) {
        size_t first = box * SPL_BOXES_LEAF,
               last = first + SPL_BOXES_LEAF < p->count ? first + SPL_BOXES_LEAF : p->count;
        struct spl_box_group *g = &leaves->groups[box / SPL_BOXES_FAN];
        for (int c = 0; c < 3; c++) {
            double low = INFINITY, high = -INFINITY;
            for (size_t i = first; i < last; i++) {
                low = spl_points_at(p, c, i) < low ? spl_points_at(p, c, i) : low;
                high = spl_points_at(p, c, i) > high ? spl_points_at(p, c, i) : high;
            }
            g->low[c][box % SPL_BOXES_FAN] = low;
            g->high[c][box % SPL_BOXES_FAN] = high;
        }
    }
}

/* Boxes around `count` groups of the level below. */
static void bound_groups(const struct spl_box_group *below, size_t count, struct spl_box_group *groups)
{
    for (size_t box = 0; box < count; box++)
        for (int c = 0; c < 3; c++) {
            double low = INFINITY, high = -INFINITY;
            for (int k = 0; k < SPL_BOXES_FAN; k++) {
                low = fmin(low, below[box].low[c][k]);
                high = fmax(high, below[box].high[c][k]);
            }
            groups[box / SPL_BOXES_FAN].low[c][box % SPL_BOXES_FAN] = low;
            groups[box / SPL_BOXES_FAN].high[c][box % SPL_BOXES_FAN] = high;
        }
}

int spl_boxes_init(struct spl_boxes *boxes, const struct spl_points *points, unsigned threads, struct spl_error *err)
{
    size_t count[SPL_BOXES_LEVELS], total = 0;
    *boxes = (struct spl_boxes){.spill = points->spill};
    for (size_t left = (points->count + SPL_BOXES_LEAF - 1) / SPL_BOXES_LEAF; !boxes->levels || left > 1;
         left = (left + SPL_BOXES_FAN - 1) / SPL_BOXES_FAN) {
        boxes->first[boxes->levels] = total;
        count[boxes->levels++] = left;
        total += (left + SPL_BOXES_FAN - 1) / SPL_BOXES_FAN;
    }
    if (!(boxes->groups = spl_spill_alloc_raw(points->spill, total, sizeof *boxes->groups, err)))
        return SPL_E_NOMEM;
    for (unsigned l = 0; l < boxes->levels; l++) {
        struct spl_box_group *groups = boxes->groups + boxes->first[l];
        for (size_t box = count[l]; box % SPL_BOXES_FAN; box++)
            for (int c = 0; c < 3; c++) {
                groups[box / SPL_BOXES_FAN].low[c][box % SPL_BOXES_FAN] = INFINITY;
                groups[box / SPL_BOXES_FAN].high[c][box % SPL_BOXES_FAN] = -INFINITY;
            }
        if (l)
            bound_groups(boxes->groups + boxes->first[l - 1], count[l], groups);
        else
            spl_parallel_for(threads, count[0], 4096 * SPL_BOXES_FAN, bound_points, &(struct leaves){points, groups});
    }
    return SPL_OK;
}

void spl_boxes_finish(struct spl_boxes *boxes)
{
    spl_spill_free(boxes->spill, boxes->groups);
    *boxes = (struct spl_boxes){0};
}
