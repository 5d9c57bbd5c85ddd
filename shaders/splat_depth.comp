/* Depth pass of method splat: the least view depth of every sample, each disc pushed back by its blend margin. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/clip.glsl"
#include "common/trim.glsl"

layout(local_size_x = SPL_WORKGROUP) in;

layout(std430, binding = SPL_STORAGE_DEPTH) coherent buffer depth_buffer { uint depth[]; };
coherent SPL_TEXEL_BUFFER(SPL_TEXELS_DEPTH) depth_texels;

void draw(splat_run run, splat s)
{
    if (!(s.position.z >= frame.near && s.position.z <= frame.far))
        return;
    disc d = make_disc(s, run.low, run.high);
    clip_line line = load_clip(run.chunk, s);
    trim_rule rule = load_trim(s);
    ivec2 at = d.first;
    /* The end is asked for at the end, here and in main(): software drivers leave a loop only there, so that a question
     * at its start costs every group of lanes another round, with all of them off. */
    for (;;) {
        float z;
        vec3 offset;
        float distance = clip(line, offset, disc_sample(d, at, z, offset));
        if (distance < 1.0 && at.y <= d.last.y) {
            precise float pushed = z + d.margin + d.behind;
            uint index = image_sample_index(at), bits = floatBitsToUint(pushed);
            /* What it reads may be old, never too near. */
            SPL_WHERE(bits < imageLoad(depth_texels, int(index)).x)
                if (!is_trimmed(rule, at, z))
                    atomicMin(depth[index], bits);
        }
        next_sample(d, at);
        if (at.y > d.last.y)
            break;
    }
}

void main()
{
    load_frame();
    splat_run run = load_splat_run();
    uint i = run.first;
    for (;;) {
        if (has_splat(run, i) && is_drawn(run.chunk, i))
            draw(run, load_splat(run.chunk, i, false));
        i += SPL_RUN_STEP;
        if (i >= run.end)
            break;
    }
}
