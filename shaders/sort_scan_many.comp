/* sort_scan.comp where many invocations run: a workgroup a value, whose counters it sums up SPL_SCAN_GROUP times
 * SPL_SCAN_OWN at once (constant 0 = 0), or one that makes totals the starts of all values (1). */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/soft_step.glsl"

#define SPL_SCAN_GROUP 256u
#define SPL_SCAN_OWN 8u

layout(local_size_x = 256) in;
layout(constant_id = 0) const uint STARTS = 0;
layout(std430, binding = SPL_STORAGE_COUNTS) buffer count_buffer { uint counts[]; };
layout(std430, binding = SPL_STORAGE_TOTALS) buffer total_buffer { uint totals[]; };
shared uint sums[SPL_SCAN_GROUP];

/* The sum of what the invocations before this one have; of all of them in the last. */
uint sum_before(uint lane, uint own)
{
    sums[lane] = own;
    barrier();
    for (uint step = 1u; step < SPL_SCAN_GROUP; step *= 2u) {
        uint beside = lane >= step ? sums[lane - step] : 0u;
        barrier();
        sums[lane] += beside;
        barrier();
    }
    return sums[lane] - own;
}

void main()
{
    load_step();
    uint lane = gl_LocalInvocationID.x, id = gl_WorkGroupID.x, before = 0u;
    if (STARTS != 0u) {
        uint own = lane < job.digits ? totals[lane] : 0u;
        uint start = sum_before(lane, own);
        if (lane < job.digits)
            totals[lane] = start;
        return;
    }
    for (uint base = 0u; base < job.blocks; base += SPL_SCAN_GROUP * SPL_SCAN_OWN) {
        uint first = base + lane * SPL_SCAN_OWN, own[SPL_SCAN_OWN], sum = 0u;
        for (uint k = 0u; k < SPL_SCAN_OWN; k++) {
            own[k] = first + k < job.blocks ? counts[(first + k) * job.digits + id] : 0u;
            sum += own[k];
        }
        uint running = before + sum_before(lane, sum);
        for (uint k = 0u; k < SPL_SCAN_OWN; k++) {
            if (first + k < job.blocks)
                counts[(first + k) * job.digits + id] = running;
            running += own[k];
        }
        before += sums[SPL_SCAN_GROUP - 1u];
        barrier(); /* the sums are read before the next round writes them */
    }
    if (lane == 0u)
        totals[id] = before;
}
