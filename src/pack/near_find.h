/* A search: included by a file for each set of instructions (near_set.h), which calls spl_near_find(). Loops over 16
 * points or 8 boxes are written to vectorise; contraction is off, so all give the same bits. Each kind of coordinates
 * has a search of its own. */
#ifndef SPL_PACK_NEAR_FIND_H
#define SPL_PACK_NEAR_FIND_H

#include "pack/near_set.h"
#include "pack/neighbours.h"

/* The k points that `takes` takes, within a squared distance. */
struct spl_near_some {
    unsigned k;
    double bound;
    spl_neighbours_takes *takes;
    const void *context;
};

/* Searches as files of their own have them. The second says how many points it looked at. */
typedef void spl_near_find_of(const struct spl_boxes *boxes, const struct spl_points *points, size_t i, unsigned k,
                              struct spl_nearest *nearest);
typedef unsigned spl_near_find_some_of(const struct spl_boxes *boxes, const struct spl_points *points, size_t i,
                                       const struct spl_near_some *some, struct spl_nearest *nearest);
spl_near_find_of spl_near_find_avx2, spl_near_find_avx512;
spl_near_find_some_of spl_near_find_some_avx2, spl_near_find_some_avx512;

enum { leaf = SPL_BOXES_LEAF, fan = SPL_BOXES_FAN, stack_max = SPL_BOXES_LEVELS * fan };
_Static_assert((int)leaf <= (int)SPL_POINTS_PAD, "the last leaf is read whole");
_Static_assert((int)leaf <= (int)SPL_NEAR_SET_RUN, "a leaf is added at once");

struct entry {
    double squared;
    uint32_t box;
    unsigned level; /* the box is around the group with this number of the level below; on level 0 a leaf */
};

/* Coordinates of SPL_LANES points; `kind` is a constant wherever this is compiled. */
SPL_INLINE void load_points(const struct spl_points *p, enum spl_points_kind kind, size_t first, spl_vec at[3])
{
    if (kind == SPL_POINTS_DOUBLES)
        for (int c = 0; c < 3; c++)
            at[c] = *(const spl_vec *)(p->axis[c] + first);
    else if (kind == SPL_POINTS_FLOATS)
        for (int c = 0; c < 3; c++)
            at[c] = spl_from_floats(*(const spl_vec_floats *)(p->floats[c] + first));
    else
        for (int c = 0; c < 3; c++)
            at[c] = spl_from_steps(*(const spl_vec_steps *)(p->steps[c] + first)) * p->step[c] + p->first[c];
}

/* Squared distances from `at` to SPL_LANES points. */
SPL_INLINE spl_vec point_distances(const struct spl_points *p, enum spl_points_kind kind, size_t first,
                                   const double at[3])
{
    spl_vec to[3];
    load_points(p, kind, first, to);
    spl_vec dx = to[0] - at[0], dy = to[1] - at[1], dz = to[2] - at[2];
    return dx * dx + dy * dy + dz * dz;
}

/* Appends the points of the leaf from `first` on that lie within `bound` to `n` of them; how many there are then. */
SPL_INLINE unsigned list_leaf(const struct spl_points *p, enum spl_points_kind kind, size_t first, const double at[3],
                              double bound, unsigned n, double squared[], uint32_t index[])
{
    const unsigned used = p->count - first < leaf ? (unsigned)(p->count - first) : leaf;
    for (unsigned k = 0; k < leaf; k += SPL_LANES) {
        spl_vec distances = point_distances(p, kind, first + k, at);
        unsigned bits = spl_bits_within(distances, bound);
        bits &= used >= k + SPL_LANES ? ~0u : used > k ? (1u << (used - k)) - 1 : 0;
        n = spl_near_put(squared, index, n, bits, distances, spl_indices((uint32_t)first + k));
    }
    return n;
}

SPL_INLINE void scan_leaf(const struct spl_points *p, enum spl_points_kind kind, size_t first, const double at[3],
                          struct spl_near_set *c)
{
    c->count = list_leaf(p, kind, first, at, c->bound, c->count, c->squared, c->index);
    if (c->count > c->wanted + SPL_NEAR_SET_SPARE)
        spl_near_set_reduce(c);
}

/* Squared distances from the box [from, to] to the `SPL_LANES` boxes from k on. */
SPL_INLINE spl_vec box_distances(const double *const low[3], const double *const high[3], unsigned k,
                                 const double from[3], const double to[3])
{
    spl_vec sum = {0};
    for (int c = 0; c < 3; c++) {
        spl_vec below = *(const spl_vec *)(low[c] + k) - to[c], above = from[c] - *(const spl_vec *)(high[c] + k);
        spl_vec out = spl_greater(spl_greater(below, above), (spl_vec){0});
        sum += out * out;
    }
    return sum;
}

/* The same for a group; bit k: whether box k is within `bound`. */
SPL_INLINE unsigned group_distances(const struct spl_box_group *g, const double from[3], const double to[3],
                                    double bound, double squared[fan])
{
    const double *const low[3] = {g->low[0], g->low[1], g->low[2]};
    const double *const high[3] = {g->high[0], g->high[1], g->high[2]};
    unsigned bits = 0;
    for (unsigned k = 0; k < fan; k += SPL_LANES) {
        spl_vec distances = box_distances(low, high, k, from, to);
        *(spl_vec *)(squared + k) = distances;
        bits |= spl_bits_within(distances, bound) << k;
    }
    return bits;
}

/* Puts the boxes of a box's group that lie within `bound` onto the stack, the nearest on top; its depth then. */
SPL_INLINE unsigned push_boxes(const struct spl_boxes *boxes, const struct entry *of, const double at[3], double bound,
                               struct entry stack[], unsigned depth)
{
    double squared[fan];
    unsigned bits = group_distances(&boxes->groups[boxes->first[of->level - 1] + of->box], at, at, bound, squared);
    const unsigned bottom = depth;
    for (; bits; bits &= bits - 1) {
        unsigned k = (unsigned)__builtin_ctz(bits), to = depth++;
        for (; to > bottom && stack[to - 1].squared < squared[k]; to--)
            stack[to] = stack[to - 1];
        stack[to] = (struct entry){squared[k], of->box * fan + k, of->level - 1};
    }
    return depth;
}

/* A search on its own, nearest boxes first: among the boxes of a group the nearest is on top of the stack. Leaves come
 * off it at once. */
SPL_INLINE void walk(const struct spl_boxes *boxes, const struct spl_points *points, enum spl_points_kind kind,
                     const double at[3], struct spl_near_set *c)
{
    struct entry stack[stack_max + 1];
    unsigned depth = 0;
    stack[depth++] = (struct entry){0, 0, boxes->levels};
    while (depth) {
        struct entry e = stack[--depth];
        if (e.squared > c->bound)
            continue;
        unsigned bottom = depth;
        depth = push_boxes(boxes, &e, at, c->bound, stack, depth);
        for (; e.level == 1 && depth > bottom; depth--)
            if (stack[depth - 1].squared <= c->bound)
                scan_leaf(points, kind, (size_t)stack[depth - 1].box * leaf, at, c);
    }
}

/* For each point of leaf `l` a squared distance within which at least `wanted` points lie, itself included: of the
 * `size` points from `first` on, those beside it in order. Several points of the leaf at once. */
SPL_INLINE void bound_in_order(const struct spl_points *p, enum spl_points_kind kind, size_t l, size_t first,
                               size_t size, unsigned wanted, double bound[leaf])
{
    double around[3][SPL_NEIGHBOURS_MAX + 1 + leaf + SPL_LANES];
    for (size_t k = 0; k < size; k += SPL_LANES) {
        spl_vec at[3];
        load_points(p, kind, first + k, at);
        for (int c = 0; c < 3; c++)
            *(spl_vec *)(around[c] + k) = at[c];
    }
    for (unsigned g = 0; g < leaf; g += SPL_LANES) {
        spl_vec squared[SPL_NEIGHBOURS_MAX + 1 + leaf], low = {0}, high = {0}, low_count = {0};
        spl_vec high_count = SPL_VEC((double)size), most = SPL_VEC((double)wanted);
        spl_vec from[3];
        load_points(p, kind, l * leaf + g, from);
        for (size_t k = 0; k < size; k++) {
            spl_vec dx = around[0][k] - from[0], dy = around[1][k] - from[1], dz = around[2][k] - from[2];
            squared[k] = dx * dx + dy * dy + dz * dz;
            high = spl_greater(squared[k], high);
        }
        for (int step = 0; step < 4; step++) {
            spl_vec t = low + (high - low) * (most - low_count + 0.4) / (high_count - low_count);
            spl_mask within = {0};
            for (size_t k = 0; k < size; k++)
                within = spl_count_up(within, squared[k], t);
            spl_vec count = __builtin_convertvector(within, spl_vec);
            spl_mask goes_on = high_count > most, few = goes_on & (count < most), many = goes_on & (count >= most);
            low = spl_select(few, t, low);
            low_count = spl_select(few, count, low_count);
            high = spl_select(many, t, high);
            high_count = spl_select(many, count, high_count);
        }
        *(spl_vec *)(bound + g) = high;
    }
}

/* What the searches for the points of leaf `l` share. */
SPL_INLINE void enter_leaf(const struct spl_boxes *boxes, const struct spl_points *p, enum spl_points_kind kind,
                           size_t l, unsigned wanted, struct spl_nearest *nearest)
{
    size_t begin = l * leaf, end = begin + leaf < p->count ? begin + leaf : p->count;
    size_t size = wanted + leaf < p->count ? wanted + leaf : p->count;
    size_t before = (size - (end - begin)) / 2, first = begin > before ? begin - before : 0;
    first = first + size > p->count ? p->count - size : first;
    double reach = 0, from[3], to[3];
    bound_in_order(p, kind, l, first, size, wanted, nearest->bound);
    for (size_t i = 0; i < end - begin; i++)
        reach = nearest->bound[i] > reach ? nearest->bound[i] : reach;
    const struct spl_box_group *own = &boxes->groups[l / fan];
    for (int c = 0; c < 3; c++) {
        from[c] = own->low[c][l % fan];
        to[c] = own->high[c][l % fan];
    }
    struct entry stack[stack_max];
    unsigned depth = 0, leaves = 0;
    stack[depth++] = (struct entry){0, 0, boxes->levels - 1};
    while (depth && leaves <= SPL_NEAR_LEAVES) {
        struct entry e = stack[--depth];
        double squared[fan];
        const struct spl_box_group *g = &boxes->groups[boxes->first[e.level] + e.box];
        for (unsigned bits = group_distances(g, from, to, reach, squared); bits; bits &= bits - 1) {
            unsigned k = (unsigned)__builtin_ctz(bits);
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
    for (unsigned k = 0; k < leaf; k++)
        nearest->found[k] = INFINITY;
    nearest->leaf = l;
}

/* A squared distance within which as many points lie as are wanted, from what was found for points of the same leaf:
 * as far as their farthest, and from there to here. Infinite where none was asked for. */
SPL_INLINE double bound_from_found(const struct spl_points *p, enum spl_points_kind kind, size_t l, const double at[3],
                                   const struct spl_nearest *nearest)
{
    double reach[leaf];
    spl_vec least = SPL_VEC(INFINITY);
    for (unsigned k = 0; k < leaf; k += SPL_LANES)
        *(spl_vec *)(reach + k) = point_distances(p, kind, l * leaf + k, at);
    for (unsigned k = 0; k < leaf; k++)
        reach[k] = sqrt(reach[k]) + nearest->found[k];
    for (unsigned k = 0; k < leaf; k += SPL_LANES)
        least = spl_lesser(*(const spl_vec *)(reach + k), least);
    double found = least[0];
    for (unsigned a = 1; a < SPL_LANES; a++)
        found = least[a] < found ? least[a] : found;
    return found * found * (1 + 1e-14); /* roots and sums are rounded */
}

SPL_INLINE void find_kind(const struct spl_boxes *boxes, const struct spl_points *p, enum spl_points_kind kind,
                          size_t i, unsigned k, struct spl_nearest *nearest)
{
    double at[3];
    spl_points_place(p, i, at);
    struct spl_near_set c;
    c.count = 0;
    c.wanted = k + 1 < p->count ? k + 1 : (unsigned)p->count;
    if (nearest->leaf != i / leaf)
        enter_leaf(boxes, p, kind, i / leaf, c.wanted, nearest);
    const double found = bound_from_found(p, kind, i / leaf, at, nearest);
    c.bound = nearest->bound[i % leaf] < found ? nearest->bound[i % leaf] : found;
    if (nearest->crowded) {
        walk(boxes, p, kind, at, &c);
    } else {
        const double *const low[3] = {nearest->low[0], nearest->low[1], nearest->low[2]};
        const double *const high[3] = {nearest->high[0], nearest->high[1], nearest->high[2]};
        scan_leaf(p, kind, i / leaf * leaf, at, &c);
        for (unsigned b = 0; b < nearest->leaves; b += SPL_LANES) {
            unsigned bits = spl_bits_within(box_distances(low, high, b, at, at), c.bound);
            for (; bits; bits &= bits - 1) {
                uint32_t l = nearest->leaf_index[b + (unsigned)__builtin_ctz(bits)];
                if (l != i / leaf)
                    scan_leaf(p, kind, (size_t)l * leaf, at, &c);
            }
        }
    }
    spl_near_set_reduce(&c);

    unsigned kept = 0;
    for (unsigned a = 0; a < c.count; a += SPL_LANES) {
        spl_vec_index index = *(const spl_vec_index *)(c.index + a);
        kept = spl_near_put(nearest->squared, nearest->index, kept, spl_bits_other(index, c.count - a, (uint32_t)i),
                            *(const spl_vec *)(c.squared + a), index);
    }
    nearest->count = kept < k ? kept : k;
    spl_vec most = {0};
    *(spl_vec *)(nearest->squared + nearest->count) = most;
    for (unsigned a = 0; a < nearest->count; a += SPL_LANES)
        most = spl_greater(*(const spl_vec *)(nearest->squared + a), most);
    double farthest = most[0];
    for (unsigned a = 1; a < SPL_LANES; a++)
        farthest = most[a] > farthest ? most[a] : farthest;
    nearest->farthest = nearest->found[i % leaf] = sqrt(farthest);
}

/* As spl_neighbours_find(). */
SPL_INLINE void spl_near_find(const struct spl_boxes *boxes, const struct spl_points *p, size_t i, unsigned k,
                              struct spl_nearest *nearest)
{
    if (p->kind == SPL_POINTS_DOUBLES)
        find_kind(boxes, p, SPL_POINTS_DOUBLES, i, k, nearest);
    else if (p->kind == SPL_POINTS_FLOATS)
        find_kind(boxes, p, SPL_POINTS_FLOATS, i, k, nearest);
    else
        find_kind(boxes, p, SPL_POINTS_STEPS, i, k, nearest);
}

/* Keeps point j in order of distance, if it is among the k nearest. */
SPL_INLINE void keep_sorted(struct spl_nearest *nearest, unsigned k, uint32_t j, double squared)
{
    unsigned at = nearest->count < k ? nearest->count++ : k - 1;
    for (; at && nearest->squared[at - 1] > squared; at--) {
        nearest->squared[at] = nearest->squared[at - 1];
        nearest->index[at] = nearest->index[at - 1];
    }
    nearest->squared[at] = squared;
    nearest->index[at] = j;
}

SPL_INLINE unsigned find_some_kind(const struct spl_boxes *boxes, const struct spl_points *p, enum spl_points_kind kind,
                                   size_t i, const struct spl_near_some *some, struct spl_nearest *nearest)
{
    struct entry stack[stack_max + 1];
    unsigned depth = 0, looked = 0;
    double at[3], bound = some->bound, squared[leaf + SPL_LANES];
    uint32_t index[leaf + SPL_LANES];
    spl_points_place(p, i, at);
    nearest->count = 0;
    stack[depth++] = (struct entry){0, 0, boxes->levels};
    while (depth && looked < SPL_NEAR_LOOKED) {
        const struct entry e = stack[--depth];
        if (e.squared > bound)
            continue;
        if (e.level) {
            depth = push_boxes(boxes, &e, at, bound, stack, depth);
            continue;
        }
        const unsigned n = list_leaf(p, kind, (size_t)e.box * leaf, at, bound, 0, squared, index);
        for (unsigned a = 0; a < n; a++) {
            if (index[a] == i || (nearest->count == some->k && squared[a] >= bound))
                continue;
            looked++;
            if (some->takes(some->context, index[a]))
                keep_sorted(nearest, some->k, index[a], squared[a]);
            if (nearest->count == some->k)
                bound = nearest->squared[some->k - 1];
        }
    }
    return looked;
}

/* As spl_neighbours_find_some(), within one distance. */
SPL_INLINE unsigned spl_near_find_some(const struct spl_boxes *boxes, const struct spl_points *p, size_t i,
                                       const struct spl_near_some *some, struct spl_nearest *nearest)
{
    if (p->kind == SPL_POINTS_DOUBLES)
        return find_some_kind(boxes, p, SPL_POINTS_DOUBLES, i, some, nearest);
    if (p->kind == SPL_POINTS_FLOATS)
        return find_some_kind(boxes, p, SPL_POINTS_FLOATS, i, some, nearest);
    return find_some_kind(boxes, p, SPL_POINTS_STEPS, i, some, nearest);
}

#endif
