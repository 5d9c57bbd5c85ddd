/* Flicker and popping; see motion.h. */
#include "support/motion.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "measure/metrics_parts.h"

void motion_add(struct motion *motion, const struct spl_image *image, const struct spl_image *truth)
{
    const bool first = !motion->previous;
    const size_t pixels = (size_t)image->width * image->height;
    const uint32_t *of_image = image->pixels, *of_truth = truth->pixels;
    uint8_t a[3][SPL_METRICS_BLOCK], b[3][SPL_METRICS_BLOCK];
    double squares = 0; /* whole */
    if (first) {
        motion->pixels = pixels;
        motion->previous = spl_alloc(pixels, 3 * sizeof *motion->previous, NULL);
    }
    spl_assert(spl_metrics_is_color(image) && spl_metrics_is_color(truth) && motion->previous);
    spl_assert(pixels == motion->pixels && image->width == truth->width && image->height == truth->height);
    for (size_t at = 0; at < pixels; at += SPL_METRICS_BLOCK) {
        const size_t count = pixels - at < SPL_METRICS_BLOCK ? pixels - at : SPL_METRICS_BLOCK;
        spl_metrics_flatten(of_image + at, count, a);
        spl_metrics_flatten(of_truth + at, count, b);
        for (int c = 0; c < 3; c++)
            for (size_t i = 0; i < count; i++) {
                int16_t *previous = &motion->previous[c * pixels + at + i], error = (int16_t)(a[c][i] - b[c][i]);
                squares += (double)(error - *previous) * (error - *previous);
                *previous = error;
            }
    }
    if (first)
        return;
    const double mean = squares / (3.0 * (double)pixels);
    motion->sum += mean;
    motion->worst = fmax(motion->worst, mean);
    motion->steps++;
}

void motion_finish(struct motion *motion, double *flicker, double *popping)
{
    if (flicker)
        *flicker = motion->steps ? sqrt(motion->sum / (double)motion->steps) : (double)NAN;
    if (popping)
        *popping = motion->steps ? sqrt(motion->worst) : (double)NAN;
    free(motion->previous);
    *motion = (struct motion){0};
}
