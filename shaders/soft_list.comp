/* Lists of the tiles: items in their order, an entry for each tile of their rectangles; first counted (constant 0 = 0),
 * then, once it is known where each tile's list starts, written (1). It is a counting sort by tile, so that lists are
 * in the items' order. Blocks remember how far they came: a walk of SPL_SOFT_ROUNDS goes on in another dispatch. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/soft_step.glsl"

layout(local_size_x = SPL_LANES) in;
layout(constant_id = 0) const uint WRITES = 0;
layout(std430, binding = SPL_STORAGE_COUNTS) buffer count_buffer { uint counts[]; };
layout(std430, binding = SPL_STORAGE_SORT_TO) writeonly buffer entry_buffer { uint entries[]; };
SPL_TEXEL_BUFFER(SPL_TEXELS_SORT_FROM) pair_texels;
SPL_TEXEL_BUFFER(SPL_TEXELS_ITEMS) item_texels;
SPL_TEXEL_BUFFER(SPL_TEXELS_TOTALS) start_texels;

uint item_at(uint i)
{
    return imageLoad(pair_texels, int(2u * i + 1u)).x;
}

void main()
{
    load_step();
    uint block = gl_GlobalInvocationID.x, kept = job.progress + 2u * block;
    if (block >= job.blocks)
        return;
    uint i = block * job.block + counts[kept], end = min((block + 1u) * job.block, job.count);
    uint column = counts[kept + 1u] & 255u, row = counts[kept + 1u] >> 8;
    uint last = job.count - 1u, item = item_at(min(i, last)), next = item_at(min(i + 1u, last));
    uint rect = imageLoad(item_texels, int(job.rects + item)).x;
    for (uint round = 0u;;) {
        uint next_rect = imageLoad(item_texels, int(job.rects + next)).x, after = item_at(min(i + 2u, last));
        uint tile = (rect & (1u << SPL_SOFT_RECT_COLUMNS) - 1u) + row * job.columns + column;
        uint counter = block * job.digits + tile;
        uint start = WRITES != 0u ? imageLoad(start_texels, int(tile)).x : 0u;
        if (i < end) {
            uint before = counts[counter];
            counts[counter] = before + 1u;
            if (WRITES != 0u)
                entries[start + before] = item;
        }
        bool wraps = column == bitfieldExtract(rect, SPL_SOFT_RECT_COLUMNS, SPL_SOFT_RECT_ROWS - SPL_SOFT_RECT_COLUMNS);
        bool ends = wraps && row == rect >> SPL_SOFT_RECT_ROWS;
        column = wraps ? 0u : column + 1u;
        row = ends ? 0u : row + uint(wraps);
        i += uint(ends);
        item = ends ? next : item; /* loaded a round ahead */
        rect = ends ? next_rect : rect;
        next = ends ? after : next;
        if (i >= end || ++round >= SPL_SOFT_ROUNDS)
            break;
    }
    counts[kept] = i - block * job.block;
    counts[kept + 1u] = column | row << 8;
}
