/* How far off a rendered depth may be and still be the right surface: the radius of the splat that the pixel shows, or
 * of the disc that a panel's cell stands for. */
#ifndef SPL_MEASURE_TOLERANCE_H
#define SPL_MEASURE_TOLERANCE_H

#include <splatd/dataset.h>
#include <splatd/render.h>

#include "base/error.h"

struct spl_tolerance;

/* `dataset` is borrowed until destroy. Takes 4 bytes a chunk. */
int spl_tolerance_create(const struct spl_dataset *dataset, struct spl_tolerance **out, struct spl_error *err);
void spl_tolerance_destroy(struct spl_tolerance *tolerance); /* NULL-safe */

/* out[i] = the radius, in the dataset's unit, at which the nearest splat of pixel i was drawn: its own, times what
 * level selection adds for the splats it leaves out at the pixel's depth z (src/render/select_draw.c): 1 /
 * sqrt(clamp((s / lod)^2, 1/4, 1)),  s = spacing * focal * supersample / z, taken with the exact share where the
 * renderer rounds the count up to full lanes, so at most a few per cent wide. Pixels without a splat get the dataset's
 * median radius. `id` and `depth` are layers of a frame of `view`; `out` holds one float a pixel. Same for any number
 * of threads (0 = all cores). */
void spl_tolerance_fill(const struct spl_tolerance *tolerance, const struct spl_view *view, const struct spl_image *id,
                        const struct spl_image *depth, unsigned threads, float *out);

#endif
