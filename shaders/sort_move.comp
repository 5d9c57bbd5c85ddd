/* Last of three: the pairs of a block to where their values go, in their order. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/soft_step.glsl"

layout(local_size_x = SPL_BLOCK_GROUP) in;
layout(std430, binding = SPL_STORAGE_COUNTS) buffer count_buffer { uint counts[]; };
layout(std430, binding = SPL_STORAGE_SORT_TO) writeonly buffer to_buffer { uint moved[]; };
SPL_TEXEL_BUFFER(SPL_TEXELS_SORT_FROM) pair_texels;
SPL_TEXEL_BUFFER(SPL_TEXELS_TOTALS) start_texels;

void main()
{
    load_step();
    uint block = gl_GlobalInvocationID.x, i = block * job.block, end = min(i + job.block, job.count);
    for (;;) {
        uint key = imageLoad(pair_texels, int(2u * i)).x, value = imageLoad(pair_texels, int(2u * i + 1u)).x;
        uint digit = (key - job.low) >> job.shift & (job.digits - 1u), counter = block * job.digits + digit;
        uint start = imageLoad(start_texels, int(digit)).x;
        if (i < end) {
            uint before = counts[counter];
            counts[counter] = before + 1u;
            moved[2u * (start + before)] = key;
            moved[2u * (start + before) + 1u] = value;
        }
        if (++i >= end)
            break;
    }
}
