/* Visibility, the operator of Pintus et al. 2011 ("Real-time Rendering of Massive Unstructured Raw Point Clouds using
 * Screen-space Operators"): eight sectors around a sample, in each the widest cone towards the eye that no nearer
 * sample enters; a sample is visible where the cones' solid angles add up to the threshold. A sample that holds
 * nothing lies infinitely far away. What is not visible is a hole, to be filled. Along parallel rays distances on the
 * image are the same at all depths.
 *
 * Constant 0 = 1, adaptive: a sample stands in the way of others as far as frame.fill_reach times its spacing on the
 * image, which is proportional to its inverse depth, and frame.fill_kernel at most. Of the rings around a sample, each
 * half as wide as the one before, the nearest sample of eight cells of their level is looked at: the time goes with
 * the kernel's logarithm. The first is the widest within reach of the coarse level's nearest sample; the last is where
 * enough sectors are blocked, or where nothing in the ring or within it is nearer. Most samples need two.
 * Constant 0 = 0, constant: every sample within frame.fill_kernel, as the earlier work has it.
 *
 * The state of a sample: its word of level 0 where it is visible, SPL_FILL_HOLE, SPL_FILL_MAYBE, or 0 = nothing to
 * see. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/fill.glsl"

layout(local_size_x = SPL_WORKGROUP) in;
layout(constant_id = 0) const uint ADAPTIVE = 1;

layout(std430, binding = SPL_STORAGE_PLANES) writeonly buffer plane_buffer { uint planes[]; };

/* What lies before a sample at depth z: of each sector the narrowest blocked cone, the square of its half angle's
 * cotangent in focal lengths, as a float's bits, whose maximum takes fewer instructions; 0 = none. Sectors are half
 * open, the first begins at +x. */
float z;
int cones[8] = int[8](0, 0, 0, 0, 0, 0, 0, 0);
bool blocked; /* something was looked at that is nearer, how far off whatever */

/* The cone of `word`, of a level whose low bits `mask` covers, `squared` samples^2 away. */
int cone_of(uint word, uint mask, float squared, bool inside)
{
    float w = inverse_depth(word, mask), spacing = spacing_of(word & SPACING_MASK);
    float reach = (PARALLEL != 0u ? 1.0 : w) * spacing * (frame.fill_radius * frame.fill_reach);
    float least = z - spacing * (frame.fill_margin * frame.fill_radius);
    precise float nearer = PARALLEL != 0u ? least - 1.0 / w : w * least - 1.0;
    precise float cone = nearer * nearer / squared;
    bool blocks = inside && nearer > 0.0;
    blocked = blocked || blocks;
    bool near = squared <= frame.fill_kernel * frame.fill_kernel && (ADAPTIVE == 0u || squared <= reach * reach);
    return blocks && near ? floatBitsToInt(cone) : 0;
}

/* Puts a cone d away into its sector, of the four around +x turned by so many quarters; `corner`: of the latter two. */
void put(int turn, bool corner, ivec2 d, int cone)
{
    int u = turn == 0 ? d.x : turn == 1 ? d.y : turn == 2 ? -d.x : -d.y;
    int v = turn == 0 ? d.y : turn == 1 ? -d.x : turn == 2 ? -d.y : d.x;
    int first = 2 * turn;
    if (!corner) {
        int before = v < 0 ? cone : 0;
        cones[(first + 6) % 8] = max(cones[(first + 6) % 8], v < -u ? before : 0);
        cones[(first + 7) % 8] = max(cones[(first + 7) % 8], v < -u ? 0 : before);
        cone = v < 0 ? 0 : cone;
    }
    cones[first] = max(cones[first], v < u ? cone : 0);
    cones[first + 1] = max(cones[first + 1], v < u ? 0 : cone);
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
        float w = inverse_depth(word, mask);
        angle = max(angle, (PARALLEL != 0u ? (w > 0.0 ? 1.0 : 0.0) : w) * spacing_of(word & SPACING_MASK));
        if (++i >= 4)
            break;
    }
    return min(angle * frame.fill_radius * frame.fill_reach, frame.fill_kernel);
}

/* Whether so many sectors are as good as blocked that the others cannot make the sample visible. */
bool is_hidden()
{
    const float most = 1.0 / 512.0; /* that such a sector may be open: 1 - sqrt(q / (q + 1)) < 1 / 2 q */
    int least = floatBitsToInt(0.5 / most * frame.inverse_fx * frame.inverse_fx);
    float open = 8.0;
    for (int i = 0; i < 8; i++)
        open -= cones[i] >= least ? 1.0 - most : 0.0;
    return open < frame.fill_threshold;
}

void look_adaptively(ivec2 at)
{
    const ivec2 ring[8] = ivec2[8](ivec2(1, 0), ivec2(1, 1), ivec2(0, 1), ivec2(-1, 1), ivec2(-1, 0), ivec2(-1, -1),
                                   ivec2(0, -1), ivec2(1, -1));
    float reach = coarse_reach(at);
    uint level = 1u, offset = frame.width * frame.height;
    for (uint next = 2u;;) {
        uvec2 size = level_size(level);
        bool wider = next < frame.fill_levels && float(1u << next) <= reach;
        offset += wider ? size.x * size.y : 0u;
        level = wider ? next : level;
        if (++next >= frame.fill_levels)
            break;
    }
    for (;;) {
        uvec2 size = level_size(level);
        uint mask = (1u << (SPL_FILL_SPACING_BITS + 2u * level)) - 1u, low = (1u << level) - 1u;
        ivec2 cell = at >> int(level);
        blocked = false;
        cone_of(plane_word(offset + uint(cell.y) * size.x + uint(cell.x)), mask, 1.0, true);
        for (int i = 0; i < 8; i++) {
            ivec2 c = cell + ring[i];
            uint word = plane_word(offset + uint(c.y) * size.x + uint(c.x));
            uvec2 place = uvec2(word >> SPL_FILL_SPACING_BITS, word >> (SPL_FILL_SPACING_BITS + level)) & low;
            ivec2 d = (c << int(level)) - at + ivec2(place);
            int cone = cone_of(word, mask, float(d.x * d.x + d.y * d.y), uint(c.x) < size.x && uint(c.y) < size.y);
            put(i / 2, i % 2 != 0, d, cone);
        }
        if (level == 0u || !blocked || is_hidden())
            break;
        level--;
        size = level_size(level);
        offset -= size.x * size.y;
    }
}

void look_everywhere(ivec2 at)
{
    int reach = int(frame.fill_kernel);
    for (ivec2 d = ivec2(-reach);;) {
        ivec2 c = at + d;
        bool inside = uint(c.x) < frame.width && uint(c.y) < frame.height && d != ivec2(0);
        int cone = cone_of(plane_word(sample_index(c)), SPACING_MASK, max(float(d.x * d.x + d.y * d.y), 1.0), inside);
        put(0, true, d, d.x > 0 && d.y >= 0 ? cone : 0);
        put(1, true, d, d.x <= 0 && d.y > 0 ? cone : 0);
        put(2, true, d, d.x < 0 && d.y <= 0 ? cone : 0);
        put(3, true, d, d.x >= 0 && d.y < 0 ? cone : 0);
        d = d.x < reach ? ivec2(d.x + 1, d.y) : ivec2(-reach, d.y + 1);
        if (d.y > reach)
            break;
    }
}

void main()
{
    load_frame();
    uint i = gl_GlobalInvocationID.x;
    if (i >= frame.width * frame.height)
        return;
    ivec2 at = place_of(i, frame.width);
    uint own = plane_word(i);
    z = own != 0u ? 1.0 / inverse_depth(own, SPACING_MASK) : 1e30;
    if (ADAPTIVE != 0u)
        look_adaptively(at);
    else
        look_everywhere(at);
    float open = 8.0; /* the solid angles that are, 1 = half the sphere in each of the sectors */
    for (int k = 0; k < 8; k++) {
        float q = min(intBitsToFloat(cones[k]) * frame.fx * frame.fx, 1e12);
        open -= sqrt(q / (q + 1.0));
    }
    bool visible = open >= frame.fill_threshold;
    uint seen = own != 0u || open >= SPL_FILL_MAYBE_OPEN ? own : SPL_FILL_MAYBE;
    planes[frame.fill_from + i] = visible || (own != 0u && (frame.flags & SPL_FRAME_KEEP) != 0u) ? seen : SPL_FILL_HOLE;
}
