/* Polar-capped maps of the sphere around a station: two azimuthal caps and a band, joined at 45 degrees of elevation,
 * where their texels are equally wide (Snyder and Mitchell 2001; section 3.1 of the textured-splats-panoramas paper,
 * whose printed inverse is wrong in four places: eqs. 4 to 6).
 *
 * An atlas of `side` and `apron` texels has its charts side by side, each with an apron around it that goes on beyond
 * its edge on the sphere, so that filters never look at another chart:
 *
 *     bottom cap | top cap | band            6 (side + apron) texels wide, side + 2 apron high
 *
 * The caps are side x side, the band 4 side x side. Place (x, y) counts texels from the atlas's corner; the centre of
 * the first is (0.5, 0.5). A texel is pi / (2 side) radians wide. Directions are in the station's frame, z up. Pure
 * functions; any thread. */
#ifndef SPL_GEOM_POLAR_H
#define SPL_GEOM_POLAR_H

#include <stdbool.h>
#include <stdint.h>

static inline uint32_t spl_polar_width(uint32_t side, uint32_t apron)
{
    return 6 * (side + apron);
}

static inline uint32_t spl_polar_height(uint32_t side, uint32_t apron)
{
    return side + 2 * apron;
}

/* Radians that a texel is wide. */
double spl_polar_texel(uint32_t side);

/* Eqs. 1 to 3: the unit direction of a place, of aprons and of the caps' corners too. */
void spl_polar_direction(uint32_t side, uint32_t apron, const double place[2], double direction[3]);

/* Eqs. 4 to 6, corrected: the place, within a chart proper, that has direction `d`, of any length above 0. */
void spl_polar_place(uint32_t side, uint32_t apron, const double d[3], double place[2]);

/* Whether texel (x, y) has a direction of its own: aprons, and the corners of caps beyond 45 degrees, repeat what
 * another chart shows. */
bool spl_polar_is_proper(uint32_t side, uint32_t apron, uint32_t x, uint32_t y);

/* spl_polar_place() in floats, of a unit `d`: what kernels do (shaders/common/polar.glsl), step by step. Off by less
 * than a twentieth of a texel of side 2048. */
void spl_polar_place_f(uint32_t side, uint32_t apron, const float d[3], float place[2]);

#endif
