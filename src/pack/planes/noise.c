/* What may lie on a plane, by the scan's noise and spacing. Runs of points beside each other in order, all over the
 * scan, that lie on a plane say how far they are off. Where noise is as wide as points are apart, few points show no
 * plane: then longer runs are asked, up to those of which one in seven says something; not longer ones, for they hold
 * more than one thing. The median leaves out curved ones.
 *
 * Noise grows with range, and what is near is fine: a board on a table a metre away is thicker than the noise there,
 * and thinner than that of the far wall. So each share of the points, which are sorted, has limits of its own, from its
 * own runs and those of its neighbours. */
#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "pack/median.h"
#include "pack/planes/patches.h"

enum { runs_most = 2048, sizes = 4, patches_most = SPL_FIT_PATCHES };
enum { share_runs = 32, share_least = 16, spacing_sample = 1024 }; /* flat ones of a share that say something */
static const size_t run_points[sizes] = {64, 256, 1024, 4096};
static const double telling = 0.15;         /* share of the runs */
static const double noise_sigmas = 4;       /* of the bound that is chosen */
static const double spacing_share = 0.2;    /* likewise */
static const double radius_spacing = 1.128; /* radius of a disc amid a surface, over its points' spacing */
static const double step_share = 0.4;       /* of the bound, is what may be no noise */

struct noise {
    const struct spl_points *points;
    size_t size, runs;
    float (*rms)[patches_most]; /* of each run's patches; unused ones < 0 */
    struct spl_fit *workers;
};

static void measure_runs(void *context, size_t begin, size_t end, unsigned worker)
{
    struct noise *n = context;
    for (size_t r = begin; r < end; r++) {
        struct spl_patch patches[patches_most];
        size_t first = n->runs > 1 ? r * (n->points->count - n->size) / (n->runs - 1) : 0;
        n->workers[worker].base = first;
        spl_spill_keep_bound(n->points->spill); /* each is in pages of its own */
        unsigned found = spl_fit_find(&n->workers[worker], first, first + n->size, patches);
        for (unsigned k = 0; k < patches_most; k++)
            n->rms[r][k] = k < found ? (float)patches[k].rms : -1;
    }
}

/* The median over runs [begin, end), in *noise; returns how many were flat. */
static size_t take_median(const struct noise *n, size_t begin, size_t end, float *values, double *noise)
{
    size_t count = 0, flat = 0;
    for (size_t r = begin; r < end; r++) {
        flat += n->rms[r][0] >= 0;
        for (unsigned k = 0; k < patches_most; k++)
            if (n->rms[r][k] >= 0)
                values[count++] = n->rms[r][k];
    }
    if (count)
        *noise = spl_median(values, count);
    return flat;
}

static double median_spacing(const struct spl_points *points, size_t begin, size_t end)
{
    float radii[spacing_sample];
    size_t sample = end - begin < spacing_sample ? end - begin : spacing_sample;
    for (size_t i = 0; i < sample; i++)
        radii[i] = points->radius[begin + i * (end - begin) / sample];
    return spl_median(radii, sample) / radius_spacing;
}

static int settle(struct spl_plane_limits_list *limits, const struct noise *n, double error, float *values,
                  struct spl_error *err)
{
    size_t points = n->points->count;
    uint32_t count = n->runs > share_runs ? (uint32_t)(n->runs / share_runs) : 1;
    limits->at = spl_alloc(count, sizeof *limits->at, err);
    if (!limits->at)
        return SPL_E_NOMEM;
    limits->count = count;
    limits->points = points;
    for (uint32_t k = 0; k < count; k++) {
        struct spl_plane_limits *l = &limits->at[k];
        size_t from = k ? k - 1 : 0, to = k + 2 < count ? k + 2 : count;
        size_t begin = (size_t)(((uint64_t)k * points + count - 1) / count);
        size_t end = (size_t)(((uint64_t)(k + 1) * points + count - 1) / count);
        double noise = limits->noise;
        size_t flat = take_median(n, from * n->runs / count, to * n->runs / count, values, &noise);
        l->noise = flat >= share_least ? fmin(noise, 2 * limits->noise) : limits->noise;
        double own = fmax(noise_sigmas * l->noise, spacing_share * median_spacing(n->points, begin, end));
        limits->own_bound = fmax(limits->own_bound, own);
        l->bound = error > 0 ? error : own;
        l->step = step_share * l->bound;
    }
    return 0;
}

void spl_plane_limits_finish(struct spl_plane_limits_list *limits)
{
    free(limits->at);
    *limits = (struct spl_plane_limits_list){0};
}

int spl_plane_limits_find(struct spl_plane_limits_list *limits, const struct spl_points *points, double error,
                          unsigned threads, struct spl_error *err)
{
    struct noise n = {.points = points};
    size_t room = points->count < run_points[sizes - 1] ? points->count : run_points[sizes - 1];
    float *values = spl_alloc_raw(runs_most * patches_most, sizeof *values, err);
    n.rms = spl_alloc_raw(runs_most, sizeof *n.rms, err);
    n.workers = spl_alloc(threads, sizeof *n.workers, err);
    int rc = values && n.rms && n.workers ? 0 : SPL_E_NOMEM;
    for (unsigned t = 0; !rc && t < threads; t++) {
        n.workers[t] = (struct spl_fit){.points = points,
                                        .limits = {.bound = INFINITY, .step = INFINITY},
                                        .group = spl_alloc_raw(room, 1, err),
                                        .off = spl_alloc_raw(room, sizeof(float), err)};
        rc = n.workers[t].group && n.workers[t].off ? 0 : SPL_E_NOMEM;
    }
    *limits = (struct spl_plane_limits_list){0};
    for (int s = 0; !rc && s < sizes && run_points[s] <= points->count; s++) {
        n.size = run_points[s];
        n.runs = points->count / n.size < runs_most ? points->count / n.size : runs_most;
        spl_parallel_for(threads, n.runs, 32, measure_runs, &n);
        if ((double)take_median(&n, 0, n.runs, values, &limits->noise) >= telling * (double)n.runs)
            break;
    }
    if (!rc)
        rc = settle(limits, &n, error, values, err);
    for (unsigned t = 0; n.workers && t < threads; t++) {
        free(n.workers[t].group);
        free(n.workers[t].off);
    }
    free(n.workers);
    free(n.rms);
    free(values);
    return rc;
}
