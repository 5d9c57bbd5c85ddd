/* Radix sort, first of three: how often each value of a digit occurs in a block of pairs. An invocation walks a block,
 * so that the sort is stable without barriers. Counters were zeroed. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/soft_step.glsl"

layout(local_size_x = SPL_BLOCK_GROUP) in;
layout(std430, binding = SPL_STORAGE_COUNTS) buffer count_buffer { uint counts[]; };
SPL_TEXEL_BUFFER(SPL_TEXELS_SORT_FROM) pair_texels;

void main()
{
    load_step();
    uint block = gl_GlobalInvocationID.x, i = block * job.block, end = min(i + job.block, job.count);
    for (;;) {
        uint key = imageLoad(pair_texels, int(2u * i)).x;
        if (i < end)
            counts[block * job.digits + ((key - job.low) >> job.shift & (job.digits - 1u))]++;
        if (++i >= end)
            break;
    }
}
