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
    spl_near_find_some_of *find_some;
};

static _Atomic enum spl_neighbours_set most_set = SPL_NEIGHBOURS_AVX512; /* for tests */

static void find_base(const struct spl_boxes *boxes, const struct spl_points *points, size_t i, unsigned k,
                      struct spl_nearest *nearest)
{
    spl_near_find(boxes, points, i, k, nearest);
}

static unsigned find_some_base(const struct spl_boxes *boxes, const struct spl_points *points, size_t i,
                               const struct spl_near_some *some, struct spl_nearest *nearest)
{
    return spl_near_find_some(boxes, points, i, some, nearest);
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
    n->find_some = find_some_base;
#if defined(__x86_64__)
    enum spl_neighbours_set set = spl_neighbours_limit(most_set);
    n->find = set == SPL_NEIGHBOURS_AVX512 ? spl_near_find_avx512
              : set == SPL_NEIGHBOURS_AVX2 ? spl_near_find_avx2
                                           : find_base;
    n->find_some = set == SPL_NEIGHBOURS_AVX512 ? spl_near_find_some_avx512
                   : set == SPL_NEIGHBOURS_AVX2 ? spl_near_find_some_avx2
                                                : find_some_base;
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

void spl_neighbours_find_some(const struct spl_neighbours *n, size_t i, unsigned k, double distance, double most,
                              spl_neighbours_takes *takes, const void *context, struct spl_nearest *nearest)
{
    struct spl_near_some some = {.k = k, .takes = takes, .context = context};
    unsigned looked = 0;
    for (double times = 2; times <= most && looked < SPL_NEAR_LOOKED; times *= 2) {
        some.bound = times * distance * times * distance;
        looked = n->find_some(&n->boxes, n->points, i, &some, nearest);
        if (nearest->count == k)
            break;
    }
    nearest->farthest = nearest->count ? sqrt(nearest->squared[nearest->count - 1]) : 0;
}
