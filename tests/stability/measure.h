/* One picture of a frame or of the truth, and what is measured of it beyond src/measure. */
#ifndef STABILITY_MEASURE_H
#define STABILITY_MEASURE_H

#include "measure/metrics.h"
#include "world.h"

/* Figures of a frame against the truth. A depth may be off by the radius of the splat that it shows. */
struct spl_metrics measure_frame(const struct world *world, const struct spl_view *view, const struct spl_frame *frame,
                                 const struct spl_image truth[SPL_LAYER_COUNT]);

/* How far the image lies from the truth, pixels right and down: the shift that explains most of the difference (least
 * squares over the truth's gradient, Lucas and Kanade 1981), from pixels that show the right surface. NAN without
 * texture. */
void measure_shift(const struct spl_frame *frame, const struct spl_image truth[SPL_LAYER_COUNT], double shift[2]);

/* Mean of image - truth over the depths that are within `outlier` of each other; NAN where there are none. */
double measure_depth_bias(const struct spl_frame *frame, const struct spl_image truth[SPL_LAYER_COUNT], double outlier);

#endif
