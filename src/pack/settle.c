/* The radius that a point's own neighbours give (radius.c) makes blobs of stray points. So none exceeds a small
 * multiple of the median of its neighbours' radii (a stray beside a surface), nor of the median of the few thousand
 * points around it (a flock of strays). These are counted, so where most lie in a densely scanned spot of a few
 * centimetres they say nothing of the floor beside it: a surface that goes on all around a point is held against what
 * a hundred others of the run have, which is more than a flock. Radii are read as they were estimated until all of a
 * block, and of those that wait, are settled, so that no result depends on the order. */
#include "pack/settle.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "pack/median.h"

enum { run_points = 4096, run_sample = 256, flock = 128 };
static const float stray_limit = 2.5f; /* times the median radius of the neighbours */

/* Multiplies limit[] by the median radius of the run that each point belongs to, on a surface by what `flock` of its
 * points exceed if that is more. */
static void limit_runs(const struct spl_settle_block *block)
{
    const float *radius = block->points->radius;
    struct spl_nearest near[2];
    spl_nearest_init(&near[0]);
    spl_nearest_init(&near[1]);
    for (size_t run = block->begin; run < block->end; run += run_points) {
        size_t n = block->end - run < run_points ? block->end - run : run_points;
        size_t sample = n < run_sample ? n : run_sample;
        float radii[run_sample];
        for (size_t i = 0; i < sample; i++)
            radii[i] = radius[run + i * n / sample];
        float median = spl_median(radii, sample); /* and sorts them */
        float sparse = n > flock ? radii[sample - 1 - sample * flock / n] : median;
        for (size_t i = run; i < run + n; i++) {
            float *limit = &block->limit[i - block->begin];
            *limit *= median;
            if (radius[i] > *limit && sparse > median && spl_radius_on_surface(block->vicinity, i, near))
                *limit *= sparse / median;
        }
    }
}

enum wait { SETTLES, WAITS_WITHIN, WAITS_OUTSIDE };

static enum wait find_wait(const struct spl_settle_block *block, uint32_t point)
{
    const uint32_t begin = (uint32_t)block->begin, points = (uint32_t)(block->end - block->begin);
    const uint32_t *list = block->neighbours + (size_t)point * block->k;
    unsigned outside = 0, unused = 0, other = 0;
    for (unsigned a = 0; a < block->k; a++) {
        outside |= (list[a] - begin >= points) & (list[a] != UINT32_MAX);
        unused |= list[a] == UINT32_MAX;
    }
    for (unsigned a = 0; block->label && !outside && a < block->k && list[a] != UINT32_MAX; a++)
        other |= block->label[list[a] - begin] != block->label[point];
    return outside || (other && unused) ? WAITS_OUTSIDE : other ? WAITS_WITHIN : SETTLES;
}

static void list_point(const struct spl_settle_block *block, uint32_t point, enum wait wait, size_t at,
                       struct spl_unsettled *unsettled)
{
    const uint32_t *list = block->neighbours + (size_t)point * block->k;
    unsettled->points[at].index = (uint32_t)block->begin + point;
    unsettled->points[at].radius = block->limit[point];
    if (wait == WAITS_OUTSIDE)
        memcpy(unsettled->neighbours + at * block->k, list, block->k * sizeof *list);
    for (unsigned a = 0; wait == WAITS_WITHIN && a < block->k; a++)
        unsettled->inner[(at - unsettled->outer) * block->k + a] = (uint16_t)(list[a] - block->begin);
}

int spl_unsettled_init(struct spl_unsettled *unsettled, const struct spl_settle_block *block)
{
    const uint32_t points = (uint32_t)(block->end - block->begin);
    size_t count[WAITS_OUTSIDE + 1] = {0}, k = block->k;
    limit_runs(block);
    for (uint32_t i = 0; i < points; i++)
        count[find_wait(block, i)]++;
    *unsettled = (struct spl_unsettled){.spill = block->points->spill,
                                        .outer = count[WAITS_OUTSIDE],
                                        .count = count[WAITS_OUTSIDE] + count[WAITS_WITHIN],
                                        .begin = block->begin,
                                        .k = block->k};
    struct spl_spill *spill = unsettled->spill;
    unsettled->points = spl_spill_take(spill, unsettled->count, sizeof *unsettled->points, NULL);
    unsettled->neighbours = spl_spill_take(spill, count[WAITS_OUTSIDE], k * sizeof *unsettled->neighbours, NULL);
    unsettled->inner = spl_spill_take(spill, count[WAITS_WITHIN], k * sizeof *unsettled->inner, NULL);
    if (!unsettled->points || !unsettled->neighbours || !unsettled->inner)
        return SPL_E_NOMEM;
    size_t at[WAITS_OUTSIDE + 1] = {[WAITS_WITHIN] = unsettled->outer};
    for (uint32_t i = 0; i < points; i++) {
        enum wait wait = find_wait(block, i);
        if (wait != SETTLES)
            list_point(block, i, wait, at[wait]++, unsettled);
    }
    return SPL_OK;
}

void spl_unsettled_finish(struct spl_unsettled *unsettled)
{
    const size_t k = unsettled->k, inner = unsettled->count - unsettled->outer;
    spl_spill_discard(unsettled->spill, unsettled->points, unsettled->count * sizeof *unsettled->points);
    spl_spill_discard(unsettled->spill, unsettled->neighbours, unsettled->outer * k * sizeof *unsettled->neighbours);
    spl_spill_discard(unsettled->spill, unsettled->inner, inner * k * sizeof *unsettled->inner);
    spl_spill_give(unsettled->spill, unsettled->points);
    spl_spill_give(unsettled->spill, unsettled->neighbours);
    spl_spill_give(unsettled->spill, unsettled->inner);
    *unsettled = (struct spl_unsettled){0};
}

const uint32_t *spl_unsettled_get_neighbours(const struct spl_unsettled *unsettled, size_t i,
                                             uint32_t room[SPL_NEIGHBOURS_MAX])
{
    if (i < unsettled->outer)
        return unsettled->neighbours + i * unsettled->k;
    const uint16_t *inner = unsettled->inner + (i - unsettled->outer) * unsettled->k;
    for (unsigned a = 0; a < unsettled->k; a++)
        room[a] = (uint32_t)unsettled->begin + inner[a];
    return room;
}

/* Radius and uncertainty of point i once the normals around it agree in sign. */
static void settle(const struct spl_points *p, size_t i, const uint32_t *neighbours, unsigned k, float limit,
                   float *radius, float *uncertainty)
{
    float around[SPL_NEIGHBOURS_MAX], most = fminf(p->radius[i], limit);
    unsigned n = 0, bound = 0;
    double sum = 0;
    const float *a = p->normal[i];
    for (; n < k && neighbours[n] != UINT32_MAX; n++) {
        const float *b = p->normal[neighbours[n]];
        float bend = 2 - (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
        sum += bend * bend;
        around[n] = p->radius[neighbours[n]];
        bound += stray_limit * around[n] < most;
    }
    /* only where more than half of the radii bound this one does their median */
    *radius = bound > n / 2 ? stray_limit * spl_middle(around, n) : most;
    *uncertainty = (float)(*radius * sum / n);
}

void spl_settle_block(const struct spl_settle_block *block, const struct spl_unsettled *unsettled)
{
    struct spl_points *p = block->points;
    float *radius = block->limit; /* the settled one takes its limit's place */
    size_t outer = 0, inner = unsettled->outer; /* who waits next */
    for (size_t i = block->begin; i < block->end; i++) {
        size_t at = i - block->begin;
        if (outer < unsettled->outer && unsettled->points[outer].index == i) {
            radius[at] = p->radius[i];
            outer++;
        } else if (inner < unsettled->count && unsettled->points[inner].index == i) {
            radius[at] = p->radius[i];
            inner++;
        } else {
            settle(p, i, block->neighbours + at * block->k, block->k, radius[at], &radius[at], &p->uncertainty[i]);
        }
    }
    memcpy(p->radius + block->begin, radius, (block->end - block->begin) * sizeof *radius);
}

void spl_settle_find(const struct spl_points *points, struct spl_unsettled *unsettled)
{
    for (size_t i = 0; i < unsettled->count; i++) {
        if (i % 256 == 0)
            spl_spill_keep_bound(points->spill);
        struct spl_unsettled_point *point = &unsettled->points[i];
        uint32_t room[SPL_NEIGHBOURS_MAX];
        const uint32_t *list = spl_unsettled_get_neighbours(unsettled, i, room);
        settle(points, point->index, list, unsettled->k, point->radius, &point->radius, &point->uncertainty);
    }
}

void spl_settle_store(struct spl_points *points, const struct spl_unsettled *unsettled)
{
    for (size_t i = 0; i < unsettled->count; i++) {
        points->radius[unsettled->points[i].index] = unsettled->points[i].radius;
        points->uncertainty[unsettled->points[i].index] = unsettled->points[i].uncertainty;
    }
}
