/* The frame in which a splat's texture lies: the same at pack and render, so it follows from the normal as it decodes.
 * Rows of texels run along horizontal lines wherever the surface is not itself nearly horizontal: walls of any azimuth
 * then show their edges to the dictionary in the same few directions. Floats, in the order of operations that
 * shaders/common/tangent.glsl repeats, so that both choose the same side of the threshold. Pure; any thread. */
#ifndef SPL_GEOM_TANGENT_H
#define SPL_GEOM_TANGENT_H

#include <math.h>

#define SPL_TANGENT_LEVEL 0.0625f /* square of the sine up to which a surface counts as horizontal: 14.5 degrees */

/* `normal` is a unit vector, world axes; `u` and `v` become unit, u × v = normal. Texel (column i, row j) of a texture
 * of `size` lies at the splat's centre + radius ((2 i + 1) / size - 1) u + radius ((2 j + 1) / size - 1) v. */
static inline void spl_tangent_frame(const float normal[3], float u[3], float v[3])
{
    float x = normal[0], y = normal[1], z = normal[2], level = x * x + y * y;
    if (level > SPL_TANGENT_LEVEL) {
        float inverse = 1.0f / sqrtf(level);
        u[0] = -y * inverse;
        u[1] = x * inverse;
        u[2] = 0.0f;
    } else {
        float inverse = 1.0f / sqrtf(1.0f - x * x);
        u[0] = (1.0f - x * x) * inverse;
        u[1] = -x * y * inverse;
        u[2] = -x * z * inverse;
    }
    v[0] = y * u[2] - z * u[1];
    v[1] = z * u[0] - x * u[2];
    v[2] = x * u[1] - y * u[0];
}

#endif
