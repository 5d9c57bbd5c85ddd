/* How far an image is from the truth: one number a kind of fault. api/measures.md has each formula and its reason. */
#ifndef SPL_MEASURE_METRICS_H
#define SPL_MEASURE_METRICS_H

#include <splatd/image.h>

#include "base/error.h"

/* The layers of one picture, all of one size. Each may be NULL: what needs it is NAN. */
struct spl_picture {
    const struct spl_image *color, *depth, *normal, *coverage;
    const float
        *tolerance_m; /* of depth, per pixel, in the depth's unit; may be NULL. NAN: the pixel is beyond no error */
    double tolerance; /* for all pixels, where tolerance_m is NULL */
};

/* NAN where a layer is missing or no pixel qualifies. */
struct spl_metrics {
    double psnr;                       /* dB over RGB; INFINITY where nothing differs */
    double ssim;                       /* of luma, at most 1 */
    double depth_rmse, depth_median;   /* depth's unit */
    double depth_beyond;               /* share 0..1 of pixels whose depth is off by more than the tolerance */
    double holes, see_through, halo;   /* shares 0..1 */
    double normal_mean, normal_median; /* degrees, 0..90 */
};

/* Compares `image` with `truth`; both are borrowed. The tolerance is the truth's where it has one (tolerance_m, or a
 * tolerance above 0), otherwise the image's. All layers that are given must be of their kind and of one size:
 * SPL_E_INPUT otherwise, naming the layer; a tolerance that is negative or no number is refused ("tolerance").
 * The outcome is the same to the bit for any number of `threads` (0 = all cores). Any thread; blocks for the
 * computation. SPL_E_NOMEM. `out` is untouched on failure. */
int spl_metrics_compare(const struct spl_picture *image, const struct spl_picture *truth, unsigned threads,
                        struct spl_metrics *out, struct spl_error *err);

/* Change from frame to frame along a path that the truth does not have. Zero-initialised. */
struct spl_motion {
    uint32_t width, height;
    int16_t *previous; /* image - truth of the last frame, one plane a channel; NULL before the first */
    double sum, worst; /* mean square of a step: over all steps, of the worst */
    size_t steps;
};

void spl_motion_init(struct spl_motion *motion);

/* Adds the next frame of the path: colour layers, all of one size and the same for all frames; SPL_E_INPUT otherwise,
 * field "color". SPL_E_NOMEM. The outcome is the same to the bit for any number of `threads`. */
int spl_motion_add(struct spl_motion *motion, const struct spl_image *image, const struct spl_image *truth,
                   unsigned threads, struct spl_error *err);

/* The path's figures in 8 bit levels, root mean square over all steps and of the worst step; NAN below two frames.
 * Either pointer may be NULL. Releases what `motion` holds and zeroes it. */
void spl_motion_finish(struct spl_motion *motion, double *flicker, double *popping);

#endif
