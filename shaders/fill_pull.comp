/* Pull: every cell of a level keeps the nearest sample of 2 x 2 cells of the level below, so of 4 x 4 two levels below.
 * The first run (constant 0) makes levels 0 and 1 from the depth of method points; linear samples stay out. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/fill.glsl"

layout(local_size_x = SPL_WORKGROUP) in;
layout(constant_id = 0) const uint FIRST = 0;
layout(constant_id = 1) const uint WIDE = 0;

layout(std430, binding = SPL_STORAGE_PLANES) writeonly buffer plane_buffer { uint planes[]; };

/* The word of level 0. */
uint first_word(uint depth)
{
    float w = 1.0 / uintBitsToFloat(depth & ~SPL_FILL_DEPTH_BITS);
    uint word = (floatBitsToUint(w) & ~SPACING_MASK) | ((depth >> 1) & SPACING_MASK);
    return depth == SPL_NOTHING || (depth & SPL_FILL_LINEAR) != 0u ? 0u : word;
}

void main()
{
    load_frame();
    uint level = frame.fill_level; /* that is made */
    uvec2 size = level_size(level), below = level_size(level - 1u);
    if (gl_GlobalInvocationID.x >= size.x * size.y)
        return;
    ivec2 cell = place_of(gl_GlobalInvocationID.x, size.x);
    uint side_bits = level - 1u, low = (1u << side_bits) - 1u;
    uint keep = ~((1u << (SPL_FILL_SPACING_BITS + 2u * level)) - 1u), best = 0u;
    for (uint i = 0u;;) {
        ivec2 at = 2 * cell + ivec2(i & 1u, i >> 1);
        bool inside = at.x < int(below.x) && at.y < int(below.y);
        uint from = uint(min(at.y, int(below.y) - 1)) * below.x + uint(min(at.x, int(below.x) - 1));
        uint word = FIRST != 0u ? first_word(depth_word(from, WIDE)) : plane_word(frame.fill_from + from);
        uint x = ((word >> SPL_FILL_SPACING_BITS) & low) | (i & 1u) << side_bits;
        uint y = ((word >> (SPL_FILL_SPACING_BITS + side_bits)) & low) | (i >> 1) << side_bits;
        uint coded =
            (word & keep) | (word & SPACING_MASK) | x << SPL_FILL_SPACING_BITS | y << (SPL_FILL_SPACING_BITS + level);
        best = max(best, inside && word != 0u ? coded : 0u);
        if (FIRST != 0u && inside)
            planes[frame.fill_from + from] = word;
        if (++i >= 4u)
            break;
    }
    planes[frame.fill_to + gl_GlobalInvocationID.x] = best;
}
