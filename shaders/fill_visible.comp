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

/* Steepness of the narrowest blocked cone of each sector: cotangent of its half angle; 0 = none. */
vec4 steep_low = vec4(0.0), steep_high = vec4(0.0);

/* How steeply `word`, of a level whose low bits `mask` covers, stands before depth z, `squared` samples^2 away. */
float steepness(uint word, uint mask, float z, float squared)
{
    float w = inverse_depth(word, mask), angle = w * spacing_of(word & SPACING_MASK) * frame.fill_radius;
    float reach = ADAPTIVE != 0u ? min(angle * frame.fill_reach, frame.fill_kernel) : frame.fill_kernel;
    float gap = z * w - 1.0 - frame.fill_margin * angle;
    return word != 0u && squared <= reach * reach ? gap * frame.fx / sqrt(squared) : 0.0;
}

/* Adds a sample (x, y) away to its sector; sectors are half open, the first begins at +x. */
void add(float x, float y, float steep)
{
    bool below = y < 0.0 || (y == 0.0 && x < 0.0);
    vec2 d = below ? -vec2(x, y) : vec2(x, y);
    bool left = d.x <= 0.0;
    d = left ? vec2(d.y, -d.x) : d;
    float sector = (left ? 2.0 : 0.0) + (d.y >= d.x ? 1.0 : 0.0);
    vec4 value = mix(vec4(0.0), vec4(steep), equal(vec4(sector), vec4(0.0, 1.0, 2.0, 3.0)));
    steep_low = max(steep_low, below ? vec4(0.0) : value);
    steep_high = max(steep_high, below ? value : vec4(0.0));
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

void look_adaptively(ivec2 at, float z)
{
    float reach = coarse_reach(at);
    uint offset = 0u;
    for (uint level = 0u;;) {
        uvec2 size = level_size(level);
        uint mask = (1u << (SPL_FILL_SPACING_BITS + 2u * level)) - 1u, low = (1u << level) - 1u;
        ivec2 cell = at >> int(level);
        ivec2 step = ivec2(-1);
        for (int i = 0;;) {
            ivec2 c = cell + step, inside = clamp(c, ivec2(0), ivec2(size) - 1);
            uint word = plane_word(offset + uint(inside.y) * size.x + uint(inside.x));
            uint x = (word >> SPL_FILL_SPACING_BITS) & low, y = (word >> (SPL_FILL_SPACING_BITS + level)) & low;
            vec2 d = vec2((c << int(level)) + ivec2(x, y) - at);
            float steep = steepness(word, mask, z, max(dot(d, d), 1.0));
            add(d.x, d.y, c == inside && i != 4 ? steep : 0.0);
            step = step.x == 1 ? ivec2(-1, step.y + 1) : ivec2(step.x + 1, step.y);
            if (++i >= 9)
                break;
        }
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
            bool inside = c.x >= 0 && c.y >= 0 && c.x < int(frame.width) && c.y < int(frame.height);
            c = clamp(c, ivec2(0), ivec2(frame.width, frame.height) - 1);
            uint word = plane_word(sample_index(c));
            vec2 d = vec2(x, y);
            float steep = steepness(word, SPACING_MASK, z, max(dot(d, d), 1.0));
            add(d.x, d.y, inside && (x != 0 || y != 0) ? steep : 0.0);
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
    bool visible = openness(steep_low) + openness(steep_high) >= frame.fill_threshold;
    planes[frame.fill_from + i] = visible || (own != 0u && frame.fill_keep != 0u) ? own : SPL_FILL_HOLE;
}
