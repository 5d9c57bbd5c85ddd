/* Regions of patches on one plane, the largest patch first: from it on the region takes what lies beside it as long as
 * it is on the plane, which is fitted anew whenever its points have become half as many more. So small patches, whose
 * own planes are uncertain, are judged by how far their points are off a good plane. A patch is on it when neither its
 * middle nor its far ends, as its tilt against the plane has them, are off by more than what is no noise may be; both
 * have been seen from the same side.
 *
 * A plane that turned while it grew may leave patches behind: those that are off the last fit are let go, and begin
 * regions of their own, or join others. Patches are few beside points: all of it runs on the calling thread, in an
 * order that depends on the patches alone. */
#include "pack/planes/regions.h"

#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/memory.h"

enum { rounds = 3, checked = 255 };
static const double facing = 0.8;        /* cosine of the two normals; small patches may be off by some degrees */
static const double far_end = 1.7320508; /* sigmas to the end of an even spread */
static const double refit = 1.5;         /* growth after which the plane is fitted anew */
static const double let_go = 1.25;       /* times the limit, is what a patch may be off the last fit */
static const uint32_t no_region = UINT32_MAX;

struct order {
    double points;
    uint32_t patch;
};

struct search {
    const struct spl_patches *patches;
    const struct spl_patch_graph *graph;
    const struct spl_plane_limits_list *limits;
    uint32_t *region; /* of each patch */
    uint32_t *queue;  /* patches of the region at work */
};

static bool lies_on(const struct search *s, const struct spl_region *r, const struct spl_patch *q, double factor)
{
    double off = 0, cosine = 0;
    for (int c = 0; c < 3; c++) {
        off += r->normal[c] * (q->moments.mean[c] - r->moments.mean[c]);
        cosine += r->normal[c] * q->normal[c];
    }
    double limit = factor * (spl_plane_limits_at(s->limits, q->first)->step + 2 * q->rms / sqrt(q->moments.count));
    if (cosine < facing || fabs(off) > limit)
        return false;
    double spread = spl_plane_moments_spread(&q->moments, r->normal);
    return fabs(off) + far_end * sqrt(fmax(0, spread * spread - q->rms * q->rms)) <= limit;
}

static void fit(struct spl_region *r)
{
    double sigma[3], normal[3], cosine = 0;
    spl_plane_moments_fit(&r->moments, sigma, normal);
    for (int c = 0; c < 3; c++)
        cosine += normal[c] * r->normal[c];
    for (int c = 0; c < 3; c++)
        r->normal[c] = cosine < 0 ? -normal[c] : normal[c];
}

/* Grows a region from patch `seed`. */
static void grow(const struct search *s, uint32_t seed, uint32_t number, struct spl_region *r)
{
    const struct spl_patch *patches = s->patches->list;
    uint32_t count = 0;
    double fitted = patches[seed].moments.count;
    *r = (struct spl_region){.moments = patches[seed].moments};
    memcpy(r->normal, patches[seed].normal, sizeof r->normal);
    s->queue[count++] = seed;
    s->region[seed] = number;
    for (uint32_t k = 0; k < count; k++)
        for (size_t n = s->graph->first[s->queue[k]]; n < s->graph->first[s->queue[k] + 1]; n++) {
            uint32_t next = s->graph->neighbour[n];
            if (s->region[next] != no_region || !lies_on(s, r, &patches[next], 1))
                continue;
            s->region[next] = number;
            s->queue[count++] = next;
            spl_plane_moments_add(&r->moments, &patches[next].moments);
            if (r->moments.count < refit * fitted)
                continue;
            fitted = r->moments.count;
            fit(r);
        }
    fit(r);
    struct spl_plane_moments kept = {0};
    for (uint32_t k = 0; k < count; k++) {
        if (lies_on(s, r, &patches[s->queue[k]], let_go))
            spl_plane_moments_add(&kept, &patches[s->queue[k]].moments);
        else
            s->region[s->queue[k]] = no_region;
    }
    r->moments = kept;
    if (kept.count > 0)
        fit(r);
}

static int compare(const void *a, const void *b)
{
    const struct order *x = a, *y = b;
    if (x->points != y->points)
        return x->points > y->points ? -1 : 1;
    return x->patch < y->patch ? -1 : x->patch > y->patch;
}

int spl_regions_find(struct spl_regions *regions, uint32_t *region, const struct spl_patches *patches,
                     const struct spl_patch_graph *graph, const struct spl_plane_limits_list *limits,
                     const struct spl_stage *stage, struct spl_error *err)
{
    size_t capacity = 0, count = patches->count;
    *regions = (struct spl_regions){0};
    struct order *order = spl_alloc_raw(count, sizeof *order, err);
    struct search s = {patches, graph, limits, region, spl_alloc_raw(count, sizeof *s.queue, err)};
    int rc = order && s.queue ? 0 : SPL_E_NOMEM;
    for (size_t i = 0; !rc && i < count; i++) {
        order[i] = (struct order){patches->list[i].moments.count, (uint32_t)i};
        region[i] = no_region;
    }
    if (!rc)
        qsort(order, count, sizeof *order, compare);
    for (int round = 0; !rc && round < rounds; round++)
        for (size_t i = 0; !rc && i < count; i++) {
            uint32_t seed = order[i].patch;
            if (region[seed] != no_region)
                continue;
            rc = spl_array_reserve(regions->list, capacity, (size_t)regions->count + 1, err);
            if (rc || ((i & checked) == 0 && (rc = spl_stage_check(stage, err))))
                break;
            grow(&s, seed, regions->count, &regions->list[regions->count]);
            if (regions->list[regions->count].moments.count > 0)
                regions->count++;
        }
    free(order);
    free(s.queue);
    return rc;
}

void spl_regions_finish(struct spl_regions *regions)
{
    free(regions->list);
    *regions = (struct spl_regions){0};
}
