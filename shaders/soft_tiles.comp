/* Lists of tiles from entries that are sorted by tile: their items, one after the other, and where each tile's
 * begin. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/soft_step.glsl"

layout(local_size_x = SPL_BLOCK_GROUP) in;
layout(std430, binding = SPL_STORAGE_SORT_TO) writeonly buffer entry_buffer { uint entries[]; };
layout(std430, binding = SPL_STORAGE_TOTALS) writeonly buffer start_buffer { uint starts[]; };
SPL_TEXEL_BUFFER(SPL_TEXELS_SORT_FROM) pair_texels;

void main()
{
    load_step();
    uint id = gl_GlobalInvocationID.x;
    if (id < job.count)
        entries[id] = imageLoad(pair_texels, int(2u * id + 1u)).x;
    if (id < job.digits) {
        uint low = 0u, high = job.count;
        while (low < high) {
            uint middle = low + (high - low) / 2u;
            bool before = imageLoad(pair_texels, int(2u * middle)).x < id;
            low = before ? middle + 1u : low;
            high = before ? high : middle;
        }
        starts[id] = low;
    }
}
