/* Planning of windows that overlap; see thick.h. What lies from where a window begins, less the reach, to the far end
 * is cut in buckets of depth; as many of the first as fit are held, and the window ends where the first of the rest may
 * begin. Where buckets are too coarse for that, the range that they are of ends behind the one that did not fit. */
#include "render/soft/thick.h"

#include <math.h>

#include "base/float.h"
#include "shared_soft.h"

/* How far a sphere at such a depth may reach, with what kernels may be off. */
static double slack(const struct spl_soft_thick *plan, double depth)
{
    return (double)plan->reach * (1 + 4 * (double)SPL_SOFT_SLACK) + 4 * (double)SPL_SOFT_SLACK * depth;
}

/* Buckets of 2^shift depths: as few bits as give no more than SPL_SOFT_BUCKETS. */
static uint32_t shift_of(uint32_t keys)
{
    uint32_t shift = 0;
    while (((keys - 1) >> shift) >= SPL_SOFT_BUCKETS)
        shift++;
    return shift;
}

static struct spl_soft_range range_of(uint32_t low, uint32_t high)
{
    return (struct spl_soft_range){(uint64_t)low << 32, (uint64_t)high << 32};
}

/* Buckets from the first that fit together. */
static uint32_t fill(const struct spl_soft_thick *plan, uint32_t count, struct spl_soft_sum *sum)
{
    uint64_t items = 0, entries = 0;
    uint32_t i = 0;
    for (; i < count; i++) {
        items += plan->sums[i].items;
        entries += plan->sums[i].entries;
        if (items > plan->room.items || entries > plan->room.entries)
            break;
        *sum = (struct spl_soft_sum){(uint32_t)items, (uint32_t)entries};
    }
    return i;
}

int spl_soft_thick_next(struct spl_soft_thick *plan, struct spl_soft_window *window, struct spl_error *err)
{
    const uint32_t first = (uint32_t)(plan->all.first >> 32), end = (uint32_t)(plan->all.end >> 32);
    if (plan->ended || first >= end)
        return SPL_OK;
    const double from = (double)fmaxf(plan->from, spl_float_of_bits(first)), back = from - slack(plan, from);
    uint32_t low = first, high = end;
    if (plan->from > 0 && back > (double)spl_float_of_bits(first))
        low = spl_float_to_bits((float)(back * (1 - 1e-6)));
    low = low < first ? first : low < end ? low : end - 1;
    for (;;) {
        const uint32_t shift = shift_of(high - low), count = ((high - low - 1) >> shift) + 1;
        const struct spl_soft_range range = range_of(low, high);
        struct spl_soft_sum sum = {0};
        int rc = plan->measure(plan->context, &range, shift + 32, plan->sums, err);
        if (rc)
            return rc;
        const uint32_t fits = fill(plan, count, &sum);
        if (fits == count && high == end) {
            *window = (struct spl_soft_window){range, sum, SPL_SOFT_NO_END};
            plan->ended = true;
            return 1;
        }
        const uint64_t behind = low + ((uint64_t)fits << shift), next = low + ((uint64_t)(fits + 1) << shift);
        const uint32_t cut = behind < high ? (uint32_t)behind : high, coarse = next < high ? (uint32_t)next : high;
        const double depth = (double)spl_float_of_bits(cut);
        const float until = (float)((depth - slack(plan, depth)) * (1 - 1e-7));
        const bool thick = (double)until > from + (double)plan->least;
        const bool filled = 2ull * sum.items >= plan->room.items || 2ull * sum.entries >= plan->room.entries;
        if (shift && shift_of(coarse - low) < shift && !(thick && filled)) {
            high = coarse;
            continue;
        }
        if (!thick)
            return SPL_SOFT_TOO_THICK;
        *window = (struct spl_soft_window){range_of(low, cut), sum, until};
        plan->from = until;
        return 1;
    }
}
