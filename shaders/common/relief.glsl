/* The surface of a panel with relief: src/dataset/relief.c, in the same order of operations. Kernels of meshes alone,
 * with SPL_MESHES. */
#ifndef SPL_RELIEF_GLSL
#define SPL_RELIEF_GLSL

#include "common/panel.glsl"

/* The height of point (i, j) of the panel's lattice, metres. */
float relief_height(panel p, uvec2 point)
{
    uint at = point.y * ((1u << p.lattice) + 1u) + point.x;
    uint word = page_word(min(p.heights + at / 4u, p.last));
    precise float height = float(int(word >> 8u * (at & 3u) & 255u) - SPL_RELIEF_ZERO) * p.worth;
    return height;
}

/* The height at (x, y), 0..16, cells of the panel, and how it rises by a cell along x and y, metres. */
float relief_at(panel p, vec2 place, out vec2 slope)
{
    float squares = float(1u << p.lattice);
    precise float scale = squares / float(SPL_PANEL_SIDE);
    precise vec2 q = place * scale;
    vec2 corner = min(floor(max(q, 0.0)), squares - 1.0);
    precise vec2 f = q - corner;
    uvec2 at = uvec2(corner);
    bool low = f.x >= f.y; /* the triangle of corner (1, 0) */
    float h00 = relief_height(p, at), h11 = relief_height(p, at + 1u);
    float middle = relief_height(p, at + (low ? uvec2(1u, 0u) : uvec2(0u, 1u)));
    precise vec2 along = low ? vec2(middle - h00, h11 - middle) : vec2(h11 - middle, middle - h00);
    precise vec2 rise = along * scale;
    precise float height = h00 + f.x * along.x + f.y * along.y;
    slope = rise;
    return height;
}

/* The normal of a surface that rises by `slope` a cell; view space, unit. */
vec3 relief_normal(panel_plane plane, vec2 slope)
{
    precise vec2 tilt = slope / plane.cell;
    precise float scale = 1.0 / sqrt(1.0 + tilt.x * tilt.x + tilt.y * tilt.y);
    precise vec3 normal = (plane.normal - tilt.x * plane.u - tilt.y * plane.v) * scale;
    return normal;
}

#endif
