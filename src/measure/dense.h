/* Where the scan itself has a point a pixel: what a render gets wrong elsewhere, no renderer could know better. */
#ifndef SPL_MEASURE_DENSE_H
#define SPL_MEASURE_DENSE_H

#include <splatd/image.h>

#include "base/error.h"

/* Marks in `dense` (a byte a pixel) the pixels around which the scan sampled the true surface with a point a pixel or
 * more: of the pixels with a true depth in the 9×9 around, at least 1 - 1/e show a point within 2 % of it, which is how
 * many random points of that density hit. `points` is the depth layer of a frame of every point, one pixel each, of the
 * same view as `truth`. Pixels without a true depth are not dense. Returns how many are. SPL_E_INPUT (negative) where
 * sizes differ or it is not depth, SPL_E_NOMEM. */
int64_t spl_dense_mark(const struct spl_image *points, const struct spl_image *truth, uint8_t *dense,
                       struct spl_error *err);

/* Empties the pixels of `image` (color, depth, normal or coverage) that are not dense. Of two pictures so treated,
 * spl_metrics_compare() tells depth, holes, see-through and normals over dense pixels alone; its PSNR is too high by 10
 * log10(pixels / dense pixels). */
void spl_dense_blank(struct spl_image *image, const uint8_t *dense);

#endif
