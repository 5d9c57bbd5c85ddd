/* Unit vectors on the octahedron: (u, v) in [-1, 1]², the upper half (z >= 0) inside |u| + |v| <= 1, the lower half
 * folded outwards into the corners. Angles are kept near the pole and stretched by at most sqrt(6) on the way to (u,
 * v). A chunk turns its normals first, so that their mean lies near +z and no fold runs through them: `axis` is the
 * world axis that becomes +z (0 x, 1 y, 2 z; the other two follow cyclically), `negative` then negates the whole
 * vector. Floats throughout, in the order of operations that shaders/common/splat.glsl repeats. Pure functions; any
 * thread. */
#ifndef SPL_GEOM_OCTAHEDRAL_H
#define SPL_GEOM_OCTAHEDRAL_H

#include <math.h>
#include <stdbool.h>

static inline void spl_octahedral_turn(const float world[3], unsigned axis, bool negative, float local[3])
{
    float sign = negative ? -1.0f : 1.0f;
    local[0] = sign * world[(axis + 1) % 3];
    local[1] = sign * world[(axis + 2) % 3];
    local[2] = sign * world[axis];
}

static inline void spl_octahedral_turn_back(const float local[3], unsigned axis, bool negative, float world[3])
{
    float sign = negative ? -1.0f : 1.0f;
    world[(axis + 1) % 3] = sign * local[0];
    world[(axis + 2) % 3] = sign * local[1];
    world[axis] = sign * local[2];
}

/* A zero vector gives (0, 0), which decodes to +z. */
static inline void spl_octahedral_encode(const float local[3], float *u, float *v)
{
    float inverse = 1.0f / fmaxf(fabsf(local[0]) + fabsf(local[1]) + fabsf(local[2]), 1e-30f);
    float x = local[0] * inverse, y = local[1] * inverse;
    *u = local[2] < 0.0f ? copysignf(1.0f - fabsf(y), x) : x;
    *v = local[2] < 0.0f ? copysignf(1.0f - fabsf(x), y) : y;
}

/* Any finite (u, v) gives a unit vector: the unfolded point is never the origin. */
static inline void spl_octahedral_decode(float u, float v, float local[3])
{
    float z = 1.0f - fabsf(u) - fabsf(v);
    float x = z < 0.0f ? (1.0f - fabsf(v)) * (u >= 0.0f ? 1.0f : -1.0f) : u;
    float y = z < 0.0f ? (1.0f - fabsf(u)) * (v >= 0.0f ? 1.0f : -1.0f) : v;
    float inverse = 1.0f / sqrtf(x * x + y * y + z * z);
    local[0] = x * inverse;
    local[1] = y * inverse;
    local[2] = z * inverse;
}

#endif
