/* The pieces of panels or, with SPL_MESHES, of meshes, with their fragments that their chunk's station saw through: as
 * of discs of the panel's blend radius. */
#ifndef SPL_PANEL_TRIM_GLSL
#define SPL_PANEL_TRIM_GLSL

#ifdef SPL_MESHES
#include "common/mesh_draw.glsl"
#else
#include "common/panel_draw.glsl"
#endif
#include "common/trim.glsl"

bool is_trimmed(panel_draw d, ivec2 at, float z)
{
    splat s;
    s.normal = d.facing;
    s.radius = d.radius;
    return is_trimmed(load_trim(s), at, z);
}

#endif
