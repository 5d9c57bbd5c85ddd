/* Planning of windows of depth; see plan.h. A level is a range cut into buckets whose contents are known: buckets that
 * fit together become a window, one that is too full becomes a level of its own, down to a depth and there to the slots
 * of ids. So a window ends where the next begins, and none is larger than it must. */
#include "render/soft/plan.h"

static uint32_t width(uint64_t n)
{
    return n ? 64u - (uint32_t)__builtin_clzll(n) : 0;
}

static int push(struct spl_soft_plan *plan, const struct spl_soft_range *range, struct spl_error *err)
{
    spl_assert(plan->depth < SPL_SOFT_LEVELS);
    struct spl_soft_level *level = &plan->levels[plan->depth];
    const uint64_t last = range->end - range->first - 1;
    const uint32_t bits = width(last);
    level->range = *range;
    level->shift = bits > SPL_SOFT_BUCKETS_LOG2 ? bits - SPL_SOFT_BUCKETS_LOG2 : 0;
    if (bits > 32 && level->shift < 32)
        level->shift = 32;
    level->count = (uint32_t)(last >> level->shift) + 1;
    level->next = 0;
    int rc = plan->measure(plan->context, range, level->shift, level->sums, err);
    plan->depth += !rc;
    return rc;
}

static struct spl_soft_range range_of(const struct spl_soft_level *level, uint32_t from, uint32_t to)
{
    uint64_t end = level->range.first + ((uint64_t)to << level->shift);
    return (struct spl_soft_range){level->range.first + ((uint64_t)from << level->shift),
                                   to == level->count || end > level->range.end ? level->range.end : end};
}

static bool fits(const struct spl_soft_plan *plan, uint64_t items, uint64_t entries)
{
    return items <= plan->room.items && entries <= plan->room.entries;
}

int spl_soft_plan_begin(struct spl_soft_plan *plan, const struct spl_soft_range *range, struct spl_error *err)
{
    plan->depth = 0;
    return range->end > range->first ? push(plan, range, err) : SPL_OK;
}

int spl_soft_plan_next(struct spl_soft_plan *plan, struct spl_soft_range *window, struct spl_soft_sum *sum,
                       struct spl_error *err)
{
    while (plan->depth) {
        struct spl_soft_level *level = &plan->levels[plan->depth - 1];
        uint64_t items = 0, entries = 0;
        while (level->next < level->count && !level->sums[level->next].items)
            level->next++;
        const uint32_t from = level->next;
        while (level->next < level->count && fits(plan, items + level->sums[level->next].items,
                                                  entries + level->sums[level->next].entries)) {
            items += level->sums[level->next].items;
            entries += level->sums[level->next++].entries;
        }
        if (from == level->count) {
            plan->depth--;
            continue;
        }
        if (level->next == from) { /* too full for itself */
            const struct spl_soft_range own = range_of(level, from, from + 1);
            level->next++;
            if (level->shift) {
                int rc = push(plan, &own, err);
                if (rc)
                    return rc;
                continue;
            }
            items = level->sums[from].items;
            entries = level->sums[from].entries;
        }
        *window = range_of(level, from, level->next);
        *sum = (struct spl_soft_sum){(uint32_t)items, (uint32_t)entries};
        return 1;
    }
    return SPL_OK;
}
