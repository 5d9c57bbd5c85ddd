/* One sample of a splat as methods points and fill draw it: the nearest wins, the least payload among equals. With 64
 * bit atomics one pass keeps depth << 32 | payload; without, pass 0 finds the depth and pass 1 the payload. */
#ifndef SPL_POINT_GLSL
#define SPL_POINT_GLSL

#ifdef SPL_ATOMICS_64
#extension GL_EXT_shader_atomic_int64 : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#endif
#include "common/frame.glsl"

layout(constant_id = 0) const uint GROUP = SPL_SUMS_COLOR;
layout(constant_id = 1) const uint PASS = 0;

#include "common/drawn.glsl"

#ifdef SPL_ATOMICS_64
layout(std430, binding = SPL_STORAGE_DEPTH) coherent buffer depth_buffer { uint64_t depth[]; };
#else
layout(std430, binding = SPL_STORAGE_DEPTH) coherent buffer depth_buffer { uint depth[]; };
layout(std430, binding = SPL_STORAGE_IDS) buffer id_buffer { uint payloads[]; };
#endif

coherent SPL_TEXEL_BUFFER(SPL_TEXELS_DEPTH) depth_texels; /* what is read may be old, never too near */

/* The depth word of method fill: its low bits hold the spacing, as the nearest one that has a code for a splat of this
 * radius, and whether the splat is linear. */
uint fill_word(uint bits, float radius, bool linear)
{
    precise float ratio = radius / frame.fill_radius;
    int code = (int(floatBitsToUint(ratio)) - 0x3f800000 + (1 << 21)) >> 22;
    code = clamp(code, 0, (1 << SPL_FILL_SPACING_BITS) - 1);
    return (bits & ~SPL_FILL_DEPTH_BITS) | uint(code) << 1 | (linear ? SPL_FILL_LINEAR : 0u);
}

/* Whether a sample of depth word `bits` may win; asked first, since what it would leave costs more. */
bool wins(uint at, uint bits)
{
#ifdef SPL_ATOMICS_64
    return bits <= imageLoad(depth_texels, int(2u * at + 1u)).x;
#else
    uint own = imageLoad(depth_texels, int(at)).x;
    return PASS == 0 ? bits < own : bits == own;
#endif
}

void put(uint at, uint bits, uint payload)
{
#ifdef SPL_ATOMICS_64
    atomicMin(depth[at], uint64_t(bits) << 32 | uint64_t(payload));
#else
    if (PASS == 0)
        atomicMin(depth[at], bits);
    else
        atomicMin(payloads[at], payload);
#endif
}

#endif
