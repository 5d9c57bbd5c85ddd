/* Depth pass of method splat, of panels and meshes. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/panel_trim.glsl"

layout(local_size_x = SPL_WORKGROUP) in;

layout(std430, binding = SPL_STORAGE_DEPTH) coherent buffer depth_buffer { uint depth[]; };
coherent SPL_TEXEL_BUFFER(SPL_TEXELS_DEPTH) depth_texels;

void panel_fragment(panel_draw d, ivec2 at, float z, float distance, float pushed, vec2 place)
{
    uint index = image_sample_index(at), bits = sided_word(pushed, panel_side(d, z, pushed));
    /* What it reads may be old, never too near. */
    SPL_WHERE(bits < imageLoad(depth_texels, int(index)).x)
        if (!is_trimmed(d, at, z))
            atomicMin(depth[index], bits);
}

void main()
{
    load_frame();
    draw_panel();
}
