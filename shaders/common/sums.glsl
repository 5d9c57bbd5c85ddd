/* Integer sums over the fragments of a sample, by group of layers (constant 0); splat_shade.comp says which. */
#ifndef SPL_SUMS_GLSL
#define SPL_SUMS_GLSL

#ifdef SPL_ATOMICS_64
#extension GL_EXT_shader_atomic_int64 : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#endif
#include "common/frame.glsl"

#ifdef SPL_TEXTURED
const uint GROUP = SPL_SUMS_COLOR;
#else
layout(constant_id = 0) const uint GROUP = SPL_SUMS_COLOR;
layout(std430, binding = SPL_STORAGE_IDS) buffer id_buffer { uint ids[]; };
#endif
#include "common/drawn.glsl"

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

/* One fragment: view depth z within the margin in front of `first`, the sample's pushed depth, which may be its own. */
void shade(uint at, float first, float z, float distance, bool sets_first, uvec3 value, uint id)
{
#ifndef SPL_TEXTURED
    if (IDENTIFIES) {
        if (sets_first)
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

#endif
