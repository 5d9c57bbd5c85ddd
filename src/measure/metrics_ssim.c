/* Structural similarity (Wang, Bovik, Sheikh, Simoncelli 2004, eq. 13): 11x11 Gaussian of sigma 1.5, K1 = 0.01,
 * K2 = 0.03, L = 255; the mean over the places where the whole window lies inside the picture.
 *
 * The window is separable. Each row of results reads eleven rows of both planes, sums them down its columns into four
 * lines (x, y, x² + y², xy; the formula needs no more than the sum of both variances) and filters those lines across.
 * Windows are symmetric, so rows and columns at equal distance share a product. Each row's sum lies in its own place,
 * and the rows are added in order. Any thread. */
#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "measure/metrics_parts.h"

enum { radius = 5, window = 2 * radius + 1, lines = 5 };

struct work {
    const float *image, *truth;
    size_t width;
    double weights[radius + 1]; /* by distance from the middle */
    double *scratch;            /* `lines` of `width` a worker */
    double *rows;
};

static void weights_init(double weights[radius + 1])
{
    double sum = 0, exact[radius + 1];
    for (int i = 0; i <= radius; i++) {
        exact[i] = exp(-i * i / (2 * 1.5 * 1.5));
        sum += i ? 2 * exact[i] : exact[i];
    }
    for (int i = 0; i <= radius; i++)
        weights[i] = exact[i] / sum;
}

static void filter_down(const struct work *w, size_t row, double *restrict sx, double *restrict sy, double *restrict ss,
                        double *restrict sp)
{
    const size_t width = w->width;
    const float *x0 = w->image + (row + radius) * width, *y0 = w->truth + (row + radius) * width;
    const double middle = w->weights[0];
    for (size_t i = 0; i < width; i++) {
        double x = (double)x0[i], y = (double)y0[i];
        sx[i] = middle * x;
        sy[i] = middle * y;
        ss[i] = middle * (x * x + y * y);
        sp[i] = middle * (x * y);
    }
    for (int k = 1; k <= radius; k++) {
        const float *xa = x0 - (size_t)k * width, *xb = x0 + (size_t)k * width;
        const float *ya = y0 - (size_t)k * width, *yb = y0 + (size_t)k * width;
        const double g = w->weights[k];
        for (size_t i = 0; i < width; i++) {
            double a = (double)xa[i], b = (double)xb[i], c = (double)ya[i], d = (double)yb[i];
            sx[i] += g * (a + b);
            sy[i] += g * (c + d);
            ss[i] += g * ((a * a + b * b) + (c * c + d * d));
            sp[i] += g * (a * c + b * d);
        }
    }
}

static inline double filter_across(const double *line, const double *weights)
{
    double sum = weights[0] * line[radius];
    for (int k = 1; k <= radius; k++)
        sum += weights[k] * (line[radius - k] + line[radius + k]);
    return sum;
}

static void compare_row(const struct work *w, size_t row, double *scratch)
{
    const double c1 = 6.5025, c2 = 58.5225; /* (0.01 * 255)^2, (0.03 * 255)^2 */
    double *sx = scratch, *sy = sx + w->width, *ss = sy + w->width, *sp = ss + w->width, *restrict out = sp + w->width;
    const double weights[radius + 1] = {w->weights[0], w->weights[1], w->weights[2],
                                        w->weights[3], w->weights[4], w->weights[5]};
    size_t count = w->width - (window - 1);
    filter_down(w, row, sx, sy, ss, sp);
    for (size_t i = 0; i < count; i++) {
        double mx = filter_across(sx + i, weights), my = filter_across(sy + i, weights);
        double variances = filter_across(ss + i, weights) - (mx * mx + my * my);
        double covariance = filter_across(sp + i, weights) - mx * my;
        out[i] = (2 * mx * my + c1) * (2 * covariance + c2) / ((mx * mx + my * my + c1) * (variances + c2));
    }
    double sum = 0;
    for (size_t i = 0; i < count; i++)
        sum += out[i];
    w->rows[row] = sum;
}

static void compare_rows(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct work *w = context;
    for (size_t row = begin; row < end; row++)
        compare_row(w, row, w->scratch + (size_t)worker * lines * w->width);
}

int spl_metrics_ssim(const float *image, const float *truth, size_t width, size_t height, unsigned threads, double *out,
                     struct spl_error *err)
{
    *out = NAN;
    if (width < window || height < window)
        return SPL_OK;
    size_t count = height - (window - 1);
    struct work w = {.image = image, .truth = truth, .width = width};
    int rc = SPL_E_NOMEM;
    weights_init(w.weights);
    w.scratch = spl_alloc_raw(spl_thread_count(threads) * width, lines * sizeof(double), err);
    w.rows = spl_alloc_raw(count, sizeof *w.rows, err);
    if (!w.scratch || !w.rows)
        goto done;
    spl_parallel_for(threads, count, SPL_METRICS_ROWS, compare_rows, &w);
    double sum = 0;
    for (size_t row = 0; row < count; row++)
        sum += w.rows[row];
    *out = sum / ((double)count * (double)(width - (window - 1)));
    rc = SPL_OK;
done:
    free(w.scratch);
    free(w.rows);
    return rc;
}
