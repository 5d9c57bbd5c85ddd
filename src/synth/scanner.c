/* How fine a scanner must scan for so many points: the share of pulses that return something is found by casting a
 * coarse grid, or the grid itself where it is small. The ratio of rows to columns keeps steps along and across equal.
 * Called by one thread; casts on many. */
#include "synth/scanner.h"

#include <stdatomic.h>

#include "base/parallel.h"
#include "geom/vector.h"

enum {
    coarse_pulses = 1440 * 600,    /* a pass; 3.5 million over four stations tell the share of returns within 0.1 % */
    coarse_footprints = 480 * 200, /* the same where a pulse is seven rays */
    counted_points_max = 200000,   /* up to here a grid's returns are counted, above they are inferred */
};

static double rows_per_column(const struct spl_scene *scene)
{
    const struct spl_scanner *s = &scene->scanner;
    switch (s->kind) {
    case SPL_SCANNER_TERRESTRIAL:
        break;
    case SPL_SCANNER_MOBILE: /* equal at the scanner's range */
        return 2 * M_PI * s->range / scene->track[scene->track_count - 1].at;
    case SPL_SCANNER_AIRBORNE: /* equal in the middle of the swath */
        return 2 * s->half_angle * M_PI / 180 * s->range / s->length;
    case SPL_SCANNER_SWEEP:
        return 1;
    }
    return 150.0 / 360.0;
}

static struct spl_scan_grid grid_of(double pulses, double ratio)
{
    struct spl_scan_grid grid = {.columns = (uint64_t)llround(fmax(1, sqrt(pulses / ratio)))};
    grid.rows = (uint64_t)llround(fmax(1, pulses / (double)grid.columns));
    return grid;
}

struct count {
    const struct spl_scene *scene;
    const struct spl_scan_grid *grid;
    const struct spl_scan_faults *faults;
    atomic_uint_fast64_t hits;
};

static void count_columns(void *context, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    struct count *c = context;
    const struct spl_scene *scene = c->scene;
    bool rays_only = !(c->faults->dropout > 0) && scene->scanner.returns == 1;
    uint64_t hits = 0;
    for (size_t i = begin; i < end; i++) {
        size_t pass = i / c->grid->columns, column = i % c->grid->columns;
        for (uint64_t row = 0; row < c->grid->rows; row++) {
            struct spl_pulse pulse;
            double t = INFINITY;
            uint32_t index;
            if (!rays_only) {
                hits += spl_scanner_cast(scene, c->grid, c->faults, pass, column, row, NULL);
                continue;
            }
            spl_scanner_pulse(scene, c->grid, pass, column, row, &pulse);
            hits += spl_bvh_hit(scene->nodes, scene->primitives, pulse.origin, pulse.direction, &t, &index);
        }
    }
    atomic_fetch_add(&c->hits, hits);
}

static uint64_t count_returns(const struct spl_scene *scene, const struct spl_scan_faults *faults,
                              const struct spl_scan_grid *grid, unsigned threads)
{
    struct count c = {.scene = scene, .grid = grid, .faults = faults};
    spl_parallel_for(threads, scene->station_count * grid->columns, 16, count_columns, &c);
    return atomic_load(&c.hits);
}

struct spl_scan_grid spl_scanner_fit(const struct spl_scene *scene, const struct spl_scan_faults *faults,
                                     uint64_t points, unsigned threads)
{
    double ratio = rows_per_column(scene);
    double coarse = scene->scanner.returns > 1 ? coarse_footprints : coarse_pulses;
    struct spl_scan_grid grid = grid_of(points > counted_points_max ? coarse : coarse_pulses / 16, ratio);
    /* Returns of all passes for a pulse of each. */
    double share = (double)count_returns(scene, faults, &grid, threads) / ((double)grid.columns * (double)grid.rows);
    double wanted = (double)points / share;
    grid = grid_of(wanted, ratio);
    grid.expected = (uint64_t)((double)(grid.columns * grid.rows) * share);
    if (points > counted_points_max)
        return grid;

    /* Few pulses: the count jumps with every row, so the nearest of the grids around is taken. */
    struct spl_scan_grid best = grid;
    double least = INFINITY;
    for (uint64_t columns = grid.columns > 4 ? grid.columns - 3 : 1; columns <= grid.columns + 3 && least > 0.002;
         columns++) {
        uint64_t middle = (uint64_t)llround(wanted / (double)columns);
        for (uint64_t rows = middle > 2 ? middle - 1 : 1; rows <= middle + 1 && least > 0.002; rows++) {
            struct spl_scan_grid tried = {.columns = columns, .rows = rows};
            tried.expected = count_returns(scene, faults, &tried, threads);
            double off = fabs((double)tried.expected - (double)points) / (double)points;
            if (off < least) {
                least = off;
                best = tried;
            }
        }
    }
    return best;
}
