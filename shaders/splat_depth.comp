/* Depth pass of method splat: the least view depth of every sample, each disc pushed back by its blend margin. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/disc.glsl"

layout(local_size_x = SPL_WORKGROUP) in;

layout(std430, binding = SPL_BIND_DEPTH) buffer depth_buffer { uint depth[]; };

void main()
{
    uint entry = gl_GlobalInvocationID.x / SPL_GROUP_SPLATS;
    splat s;
    if (entry >= frame.entries || !load_splat(entry, gl_GlobalInvocationID.x % SPL_GROUP_SPLATS, false, s))
        return;
    if (!(s.position.z >= frame.near && s.position.z <= frame.far))
        return;
    footprint f = disc_footprint(s);
    for (int y = f.first.y; y <= f.last.y; y++) {
        for (int x = f.first.x; x <= f.last.x; x++) {
            float z;
            if (disc_sample(s, f, ivec2(x, y), z) >= 1.0)
                continue;
            precise float pushed = z + f.margin;
            uint bits = floatBitsToUint(pushed), at = sample_index(ivec2(x, y));
            if (bits < depth[at])
                atomicMin(depth[at], bits);
        }
    }
}
