/* A polar-capped z-buffer. Discs are drawn at three quarters of their radius, which still closes a surface and reaches
 * less far beyond its ends, as points as close as half a texel. The least range of a texel does not depend on the order
 * in which threads come. */
#include "pack/maps/sight.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "geom/polar.h"
#include "geom/tangent.h"

enum { side = 512, rings_max = 48 };
static const double share = 0.75, steepest = 5.67; /* tangent of 80 degrees */

struct drawing {
    struct spl_sight *sight;
    const struct spl_splats *splats;
};

static size_t texel_of(const double d[3])
{
    double place[2];
    spl_polar_place(side, 0, d, place);
    size_t x = (size_t)fmin(place[0], 6 * side - 1), y = (size_t)fmin(place[1], side - 1);
    return y * 6 * side + x;
}

static void draw_point(struct spl_sight *sight, const double p[3])
{
    float range = (float)sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    uint32_t bits, old;
    if (!(range > 0))
        return;
    memcpy(&bits, &range, sizeof bits);
    _Atomic uint32_t *texel = &sight->nearest[texel_of(p)];
    old = atomic_load_explicit(texel, memory_order_relaxed);
    while (bits < old && !atomic_compare_exchange_weak_explicit(texel, &old, bits, memory_order_relaxed,
                                                                memory_order_relaxed))
        ;
}

static void draw_disc(struct spl_sight *sight, const struct spl_world_splat *splat)
{
    float u[3], v[3];
    double own[3], across[3], up[3], range = 0, radius = share * (double)splat->splat.radius;
    spl_station_to_own(sight->station, splat->position, own);
    for (int i = 0; i < 3; i++)
        range += own[i] * own[i];
    draw_point(sight, own);
    int rings = (int)fmin(ceil(2 * radius / (sqrt(range) * spl_polar_texel(side)) - 0.5), rings_max);
    if (rings < 1)
        return;
    spl_tangent_frame(splat->splat.normal, u, v);
    spl_station_turn(sight->station, (double[3]){(double)u[0], (double)u[1], (double)u[2]}, across);
    spl_station_turn(sight->station, (double[3]){(double)v[0], (double)v[1], (double)v[2]}, up);
    for (int ring = 1; ring <= rings; ring++)
        for (int i = 0, steps = 6 * ring; i < steps; i++) {
            double angle = 2 * M_PI * i / steps, r = radius * ring / rings, p[3];
            for (int k = 0; k < 3; k++)
                p[k] = own[k] + r * (cos(angle) * across[k] + sin(angle) * up[k]);
            draw_point(sight, p);
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
    size_t texels = (size_t)6 * side * side;
    *sight = (struct spl_sight){.station = station, .nearest = spl_alloc_raw(texels, sizeof *sight->nearest, err)};
    if (!sight->nearest)
        return SPL_E_NOMEM;
    for (size_t i = 0; i < texels; i++)
        atomic_init(&sight->nearest[i], UINT32_MAX);
    struct drawing drawing = {sight, splats};
    spl_parallel_for(threads, splats->chunk_count, 16, draw, &drawing);
    return SPL_OK;
}

void spl_sight_finish(struct spl_sight *sight)
{
    free(sight->nearest);
    *sight = (struct spl_sight){0};
}

bool spl_sight_sees(const struct spl_sight *sight, const struct spl_world_splat *splat, double *cosine, double *range)
{
    double own[3], normal[3], along = 0, square = 0;
    const float *n = splat->splat.normal;
    uint32_t bits;
    float nearest;
    spl_station_to_own(sight->station, splat->position, own);
    spl_station_turn(sight->station, (double[3]){(double)n[0], (double)n[1], (double)n[2]}, normal);
    for (int i = 0; i < 3; i++) {
        along += own[i] * normal[i];
        square += own[i] * own[i];
    }
    *range = sqrt(square);
    if (!(*range > 0))
        return false;
    *cosine = fmin(fabs(along) / *range, 1);
    bits = atomic_load_explicit(&sight->nearest[texel_of(own)], memory_order_relaxed);
    if (bits == UINT32_MAX)
        return true;
    memcpy(&nearest, &bits, sizeof nearest);
    double slant = fmin(sqrt(1 - *cosine * *cosine) / fmax(*cosine, 1e-3), steepest);
    return *range <= (double)nearest + (double)splat->splat.radius + *range * spl_polar_texel(side) * slant;
}
