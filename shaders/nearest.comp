/* Method nearest: each sample keeps the disc whose depth, bent into a cone by as much of the blend margin as the sample
 * lies off the disc's centre, is the least; the least payload among equals. So discs of one surface meet where their
 * cones do, in the middle between their centres, without sums. The payload (constant 0) is what the requested layer
 * needs: colour, octahedral normal, id, what it is, the depth that was not bent, or for maps colour and how far it was. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/point.glsl"
#include "common/octahedral.glsl"
#include "common/bend.glsl"
#include "common/clip.glsl"
#include "common/paint.glsl"
#include "common/trim.glsl"

layout(local_size_x = SPL_WORKGROUP) in;

void draw(splat_run run, splat s)
{
    if (!(s.position.z >= frame.near && s.position.z <= frame.far))
        return;
    uint payload = identity(SPL_DRAWN, run.chunk.first_id + item_of(s.index));
    if (GROUP == SPL_SUMS_COLOR || GROUP == SPL_SUMS_MAPPED) {
        uvec3 c = shown_color(run.chunk, s);
        payload = c.x | c.y << 8 | c.z << 16;
    } else if (GROUP == SPL_SUMS_NORMAL) {
        payload = pack_normal(s.normal);
    }
    disc d = make_disc(s, run.low, run.high);
    clip_line line = load_clip(run.chunk, s);
    trim_rule rule = load_trim(s);
    ivec2 sample_at = d.first;
    for (;;) { /* the end is asked for at the end: see splat_depth.comp */
        float z;
        vec3 offset;
        float distance = clip(line, offset, disc_sample(d, sample_at, z, offset));
        if (distance < 1.0 && sample_at.y <= d.last.y) {
            precise float bent = z + d.margin * distance + d.behind;
            uint at = image_sample_index(sample_at), bits = floatBitsToUint(bent);
            SPL_WHERE(wins(at, bits))
                if (!is_trimmed(rule, sample_at, z))
                    put(at, bits, GROUP == SPL_SUMS_DEPTH    ? floatBitsToUint(z)
                                  : GROUP == SPL_SUMS_MAPPED ? payload | bend_code(z, bent) << 24
                                                             : payload);
        }
        next_sample(d, sample_at);
        if (sample_at.y > d.last.y)
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
