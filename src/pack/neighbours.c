/* Nearest neighbours over Morton order. A search starts from a proven bound, given by the points beside it in order;
 * the 16 searches of a leaf share one walk over the boxes, which lists the leaves that any of their bounds reaches.
 * Where these are too many (a stray point in the leaf, or two far ends of the order), each search walks alone, nearest
 * boxes first. So neither a stray point nor a dense cluster makes a search look at more than its surroundings.
 *
 * Everything is doubles: a cloud of 10^9 metres with millimetre detail needs no special case. Loops over 16 points or
 * 8 boxes are written to vectorise, and compiled twice, for AVX2 and for the base architecture; contraction is off, so
 * both give the same bits. Read-only after creation: any thread may search. */
#include "pack/neighbours.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "pack/near_set.h"

enum { leaf = SPL_BOXES_LEAF, fan = SPL_BOXES_FAN, stack_max = SPL_BOXES_LEVELS * fan };
_Static_assert((int)leaf <= (int)SPL_POINTS_PAD, "the last leaf is read whole");
_Static_assert((int)leaf <= (int)SPL_NEAR_SET_RUN, "a leaf is added at once");

struct spl_neighbours {
    const struct spl_points *points;
    struct spl_boxes boxes;
};

struct entry {
    double squared;
    uint32_t box;
    unsigned level; /* of the group with this number, which the box is around */
};

struct spl_neighbours *spl_neighbours_create(const struct spl_points *points, unsigned threads, struct spl_error *err)
{
    struct spl_neighbours *n = spl_alloc(1, sizeof *n, err);
    if (!n)
        return NULL;
    n->points = points;
    if (!spl_boxes_init(&n->boxes, points, threads, err))
        return n;
    free(n);
    return NULL;
}

void spl_neighbours_destroy(struct spl_neighbours *neighbours)
{
    if (!neighbours)
        return;
    spl_boxes_finish(&neighbours->boxes);
    free(neighbours);
}

/* Squared distances from `at` to points first..first + count - 1, count a multiple of SPL_LANES. */
SPL_INLINE void point_distances(const struct spl_points *p, size_t first, unsigned count, const double at[3],
                                double *squared)
{
    spl_vec x = SPL_VEC(at[0]), y = SPL_VEC(at[1]), z = SPL_VEC(at[2]);
    for (unsigned k = 0; k < count; k += SPL_LANES) {
        spl_vec dx = *(const spl_vec *)(p->axis[0] + first + k) - x;
        spl_vec dy = *(const spl_vec *)(p->axis[1] + first + k) - y;
        spl_vec dz = *(const spl_vec *)(p->axis[2] + first + k) - z;
        *(spl_vec *)(squared + k) = dx * dx + dy * dy + dz * dz;
    }
}

SPL_INLINE void scan_leaf(const struct spl_points *p, size_t first, const double at[3], struct spl_near_set *c)
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
    if (n > c->wanted + SPL_NEAR_SET_SPARE)
        spl_near_set_reduce(c);
}

/* Squared distances from the box [from, to] to `SPL_LANES` boxes. */
SPL_INLINE void box_distances(const double *const low[3], const double *const high[3], const double from[3],
                              const double to[3], double *squared)
{
    spl_vec sum = SPL_VEC(0.0);
    for (int c = 0; c < 3; c++) {
        spl_vec a = SPL_VEC(from[c]), b = SPL_VEC(to[c]), l = *(const spl_vec *)low[c], h = *(const spl_vec *)high[c];
        spl_vec below = (spl_vec)((spl_mask)(l - b) & (l > b)), above = (spl_vec)((spl_mask)(a - h) & (a > h));
        sum += below * below + above * above;
    }
    *(spl_vec *)squared = sum;
}

SPL_INLINE void group_distances(const struct spl_box_group *g, const double from[3], const double to[3],
                                double squared[fan])
{
    for (int k = 0; k < fan; k += SPL_LANES) {
        const double *low[3] = {&g->low[0][k], &g->low[1][k], &g->low[2][k]};
        const double *high[3] = {&g->high[0][k], &g->high[1][k], &g->high[2][k]};
        box_distances(low, high, from, to, squared + k);
    }
}

/* A search on its own. */
SPL_INLINE void walk(const struct spl_neighbours *n, const double at[3], struct spl_near_set *c)
{
    struct entry stack[stack_max];
    unsigned depth = 0;
    stack[depth++] = (struct entry){0, 0, n->boxes.levels - 1};
    while (depth) {
        struct entry e = stack[--depth];
        if (e.squared > c->bound)
            continue;
        double squared[fan];
        group_distances(&n->boxes.groups[n->boxes.first[e.level] + e.box], at, at, squared);
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
SPL_INLINE double bound_in_order(const struct spl_points *p, size_t first, size_t size, const double at[3],
                                 unsigned wanted)
{
    double squared[SPL_NEIGHBOURS_MAX + 1 + 3 * leaf], high = 0;
    size_t padded = (size + SPL_LANES - 1) / SPL_LANES * SPL_LANES;
    point_distances(p, first, (unsigned)padded, at, squared);
    for (size_t k = size; k < padded; k++)
        squared[k] = INFINITY;
    for (size_t k = 0; k < size; k++)
        high = squared[k] > high ? squared[k] : high;
    double low = 0;
    unsigned low_count = 0, high_count = (unsigned)size;
    for (int step = 0; step < 4 && high_count > wanted; step++) {
        double t = low + (high - low) * ((double)(wanted - low_count) + 0.4) / (double)(high_count - low_count);
        unsigned count = spl_count_within(squared, (unsigned)padded, t);
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
SPL_INLINE void enter_leaf(const struct spl_neighbours *n, size_t l, unsigned wanted, struct spl_nearest *nearest)
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
    const struct spl_box_group *own = &n->boxes.groups[l / fan];
    for (int c = 0; c < 3; c++) {
        from[c] = own->low[c][l % fan];
        to[c] = own->high[c][l % fan];
    }
    struct entry stack[stack_max];
    unsigned depth = 0, leaves = 0;
    stack[depth++] = (struct entry){0, 0, n->boxes.levels - 1};
    while (depth && leaves <= SPL_NEAR_LEAVES) {
        struct entry e = stack[--depth];
        double squared[fan];
        const struct spl_box_group *g = &n->boxes.groups[n->boxes.first[e.level] + e.box];
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
    for (; leaves % SPL_LANES; leaves++)
        for (int c = 0; c < 3 && !nearest->crowded; c++) {
            nearest->low[c][leaves] = INFINITY;
            nearest->high[c][leaves] = -INFINITY;
        }
    nearest->leaves = leaves;
    nearest->leaf = l;
}

SPL_INLINE void find(const struct spl_neighbours *n, size_t i, unsigned k, struct spl_nearest *nearest)
{
    const struct spl_points *p = n->points;
    const double at[3] = {p->axis[0][i], p->axis[1][i], p->axis[2][i]};
    struct spl_near_set c;
    c.count = 0;
    c.wanted = k + 1 < p->count ? k + 1 : (unsigned)p->count;
    if (nearest->leaf != i / leaf)
        enter_leaf(n, i / leaf, c.wanted, nearest);
    c.bound = nearest->bound[i % leaf];
    if (nearest->crowded) {
        walk(n, at, &c);
    } else {
        scan_leaf(p, i / leaf * leaf, at, &c);
        for (unsigned b = 0; b < nearest->leaves; b += SPL_LANES) {
            const double *low[3] = {&nearest->low[0][b], &nearest->low[1][b], &nearest->low[2][b]};
            const double *high[3] = {&nearest->high[0][b], &nearest->high[1][b], &nearest->high[2][b]};
            double squared[SPL_LANES];
            box_distances(low, high, at, at, squared);
            for (unsigned a = 0; a < SPL_LANES; a++)
                if (squared[a] <= c.bound && nearest->leaf_index[b + a] != i / leaf)
                    scan_leaf(p, (size_t)nearest->leaf_index[b + a] * leaf, at, &c);
        }
    }
    spl_near_set_reduce(&c);

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
