/* Method nearest, of panels and meshes: their depth is not bent. */
#version 450
#extension GL_GOOGLE_include_directive : require
#define SPL_SHOWN 1
#include "common/point.glsl"
#include "common/octahedral.glsl"
#include "common/bend.glsl"
#include "common/panel_trim.glsl"

layout(local_size_x = SPL_WORKGROUP) in;

void panel_fragment(panel_draw d, ivec2 at, float z, float distance, float pushed, vec2 place)
{
    precise float bent = z + d.behind;
    uint index = image_sample_index(at), bits = floatBitsToUint(bent);
    if (wins(index, bits) && !is_trimmed(d, at, z)) {
        uint payload = identity(SPL_DRAWN, d.id);
        if (GROUP == SPL_SUMS_COLOR || GROUP == SPL_SUMS_MAPPED) {
            vec3 own = panel_color(d.own, uvec2(clamp(place, 0.0, float(SPL_PANEL_SIDE) - 0.5)));
            uvec3 c = shown_on_panel(d, own, at, z);
            payload = c.x | c.y << 8 | c.z << 16;
            if (GROUP == SPL_SUMS_MAPPED)
                payload |= bend_code(z, bent) << 24;
        } else if (GROUP == SPL_SUMS_NORMAL) {
            payload = pack_normal(d.facing);
        } else if (GROUP == SPL_SUMS_DEPTH) {
            payload = floatBitsToUint(z);
        }
        put(index, bits, payload);
    }
}

void main()
{
    load_frame();
    draw_panel();
}
