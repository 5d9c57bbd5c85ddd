/* Nearest neighbours over Morton order: every 16 points in a row are a leaf with a box, every 8 boxes a group with a
 * box of its own, up to one group. A search starts from a proven bound, given by the points beside it in order; the 16
 * searches of a leaf share one walk over the boxes, which lists the leaves that any of their bounds reaches. Where
 * these are too many (a stray point in the leaf, or two far ends of the order), each search walks alone, nearest boxes
 * first. What lies within the bound is collected, and the bound tightened whenever the buffer is full; so neither a
 * stray point nor a dense cluster makes a search look at more than its surroundings.
 *
 * Everything is doubles: a cloud of 10^9 metres with millimetre detail needs no special case. Loops over 16 points or
 * 8 boxes are written to vectorise, and compiled twice, for AVX2 and for the base architecture; contraction is off, so
 * both give the same bits. Read-only after creation: any thread may search. */
#include "pack/neighbours.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "base/parallel.h"

enum {
    lanes = 4,
    leaf = SPL_NEAR_LEAF,
    fan = 8,
    levels_max = 12,
    stack_max = levels_max * fan,
    spare = 40, /* candidates beyond the wanted ones that wait for a reduction */
    buffer_max = (SPL_NEIGHBOURS_MAX + 1 + spare + leaf + lanes - 1) / lanes * lanes
};
_Static_assert((int)leaf <= (int)SPL_POINTS_PAD, "the last leaf is read whole");

struct group {
    double low[3][fan], high[3][fan];
};

struct spl_neighbours {
    const struct spl_points *points;
    struct group *groups;     /* all levels, leaves' first */
    size_t first[levels_max]; /* of each level in groups */
    size_t boxes[levels_max]; /* used ones of each level */
    unsigned levels;
};

struct candidates {
    unsigned count, wanted;
    double bound; /* squared; `wanted` points lie within it */
    double squared[buffer_max];
    uint32_t index[buffer_max];
};

struct entry {
    double squared;
    uint32_t box;
    unsigned level; /* whose groups the box names: `box` is a group of that level */
};

static void leaf_boxes(void *context, size_t begin, size_t end, unsigned worker)
{
    struct spl_neighbours *n = context;
    const struct spl_points *p = n->points;
    (void)worker;
    for (size_t box = begin; box < end; box++) {
        size_t first = box * leaf, last = first + leaf < p->count ? first + leaf : p->count;
        struct group *g = &n->groups[box / fan];
        for (int c = 0; c < 3; c++) {
            double low = INFINITY, high = -INFINITY;
            for (size_t i = first; i < last; i++) {
                low = p->axis[c][i] < low ? p->axis[c][i] : low;
                high = p->axis[c][i] > high ? p->axis[c][i] : high;
            }
            g->low[c][box % fan] = low;
            g->high[c][box % fan] = high;
        }
    }
}

struct spl_neighbours *spl_neighbours_create(const struct spl_points *points, unsigned threads, struct spl_error *err)
{
    struct spl_neighbours *n = spl_alloc(1, sizeof *n, err);
    if (!n)
        return NULL;
    n->points = points;
    size_t total = 0;
    for (size_t boxes = (points->count + leaf - 1) / leaf; n->levels == 0 || boxes > 1; n->levels++) {
        size_t groups = (boxes + fan - 1) / fan;
        n->boxes[n->levels] = boxes;
        n->first[n->levels] = total;
        total += groups;
        boxes = groups;
    }
    n->groups = spl_alloc_raw(total, sizeof *n->groups, err);
    if (!n->groups) {
        spl_neighbours_destroy(n);
        return NULL;
    }
    for (unsigned l = 0; l < n->levels; l++) {
        struct group *groups = n->groups + n->first[l];
        for (size_t box = n->boxes[l]; box % fan; box++)
            for (int c = 0; c < 3; c++) {
                groups[box / fan].low[c][box % fan] = INFINITY;
                groups[box / fan].high[c][box % fan] = -INFINITY;
            }
        if (l == 0) {
            spl_parallel_for(threads, n->boxes[0], 4096 * fan, leaf_boxes, n);
            continue;
        }
        const struct group *below = n->groups + n->first[l - 1];
        for (size_t box = 0; box < n->boxes[l]; box++)
            for (int c = 0; c < 3; c++) {
                double low = INFINITY, high = -INFINITY;
                for (int k = 0; k < fan; k++) {
                    low = fmin(low, below[box].low[c][k]);
                    high = fmax(high, below[box].high[c][k]);
                }
                groups[box / fan].low[c][box % fan] = low;
                groups[box / fan].high[c][box % fan] = high;
            }
    }
    return n;
}

void spl_neighbours_destroy(struct spl_neighbours *neighbours)
{
    if (!neighbours)
        return;
    free(neighbours->groups);
    free(neighbours);
}

#define INLINE static inline __attribute__((always_inline))

/* Four doubles, unaligned in memory; comparisons give masks. */
typedef double vec __attribute__((vector_size(32), aligned(8), may_alias));
typedef int64_t mask __attribute__((vector_size(32), aligned(8), may_alias));
#define SPLAT(v) ((vec){v, v, v, v})

/* How many of `n` values, padded with infinity to whole lanes, are at most `limit`. */
INLINE unsigned count_within(const double *values, unsigned n, double limit)
{
    vec most = SPLAT(limit);
    mask sum = {0};
    for (unsigned i = 0; i < n; i += lanes)
        sum -= *(const vec *)(values + i) <= most;
    return (unsigned)(sum[0] + sum[1] + sum[2] + sum[3]);
}

/* The least of `n` values above `limit`. */
INLINE double next_above(const double *values, unsigned n, double limit)
{
    double least = INFINITY;
    for (unsigned i = 0; i < n; i++)
        least = values[i] > limit && values[i] < least ? values[i] : least;
    return least;
}

/* Keeps the `wanted` nearest candidates and tightens the bound to the farthest of them. The threshold that counts just
 * `wanted` is found by false position: on a surface the count grows linearly with the squared distance. Where several
 * are equally far (points on a grid), the first of them are kept. */
INLINE void reduce(struct candidates *c)
{
    unsigned n = c->count, low_count = 0, high_count = n, wanted = c->wanted, ties = 0;
    if (n <= wanted)
        return;
    for (unsigned i = n; i % lanes; i++)
        c->squared[i] = INFINITY;
    double low = -1, high = c->bound, at_tie = INFINITY;
    for (int step = 0; low_count < wanted && ties == 0; step++) {
        bool by_value = step >= 4;
        double from = low > 0 ? low : 0;
        double t = by_value
                       ? next_above(c->squared, n, low)
                       : from + (high - from) * ((double)(wanted - low_count) + 0.4) / (double)(high_count - low_count);
        unsigned count = count_within(c->squared, n, t);
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
    double farthest = 0;
    for (unsigned i = 0; i < wanted; i++)
        farthest = c->squared[i] > farthest ? c->squared[i] : farthest;
    c->count = wanted;
    c->bound = farthest;
}

/* Squared distances from `at` to points first..first + count - 1, count a multiple of the lanes. */
INLINE void point_distances(const struct spl_points *p, size_t first, unsigned count, const double at[3],
                            double *squared)
{
    vec x = SPLAT(at[0]), y = SPLAT(at[1]), z = SPLAT(at[2]);
    for (unsigned k = 0; k < count; k += lanes) {
        vec dx = *(const vec *)(p->axis[0] + first + k) - x;
        vec dy = *(const vec *)(p->axis[1] + first + k) - y;
        vec dz = *(const vec *)(p->axis[2] + first + k) - z;
        *(vec *)(squared + k) = dx * dx + dy * dy + dz * dz;
    }
}

INLINE void scan_leaf(const struct spl_points *p, size_t first, const double at[3], struct candidates *c)
{
    double squared[leaf], bound = c->bound;
    point_distances(p, first, leaf, at, squared);
    unsigned n = c->count, used = p->count - first < leaf ? (unsigned)(p->count - first) : leaf;
    for (unsigned k = 0; k < used; k++) {
        c->squared[n] = squared[k];
        c->index[n] = (uint32_t)first + k;
        n += squared[k] <= bound;
    }
    c->count = n;
    if (n > c->wanted + spare)
        reduce(c);
}

/* Squared distances from the box [from, to] to `lanes` boxes. */
INLINE void box_distances(const double *const low[3], const double *const high[3], const double from[3],
                          const double to[3], double *squared)
{
    vec sum = SPLAT(0.0);
    for (int c = 0; c < 3; c++) {
        vec a = SPLAT(from[c]), b = SPLAT(to[c]), l = *(const vec *)low[c], h = *(const vec *)high[c];
        vec below = (vec)((mask)(l - b) & (l > b)), above = (vec)((mask)(a - h) & (a > h));
        sum += below * below + above * above;
    }
    *(vec *)squared = sum;
}

INLINE void group_distances(const struct group *g, const double from[3], const double to[3], double squared[fan])
{
    for (int k = 0; k < fan; k += lanes) {
        const double *low[3] = {&g->low[0][k], &g->low[1][k], &g->low[2][k]};
        const double *high[3] = {&g->high[0][k], &g->high[1][k], &g->high[2][k]};
        box_distances(low, high, from, to, squared + k);
    }
}

/* A search on its own. */
INLINE void walk(const struct spl_neighbours *n, const double at[3], struct candidates *c)
{
    struct entry stack[stack_max];
    unsigned depth = 0;
    stack[depth++] = (struct entry){0, 0, n->levels - 1};
    while (depth) {
        struct entry e = stack[--depth];
        if (e.squared > c->bound)
            continue;
        double squared[fan];
        group_distances(&n->groups[n->first[e.level] + e.box], at, at, squared);
        struct entry near[fan];
        int count = 0;
        for (unsigned k = 0; k < fan; k++) {
            near[count] = (struct entry){squared[k], e.box * fan + k, e.level - 1};
            count += squared[k] <= c->bound;
        }
        for (int i = 1; i < count; i++) { /* farthest first: the nearest is taken from the top */
            struct entry moved = near[i];
            int k = i;
            for (; k > 0 && near[k - 1].squared < moved.squared; k--)
                near[k] = near[k - 1];
            near[k] = moved;
        }
        if (e.level > 0) {
            for (int i = 0; i < count; i++)
                stack[depth++] = near[i];
        } else {
            for (int i = count; i-- > 0;)
                if (near[i].squared <= c->bound)
                    scan_leaf(n->points, (size_t)near[i].box * leaf, at, c);
        }
    }
}

/* A squared distance within which at least `wanted` points lie, the point itself included: those beside it in order. */
INLINE double bound_in_order(const struct spl_points *p, size_t first, size_t size, const double at[3], unsigned wanted)
{
    double squared[SPL_NEIGHBOURS_MAX + 1 + 3 * leaf], high = 0;
    size_t padded = (size + lanes - 1) / lanes * lanes;
    point_distances(p, first, (unsigned)padded, at, squared);
    for (size_t k = size; k < padded; k++)
        squared[k] = INFINITY;
    for (size_t k = 0; k < size; k++)
        high = squared[k] > high ? squared[k] : high;
    double low = 0;
    unsigned low_count = 0, high_count = (unsigned)size;
    for (int step = 0; step < 4 && high_count > wanted; step++) {
        double t = low + (high - low) * ((double)(wanted - low_count) + 0.4) / (double)(high_count - low_count);
        unsigned count = count_within(squared, (unsigned)padded, t);
        if (count < wanted) {
            low = t;
            low_count = count;
        } else {
            high = t;
            high_count = count;
        }
    }
    return high;
}

/* What the searches for the points of leaf `l` share. */
INLINE void enter_leaf(const struct spl_neighbours *n, size_t l, unsigned wanted, struct spl_nearest *nearest)
{
    const struct spl_points *p = n->points;
    size_t begin = l * leaf, end = begin + leaf < p->count ? begin + leaf : p->count;
    size_t size = wanted + leaf < p->count ? wanted + leaf : p->count;
    size_t before = (size - (end - begin)) / 2, first = begin > before ? begin - before : 0;
    first = first + size > p->count ? p->count - size : first;
    double reach = 0, from[3], to[3];
    for (size_t i = begin; i < end; i++) {
        const double at[3] = {p->axis[0][i], p->axis[1][i], p->axis[2][i]};
        double bound = nearest->bound[i - begin] = bound_in_order(p, first, size, at, wanted);
        reach = bound > reach ? bound : reach;
    }
    const struct group *own = &n->groups[l / fan];
    for (int c = 0; c < 3; c++) {
        from[c] = own->low[c][l % fan];
        to[c] = own->high[c][l % fan];
    }
    struct entry stack[stack_max];
    unsigned depth = 0, leaves = 0;
    stack[depth++] = (struct entry){0, 0, n->levels - 1};
    while (depth && leaves <= SPL_NEAR_LEAVES) {
        struct entry e = stack[--depth];
        double squared[fan];
        const struct group *g = &n->groups[n->first[e.level] + e.box];
        group_distances(g, from, to, squared);
        for (unsigned k = 0; k < fan; k++) {
            if (!(squared[k] <= reach))
                continue;
            if (e.level > 0) {
                stack[depth++] = (struct entry){squared[k], e.box * fan + k, e.level - 1};
            } else if (leaves++ < SPL_NEAR_LEAVES) {
                nearest->leaf_index[leaves - 1] = e.box * fan + k;
                for (int c = 0; c < 3; c++) {
                    nearest->low[c][leaves - 1] = g->low[c][k];
                    nearest->high[c][leaves - 1] = g->high[c][k];
                }
            }
        }
    }
    nearest->crowded = leaves > SPL_NEAR_LEAVES;
    for (; leaves % lanes; leaves++)
        for (int c = 0; c < 3 && !nearest->crowded; c++) {
            nearest->low[c][leaves] = INFINITY;
            nearest->high[c][leaves] = -INFINITY;
        }
    nearest->leaves = leaves;
    nearest->leaf = l;
}

INLINE void find(const struct spl_neighbours *n, size_t i, unsigned k, struct spl_nearest *nearest)
{
    const struct spl_points *p = n->points;
    const double at[3] = {p->axis[0][i], p->axis[1][i], p->axis[2][i]};
    struct candidates c;
    c.count = 0;
    c.wanted = k + 1 < p->count ? k + 1 : (unsigned)p->count;
    if (nearest->leaf != i / leaf)
        enter_leaf(n, i / leaf, c.wanted, nearest);
    c.bound = nearest->bound[i % leaf];
    if (nearest->crowded) {
        walk(n, at, &c);
    } else {
        scan_leaf(p, i / leaf * leaf, at, &c);
        for (unsigned b = 0; b < nearest->leaves; b += lanes) {
            const double *low[3] = {&nearest->low[0][b], &nearest->low[1][b], &nearest->low[2][b]};
            const double *high[3] = {&nearest->high[0][b], &nearest->high[1][b], &nearest->high[2][b]};
            double squared[lanes];
            box_distances(low, high, at, at, squared);
            for (unsigned a = 0; a < lanes; a++)
                if (squared[a] <= c.bound && nearest->leaf_index[b + a] != i / leaf)
                    scan_leaf(p, (size_t)nearest->leaf_index[b + a] * leaf, at, &c);
        }
    }
    reduce(&c);

    unsigned kept = 0;
    for (unsigned a = 0; a < c.count; a++) {
        nearest->index[kept] = c.index[a];
        nearest->squared[kept] = c.squared[a];
        kept += c.index[a] != i;
    }
    nearest->count = kept < k ? kept : k;
    double farthest = 0;
    for (unsigned a = 0; a < nearest->count; a++)
        farthest = nearest->squared[a] > farthest ? nearest->squared[a] : farthest;
    nearest->farthest = sqrt(farthest);
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) static void find_avx2(const struct spl_neighbours *n, size_t i, unsigned k,
                                                      struct spl_nearest *nearest)
{
    find(n, i, k, nearest);
}
#endif

void spl_neighbours_find(const struct spl_neighbours *neighbours, size_t i, unsigned k, struct spl_nearest *nearest)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2")) {
        find_avx2(neighbours, i, k, nearest);
        return;
    }
#endif
    find(neighbours, i, k, nearest);
}
