/* Shade pass of method splat: integer sums over the fragments that lie within the blend margin of the first surface.
 * One run per group of layers (constant 0); sums per sample are
 *   color   r g b w
 *   depth   low high - w    of w * offset, where offset counts 2^-18 of the pushed depth in front of it: low = bits
 * 0..8
 *   normal  x y z w         of w * (127 n + 127.5)
 *   id      least dataset index among the discs that set the depth, in the id buffer
 * With SPL_TEXTURED, for chunks with atoms: group colour, whose fragments have the colour of the splat's texture
 * there; with SPL_SUMMED too, interpolated in the sums that splat_sum.comp made.
 * With SPL_TRIMS, for chunks that a map trims: what was trimmed is what would have been nearer than the depth pass says;
 * beside the surface itself nothing is. */
#version 450
#extension GL_GOOGLE_include_directive : require
#ifdef SPL_ATOMICS_64
#extension GL_EXT_shader_atomic_int64 : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#endif
#ifdef SPL_TEXTURED
#include "common/texture.glsl"
#else
#include "common/clip.glsl"
#endif

layout(local_size_x = SPL_WORKGROUP) in;
#ifdef SPL_TEXTURED
const uint GROUP = SPL_SUMS_COLOR;
#else
layout(constant_id = 0) const uint GROUP = SPL_SUMS_COLOR;
layout(std430, binding = SPL_STORAGE_IDS) buffer id_buffer { uint ids[]; };
#endif

SPL_TEXEL_BUFFER(SPL_TEXELS_DEPTH) depth_texels;

/* a and b are added to words 2 pair and 2 pair + 1; neither can wrap (frame.weight_max), so one wide add serves
 * both. */
#ifdef SPL_ATOMICS_64
layout(std430, binding = SPL_STORAGE_SUMS) buffer sums_buffer { uint64_t sums[]; };
void add(uint pair, uint a, uint b)
{
    atomicAdd(sums[pair], uint64_t(a) | uint64_t(b) << 32);
}
#else
layout(std430, binding = SPL_STORAGE_SUMS) buffer sums_buffer { uint sums[]; };
void add(uint pair, uint a, uint b)
{
    if (a != 0u)
        atomicAdd(sums[2u * pair], a);
    if (b != 0u)
        atomicAdd(sums[2u * pair + 1u], b);
}
#endif

/* One fragment: view depth z within the margin in front of `first`, the sample's pushed depth. */
void shade(uint at, float first, float z, float distance, float pushed, uvec3 value, uint id)
{
#ifndef SPL_TEXTURED
    if (GROUP == SPL_SUMS_ID) {
        if (pushed == first)
            atomicMin(ids[at], id);
        return;
    }
#endif
    precise float share = (1.0 - distance) * float(frame.weight_max);
    uint weight = max(uint(share + 0.5), 1u);
    if (GROUP == SPL_SUMS_DEPTH) {
        precise float offset = (first - z) / first * 262144.0;
        uint sum = weight * min(uint(offset + 0.5), 262143u);
        add(2u * at, sum & 511u, sum >> 9);
        add(2u * at + 1u, 0u, weight);
    } else {
        add(2u * at, weight * value.x, weight * value.y);
        add(2u * at + 1u, weight * value.z, weight);
    }
}

void draw(splat_run run, splat s)
{
    if (!(s.position.z >= frame.near && s.position.z <= frame.far))
        return;
    uvec3 value = uvec3(0u);
    if (GROUP == SPL_SUMS_COLOR)
        value = load_color(run.chunk, s.index);
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
            precise float pushed = z + d.margin;
#ifdef SPL_TRIMS
            z = pushed < first ? 3e38 : z;
#endif
            if (z <= first)
                shade(at, first, z, distance, pushed, value, run.chunk.first_id + s.index);
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
        if (i < run.end)
            draw(run, load_splat(run.chunk, i, false));
        i += SPL_LANES;
        if (i >= run.end)
            break;
    }
}
