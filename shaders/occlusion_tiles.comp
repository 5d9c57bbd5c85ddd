/* Occlusion, step 1: the greatest pushed depth of every tile of the image. An empty sample's word is the greatest of
 * all, so a tile that is not full occludes nothing. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/frame.glsl"

layout(local_size_x = SPL_WORKGROUP) in;
layout(constant_id = 0) const uint WIDE = 0; /* 1: words of 64 bits, payload and depth */

SPL_TEXEL_BUFFER(SPL_TEXELS_DEPTH) depth_texels;
layout(std430, binding = SPL_STORAGE_OCCLUDERS) writeonly buffer tile_buffer { uint tiles[]; };

void main()
{
    load_frame();
    uint columns = (frame.width + SPL_OCCLUSION_TILE - 1u) / SPL_OCCLUSION_TILE;
    uint rows = (frame.height + SPL_OCCLUSION_TILE - 1u) / SPL_OCCLUSION_TILE;
    uint tile = gl_GlobalInvocationID.x;
    if (tile >= columns * rows)
        return;
    uvec2 first = uvec2(tile % columns, tile / columns) * SPL_OCCLUSION_TILE;
    uvec2 end = min(first + SPL_OCCLUSION_TILE, uvec2(frame.width, frame.height));
    uint greatest = 0u;
    for (uint y = first.y; y < end.y; y++)
        for (uint x = first.x; x < end.x; x++)
            greatest = max(greatest, imageLoad(depth_texels, int((y * frame.width + x) * (1u + WIDE) + WIDE)).x);
    tiles[tile] = greatest;
}
