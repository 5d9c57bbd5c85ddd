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

#endif
