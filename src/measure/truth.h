/* What a view's frames are compared with: the true images, and the part of them where the scan has a point a pixel. */
#ifndef SPL_MEASURE_TRUTH_H
#define SPL_MEASURE_TRUTH_H

#include "measure/metrics.h"

/* Zero-initialised. */
struct spl_truth {
    struct spl_image images[SPL_LAYER_COUNT];
    float *tolerance; /* one a pixel, for the caller to fill before each comparison */
    struct spl_image
        dense_images[SPL_LAYER_COUNT]; /* the same as `images`, empty where the scan is thin; may all be NULL */
    uint8_t *dense;                    /* a byte a pixel; may be NULL */
    double dense_share, dense_of_all;  /* of the pixels with a true depth; of all */
};

/* Allocates `tolerance` for images of that size. SPL_E_NOMEM. */
int spl_truth_init(struct spl_truth *truth, uint32_t width, uint32_t height, struct spl_error *err);
void spl_truth_finish(struct spl_truth *truth);

/* Finds the dense part; `points` is as for spl_dense_mark(). `images` must hold a depth. */
int spl_truth_mark_dense(struct spl_truth *truth, const struct spl_image *points, struct spl_error *err);

/* Compares a frame's images with the truth: all of it, then the dense part alone, which empties `images` elsewhere.
 * What is not known is NAN: all of *dense where no dense part was marked, SSIM and halo of it always. Uses all cores.
 */
int spl_truth_compare(const struct spl_truth *truth, struct spl_image images[SPL_LAYER_COUNT], struct spl_metrics *all,
                      struct spl_metrics *dense, struct spl_error *err);

#endif
