/* Method points: each splat's centre covers the one sample that it falls on; the nearest wins, the least payload among
 * equals. With 64 bit atomics one pass keeps depth << 32 | payload; without, pass 0 finds the depth and pass 1 the
 * payload. The payload (constant 0) is what the requested layer needs: colour, octahedral normal or id. For method fill
 * (constant 2) the depth's low bits hold the splat's spacing and whether it is linear. */
#version 450
#extension GL_GOOGLE_include_directive : require
#ifdef SPL_ATOMICS_64
#extension GL_EXT_shader_atomic_int64 : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#endif
#include "common/splat.glsl"
#include "common/octahedral.glsl"

layout(local_size_x = SPL_WORKGROUP) in;
layout(constant_id = 0) const uint GROUP = SPL_SUMS_COLOR;
layout(constant_id = 1) const uint PASS = 0;
layout(constant_id = 2) const uint FILL = 0;

#ifdef SPL_ATOMICS_64
layout(std430, binding = SPL_BIND_DEPTH) coherent buffer depth_buffer { uint64_t depth[]; };
#else
layout(std430, binding = SPL_BIND_DEPTH) coherent buffer depth_buffer { uint depth[]; };
layout(std430, binding = SPL_BIND_ID) buffer id_buffer { uint payloads[]; };
#endif

coherent SPL_TEXEL_BUFFER(SPL_TEXELS_DEPTH) depth_texels; /* what is read may be old, never too near */

uint payload(spl_draw_chunk chunk, splat s)
{
    if (GROUP == SPL_SUMS_COLOR) {
        uvec3 c = load_color(chunk, s.index);
        return c.x | c.y << 8 | c.z << 16;
    }
    if (GROUP == SPL_SUMS_NORMAL)
        return pack_normal(s.normal);
    return chunk.first_id + s.index;
}

/* The nearest of the spacings that have a code, for a splat of this radius. */
uint spacing_code(float radius)
{
    precise float ratio = radius / frame.fill_radius;
    int code = (int(floatBitsToUint(ratio)) - 0x3f800000 + (1 << 21)) >> 22;
    return uint(clamp(code, 0, (1 << SPL_FILL_SPACING_BITS) - 1));
}

void draw(spl_draw_chunk chunk, splat s)
{
    vec3 p = s.position;
    if (!(p.z >= frame.near && p.z <= frame.far))
        return;
    precise vec2 center = vec2(frame.fx * (p.x / p.z) + frame.cx, frame.fy * (p.y / p.z) + frame.cy);
    if (!(center.x >= 0.0 && center.y >= 0.0 && center.x < float(frame.width) && center.y < float(frame.height)))
        return;
    uint at = sample_index(ivec2(center)), bits = floatBitsToUint(p.z);
    if (FILL != 0u)
        bits = (bits & ~SPL_FILL_DEPTH_BITS) | spacing_code(min(load_radius(chunk, s.index), SPL_FILL_STRAY * chunk.radius_min)) << 1 |
               (is_linear(chunk, s.index) ? SPL_FILL_LINEAR : 0u);
#ifdef SPL_ATOMICS_64
    if (bits <= imageLoad(depth_texels, int(2u * at + 1u)).x)
        atomicMin(depth[at], uint64_t(bits) << 32 | uint64_t(payload(chunk, s)));
#else
    if (PASS == 0) {
        if (bits < imageLoad(depth_texels, int(at)).x)
            atomicMin(depth[at], bits);
    } else if (bits == imageLoad(depth_texels, int(at)).x) {
        atomicMin(payloads[at], payload(chunk, s));
    }
#endif
}

void main()
{
    load_frame();
    splat_run run = load_splat_run();
    uint i = run.first;
    for (;;) {
        if (i < run.end)
            draw(run.chunk, load_splat(run.chunk, i, GROUP != SPL_SUMS_NORMAL));
        i += SPL_LANES;
        if (i >= run.end)
            break;
    }
}
