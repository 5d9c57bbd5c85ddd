/* Points of equal keys are ordered within their own bounds, recursively, so that a dense cluster in a wide cloud is as
 * well ordered as any other. Equal coordinates can only lie in one such run, so duplicates are told here: of them the
 * point stays that has a station, a normal, the greater class and colour, and so on. Any thread. */
#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "pack/order.h"
#include "pack/order_parts.h"

enum { short_run = 32 };

static int compare_whole(uint32_t a, uint32_t b)
{
    return (a > b) - (a < b);
}

static int compare_reals(double a, double b)
{
    return (a > b) - (a < b);
}

static int compare_pairs(const void *a, const void *b)
{
    const struct spl_order_pair *p = a, *q = b;
    if (p->key != q->key)
        return p->key < q->key ? -1 : 1;
    return p->index < q->index ? -1 : p->index > q->index;
}

/* Which of two points at one place comes first: by what they have beside it. 0 where that is the same too. */
static int compare_points(const struct spl_points *p, uint32_t a, uint32_t b)
{
    int order = p->station ? compare_whole(p->station[a], p->station[b]) : 0; /* SPL_NO_STATION is the greatest */
    for (int c = 0; p->normal && !order && c < 3; c++)
        order = compare_reals((double)p->normal[b][c], (double)p->normal[a][c]);
    if (!order)
        order = compare_whole(p->color_class[b], p->color_class[a]);
    for (int s = 0; !order && s < SPL_POINT_SCALARS; s++)
        if (p->scalar[s].values)
            order = compare_whole(spl_scalar_number(&p->scalar[s], a), spl_scalar_number(&p->scalar[s], b));
    return order;
}

void spl_order_keep_one(const struct spl_points *p, uint32_t *index, size_t n)
{
    for (size_t i = 1; i < n; i++) {
        if (i % SPL_ORDER_RANDOM_GRAIN == 0)
            spl_spill_keep_bound(p->spill);
        index[0] = compare_points(p, index[i], index[0]) < 0 ? index[i] : index[0];
        index[i] = SPL_ORDER_DROPPED;
    }
}

/* Each level divides the extent by 2^21, so doubles end the recursion after a few. */
bool spl_order_equal(const struct spl_points *p, uint32_t *index, size_t n)
{
    double low[3], size = 0;
    spl_spill_keep_bound(p->spill);
    for (int c = 0; c < 3; c++) {
        double high = low[c] = spl_points_at(p, c, index[0]);
        for (size_t i = 1; i < n; i++) {
            double v = spl_points_at(p, c, index[i]);
            low[c] = v < low[c] ? v : low[c];
            high = v > high ? v : high;
        }
        size = fmax(size, high - low[c]);
    }
    if (size == 0) {
        spl_order_keep_one(p, index, n);
        return true;
    }
    struct spl_order_pair few[short_run], *many = n <= short_run ? NULL : spl_alloc_raw(n, sizeof *many, NULL);
    struct spl_order_pair *pairs = n <= short_run ? few : many;
    if (!pairs)
        return false;
    for (size_t i = 0; i < n; i++)
        pairs[i] = (struct spl_order_pair){spl_points_key(p, index[i], low, size), index[i]};
    qsort(pairs, n, sizeof *pairs, compare_pairs);
    for (size_t i = 0; i < n; i++)
        index[i] = pairs[i].index;
    bool done = true;
    for (size_t i = 0, end; i < n; i = end) {
        for (end = i + 1; end < n && pairs[end].key == pairs[i].key;)
            end++;
        done &= end - i == 1 || spl_order_equal(p, index + i, end - i);
    }
    free(many);
    return done;
}
