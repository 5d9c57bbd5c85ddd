/* How much of the image what lies in a box covers. Pure functions; any thread. */
#ifndef SPL_RENDER_FOOTPRINT_H
#define SPL_RENDER_FOOTPRINT_H

#include <splatd/camera.h>

#include "shared.h"

/* The occlusion tiles of samples [low, high], which may lie outside the image, of what is nowhere nearer than
 * `near`. */
struct spl_chunk_bounds spl_footprint_bounds(const struct spl_camera *camera, const double low[2],
                                             const double high[2], double near);

/* The most samples along an image axis that a disc of `radius` covers if no part of it is nearer than `near`; what lies
 * off the image does not count. INFINITY where near is not above 0. */
double spl_footprint_side(const struct spl_camera *camera, double radius, double near);

/* Samples that are looked at for a disc of `radius`, or another piece within such a ball, of which [low, high] and
 * `near` are known, at most. */
uint64_t spl_footprint_samples(const struct spl_camera *camera, const double low[2], const double high[2],
                               double radius, double near);

#endif
