/* Shade pass of method splat: chunks of lines, beside splat_shade.comp, with the same sums. What a sample shows is of
 * the nearer of the piece's two vertices; its weight falls with the distance from the axis as a disc's does. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/capsule.glsl"
#include "common/paint.glsl"
#include "common/sums.glsl"

layout(local_size_x = SPL_WORKGROUP) in;

SPL_TEXEL_BUFFER(SPL_TEXELS_DEPTH) depth_texels;

uvec3 value_of(spl_draw_chunk chunk, splat vertex)
{
    if (GROUP == SPL_SUMS_COLOR)
        return shown_color(chunk, vertex);
    if (GROUP == SPL_SUMS_NORMAL)
        return uvec3(vertex.normal * 127.0 + 127.5);
    return uvec3(0u);
}

void draw(splat_run run, splat a, splat b)
{
    capsule c = make_capsule(cut_piece(a.position, b.position), run.chunk, run.low, run.high);
    uvec3 values[2] = {value_of(run.chunk, a), value_of(run.chunk, b)};
    capsule_walk walk = begin_walk(c);
    for (;;) {
        float z;
        bool second;
        float distance = capsule_sample(c, walk, z, second);
        if (distance < 1.0 && is_inside(c, walk) && is_kept(capsule_point(c, walk, z), 0u, CUT_OPEN)) {
            uint at = image_sample_index(sample_of(c, walk));
            uint front = imageLoad(depth_texels, int(at)).x;
            float first = uintBitsToFloat(front);
            if (z <= first)
                shade(at, first, z, distance, capsule_word(c, z) == front, second ? values[1] : values[0],
                      identity(SPL_DRAWN_LINE, run.chunk.first_id + a.index + uint(second)));
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
    splat a = load_splat(run.chunk, i, GROUP != SPL_SUMS_NORMAL);
    splat b = load_splat(run.chunk, i + 1u, GROUP != SPL_SUMS_NORMAL);
    if (is_between(a.position, b.position))
        draw(run, a, b);
}
