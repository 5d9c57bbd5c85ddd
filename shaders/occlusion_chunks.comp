/* Occlusion, step 2: chunks that lie behind everything drawn so far in all of their tiles are dropped by drawing none
 * of their splats. A fragment behind its sample's pushed depth changes neither pass, so the image stays the same to the
 * bit. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/frame.glsl"

layout(local_size_x = SPL_WORKGROUP) in;

layout(std430, binding = SPL_STORAGE_BOUNDS) readonly buffer bounds_buffer { spl_chunk_bounds bounds[]; };
layout(std430, binding = SPL_STORAGE_CHUNKS) buffer chunk_buffer { spl_draw_chunk draw_chunks[]; };
SPL_TEXEL_BUFFER(SPL_TEXELS_OCCLUDERS) tile_texels;

void main()
{
    load_frame();
    uint chunk = frame.first_entry + gl_GlobalInvocationID.x;
    if (gl_GlobalInvocationID.x >= frame.entries)
        return;
    uint columns = (frame.width + SPL_OCCLUSION_TILE - 1u) / SPL_OCCLUSION_TILE;
    uvec2 first = uvec2(bounds[chunk].first & 0xffffu, bounds[chunk].first >> 16);
    uvec2 last = uvec2(bounds[chunk].last & 0xffffu, bounds[chunk].last >> 16);
    uint near = floatBitsToUint(bounds[chunk].near);
    for (uint y = first.y; y <= last.y; y++)
        for (uint x = first.x; x <= last.x; x++)
            if (near <= imageLoad(tile_texels, int(y * columns + x)).x)
                return;
    draw_chunks[chunk].count = 0u;
}
