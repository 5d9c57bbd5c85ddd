/* Shade pass of method splat: integer sums over the fragments that lie within the blend margin of the first surface.
 * One run per group of layers (constant 0); sums per sample are
 *   color   r g b w
 *   depth   low high - w    of w * offset, where offset counts 2^-18 of the pushed depth in front of it: low = bits
 * 0..8
 *   normal  x y z w         of w * (127 n + 127.5)
 *   id      least dataset index among the discs that set the depth, in the id buffer
 *   primitive  the same of SPL_DRAWN_*
 * With SPL_TEXTURED, for chunks with atoms: group colour, whose fragments have the colour of the splat's texture
 * there; with SPL_SUMMED too, interpolated in the sums that splat_sum.comp made.
 * With SPL_TRIMS, for chunks that a map trims: what was trimmed is what would have been nearer than the depth pass
 * says; beside the surface itself nothing is. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/sums.glsl"
#ifdef SPL_TEXTURED
#include "common/texture.glsl"
#else
#include "common/clip.glsl"
#include "common/paint.glsl"
#endif

SPL_TEXEL_BUFFER(SPL_TEXELS_DEPTH) depth_texels;

struct work {
    disc d;
    clip_line line;
    uvec3 value;
    uint id;
#ifdef SPL_TEXTURED
    splat_texture texture;
#endif
};

bool prepare(splat_run run, splat s, out work w)
{
    if (!(s.position.z >= frame.near && s.position.z <= frame.far))
        return false;
    w.value = uvec3(0u);
    if (GROUP == SPL_SUMS_COLOR)
#ifdef SPL_TEXTURED
        w.value = load_color(run.chunk, s.index);
#else
        w.value = shown_color(run.chunk, s);
#endif
    else if (GROUP == SPL_SUMS_NORMAL)
        w.value = uvec3(s.normal * 127.0 + 127.5);
    w.id = identity(SPL_DRAWN, run.chunk.first_id + item_of(s.index));
    w.d = make_disc(s, run.low, run.high);
    w.line = load_clip(run.chunk, s);
    if (w.line.verdict == CUT_GONE)
        return false;
#ifdef SPL_TEXTURED
    w.texture = load_texture(run.chunk, s, w.value);
    lay_texture(w.texture, run.chunk, s, own_entry() * SPL_RUN_SPLATS + s.index % SPL_RUN_SPLATS);
#endif
    return true;
}

void touch(work w, ivec2 sample_at)
{
    float z;
    vec3 offset;
    float distance = clip(w.line, offset, disc_sample(w.d, sample_at, z, offset));
    uint at = image_sample_index(sample_at);
    if (distance < 1.0 && sample_at.y <= w.d.last.y) {
        uint front = imageLoad(depth_texels, int(at)).x;
        float first = uintBitsToFloat(front);
        uvec3 value = w.value;
#ifdef SPL_TEXTURED
        if (z <= first)
            value = sample_texture(w.texture, offset);
#endif
        precise float pushed = z + w.d.margin + w.d.behind;
        uint own = sided_word(pushed, w.d.side);
#ifdef SPL_TRIMS
        z = own < front ? 3e38 : z;
#endif
        precise float there = z + w.d.behind;
        if (there <= first && !is_hidden(front, own, there))
            shade(at, first, z, distance, own == front, value, w.id);
    }
}

#include "common/walk.glsl"
