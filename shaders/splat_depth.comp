/* Depth pass of method splat: the least view depth of every sample, each disc pushed back by its blend margin. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/clip.glsl"
#include "common/trim.glsl"

layout(std430, binding = SPL_STORAGE_DEPTH) coherent buffer depth_buffer { uint depth[]; };
coherent SPL_TEXEL_BUFFER(SPL_TEXELS_DEPTH) depth_texels;

struct work {
    disc d;
    clip_line line;
    trim_rule rule;
};

bool prepare(splat_run run, splat s, out work w)
{
    if (!(s.position.z >= frame.near && s.position.z <= frame.far))
        return false;
    w.d = make_disc(s, run.low, run.high);
    w.line = load_clip(run.chunk, s);
    if (w.line.verdict == CUT_GONE)
        return false;
    w.rule = load_trim(s);
    return true;
}

void touch(work w, ivec2 at)
{
    float z;
    vec3 offset;
    float distance = clip(w.line, offset, disc_sample(w.d, at, z, offset));
    if (distance < 1.0 && at.y <= w.d.last.y) {
        precise float pushed = z + w.d.margin + w.d.behind;
        uint index = image_sample_index(at), bits = sided_word(pushed, w.d.side);
        /* What it reads may be old, never too near. */
        SPL_WHERE(bits < imageLoad(depth_texels, int(index)).x)
            if (!is_trimmed(w.rule, at, z))
                atomicMin(depth[index], bits);
    }
}

#include "common/walk.glsl"
