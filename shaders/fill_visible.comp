/* Visibility, the operator of Pintus et al. 2011 ("Real-time Rendering of Massive Unstructured Raw Point Clouds using
 * Screen-space Operators"): eight sectors around a sample, in each the widest cone towards the eye that no nearer sample
 * enters; a sample is visible where the cones' solid angles add up to the threshold. A sample that holds nothing lies
 * infinitely far away. What is not visible is a hole, to be filled.
 *
 * Constant 0 = 1, adaptive: a sample stands in the way of others as far as frame.fill_reach times its spacing on the image,
 * which is proportional to its inverse depth, and frame.fill_kernel at most. Of the rings around a sample, each twice as
 * wide as the one before, the nearest sample of eight cells of their level is looked at: the time goes with the kernel's
 * logarithm. Rings beyond the reach of the coarse level's nearest sample are left out.
 * Constant 0 = 0, constant: every sample within frame.fill_kernel, as the earlier work has it.
 *
 * The state of a sample: its word of level 0 where it is visible, SPL_FILL_HOLE, or 0 = nothing to see. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/fill.glsl"

layout(local_size_x = SPL_WORKGROUP) in;
layout(constant_id = 0) const uint ADAPTIVE = 1;

layout(std430, binding = SPL_BIND_SUMS) writeonly buffer plane_buffer { uint planes[]; };

/* Steepness of the narrowest blocked cone of each sector: cotangent of its half angle; 0 = none. Sectors are half open, the
 * first begins at +x. */
float s0 = 0.0, s1 = 0.0, s2 = 0.0, s3 = 0.0, s4 = 0.0, s5 = 0.0, s6 = 0.0, s7 = 0.0;

/* How steeply `word`, of a level whose low bits `mask` covers, stands before depth z, `squared` samples^2 away. */
float steepness(uint word, uint mask, float z, float squared, bool inside)
{
    float w = inverse_depth(word, mask), angle = w * spacing_of(word & SPACING_MASK) * frame.fill_radius;
    float reach = ADAPTIVE != 0u ? min(angle * frame.fill_reach, frame.fill_kernel) : word != 0u ? frame.fill_kernel : 0.0;
    precise float steep = (z * w - 1.0 - frame.fill_margin * angle) * frame.fx / sqrt(squared);
    return inside && squared <= reach * reach ? steep : 0.0;
}

/* The largest reach of what lies around: of the nearest sample of the four closest cells of the coarse level. */
float coarse_reach(ivec2 at)
{
    uint level = frame.fill_levels;
    uvec2 size = level_size(level);
    uint mask = (1u << (SPL_FILL_SPACING_BITS + 2u * level)) - 1u;
    ivec2 cell = at >> int(level), other = cell + 2 * ((at >> int(level - 1u)) & 1) - 1, last = ivec2(size) - 1;
    other = clamp(other, ivec2(0), last);
    float angle = 0.0;
    for (int i = 0;;) {
        ivec2 c = ivec2((i & 1) != 0 ? other.x : cell.x, (i & 2) != 0 ? other.y : cell.y);
        uint word = plane_word(frame.fill_to + uint(c.y) * size.x + uint(c.x));
        angle = max(angle, inverse_depth(word, mask) * spacing_of(word & SPACING_MASK));
        if (++i >= 4)
            break;
    }
    return min(angle * frame.fill_radius * frame.fill_reach, frame.fill_kernel);
}

/* One sample of level 0, which lies in sector S whatever it is. */
#define NEXT(X, Y, S)                                                                                                 \
    {                                                                                                                 \
        ivec2 c = at + ivec2(X, Y);                                                                                    \
        bool inside = uint(c.x) < frame.width && uint(c.y) < frame.height;                                             \
        S = steepness(plane_word(sample_index(c)), SPACING_MASK, z, float((X) * (X) + (Y) * (Y)), inside);             \
    }

/* The nearest sample of a cell, (u, v) away after a turn by quarters that brings the cell to +x, or to +x and +y. */
#define CELL(X, Y, U, V)                                                                                              \
    ivec2 c = cell + ivec2(X, Y);                                                                                      \
    uint word = plane_word(offset + uint(c.y) * size.x + uint(c.x));                                                   \
    vec2 d = vec2((c << int(level)) - at + ivec2(bitfieldExtract(word, SPL_FILL_SPACING_BITS, int(level)),             \
                                                 bitfieldExtract(word, SPL_FILL_SPACING_BITS + int(level), int(level)))); \
    float u = U, v = V, steep = steepness(word, mask, z, dot(d, d), uint(c.x) < size.x && uint(c.y) < size.y);
#define SIDE(X, Y, U, V, A, B, C, D) /* sectors from a quarter before +x to a quarter behind it */                    \
    {                                                                                                                 \
        CELL(X, Y, U, V)                                                                                               \
        A = max(A, v < -u ? steep : 0.0);                                                                              \
        B = max(B, v < 0.0 && v >= -u ? steep : 0.0);                                                                  \
        C = max(C, v >= 0.0 && v < u ? steep : 0.0);                                                                   \
        D = max(D, v >= u ? steep : 0.0);                                                                              \
    }
#define CORNER(X, Y, U, V, A, B)                                                                                      \
    {                                                                                                                 \
        CELL(X, Y, U, V)                                                                                               \
        A = max(A, v < u ? steep : 0.0);                                                                               \
        B = max(B, v >= u ? steep : 0.0);                                                                              \
    }

void look_adaptively(ivec2 at, float z)
{
    float reach = coarse_reach(at);
    uint offset = frame.width * frame.height;
    NEXT(1, 0, s0)
    NEXT(1, 1, s1)
    NEXT(0, 1, s2)
    NEXT(-1, 1, s3)
    NEXT(-1, 0, s4)
    NEXT(-1, -1, s5)
    NEXT(0, -1, s6)
    NEXT(1, -1, s7)
    for (uint level = 1u;;) { /* one round too many does no harm: it is the coarse level */
        uvec2 size = level_size(level);
        uint mask = (1u << (SPL_FILL_SPACING_BITS + 2u * level)) - 1u;
        ivec2 cell = at >> int(level);
        SIDE(1, 0, d.x, d.y, s6, s7, s0, s1)
        SIDE(0, 1, d.y, -d.x, s0, s1, s2, s3)
        SIDE(-1, 0, -d.x, -d.y, s2, s3, s4, s5)
        SIDE(0, -1, -d.y, d.x, s4, s5, s6, s7)
        CORNER(1, 1, d.x, d.y, s0, s1)
        CORNER(-1, 1, d.y, -d.x, s2, s3)
        CORNER(-1, -1, -d.x, -d.y, s4, s5)
        CORNER(1, -1, -d.y, d.x, s6, s7)
        offset += size.x * size.y;
        level++;
        if (level >= frame.fill_levels || float(1u << level) > reach)
            break;
    }
}

void look_everywhere(ivec2 at, float z)
{
    int reach = int(frame.fill_kernel);
    for (int y = -reach;;) {
        for (int x = -reach;;) {
            ivec2 c = at + ivec2(x, y);
            bool inside = uint(c.x) < frame.width && uint(c.y) < frame.height && (x != 0 || y != 0);
            float steep = steepness(plane_word(sample_index(c)), SPACING_MASK, z, max(float(x * x + y * y), 1.0), inside);
            if (y >= 0 && x > 0) {
                s0 = max(s0, y < x ? steep : 0.0);
                s1 = max(s1, y >= x ? steep : 0.0);
            } else if (x <= 0 && y > 0) {
                s2 = max(s2, -x < y ? steep : 0.0);
                s3 = max(s3, -x >= y ? steep : 0.0);
            } else if (y <= 0 && x < 0) {
                s4 = max(s4, -y < -x ? steep : 0.0);
                s5 = max(s5, -y >= -x ? steep : 0.0);
            } else {
                s6 = max(s6, x < -y ? steep : 0.0);
                s7 = max(s7, x >= -y ? steep : 0.0);
            }
            if (++x > reach)
                break;
        }
        if (++y > reach)
            break;
    }
}

/* The solid angles that are open, 1 = half the sphere in each of the sectors. */
float openness(vec4 steep)
{
    vec4 s = min(steep, vec4(1e6));
    return dot(vec4(1.0) - s / sqrt(s * s + 1.0), vec4(1.0));
}

void main()
{
    load_frame();
    uint i = gl_GlobalInvocationID.x;
    if (i >= frame.width * frame.height)
        return;
    ivec2 at = place_of(i, frame.width);
    uint own = plane_word(i);
    float z = own != 0u ? 1.0 / inverse_depth(own, SPACING_MASK) : 1e30;
    if (ADAPTIVE != 0u)
        look_adaptively(at, z);
    else
        look_everywhere(at, z);
    bool visible = openness(vec4(s0, s1, s2, s3)) + openness(vec4(s4, s5, s6, s7)) >= frame.fill_threshold;
    planes[frame.fill_from + i] = visible || (own != 0u && frame.fill_keep != 0u) ? own : SPL_FILL_HOLE;
}
