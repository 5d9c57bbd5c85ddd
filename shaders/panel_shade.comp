/* Shade pass of method splat, of panels: the sums of splat_shade.comp. A fragment weighs as much as a disc's at its
 * centre; colours are interpolated between the middles of cells, as discs blend. */
#version 450
#extension GL_GOOGLE_include_directive : require
#define SPL_SHOWN 1
#include "common/sums.glsl"
#ifdef SPL_MESHES
#include "common/mesh_draw.glsl"
#else
#include "common/panel_draw.glsl"
#endif

layout(local_size_x = SPL_WORKGROUP) in;

SPL_TEXEL_BUFFER(SPL_TEXELS_DEPTH) depth_texels;

void panel_fragment(panel_draw d, ivec2 at, float z, float distance, float pushed, vec2 place)
{
    uint index = image_sample_index(at);
    uint front = imageLoad(depth_texels, int(index)).x, own = sided_word(pushed, panel_side(d, z, pushed));
    float first = uintBitsToFloat(front);
#ifdef SPL_TRIMS
    z = own < front ? 3e38 : z; /* what was trimmed: see splat_shade.comp */
#endif
    precise float there = z + d.behind;
    if (there <= first && !is_hidden(front, own, there)) {
        uvec3 value = uvec3(0u);
        if (GROUP == SPL_SUMS_COLOR)
            value = shown_on_panel(d, panel_color_between(d.own, place), at, z);
        else if (GROUP == SPL_SUMS_NORMAL)
            value = uvec3(d.facing * 127.0 + 127.5);
        shade(index, first, z, distance, own == front, value, identity(SPL_DRAWN, d.id));
    }
}

void main()
{
    load_frame();
    draw_panel();
}
