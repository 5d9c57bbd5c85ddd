/* Method nearest: each sample keeps the disc whose depth, bent into a cone by as much of the blend margin as the sample
 * lies off the disc's centre, is the least; the least payload among equals. So discs of one surface meet where their
 * cones do, in the middle between their centres, without sums. The payload (constant 0) is what the requested layer
 * needs: colour, how far off its disc's centre the sample lies and how large that is, octahedral normal, id, what it
 * is, the depth that was not bent, or for maps colour and how far it was. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/point.glsl"
#include "common/octahedral.glsl"
#include "common/bend.glsl"
#include "common/clip.glsl"
#include "common/paint.glsl"
#include "common/trim.glsl"

struct work {
    disc d;
    clip_line line;
    trim_rule rule;
    uint payload;
};

bool prepare(splat_run run, splat s, out work w)
{
    if (!(s.position.z >= frame.near && s.position.z <= frame.far))
        return false;
    w.payload = identity(SPL_DRAWN, run.chunk.first_id + item_of(s.index));
    if (GROUP == SPL_SUMS_COLOR || GROUP == SPL_SUMS_MAPPED) {
        uvec3 c = shown_color(run.chunk, s);
        w.payload = c.x | c.y << 8 | c.z << 16;
    } else if (GROUP == SPL_SUMS_NORMAL) {
        w.payload = pack_normal(s.normal);
    }
    w.d = make_disc(s, run.low, run.high);
    if (GROUP == SPL_SUMS_COLOR)
        w.payload |= disc_word(w.d.short_radius);
    w.line = load_clip(run.chunk, s);
    if (w.line.verdict == CUT_GONE)
        return false;
    w.rule = load_trim(s);
    return true;
}

void touch(work w, ivec2 sample_at)
{
    float z;
    vec3 offset;
    float distance = clip(w.line, offset, disc_sample(w.d, sample_at, z, offset));
    if (distance < 1.0 && sample_at.y <= w.d.last.y) {
        precise float bent = z + w.d.margin * distance + w.d.behind;
        uint at = image_sample_index(sample_at), bits = floatBitsToUint(bent);
        uint off = disc_off_bits(distance); /* none of lines, panels and meshes, which weigh 1 */
        SPL_WHERE(wins(at, bits))
            if (!is_trimmed(w.rule, sample_at, z))
                put(at, bits, GROUP == SPL_SUMS_DEPTH    ? floatBitsToUint(z)
                              : GROUP == SPL_SUMS_COLOR  ? w.payload | off
                              : GROUP == SPL_SUMS_MAPPED ? w.payload | bend_code(z, bent) << 24
                                                         : w.payload);
    }
}

#include "common/walk.glsl"
