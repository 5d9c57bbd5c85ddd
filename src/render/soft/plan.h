/* Windows of depth: soft spheres that are more than fit are drawn a range after the other, front to back. A place in
 * the order of blending is depth (float bits) << 32 | slot; a window is a range of places. Pure; the caller's
 * thread. */
#ifndef SPL_RENDER_SOFT_PLAN_H
#define SPL_RENDER_SOFT_PLAN_H

#include <stdbool.h>
#include <stdint.h>

#include "base/error.h"

struct spl_soft_range {
    uint64_t first, end; /* places */
};

struct spl_soft_sum {
    uint32_t items, entries;
};

enum { SPL_SOFT_BUCKETS_LOG2 = 10, SPL_SOFT_BUCKETS = 1 << SPL_SOFT_BUCKETS_LOG2, SPL_SOFT_LEVELS = 8 };

/* Sums up what lies in `range` by buckets of 2^shift places; fills in those that the range has. Either shift is 32 and
 * more, and the range whole depths, or the range is of one depth. */
typedef int spl_soft_measure_range(void *context, const struct spl_soft_range *range, uint32_t shift,
                                   struct spl_soft_sum *sums, struct spl_error *err);

struct spl_soft_level {
    struct spl_soft_range range;
    uint32_t shift, next, count; /* of buckets */
    struct spl_soft_sum sums[SPL_SOFT_BUCKETS];
};

struct spl_soft_plan {
    struct spl_soft_sum room; /* what fits in a window */
    spl_soft_measure_range *measure;
    void *context;
    uint32_t depth; /* of levels */
    struct spl_soft_level levels[SPL_SOFT_LEVELS];
};

/* Begins a plan of everything in `range`, whose ends are whole depths. */
int spl_soft_plan_begin(struct spl_soft_plan *plan, const struct spl_soft_range *range, struct spl_error *err);
/* The next window, by rising depth, with something in it: it fits, or is a single place. *sum is what it has. Returns
 * 1; 0 after the last; an error of measure(). */
int spl_soft_plan_next(struct spl_soft_plan *plan, struct spl_soft_range *window, struct spl_soft_sum *sum,
                       struct spl_error *err);

#endif
