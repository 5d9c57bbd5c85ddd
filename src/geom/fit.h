/* A field of view for images of any shape. Pure. */
#ifndef SPL_GEOM_FIT_H
#define SPL_GEOM_FIT_H

#include <math.h>

/* The vertical field of view, degrees, of an image that shows at least fit[0] degrees across and fit[1] upright; both
 * in (0, 179]. */
static inline double spl_fit_fov(const double fit[2], double width, double height)
{
    double across = tan(fit[0] * M_PI / 360) * height / width, upright = tan(fit[1] * M_PI / 360);
    return across > upright ? fmin(2 * atan(across) * 180 / M_PI, 179) : fit[1];
}

#endif
