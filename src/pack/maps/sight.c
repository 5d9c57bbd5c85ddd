/* Polar-capped z-buffers, each half as fine as the one before. A disc is drawn into the finest where its centre and
 * six points of its rim leave no texel out, so that none costs more however large it is; a point is held against all
 * of them. Discs are drawn at three quarters of their radius, which still closes a surface and reaches less far beyond
 * its ends. The least range of a texel does not depend on the order in which threads come. */
#include "pack/maps/sight.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "geom/polar.h"
#include "geom/tangent.h"

enum { side = 512, levels = SPL_SIGHT_LEVELS };
static const double share = 0.75, steepest = 5.67; /* tangent of 80 degrees */
static const double least = 0.25, most = 0.75;     /* radii of discs that are drawn as seven points, texels */

struct drawing {
    struct spl_sight *sight;
    const struct spl_splats *splats;
};

static size_t words_of(int level)
{
    return (size_t)6 * (side >> level) * (side >> level);
}

/* The texel of the finest level that shows a direction: places of all levels are shares of each other. */
static void place_of(const double p[3], double range, uint32_t at[2])
{
    const float d[3] = {(float)(p[0] / range), (float)(p[1] / range), (float)(p[2] / range)};
    float place[2];
    spl_polar_place_f(side, 0, d, place);
    at[0] = (uint32_t)fminf(fmaxf(place[0], 0), 6 * side - 1);
    at[1] = (uint32_t)fminf(fmaxf(place[1], 0), side - 1);
}

static size_t texel_of(const uint32_t at[2], int level)
{
    return (size_t)(at[1] >> level) * (6 * side >> level) + (at[0] >> level);
}

static double length_of(const double p[3])
{
    return sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
}

static void draw_point(struct spl_sight *sight, const double p[3], int level)
{
    double length = length_of(p);
    float range = (float)length;
    uint32_t bits, old, at[2];
    if (!(range > 0))
        return;
    memcpy(&bits, &range, sizeof bits);
    place_of(p, length, at);
    _Atomic uint32_t *texel = &sight->nearest[level][texel_of(at, level)];
    old = atomic_load_explicit(texel, memory_order_relaxed);
    while (bits < old && !atomic_compare_exchange_weak_explicit(texel, &old, bits, memory_order_relaxed,
                                                                memory_order_relaxed))
        ;
}

static void draw_disc(struct spl_sight *sight, const struct spl_world_splat *splat)
{
    static const double turns[6][2] = {{1, 0}, {0.5, 0.8660254}, {-0.5, 0.8660254},
                                       {-1, 0}, {-0.5, -0.8660254}, {0.5, -0.8660254}};
    float u[3], v[3];
    double own[3], across[3], up[3], radius = share * (double)splat->splat.radius;
    int level = 0;
    spl_station_to_own(sight->station, splat->position, own);
    double texels = radius / (length_of(own) * spl_polar_texel(side));
    for (; level + 1 < levels && texels > most; level++)
        texels /= 2;
    draw_point(sight, own, level);
    if (texels < least)
        return;
    spl_tangent_frame(splat->splat.normal, u, v);
    spl_station_turn(sight->station, (double[3]){(double)u[0], (double)u[1], (double)u[2]}, across);
    spl_station_turn(sight->station, (double[3]){(double)v[0], (double)v[1], (double)v[2]}, up);
    for (int i = 0; i < 6; i++) {
        double p[3];
        for (int k = 0; k < 3; k++)
            p[k] = own[k] + radius * (turns[i][0] * across[k] + turns[i][1] * up[k]);
        draw_point(sight, p, level);
    }
}

static void draw(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct drawing *drawing = context;
    const struct spl_splats *splats = drawing->splats;
    struct spl_world_splat list[SPL_CHUNK_SPLATS];
    (void)worker;
    for (uint32_t c = (uint32_t)begin; c < end; c++) {
        bool drawn = spl_splats_is_leaf(splats, c) && spl_splats_is_discs(splats, c);
        uint32_t count = drawn ? spl_splats_get(splats, c, list) : 0;
        for (uint32_t i = 0; i < count; i++)
            draw_disc(drawing->sight, &list[i]);
    }
}

int spl_sight_init(struct spl_sight *sight, const struct spl_station *station, const struct spl_splats *splats,
                   unsigned threads, struct spl_error *err)
{
    size_t texels = 0;
    *sight = (struct spl_sight){.station = station};
    for (int level = 0; level < levels; level++)
        texels += words_of(level);
    if (!(sight->nearest[0] = spl_alloc_raw(texels, sizeof *sight->nearest[0], err)))
        return SPL_E_NOMEM;
    for (size_t i = 0; i < texels; i++)
        atomic_init(&sight->nearest[0][i], UINT32_MAX);
    for (int level = 1; level < levels; level++)
        sight->nearest[level] = sight->nearest[level - 1] + words_of(level - 1);
    struct drawing drawing = {sight, splats};
    spl_parallel_for(threads, splats->chunk_count, 16, draw, &drawing);
    return SPL_OK;
}

void spl_sight_finish(struct spl_sight *sight)
{
    free(sight->nearest[0]);
    *sight = (struct spl_sight){0};
}

bool spl_sight_sees(const struct spl_sight *sight, const struct spl_world_splat *splat, double *cosine, double *range)
{
    double own[3], normal[3], along = 0;
    const float *n = splat->splat.normal;
    uint32_t at[2];
    bool seen = true;
    spl_station_to_own(sight->station, splat->position, own);
    spl_station_turn(sight->station, (double[3]){(double)n[0], (double)n[1], (double)n[2]}, normal);
    for (int i = 0; i < 3; i++)
        along += own[i] * normal[i];
    *range = length_of(own);
    if (!((float)*range > 0))
        return false;
    *cosine = fmin(fabs(along) / *range, 1);
    double slant = fmin(sqrt(1 - *cosine * *cosine) / fmax(*cosine, 1e-3), steepest);
    double step = *range * spl_polar_texel(side) * slant;
    place_of(own, *range, at);
    for (int level = 0; seen && level < levels; level++, step *= 2) {
        uint32_t bits = atomic_load_explicit(&sight->nearest[level][texel_of(at, level)], memory_order_relaxed);
        float nearest = INFINITY;
        if (bits != UINT32_MAX)
            memcpy(&nearest, &bits, sizeof nearest);
        seen = *range <= (double)nearest + (double)splat->splat.radius + step;
    }
    return seen;
}
