/* Depth pass of method splat: the least view depth of every sample, each disc pushed back by its blend margin. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/disc.glsl"

layout(local_size_x = SPL_WORKGROUP) in;

layout(std430, binding = SPL_BIND_DEPTH) coherent buffer depth_buffer { uint depth[]; };
coherent SPL_TEXEL_BUFFER(SPL_TEXELS_DEPTH) depth_texels;

void draw(splat_run run, splat s)
{
    if (!(s.position.z >= frame.near && s.position.z <= frame.far))
        return;
    disc d = make_disc(s, run.low, run.high);
    ivec2 at = d.first;
    while (at.y <= d.last.y) {
        float z;
        if (disc_sample(d, at, z) < 1.0) {
            precise float pushed = z + d.margin;
            uint index = sample_index(at), bits = floatBitsToUint(pushed);
            if (bits < imageLoad(depth_texels, int(index)).x) /* what it reads may be old, never too near */
                atomicMin(depth[index], bits);
        }
        next_sample(d, at);
    }
}

void main()
{
    load_frame();
    splat_run run = load_splat_run();
    for (uint i = run.first; i < run.end; i += SPL_LANES)
        draw(run, load_splat(run.chunk, i, false));
}
