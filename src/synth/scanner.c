/* Where the rays of a station go, and how many of them it takes. Pure functions of the scene and the grid. */
#include "synth/scanner.h"

#include <math.h>
#include <stdatomic.h>

#include "base/parallel.h"
#include "synth/random.h"
#include "synth/vector.h"

static const double lowest = -60, highest = 90;      /* elevations, degrees */
static const double rows_per_column = 150.0 / 360.0; /* equal steps both ways */
enum {
    coarse_columns = 1440,       /* 3.5 million rays over four stations tell the share of returns within 0.1 % */
    counted_points_max = 200000, /* up to here a grid's returns are counted, above they are inferred */
};

static void direction_of(const struct spl_scan_grid *grid, uint64_t column, uint64_t row, double direction[3])
{
    double azimuth = 2 * M_PI * ((double)column + 0.5) / (double)grid->columns;
    double elevation = (lowest + (highest - lowest) * ((double)row + 0.5) / (double)grid->rows) * M_PI / 180;
    direction[0] = cos(elevation) * cos(azimuth);
    direction[1] = cos(elevation) * sin(azimuth);
    direction[2] = sin(elevation);
}

static void to_world(const struct spl_station *station, const double local[3], double world[3])
{
    for (int i = 0; i < 3; i++)
        world[i] = dot3(&station->rotation[3 * i], local);
}

/* A standard normal deviate for each key (Box-Muller). */
static double gaussian(uint64_t key)
{
    double radius = sqrt(-2 * log(1 - unit_of(hash64(key))));
    return radius * cos(2 * M_PI * unit_of(hash64(key ^ 0x5851f42d4c957f2du)));
}

struct spl_return spl_scanner_cast(const struct spl_scene *scene, const struct spl_scan_grid *grid, size_t station,
                                   uint64_t column, uint64_t row, double sigma, uint64_t seed)
{
    const struct spl_station *s = &scene->stations[station];
    struct spl_return r = {0};
    struct spl_hit hit;
    double direction[3], ray[3];
    direction_of(grid, column, row, direction);
    to_world(s, direction, ray);
    if (!spl_scene_hit(scene, s->position, ray, &hit))
        return r;
    double range = hit.t;
    if (sigma > 0)
        range += sigma * gaussian(hash64(hash64(seed ^ hash64(station)) ^ column) ^ row);
    mad3((double[3]){0}, range, direction, r.local);
    mad3(s->position, range, ray, r.world);
    r.hit = true;
    r.intensity = (float)((0.3 * hit.color[0] + 0.6 * hit.color[1] + 0.1 * hit.color[2]) / 255 *
                          (0.5 - 0.5 * dot3(hit.normal, ray)));
    for (int i = 0; i < 3; i++)
        r.color[i] = hit.color[i];
    return r;
}

struct count {
    const struct spl_scene *scene;
    const struct spl_scan_grid *grid;
    atomic_uint_fast64_t hits;
};

static void count_columns(void *context, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    struct count *c = context;
    uint64_t hits = 0;
    for (size_t i = begin; i < end; i++) {
        const struct spl_station *s = &c->scene->stations[i / c->grid->columns];
        for (uint64_t row = 0; row < c->grid->rows; row++) {
            double direction[3], ray[3], t = INFINITY;
            uint32_t index;
            direction_of(c->grid, i % c->grid->columns, row, direction);
            to_world(s, direction, ray);
            hits += spl_bvh_hit(c->scene->nodes, c->scene->primitives, s->position, ray, &t, &index);
        }
    }
    atomic_fetch_add(&c->hits, hits);
}

static uint64_t count_returns(const struct spl_scene *scene, const struct spl_scan_grid *grid, unsigned threads)
{
    struct count c = {.scene = scene, .grid = grid};
    spl_parallel_for(threads, scene->station_count * grid->columns, 16, count_columns, &c);
    return atomic_load(&c.hits);
}

struct spl_scan_grid spl_scanner_fit(const struct spl_scene *scene, uint64_t points, unsigned threads)
{
    struct spl_scan_grid grid = {.columns = coarse_columns / 4,
                                 .rows = (uint64_t)(coarse_columns / 4 * rows_per_column)};
    if (points > counted_points_max) {
        grid.columns = coarse_columns;
        grid.rows = (uint64_t)(coarse_columns * rows_per_column);
    }
    double cells = (double)grid.columns * (double)grid.rows;
    /* Returns of all stations for a cell of each. */
    double share = (double)count_returns(scene, &grid, threads) / cells;
    double wanted = (double)points / share;
    grid.columns = (uint64_t)llround(sqrt(wanted / rows_per_column));
    grid.rows = (uint64_t)llround(wanted / (double)grid.columns);
    grid.expected = (uint64_t)((double)(grid.columns * grid.rows) * share);
    if (points > counted_points_max)
        return grid;

    /* Few rays: the count jumps with every row, so the nearest of the grids around is taken. */
    struct spl_scan_grid best = grid;
    double least = INFINITY;
    for (uint64_t columns = grid.columns - 3; columns <= grid.columns + 3 && least > 0.002; columns++) {
        uint64_t middle = (uint64_t)llround(wanted / (double)columns);
        for (uint64_t rows = middle - 1; rows <= middle + 1 && least > 0.002; rows++) {
            struct spl_scan_grid tried = {.columns = columns, .rows = rows};
            tried.expected = count_returns(scene, &tried, threads);
            double off = fabs((double)tried.expected - (double)points) / (double)points;
            if (off < least) {
                least = off;
                best = tried;
            }
        }
    }
    return best;
}
