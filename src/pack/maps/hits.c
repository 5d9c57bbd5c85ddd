/* Two rounds over the chunks: the first counts, so that each chunk knows where its hits go and threads change
 * nothing. */
#include "pack/maps/hits.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "geom/polar.h"
#include "pack/maps/sight.h"
#include "pack/median.h"

struct gathering {
    struct spl_hits *hits;
    const struct spl_splats *splats;
    const struct spl_stations *stations;
    uint32_t station;
    bool own; /* the station's own splats alone; else what these show, one of which is not NULL */
    const struct spl_map_sight *map;
    const struct spl_sight *sight;
    size_t *first; /* by chunk: of its hits; while counting, how many of the chunk before */
    bool counting;
};

static bool shows(const struct gathering *g, const struct spl_world_splat *splat, const double own[3], double range)
{
    double normal[3], cosine;
    if (!g->map)
        return spl_sight_sees(g->sight, splat, &cosine, &range);
    const float *n = splat->splat.normal;
    spl_station_turn(&g->stations->list[g->station], (double[3]){(double)n[0], (double)n[1], (double)n[2]}, normal);
    cosine = fmin(fabs(own[0] * normal[0] + own[1] * normal[1] + own[2] * normal[2]) / range, 1);
    return spl_map_shows(g->map, own, (double)splat->splat.radius, cosine) > 0;
}

static void gather(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct gathering *g = context;
    const struct spl_splats *splats = g->splats;
    struct spl_world_splat list[SPL_CHUNK_SPLATS];
    (void)worker;
    for (uint32_t c = (uint32_t)begin; c < end; c++) {
        const struct spl_chunk *chunk = &splats->chunks[c];
        const uint16_t *of = g->stations->of + chunk->first_id;
        bool asked = spl_splats_is_leaf(splats, c) && spl_splats_is_discs(splats, c), any = !g->own;
        for (uint32_t i = 0; asked && !any && i < chunk->count; i++)
            any = of[i] == g->station;
        uint32_t count = asked && any ? spl_splats_get(splats, c, list) : 0;
        size_t at = g->counting ? 0 : g->first[c];
        for (uint32_t i = 0; i < count; i++) {
            double range, own[3];
            if (g->own && of[i] != g->station)
                continue;
            spl_station_to_own(&g->stations->list[g->station], list[i].position, own);
            range = sqrt(own[0] * own[0] + own[1] * own[1] + own[2] * own[2]);
            if (!((float)range > 0) || (!g->own && !shows(g, &list[i], own, range)))
                continue;
            if (!g->counting) {
                struct spl_hit *hit = &g->hits->list[at];
                *hit = (struct spl_hit){.range = (float)range, .radius = list[i].splat.radius};
                for (int k = 0; k < 3; k++) {
                    hit->direction[k] = (float)(own[k] / range);
                    hit->color[k] = list[i].splat.color[k];
                }
            }
            at++;
        }
        if (g->counting)
            g->first[c + 1] = at;
    }
}

int spl_hits_init(struct spl_hits *hits, const struct spl_splats *splats, const struct spl_stations *stations,
                  uint32_t station, const struct spl_map_sight *map, unsigned threads, struct spl_error *err)
{
    struct gathering g = {.hits = hits,
                          .splats = splats,
                          .stations = stations,
                          .station = station,
                          .own = stations->scanned,
                          .map = map,
                          .counting = true};
    struct spl_sight sight = {0};
    *hits = (struct spl_hits){0};
    int rc = (g.first = spl_alloc(splats->chunk_count + (size_t)1, sizeof *g.first, err)) ? SPL_OK : SPL_E_NOMEM;
    if (!rc && !g.own && !map) {
        rc = spl_sight_init(&sight, &stations->list[station], splats, threads, err);
        g.sight = &sight;
    }
    if (!rc) {
        spl_parallel_for(threads, splats->chunk_count, 16, gather, &g);
        for (uint32_t c = 0; c < splats->chunk_count; c++)
            g.first[c + 1] += g.first[c];
        hits->count = g.first[splats->chunk_count];
        hits->list = spl_alloc_raw(hits->count, sizeof *hits->list, err);
        hits->texel = spl_alloc_raw(hits->count, sizeof *hits->texel, err);
        rc = hits->list && hits->texel ? SPL_OK : SPL_E_NOMEM;
    }
    if (!rc) {
        g.counting = false;
        spl_parallel_for(threads, splats->chunk_count, 16, gather, &g);
    }
    spl_sight_finish(&sight);
    free(g.first);
    if (rc)
        spl_hits_finish(hits);
    return rc;
}

void spl_hits_finish(struct spl_hits *hits)
{
    free(hits->list);
    free(hits->texel);
    *hits = (struct spl_hits){0};
}

struct placing {
    struct spl_hits *hits;
    uint32_t side, apron;
};

static void place(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct placing *p = context;
    double left[3] = {0, p->side + 2.0 * p->apron, 2 * (p->side + 2.0 * p->apron)};
    (void)worker;
    for (size_t i = begin; i < end; i++) {
        const float *d = p->hits->list[i].direction;
        const double direction[3] = {(double)d[0], (double)d[1], (double)d[2]};
        double at[2];
        spl_polar_place(p->side, p->apron, direction, at);
        int chart = at[0] < left[1] ? 0 : at[0] < left[2] ? 1 : 2; /* a place at a chart's end is in its last texel */
        double last = left[chart] + p->apron + (chart == 2 ? 4 : 1) * p->side - 1.0;
        uint32_t x = (uint32_t)fmin(at[0], last), y = (uint32_t)fmin(at[1], p->apron + p->side - 1.0);
        p->hits->texel[i] = y * spl_polar_width(p->side, p->apron) + x;
    }
}

void spl_hits_place(struct spl_hits *hits, uint32_t side, uint32_t apron, unsigned threads)
{
    struct placing p = {hits, side, apron};
    spl_parallel_for(threads, hits->count, 4096, place, &p);
}

struct comparison {
    const struct spl_splats *splats;
    const struct spl_stations *stations;
    float *off; /* by chunk: of a splat from its neighbour's disc; NaN = none to compare */
};

static void compare(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct comparison *c = context;
    struct spl_world_splat list[SPL_CHUNK_SPLATS];
    (void)worker;
    for (size_t i = begin; i < end; i++) {
        uint32_t chunk = (uint32_t)i, nearest = 0;
        const uint16_t *of = c->stations->of + c->splats->chunks[chunk].first_id;
        double least = INFINITY, off = 0;
        c->off[i] = NAN;
        if (!spl_splats_is_leaf(c->splats, chunk) || !spl_splats_is_discs(c->splats, chunk))
            continue;
        uint32_t count = spl_splats_get(c->splats, chunk, list);
        for (uint32_t k = 1; k < count; k++) {
            double square = 0;
            for (int a = 0; a < 3; a++)
                square += (list[k].position[a] - list[0].position[a]) * (list[k].position[a] - list[0].position[a]);
            double radius = (double)list[0].splat.radius;
            if (of[k] != of[0] || square >= least || square > 4 * radius * radius)
                continue;
            least = square;
            nearest = k;
        }
        for (int a = 0; a < 3; a++)
            off += (list[nearest].position[a] - list[0].position[a]) * (double)list[0].splat.normal[a];
        if (nearest)
            c->off[i] = (float)fabs(off);
    }
}

int spl_hits_find_noise(const struct spl_splats *splats, const struct spl_stations *stations, unsigned threads,
                        double *sigma, struct spl_error *err)
{
    struct comparison c = {splats, stations, spl_alloc_raw(splats->chunk_count, sizeof *c.off, err)};
    size_t count = 0;
    if (!c.off)
        return SPL_E_NOMEM;
    spl_parallel_for(threads, splats->chunk_count, 16, compare, &c);
    for (uint32_t i = 0; i < splats->chunk_count; i++)
        if (!isnan(c.off[i]))
            c.off[count++] = c.off[i];
    *sigma = count ? (double)spl_median(c.off, count) * 1.4826 / M_SQRT2 : 0;
    free(c.off);
    return SPL_OK;
}
