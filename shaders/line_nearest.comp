/* Method nearest: chunks of lines, beside nearest.comp, an invocation for each piece. Its depth is bent over its width
 * as a disc's is; what a sample shows is of the nearer of the piece's two vertices. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/point.glsl"
#include "common/octahedral.glsl"
#include "common/bend.glsl"
#include "common/capsule.glsl"
#include "common/paint.glsl"

layout(local_size_x = SPL_WORKGROUP) in;

/* Of vertex `index`. */
uint payload(spl_draw_chunk chunk, splat vertex)
{
    if (GROUP == SPL_SUMS_COLOR || GROUP == SPL_SUMS_MAPPED) {
        uvec3 c = shown_color(chunk, vertex);
        return c.x | c.y << 8 | c.z << 16;
    }
    if (GROUP == SPL_SUMS_NORMAL)
        return pack_normal(vertex.normal);
    return identity(SPL_DRAWN_LINE, chunk.first_id + vertex.index);
}

void draw(splat_run run, splat a, splat b)
{
    capsule c = make_capsule(cut_piece(a.position, b.position), run.chunk, run.low, run.high);
    uvec2 payloads = uvec2(payload(run.chunk, a), payload(run.chunk, b));
    capsule_walk walk = begin_walk(c);
    for (;;) { /* the end is asked for at the end: see common/walk.glsl */
        float z;
        bool second;
        float distance = capsule_sample(c, walk, z, second);
        if (distance < 1.0 && is_inside(c, walk) && is_kept(capsule_point(c, walk, z), 0u, CUT_OPEN)) {
            precise float bent = z + capsule_margin(c, z) * distance;
            uint at = image_sample_index(sample_of(c, walk)), bits = floatBitsToUint(bent);
            uint own = second ? payloads.y : payloads.x;
            if (wins(at, bits))
                put(at, bits, GROUP == SPL_SUMS_DEPTH    ? floatBitsToUint(z)
                              : GROUP == SPL_SUMS_MAPPED ? own | bend_code(z, bent) << 24
                                                         : own);
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
    splat a = load_splat(run.chunk, i, GROUP != SPL_SUMS_NORMAL && !PAINTS_NORMALS);
    splat b = load_splat(run.chunk, i + 1u, GROUP != SPL_SUMS_NORMAL && !PAINTS_NORMALS);
    if (is_between(a.position, b.position))
        draw(run, a, b);
}
