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
 * With SPL_TRIMS, for chunks that a map trims: what was trimmed is what would have been nearer than the depth pass says;
 * beside the surface itself nothing is. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/sums.glsl"
#ifdef SPL_TEXTURED
#include "common/texture.glsl"
#else
#include "common/clip.glsl"
#include "common/paint.glsl"
#endif

layout(local_size_x = SPL_WORKGROUP) in;

SPL_TEXEL_BUFFER(SPL_TEXELS_DEPTH) depth_texels;

void draw(splat_run run, splat s)
{
    if (!(s.position.z >= frame.near && s.position.z <= frame.far))
        return;
    uvec3 value = uvec3(0u);
    if (GROUP == SPL_SUMS_COLOR)
#ifdef SPL_TEXTURED
        value = load_color(run.chunk, s.index);
#else
        value = shown_color(run.chunk, s);
#endif
    else if (GROUP == SPL_SUMS_NORMAL)
        value = uvec3(s.normal * 127.0 + 127.5);
    disc d = make_disc(s, run.low, run.high);
    clip_line line = load_clip(run.chunk, s);
#ifdef SPL_TEXTURED
    splat_texture t = load_texture(run.chunk, s, value);
    lay_texture(t, run.chunk, s, gl_GlobalInvocationID.x / SPL_LANES * SPL_RUN_SPLATS + s.index % SPL_RUN_SPLATS);
#endif
    ivec2 sample_at = d.first;
    for (;;) {
        float z;
        vec3 offset;
        float distance = clip(line, offset, disc_sample(d, sample_at, z, offset));
        uint at = image_sample_index(sample_at);
        if (distance < 1.0 && sample_at.y <= d.last.y) {
            float first = uintBitsToFloat(imageLoad(depth_texels, int(at)).x);
#ifdef SPL_TEXTURED
            if (z <= first)
                value = sample_texture(t, offset);
#endif
            precise float pushed = z + d.margin + d.behind;
#ifdef SPL_TRIMS
            z = pushed < first ? 3e38 : z;
#endif
            precise float there = z + d.behind;
            if (there <= first)
                shade(at, first, z, distance, pushed, value,
                      identity(SPL_DRAWN, run.chunk.first_id + item_of(s.index)));
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
