/* What of a tile's draw list is soft, within a window of depth: counted, by the host's slots or by buckets of depth, or
 * gathered as items in the order of their ids. Everything belongs to the renderer's thread. */
#ifndef SPL_RENDER_SOFT_GATHER_H
#define SPL_RENDER_SOFT_GATHER_H

#include "render/renderer.h"
#include "render/soft/order.h"
#include "render/soft/plan.h"

struct spl_soft_gathering {
    struct spl_tile *tile;
    struct spl_soft_order *order;
    uint32_t slots; /* of the list: those of all its soft chunks */
    bool details;   /* items get them: something is found (of.h) */
};

struct spl_soft_counted {
    uint64_t items, entries;
    uint32_t most;      /* entries of an item */
    uint32_t low, high; /* depths, float bits */
    float reach;        /* largest radius */
    bool thin;          /* some are narrower than a sample */
};

/* How many slots the soft chunk has. */
uint32_t spl_soft_slots_of(const struct spl_draw_list *list, size_t chunk);

/* What a window has. Runs what was recorded. */
int spl_soft_count(const struct spl_soft_gathering *from, const struct spl_soft_range *window,
                   struct spl_soft_counted *sum, struct spl_error *err);
/* Records the gathering of the window that was counted last, all of which fits. */
int spl_soft_gather(const struct spl_soft_gathering *from, const struct spl_soft_range *window, struct spl_error *err);
/* measure() of plan.h and thick.h; `context` is a struct spl_soft_gathering. Runs what was recorded. */
int spl_soft_measure(void *context, const struct spl_soft_range *range, uint32_t shift, struct spl_soft_sum *sums,
                     struct spl_error *err);

#endif
