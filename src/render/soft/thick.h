/* Windows of depth for what has a thickness: models but express cut a ray where it enters and leaves spheres, so that a
 * window of events needs all spheres that overlap it. Windows follow one another without a gap; what they hold overlaps
 * by the largest radius on each side. Pure; the caller's thread. */
#ifndef SPL_RENDER_SOFT_THICK_H
#define SPL_RENDER_SOFT_THICK_H

#include "render/soft/plan.h"

struct spl_soft_thick {
    struct spl_soft_sum room; /* what may be held at once */
    struct spl_soft_range all; /* whose ends are whole depths */
    float reach;              /* no sphere has a larger radius */
    float least;              /* no window is thinner but the last; 0 = any that is not empty */
    spl_soft_measure_range *measure;
    void *context;
    float from; /* where the next window begins; 0 = at the first depth */
    bool ended;
    struct spl_soft_sum sums[SPL_SOFT_BUCKETS];
};

struct spl_soft_window {
    struct spl_soft_range held; /* places of the centres of what it needs */
    struct spl_soft_sum sum;    /* of these */
    float until;                /* events before this depth are its own, or an earlier one's; SPL_SOFT_NO_END: all */
};

#define SPL_SOFT_NO_END 3e38f

/* The next window, by rising depth. Returns 1; 0 after the last; SPL_SOFT_TOO_THICK where so much overlaps from
 * plan->from on that a window of the least thickness does not fit; an error of measure(). */
enum { SPL_SOFT_TOO_THICK = 2 };
int spl_soft_thick_next(struct spl_soft_thick *plan, struct spl_soft_window *window, struct spl_error *err);

#endif
