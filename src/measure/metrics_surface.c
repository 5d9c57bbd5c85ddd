/* Where the surface is: depth, coverage and normals.
 *
 * A depth is there when it is finite, a normal when it is finite and not zero, coverage when it is above 0.
 * Neighbourhoods are 3x3, cut off at the picture's edges. Counts are whole numbers; sums of squares and of angles lie a
 * row each and are added in order. Any thread. */
#include <math.h>

#include "base/parallel.h"
#include "measure/metrics_parts.h"

static double share(uint64_t part, uint64_t of)
{
    return of ? (double)part / (double)of : NAN;
}

static double add_rows(const double *rows, size_t count)
{
    double sum = 0;
    for (size_t i = 0; i < count; i++)
        sum += rows[i];
    return sum;
}

struct depth_work {
    const float *image, *truth;
    const float *tolerances; /* may be NULL */
    float tolerance, *errors;
    double *rows;
    uint32_t width, height;
    atomic_uint_fast64_t covered, both, beyond, through;
};

/* The farthest true depth around a pixel. */
static float farthest(const struct depth_work *w, size_t x, size_t y)
{
    float most = -INFINITY;
    for (size_t v = y ? y - 1 : 0; v <= y + 1 && v < w->height; v++)
        for (size_t u = x ? x - 1 : 0; u <= x + 1 && u < w->width; u++) {
            float depth = w->truth[v * w->width + u];
            most = isfinite(depth) && depth > most ? depth : most;
        }
    return most;
}

static void compare_depths(void *context, size_t begin, size_t end, unsigned worker)
{
    struct depth_work *w = context;
    uint64_t covered = 0, both = 0, beyond = 0, through = 0;
    (void)worker;
    for (size_t y = begin; y < end; y++) {
        double sum = 0;
        for (size_t x = 0; x < w->width; x++) {
            size_t at = y * w->width + x;
            float image = w->image[at], truth = w->truth[at], error = fabsf(image - truth);
            covered += isfinite(truth);
            w->errors[at] = NAN;
            if (!isfinite(error)) /* one of them is not there */
                continue;
            float tolerance = w->tolerances ? w->tolerances[at] : w->tolerance;
            w->errors[at] = error;
            both++;
            sum += (double)error * error;
            if (!(error > tolerance))
                continue;
            beyond++;
            through += image > truth && image > farthest(w, x, y) + tolerance;
        }
        w->rows[y] = sum;
    }
    atomic_fetch_add_explicit(&w->covered, covered, memory_order_relaxed);
    atomic_fetch_add_explicit(&w->both, both, memory_order_relaxed);
    atomic_fetch_add_explicit(&w->beyond, beyond, memory_order_relaxed);
    atomic_fetch_add_explicit(&w->through, through, memory_order_relaxed);
}

void spl_metrics_depth(const struct spl_picture *image, const struct spl_picture *truth, unsigned threads,
                       float *scratch, double *rows, struct spl_metrics *out)
{
    const struct spl_picture *teller = truth->tolerance_m || truth->tolerance > 0 ? truth : image;
    struct depth_work w = {.image = image->depth->pixels,
                           .truth = truth->depth->pixels,
                           .tolerances = teller->tolerance_m,
                           .tolerance = (float)teller->tolerance,
                           .errors = scratch,
                           .rows = rows,
                           .width = truth->depth->width,
                           .height = truth->depth->height};
    spl_parallel_for(threads, w.height, SPL_METRICS_ROWS, compare_depths, &w);
    out->depth_rmse = w.both ? sqrt(add_rows(rows, w.height) / (double)w.both) : NAN;
    out->depth_median = spl_metrics_median(scratch, (size_t)w.width * w.height);
    out->depth_beyond = share(w.beyond, w.both);
    out->see_through = share(w.through, w.covered);
}

/* A pixel is fully covered when less than one of 64x64 samples can be missing: shares are sums of floats. */
static const float full = 1 - 1.0f / 8192;

struct coverage_work {
    const float *image, *truth;
    uint32_t width, height;
    atomic_uint_fast64_t solid, holes, empty, halo;
};

static void compare_coverage(void *context, size_t begin, size_t end, unsigned worker)
{
    struct coverage_work *w = context;
    uint64_t sums[4] = {0};
    uint8_t touched[SPL_METRICS_BLOCK + 2]; /* something in the column of three, from one pixel left of the block */
    (void)worker;
    for (size_t y = begin; y < end; y++)
        for (size_t left = 0; left < w->width; left += SPL_METRICS_BLOCK) {
            size_t count = w->width - left < SPL_METRICS_BLOCK ? w->width - left : SPL_METRICS_BLOCK;
            const float *truth = w->truth + y * w->width + left, *image = w->image + y * w->width + left;
            const float *above = y ? truth - w->width : truth, *below = y + 1 < w->height ? truth + w->width : truth;
            touched[0] = left && (above[-1] > 0 || truth[-1] > 0 || below[-1] > 0);
            for (size_t i = 0; i < count; i++)
                touched[i + 1] = (above[i] > 0) | (truth[i] > 0) | (below[i] > 0);
            touched[count + 1] = left + count < w->width && (above[count] > 0 || truth[count] > 0 || below[count] > 0);
            uint32_t solid = 0, holes = 0, empty = 0, halo = 0;
            for (size_t i = 0; i < count; i++) {
                uint32_t painted = image[i] >= 0.5f, is_solid = truth[i] >= full;
                uint32_t is_empty = !(touched[i] | touched[i + 1] | touched[i + 2]);
                solid += is_solid;
                holes += is_solid & !painted;
                empty += is_empty;
                halo += is_empty & painted;
            }
            sums[0] += solid;
            sums[1] += holes;
            sums[2] += empty;
            sums[3] += halo;
        }
    atomic_fetch_add_explicit(&w->solid, sums[0], memory_order_relaxed);
    atomic_fetch_add_explicit(&w->holes, sums[1], memory_order_relaxed);
    atomic_fetch_add_explicit(&w->empty, sums[2], memory_order_relaxed);
    atomic_fetch_add_explicit(&w->halo, sums[3], memory_order_relaxed);
}

void spl_metrics_coverage(const struct spl_image *image, const struct spl_image *truth, unsigned threads,
                          struct spl_metrics *out)
{
    struct coverage_work w = {
        .image = image->pixels, .truth = truth->pixels, .width = truth->width, .height = truth->height};
    spl_parallel_for(threads, w.height, SPL_METRICS_ROWS, compare_coverage, &w);
    out->holes = share(w.holes, w.solid);
    out->halo = share(w.halo, w.empty);
}

struct normal_work {
    const float *image, *truth;
    uint32_t width;
    float *angles;
    double *rows;
    atomic_uint_fast64_t both;
};

/* Between the two lines, without regard to sign: 0..90 degrees, exact near 0 where an arc cosine is not. */
static void compare_normals(void *context, size_t begin, size_t end, unsigned worker)
{
    struct normal_work *w = context;
    uint64_t both = 0;
    (void)worker;
    for (size_t y = begin; y < end; y++) {
        double sum = 0;
        for (size_t at = y * w->width; at < (y + 1) * w->width; at++) {
            const float *a = w->image + 3 * at, *b = w->truth + 3 * at;
            float cx = a[1] * b[2] - a[2] * b[1], cy = a[2] * b[0] - a[0] * b[2], cz = a[0] * b[1] - a[1] * b[0];
            float sine = sqrtf(cx * cx + cy * cy + cz * cz), cosine = fabsf(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
            w->angles[at] = NAN;
            if (!(sine + cosine > 0 && sine + cosine < INFINITY))
                continue;
            float angle = atan2f(sine, cosine) * (float)(180 / M_PI);
            w->angles[at] = angle;
            sum += angle;
            both++;
        }
        w->rows[y] = sum;
    }
    atomic_fetch_add_explicit(&w->both, both, memory_order_relaxed);
}

void spl_metrics_normal(const struct spl_image *image, const struct spl_image *truth, unsigned threads, float *scratch,
                        double *rows, struct spl_metrics *out)
{
    struct normal_work w = {
        .image = image->pixels, .truth = truth->pixels, .width = truth->width, .angles = scratch, .rows = rows};
    spl_parallel_for(threads, truth->height, SPL_METRICS_ROWS, compare_normals, &w);
    out->normal_mean = w.both ? add_rows(rows, truth->height) / (double)w.both : NAN;
    out->normal_median = spl_metrics_median(scratch, (size_t)truth->width * truth->height);
}
