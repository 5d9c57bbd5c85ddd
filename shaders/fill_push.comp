/* Push: an empty cell becomes the bilinear mean of the four closest cells of the level above, of those that belong to
 * the nearest one's surface, or to that behind it where more of them do: an edge lies half way between the points on
 * both sides of it. The last run (constant 1) fills the holes among the samples, and cracks, and writes depth and
 * payload as method points leaves them: visible samples as they are; a hole that nothing reaches keeps its sample; a
 * linear sample stays where it is nearer than what fills its place. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/fill.glsl"

layout(local_size_x = SPL_WORKGROUP) in;
layout(constant_id = 0) const uint GROUP = SPL_SUMS_COLOR;
layout(constant_id = 1) const uint LAST = 0;
layout(constant_id = 2) const uint WIDE = 0;

#include "common/payload.glsl"

layout(std430, binding = SPL_STORAGE_PLANES) writeonly buffer plane_buffer { uint planes[]; };
layout(std430, binding = SPL_STORAGE_DEPTH) writeonly buffer depth_buffer { uint depth[]; };
layout(std430, binding = SPL_STORAGE_IDS) writeonly buffer id_buffer { uint payloads[]; };

/* Of cell i, the cell above being the first; three against it outvote that one, so that edges are not its steps. */
float vote_of(int i)
{
    return i == 0 ? 5.0 : i == 3 ? 1.0 : 3.0;
}

/* The mean over the level above, whose planes begin at frame.fill_from; word 0 = there is none. */
uint interpolate(ivec2 at, out uint filled)
{
    uint level = frame.fill_level;
    uvec2 size = level_size(level + 1u);
    ivec2 cell = at >> 1, other = clamp(cell + 2 * (at & 1) - 1, ivec2(0), ivec2(size) - 1);
    uint word[4], payload[4], nearest = 0u, nearest_payload = 0u;
    for (int i = 0; i < 4; i++) {
        ivec2 c = ivec2((i & 1) != 0 ? other.x : cell.x, (i & 2) != 0 ? other.y : cell.y);
        uint from = frame.fill_from + uint(c.y) * size.x + uint(c.x);
        word[i] = plane_word(from);
        payload[i] = plane_word(from + frame.fill_stride);
        bool nearer = word[i] > nearest;
        nearest = nearer ? word[i] : nearest;
        nearest_payload = nearer ? payload[i] : nearest_payload;
    }
    float least = inverse_depth(nearest, SPACING_MASK) / (1.0 + surface_tolerance(nearest, float(2u << level)));
    float most = 1e38, front = 0.0, behind = 0.0;
    uint second = 0u, second_payload = 0u;
    for (int i = 0; i < 4; i++) {
        bool near = inverse_depth(word[i], SPACING_MASK) >= least, next = !near && word[i] > second;
        front += near ? vote_of(i) : 0.0;
        behind += !near && word[i] != 0u ? vote_of(i) : 0.0;
        second = next ? word[i] : second;
        second_payload = next ? payload[i] : second_payload;
    }
    if (behind > front) {
        most = least;
        nearest = second;
        nearest_payload = second_payload;
        least = inverse_depth(nearest, SPACING_MASK) / (1.0 + surface_tolerance(nearest, float(2u << level)));
    }
    precise float sum = 0.0;
    float weight = 0.0;
    vec3 vector = vec3(0.0);
    for (int i = 0; i < 4; i++) {
        float w = inverse_depth(word[i], SPACING_MASK), share = i == 0 ? 9.0 : i == 3 ? 1.0 : 3.0;
        share = word[i] != 0u && w >= least && w < most ? share : 0.0;
        sum += share * w;
        weight += share;
        vector += share * payload_vector(payload[i]);
    }
    filled = payload_of(vector, max(weight, 1.0), nearest_payload);
    precise float average = sum / weight;
    return weight > 0.0 ? (floatBitsToUint(average) & ~SPACING_MASK) | (nearest & SPACING_MASK) : 0u;
}

/* How far from `at` the first sample with something to see is, of the nearest `most`; else 0. */
int look_along(ivec2 at, ivec2 way, int most)
{
    for (int n = 1; n <= most; n++) {
        ivec2 c = at + n * way;
        bool inside = uint(c.x) < frame.width && uint(c.y) < frame.height;
        uint state = inside ? plane_word(frame.fill_to + sample_index(c)) : 0u;
        if (state != 0u && state != SPL_FILL_MAYBE)
            return n;
    }
    return 0;
}

/* Is a sample with nothing to see part of a crack: does it lie between things that are no farther apart than three
 * quarters of what the points of `surface` are, or two samples, on at least three of the four lines through it? By
 * chance the reach of none around has closed it. */
bool is_crack(ivec2 at, uint surface)
{
    const ivec2 lines[4] = ivec2[4](ivec2(1, 0), ivec2(0, 1), ivec2(1, 1), ivec2(1, -1));
    precise float reach = (PARALLEL != 0u ? 1.0 : inverse_depth(surface, SPACING_MASK)) *
                          spacing_of(surface & SPACING_MASK) * (frame.fill_radius * frame.fill_reach);
    int most = clamp(int(SPL_FILL_CRACK_REACH * min(reach, frame.fill_kernel)), 2, SPL_FILL_CRACK), open = 0;
    for (int i = 0; i < 4 && open < 2; i++) {
        int ahead = look_along(at, lines[i], most), behind = ahead > 0 ? most + 1 - ahead : 0;
        open += look_along(at, -lines[i], behind) > 0 ? 0 : 1;
    }
    return open < 2;
}

void main()
{
    load_frame();
    uint i = gl_GlobalInvocationID.x, level = frame.fill_level;
    uvec2 size = level_size(level);
    if (i >= size.x * size.y)
        return;
    uint own = plane_word(frame.fill_to + i), filled;
    uint word = interpolate(place_of(i, size.x), filled);
    if (LAST == 0u) {
        uint kept = plane_word(frame.fill_to + frame.fill_stride + i);
        planes[frame.fill_to + i] = own != 0u ? own : word;
        planes[frame.fill_to + frame.fill_stride + i] = own != 0u ? kept : filled;
        return;
    }
    uint bits = depth_word(i, WIDE), kept = payload_word(i, WIDE);
    uint clean = bits == SPL_NOTHING ? SPL_NOTHING : (bits & ~SPL_FILL_DEPTH_BITS) | (SPL_FILL_DEPTH_BITS + 1u) / 2u;
    uint surface = word != 0u ? floatBitsToUint(1.0 / inverse_depth(word, SPACING_MASK)) : SPL_NOTHING;
    bool linear = bits != SPL_NOTHING && (bits & SPL_FILL_LINEAR) != 0u;
    bool hole = own == SPL_FILL_HOLE || (own == SPL_FILL_MAYBE && word != 0u && is_crack(place_of(i, size.x), word));
    bool fills = hole && word != 0u && !(linear && clean <= surface);
    uint result = fills ? surface : clean, payload = fills ? filled : kept;
    if (WIDE != 0u) {
        depth[2u * i] = payload;
        depth[2u * i + 1u] = result;
    } else {
        depth[i] = result;
        payloads[i] = payload;
    }
}
