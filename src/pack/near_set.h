/* Collecting the nearest of many points: what lies within a bound is added, and the bound tightened whenever
 * SPL_NEAR_SET_SPARE more than the wanted ones are there, so that a dense cluster costs a search no more than its
 * surroundings. Loops are written to vectorise, and inline, so that they are compiled for whatever processor the search
 * that uses them is. */
#ifndef SPL_PACK_NEAR_SET_H
#define SPL_PACK_NEAR_SET_H

#include <math.h>

#include "pack/points.h"

#define SPL_INLINE static inline __attribute__((always_inline))

/* Four doubles, unaligned in memory; comparisons give masks. */
enum { SPL_LANES = 4 };
typedef double spl_vec __attribute__((vector_size(32), aligned(8), may_alias));
typedef int64_t spl_mask __attribute__((vector_size(32), aligned(8), may_alias));
#define SPL_VEC(v) ((spl_vec){v, v, v, v})

enum {
    SPL_NEAR_SET_SPARE = 40, /* points beyond the wanted ones that wait for a reduction */
    SPL_NEAR_SET_RUN = 16,   /* a search adds at most before it reduces again */
    SPL_NEAR_SET_MAX =
        (SPL_NEIGHBOURS_MAX + 1 + SPL_NEAR_SET_SPARE + SPL_NEAR_SET_RUN + SPL_LANES - 1) / SPL_LANES * SPL_LANES
};

struct spl_near_set {
    unsigned count, wanted; /* of which SPL_NEIGHBOURS_MAX + 1 at most */
    double bound;           /* squared; `wanted` points lie within it */
    double squared[SPL_NEAR_SET_MAX];
    uint32_t index[SPL_NEAR_SET_MAX];
};

/* How many of `n` values, padded with infinity to whole SPL_LANES, are at most `limit`. */
SPL_INLINE unsigned spl_count_within(const double *values, unsigned n, double limit)
{
    spl_vec most = SPL_VEC(limit);
    spl_mask sum = {0};
    for (unsigned i = 0; i < n; i += SPL_LANES)
        sum -= *(const spl_vec *)(values + i) <= most;
    return (unsigned)(sum[0] + sum[1] + sum[2] + sum[3]);
}

/* The least of `n` values, padded like these, above `limit`. */
SPL_INLINE double spl_next_above(const double *values, unsigned n, double limit)
{
    spl_vec floor = SPL_VEC(limit), least = SPL_VEC(INFINITY);
    for (unsigned i = 0; i < n; i += SPL_LANES) {
        spl_vec v = *(const spl_vec *)(values + i);
        spl_mask less = (v > floor) & (v < least);
        least = (spl_vec)(((spl_mask)v & less) | ((spl_mask)least & ~less));
    }
    double a = least[0] < least[1] ? least[0] : least[1], b = least[2] < least[3] ? least[2] : least[3];
    return a < b ? a : b;
}

/* Keeps the `wanted` nearest candidates and tightens the bound to just them. The threshold that counts just `wanted`
 * is found by false position: on a surface the count grows linearly with the squared distance. Where several are
 * equally far (points on a grid), the first of them are kept. */
SPL_INLINE void spl_near_set_reduce(struct spl_near_set *c)
{
    unsigned n = c->count, low_count = 0, high_count = n, wanted = c->wanted, ties = 0;
    if (n <= wanted)
        return;
    for (unsigned i = n; i % SPL_LANES; i++)
        c->squared[i] = INFINITY;
    double low = -1, high = c->bound, at_tie = INFINITY;
    for (int step = 0; low_count < wanted && ties == 0; step++) {
        bool by_value = step >= 6;
        double from = low > 0 ? low : 0;
        double t = by_value
                       ? spl_next_above(c->squared, n, low)
                       : from + (high - from) * ((double)(wanted - low_count) + 0.4) / (double)(high_count - low_count);
        unsigned count = spl_count_within(c->squared, n, t);
        if (count <= wanted) {
            low = t;
            low_count = count;
        } else if (by_value) { /* all between low and t are at t */
            at_tie = t;
            ties = wanted - low_count;
        } else {
            high = t;
            high_count = count;
        }
    }
    unsigned kept = 0;
    for (unsigned i = 0; i < n; i++) {
        double d = c->squared[i];
        c->squared[kept] = d;
        c->index[kept] = c->index[i];
        unsigned tie = ties > 0 && d == at_tie;
        ties -= tie;
        kept += (d <= low) | tie;
    }
    c->count = wanted;
    c->bound = at_tie < INFINITY ? at_tie : low;
}

#endif
