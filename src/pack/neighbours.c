/* Nearest neighbours over Morton order. A search starts from a proven bound, given by the points beside it in order;
 * the 16 searches of a leaf share one walk over the boxes, which lists the leaves that any of their bounds reaches.
 * Where these are too many (a stray point in the leaf, or two far ends of the order), each search walks alone, nearest
 * boxes first. So neither a stray point nor a dense cluster makes a search look at more than its surroundings.
 *
 * Everything is doubles: a cloud of 10^9 metres with millimetre detail needs no special case. Searches are compiled for
 * AVX-512, for AVX2 and for the base architecture; contraction is off, so all give the same bits. Read-only after
 * creation: any thread may search. */
#include "pack/neighbours.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "pack/near_find.h"

struct spl_neighbours {
    const struct spl_points *points;
    struct spl_boxes boxes;
    spl_near_find_of *find;
};

static _Atomic enum spl_neighbours_set most_set = SPL_NEIGHBOURS_AVX512; /* for tests */

static void find_base(const struct spl_boxes *boxes, const struct spl_points *points, size_t i, unsigned k,
                      struct spl_nearest *nearest)
{
    spl_near_find(boxes, points, i, k, nearest);
}

enum spl_neighbours_set spl_neighbours_limit(enum spl_neighbours_set most)
{
    most_set = most;
#if defined(__x86_64__)
    const bool bits = __builtin_cpu_supports("bmi") && __builtin_cpu_supports("popcnt");
    if (most >= SPL_NEIGHBOURS_AVX512 && bits && __builtin_cpu_supports("avx512f") &&
        __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq"))
        return SPL_NEIGHBOURS_AVX512;
    if (most >= SPL_NEIGHBOURS_AVX2 && bits && __builtin_cpu_supports("avx2"))
        return SPL_NEIGHBOURS_AVX2;
#endif
    return SPL_NEIGHBOURS_BASE;
}

struct spl_neighbours *spl_neighbours_create(const struct spl_points *points, unsigned threads, struct spl_error *err)
{
    struct spl_neighbours *n = spl_alloc(1, sizeof *n, err);
    if (!n)
        return NULL;
    n->points = points;
    n->find = find_base;
#if defined(__x86_64__)
    enum spl_neighbours_set set = spl_neighbours_limit(most_set);
    n->find = set == SPL_NEIGHBOURS_AVX512 ? spl_near_find_avx512
              : set == SPL_NEIGHBOURS_AVX2 ? spl_near_find_avx2
                                           : find_base;
#endif
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

void spl_neighbours_find(const struct spl_neighbours *neighbours, size_t i, unsigned k, struct spl_nearest *nearest)
{
    neighbours->find(&neighbours->boxes, neighbours->points, i, k, nearest);
}

/* Keeps point j in order of distance, if it is among the k nearest. */
static void keep_sorted(struct spl_nearest *nearest, unsigned k, size_t j, double squared)
{
    unsigned at = nearest->count < k ? nearest->count++ : k - 1;
    for (; at && nearest->squared[at - 1] > squared; at--) {
        nearest->squared[at] = nearest->squared[at - 1];
        nearest->index[at] = nearest->index[at - 1];
    }
    nearest->squared[at] = squared;
    nearest->index[at] = (uint32_t)j;
}

void spl_neighbours_find_some(const struct spl_neighbours *n, size_t i, unsigned k, double reach,
                              bool (*takes)(const void *context, size_t point), const void *context,
                              struct spl_nearest *nearest)
{
    const struct spl_boxes *boxes = &n->boxes;
    struct entry stack[stack_max + 1];
    unsigned depth = 0, looked = 0;
    double at[3], bound = reach * reach;
    spl_points_place(n->points, i, at);
    nearest->count = 0;
    stack[depth++] = (struct entry){0, 0, boxes->levels};
    while (depth && looked < SPL_NEAR_LOOKED) {
        const struct entry e = stack[--depth];
        if (e.squared > bound)
            continue;
        if (!e.level) {
            const size_t begin = (size_t)e.box * leaf;
            const size_t end = begin + leaf < n->points->count ? begin + leaf : n->points->count;
            for (size_t j = begin; j < end; j++) {
                double apart[3];
                spl_points_apart(n->points, at, j, apart);
                const double squared = apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2];
                if (squared > bound || j == i || (nearest->count == k && squared >= nearest->squared[k - 1]))
                    continue;
                looked++;
                if (takes(context, j))
                    keep_sorted(nearest, k, j, squared);
            }
            bound = nearest->count == k ? nearest->squared[k - 1] : bound;
            continue;
        }
        depth = push_boxes(boxes, &e, at, bound, stack, depth);
    }
    nearest->farthest = nearest->count ? sqrt(nearest->squared[nearest->count - 1]) : 0;
}
