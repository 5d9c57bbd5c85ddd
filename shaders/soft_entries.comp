/* Entries of lists, where these are sorted by tile: how many the items of a block have (constant 0 = 0), then each as a
 * pair of tile and item, behind those of the blocks before (1). What is beyond job.entries is left out. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/soft_step.glsl"

layout(local_size_x = SPL_BLOCK_GROUP) in;
layout(constant_id = 0) const uint WRITES = 0;
layout(std430, binding = SPL_STORAGE_COUNTS) buffer count_buffer { uint counts[]; };
layout(std430, binding = SPL_STORAGE_SORT_TO) writeonly buffer pair_buffer { uint pairs[]; };
SPL_TEXEL_BUFFER(SPL_TEXELS_SORT_FROM) sorted_texels;
SPL_TEXEL_BUFFER(SPL_TEXELS_ITEMS) item_texels;

void main()
{
    load_step();
    uint block = gl_GlobalInvocationID.x, i = block * job.block, end = min(i + job.block, job.count);
    if (block >= job.blocks)
        return;
    uint at = WRITES != 0u ? counts[block] : 0u;
    for (; i < end; i++) {
        uint item = imageLoad(sorted_texels, int(2u * i + 1u)).x;
        uint rect = imageLoad(item_texels, int(job.rects + item)).x;
        uint columns = bitfieldExtract(rect, SPL_SOFT_RECT_COLUMNS, SPL_SOFT_RECT_ROWS - SPL_SOFT_RECT_COLUMNS) + 1u;
        uint rows = (rect >> SPL_SOFT_RECT_ROWS) + 1u, first = rect & (1u << SPL_SOFT_RECT_COLUMNS) - 1u;
        for (uint row = 0u; WRITES != 0u && row < rows; row++)
            for (uint column = 0u; column < columns; column++) {
                uint entry = at + row * columns + column;
                if (entry < job.entries) {
                    pairs[2u * entry] = first + row * job.columns + column;
                    pairs[2u * entry + 1u] = item;
                }
            }
        at += columns * rows;
    }
    if (WRITES == 0u)
        counts[block] = at;
}
