/* Measures of the suite: src/measure's metrics with the tolerance that bench gives them, and two of its own. Pure. */
#include "measure.h"

#include <math.h>
#include <stdlib.h>

#include "measure/tolerance.h"

struct spl_metrics measure_frame(const struct world *world, const struct spl_view *view, const struct spl_frame *frame,
                                 const struct spl_image truth[SPL_LAYER_COUNT])
{
    struct spl_metrics metrics;
    struct spl_tolerance *tolerance = NULL;
    struct spl_error err = {0};
    const struct spl_image *const images = frame->images;
    float *radius = malloc((size_t)view->camera.width * view->camera.height * sizeof *radius);
    if (!radius || spl_tolerance_create(world->dataset, &tolerance, &err))
        abort();
    spl_tolerance_fill(tolerance, view, &images[SPL_LAYER_ID], &images[SPL_LAYER_DEPTH], 0, radius);
    const struct spl_picture image = {&images[SPL_LAYER_COLOR], &images[SPL_LAYER_DEPTH],
                                      images[SPL_LAYER_NORMAL].pixels ? &images[SPL_LAYER_NORMAL] : NULL,
                                      &images[SPL_LAYER_COVERAGE]};
    const struct spl_picture reference = {&truth[SPL_LAYER_COLOR], &truth[SPL_LAYER_DEPTH], &truth[SPL_LAYER_NORMAL],
                                          &truth[SPL_LAYER_COVERAGE], .tolerance_m = radius};
    if (spl_metrics_compare(&image, &reference, 0, &metrics, &err))
        abort();
    spl_tolerance_destroy(tolerance);
    free(radius);
    return metrics;
}

static double luma(const struct spl_image *color, size_t i)
{
    const uint8_t *p = (const uint8_t *)color->pixels + 4 * i;
    return 0.299 * p[0] + 0.587 * p[1] + 0.114 * p[2];
}

void measure_shift(const struct spl_frame *frame, const struct spl_image truth[SPL_LAYER_COUNT], double shift[2])
{
    const struct spl_image *t = &truth[SPL_LAYER_COLOR], *image = &frame->images[SPL_LAYER_COLOR];
    const float *depth = frame->images[SPL_LAYER_DEPTH].pixels, *true_depth = truth[SPL_LAYER_DEPTH].pixels;
    double xx = 0, xy = 0, yy = 0, xe = 0, ye = 0;
    for (uint32_t y = 1; y + 1 < t->height; y++)
        for (uint32_t x = 1; x + 1 < t->width; x++) {
            size_t i = (size_t)y * t->width + x;
            bool surface = fabs(depth[i] / true_depth[i] - 1) < 0.02; /* false for NaN */
            for (int k = 0; k < 4 && surface; k++) {                  /* away from silhouettes, where blobs are wider */
                size_t j = k == 0 ? i - 1 : k == 1 ? i + 1 : k == 2 ? i - t->width : i + t->width;
                surface = fabs(true_depth[j] / true_depth[i] - 1) < 0.02;
            }
            if (!surface)
                continue;
            double gx = (luma(t, i + 1) - luma(t, i - 1)) / 2, gy = (luma(t, i + t->width) - luma(t, i - t->width)) / 2;
            double e = luma(t, i) - luma(image, i); /* T(x - s) = T(x) - g s */
            xx += gx * gx;
            xy += gx * gy;
            yy += gy * gy;
            xe += gx * e;
            ye += gy * e;
        }
    double determinant = xx * yy - xy * xy;
    shift[0] = determinant > 0 ? (yy * xe - xy * ye) / determinant : NAN;
    shift[1] = determinant > 0 ? (xx * ye - xy * xe) / determinant : NAN;
}

double measure_depth_bias(const struct spl_frame *frame, const struct spl_image truth[SPL_LAYER_COUNT], double outlier)
{
    const struct spl_image *image = &frame->images[SPL_LAYER_DEPTH];
    const float *depth = image->pixels, *true_depth = truth[SPL_LAYER_DEPTH].pixels;
    double sum = 0, count = 0;
    for (size_t i = 0; i < (size_t)image->width * image->height; i++)
        if (fabs((double)depth[i] - true_depth[i]) < outlier) {
            sum += (double)depth[i] - true_depth[i];
            count++;
        }
    return count ? sum / count : NAN;
}
