/* Second of three: counters become how many of their value lie in the blocks before, and totals how many there are
 * (constant 0 = 0, an invocation a value); totals become where each value starts (1, one invocation). */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/soft_step.glsl"

layout(local_size_x = SPL_LANES) in;
layout(constant_id = 0) const uint STARTS = 0;
layout(std430, binding = SPL_STORAGE_COUNTS) buffer count_buffer { uint counts[]; };
layout(std430, binding = SPL_STORAGE_TOTALS) buffer total_buffer { uint totals[]; };

void main()
{
    load_step();
    uint id = gl_GlobalInvocationID.x, running = 0u;
    if (STARTS != 0u) {
        for (uint i = id == 0u ? 0u : job.digits; i < job.digits; i++) {
            uint own = totals[i];
            totals[i] = running;
            running += own;
        }
    } else if (id < job.digits) {
        for (uint block = 0u; block < job.blocks; block++) {
            uint at = block * job.digits + id, own = counts[at];
            counts[at] = running;
            running += own;
        }
        totals[id] = running;
    }
}
