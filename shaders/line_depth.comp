/* Depth pass of method splat: chunks of lines, beside splat_depth.comp, an invocation for each piece. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/capsule.glsl"

layout(local_size_x = SPL_WORKGROUP) in;

layout(std430, binding = SPL_STORAGE_DEPTH) coherent buffer depth_buffer { uint depth[]; };
coherent SPL_TEXEL_BUFFER(SPL_TEXELS_DEPTH) depth_texels;

void draw(capsule c)
{
    capsule_walk walk = begin_walk(c);
    for (;;) { /* the end is asked for at the end: see common/walk.glsl */
        float z;
        bool second;
        float distance = capsule_sample(c, walk, z, second);
        if (distance < 1.0 && is_inside(c, walk) && is_kept(capsule_point(c, walk, z), 0u, CUT_OPEN)) {
            uint index = image_sample_index(sample_of(c, walk)), bits = capsule_word(c, z);
            /* What it reads may be old, never too near. */
            if (bits < imageLoad(depth_texels, int(index)).x)
                atomicMin(depth[index], bits);
        }
        next_step(c, walk);
        if (walk.at.x >= c.end)
            break;
    }
}

void main()
{
    load_frame();
    splat_run run = load_run_of(gl_GlobalInvocationID.x / SPL_RUN_SPLATS);
    uint i = run.first + gl_GlobalInvocationID.x % SPL_RUN_SPLATS;
    if (i >= run.end || !is_piece(run, i))
        return;
    vec3 p = load_splat(run.chunk, i, true).position, q = load_splat(run.chunk, i + 1u, true).position;
    if (is_between(p, q))
        draw(make_capsule(cut_piece(p, q), run.chunk, run.low, run.high));
}
