/* Nearest neighbours over Morton order: every 16 points in a row are a leaf with a box, every 8 boxes a group with a box
 * of its own, up to one group. A search starts from a proven bound (the points beside it in order, or the last search's
 * ball moved to here), walks the boxes nearest first, collects what lies within the bound and tightens it whenever the
 * buffer is full; so neither a stray point nor a dense cluster makes it look at more than its surroundings.
 *
 * Everything is doubles: a cloud of 10^9 metres with millimetre detail needs no special case. Loops over 16 points or
 * 8 boxes are written to vectorise, and compiled twice, for AVX2 and for the base architecture; contraction is off, so
 * both give the same bits. Read-only after creation: any thread may search. */
#include "pack/neighbours.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "base/parallel.h"

enum { leaf = 16, fan = 8, levels_max = 12, buffer_max = 2 * SPL_NEIGHBOURS_MAX, stack_max = levels_max * fan };
_Static_assert((int)leaf <= (int)SPL_POINTS_PAD, "the last leaf is read whole");

struct group {
    double low[3][fan], high[3][fan];
};

struct spl_neighbours {
    const struct spl_points *points;
    struct group *groups;             /* all levels, leaves' first */
    size_t first[levels_max];         /* of each level in groups */
    size_t boxes[levels_max];         /* used ones of each level */
    unsigned levels;
};

struct candidates {
    unsigned count, wanted;           /* wanted < buffer_max - leaf */
    double bound;                     /* squared; `wanted` points lie within it */
    double squared[buffer_max + leaf];
    uint32_t index[buffer_max + leaf];
};

struct entry {
    double squared;
    uint32_t box;
    unsigned level;                   /* whose groups the box names: `box` is a group of that level */
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

/* Keeps the `wanted` nearest candidates and tightens the bound to the farthest of them. The threshold that counts just
 * `wanted` is found by false position: on a surface the count grows linearly with the squared distance. */
INLINE void reduce(struct candidates *c)
{
    unsigned n = c->count, low_count = 0, high_count = n, wanted = c->wanted;
    if (n <= wanted)
        return;
    double low = 0, high = c->bound, threshold = -1;
    for (int step = 0; step < 10 && threshold < 0; step++) {
        double t = low + (high - low) * ((double)(wanted - low_count) + 0.4) / (double)(high_count - low_count);
        unsigned count = 0;
        for (unsigned i = 0; i < n; i++)
            count += c->squared[i] <= t;
        if (count == wanted) {
            threshold = t;
        } else if (count < wanted) {
            low = t;
            low_count = count;
        } else {
            high = t;
            high_count = count;
        }
    }
    double farthest = 0;
    if (threshold >= 0) {
        unsigned kept = 0;
        for (unsigned i = 0; i < n; i++) {
            double d = c->squared[i];
            c->squared[kept] = d;
            c->index[kept] = c->index[i];
            kept += d <= threshold;
            farthest = d <= threshold && d > farthest ? d : farthest;
        }
    } else { /* ties, as on a grid */
        for (unsigned i = 1; i < n; i++) {
            double d = c->squared[i];
            uint32_t index = c->index[i];
            unsigned k = i;
            for (; k > 0 && c->squared[k - 1] > d; k--) {
                c->squared[k] = c->squared[k - 1];
                c->index[k] = c->index[k - 1];
            }
            c->squared[k] = d;
            c->index[k] = index;
        }
        farthest = c->squared[wanted - 1];
    }
    c->count = wanted;
    c->bound = farthest;
}

INLINE void scan_leaf(const struct spl_points *p, size_t first, const double at[3], struct candidates *c)
{
    const double *x = p->axis[0] + first, *y = p->axis[1] + first, *z = p->axis[2] + first;
    double squared[leaf];
    for (int k = 0; k < leaf; k++) {
        double dx = x[k] - at[0], dy = y[k] - at[1], dz = z[k] - at[2];
        squared[k] = dx * dx + dy * dy + dz * dz;
    }
    unsigned n = c->count, used = p->count - first < leaf ? (unsigned)(p->count - first) : leaf;
    double bound = c->bound;
    for (unsigned k = 0; k < used; k++) {
        c->squared[n] = squared[k];
        c->index[n] = (uint32_t)first + k;
        n += squared[k] <= bound;
    }
    c->count = n;
    if (n > buffer_max - leaf || n > c->wanted + 40)
        reduce(c);
}

/* Squared distances from `at` to the boxes of a group. */
INLINE void group_distances(const struct group *g, const double at[3], double squared[fan])
{
    for (int k = 0; k < fan; k++)
        squared[k] = 0;
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < fan; k++) {
            double below = g->low[c][k] - at[c], above = at[c] - g->high[c][k];
            double d = below > above ? below : above;
            d = d > 0 ? d : 0;
            squared[k] += d * d;
        }
}

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
        group_distances(&n->groups[n->first[e.level] + e.box], at, squared);
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
INLINE double bound_in_order(const struct spl_points *p, size_t i, const double at[3], unsigned wanted)
{
    struct candidates window;
    size_t size = wanted + 8 < p->count ? wanted + 8 : p->count;
    size_t first = i > size / 2 ? i - size / 2 : 0;
    first = first + size > p->count ? p->count - size : first;
    window.count = (unsigned)size;
    window.wanted = wanted;
    double farthest = 0;
    for (size_t k = 0; k < size; k++) {
        double dx = p->axis[0][first + k] - at[0], dy = p->axis[1][first + k] - at[1], dz = p->axis[2][first + k] - at[2];
        window.squared[k] = dx * dx + dy * dy + dz * dz;
        farthest = window.squared[k] > farthest ? window.squared[k] : farthest;
    }
    window.bound = farthest;
    reduce(&window);
    return window.bound;
}

INLINE void find(const struct spl_neighbours *n, size_t i, unsigned k, struct spl_nearest *nearest)
{
    const struct spl_points *p = n->points;
    const double at[3] = {p->axis[0][i], p->axis[1][i], p->axis[2][i]};
    struct candidates c;
    c.count = 0;
    c.wanted = k + 1 < p->count ? k + 1 : (unsigned)p->count;
    c.bound = INFINITY;
    if (nearest->warm) { /* the last ball holds `wanted` points; so does one about here that contains it */
        double dx = at[0] - nearest->at[0], dy = at[1] - nearest->at[1], dz = at[2] - nearest->at[2];
        double reach = (sqrt(dx * dx + dy * dy + dz * dz) + nearest->farthest) * (1 + 1e-12);
        c.bound = reach * reach;
    }
    double beside = bound_in_order(p, i, at, c.wanted);
    c.bound = beside < c.bound ? beside : c.bound;
    walk(n, at, &c);
    reduce(&c);

    unsigned kept = 0;
    double farthest = 0;
    for (unsigned a = 0; a < c.count; a++) {
        nearest->index[kept] = c.index[a];
        nearest->squared[kept] = c.squared[a];
        kept += c.index[a] != i;
        farthest = c.squared[a] > farthest ? c.squared[a] : farthest;
    }
    nearest->count = kept < k ? kept : k;
    nearest->farthest = sqrt(farthest);
    nearest->warm = true;
    for (int axis = 0; axis < 3; axis++)
        nearest->at[axis] = at[axis];
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
