/* Regions of patches by a rule, the largest patch first: from it on a region takes what lies beside what it has,
 * breadth first, and lets go what it does not keep once it is whole. On the calling thread, in an order that depends on
 * the patches alone; patches are few beside points. */
#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/memory.h"
#include "pack/planes/regions.h"

enum { checked = 255 };
static const uint32_t no_region = UINT32_MAX;

struct order {
    double points;
    uint32_t patch;
};

struct search {
    const struct spl_patch *patches;
    const struct spl_patch_graph *graph;
    const struct spl_region_rule *rule;
    uint32_t *region; /* of each patch */
    uint32_t *queue;  /* patches of the region at work */
};

/* What the region keeps of its `count` patches; it may be none. */
static void let_go(const struct search *s, uint32_t count, struct spl_region *r)
{
    struct spl_plane_moments kept = {0};
    s->rule->fit(r);
    for (uint32_t k = 0; k < count; k++) {
        uint32_t patch = s->queue[k];
        if (s->rule->keeps(s->rule->state, r, &s->patches[patch]))
            spl_plane_moments_add(&kept, &s->patches[patch].moments);
        else
            s->region[patch] = no_region;
    }
    r->moments = kept;
    if (kept.count > 0)
        s->rule->fit(r);
}

static void grow(const struct search *s, uint32_t seed, uint32_t number, struct spl_region *r)
{
    const struct spl_patch *patches = s->patches;
    const struct spl_region_rule *rule = s->rule;
    uint32_t count = 0;
    *r = (struct spl_region){.moments = patches[seed].moments};
    memcpy(r->normal, patches[seed].normal, sizeof r->normal);
    rule->begin(rule->state, &patches[seed]);
    s->queue[count++] = seed;
    s->region[seed] = number;
    for (uint32_t k = 0; k < count; k++)
        for (size_t n = s->graph->first[s->queue[k]]; n < s->graph->first[s->queue[k] + 1]; n++) {
            uint32_t next = s->graph->neighbour[n];
            if (s->region[next] != no_region || !rule->takes(rule->state, r, &patches[s->queue[k]], &patches[next]))
                continue;
            s->region[next] = number;
            s->queue[count++] = next;
            spl_plane_moments_add(&r->moments, &patches[next].moments);
            rule->took(rule->state, r, &patches[next]);
        }
    if (rule->fit)
        let_go(s, count, r);
}

static int compare(const void *a, const void *b)
{
    const struct order *x = a, *y = b;
    if (x->points != y->points)
        return x->points > y->points ? -1 : 1;
    return x->patch < y->patch ? -1 : x->patch > y->patch;
}

int spl_regions_search(struct spl_regions *regions, uint32_t *region, const struct spl_patches *patches,
                       const struct spl_patch_graph *graph, const struct spl_region_rule *rule,
                       const struct spl_stage *stage, struct spl_error *err)
{
    size_t capacity = 0, count = patches->count;
    *regions = (struct spl_regions){0};
    struct order *order = spl_alloc_raw(count, sizeof *order, err);
    struct search s = {patches->list, graph, rule, region, spl_alloc_raw(count, sizeof *s.queue, err)};
    int rc = order && s.queue ? 0 : SPL_E_NOMEM;
    for (size_t i = 0; !rc && i < count; i++) {
        order[i] = (struct order){patches->list[i].moments.count, (uint32_t)i};
        region[i] = no_region;
    }
    if (!rc)
        qsort(order, count, sizeof *order, compare);
    for (uint32_t round = 0; !rc && round < rule->rounds; round++)
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
