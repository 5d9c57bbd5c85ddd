/* Second pull, of what is visible: a cell holds the mean of those of its 2 x 2 children that belong to the nearest
 * one's surface, inverse depth (linear along a plane's image) and payload (constant 0: its group). The first run
 * (constant 1) takes samples and their states. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/fill.glsl"

layout(local_size_x = SPL_WORKGROUP) in;
layout(constant_id = 0) const uint GROUP = SPL_SUMS_COLOR;
layout(constant_id = 1) const uint FIRST = 0;
layout(constant_id = 2) const uint WIDE = 0;

#include "common/payload.glsl"

layout(std430, binding = SPL_STORAGE_PLANES) writeonly buffer plane_buffer { uint planes[]; };

void main()
{
    load_frame();
    uint level = frame.fill_level;
    uvec2 size = level_size(level), below = level_size(level - 1u);
    if (gl_GlobalInvocationID.x >= size.x * size.y)
        return;
    ivec2 cell = place_of(gl_GlobalInvocationID.x, size.x);
    uint word[4], payload[4], nearest = 0u, nearest_payload = 0u;
    for (int i = 0; i < 4; i++) {
        ivec2 at = 2 * cell + ivec2(i & 1, i >> 1);
        bool inside = at.x < int(below.x) && at.y < int(below.y);
        uint from = uint(min(at.y, int(below.y) - 1)) * below.x + uint(min(at.x, int(below.x) - 1));
        uint w = plane_word(frame.fill_from + from);
        word[i] = inside && w < SPL_FILL_HOLE ? w : 0u;
        payload[i] = FIRST != 0u ? payload_word(from, WIDE) : plane_word(frame.fill_from + frame.fill_stride + from);
        bool nearer = word[i] > nearest;
        nearest = nearer ? word[i] : nearest;
        nearest_payload = nearer ? payload[i] : nearest_payload;
    }
    float least = inverse_depth(nearest, SPACING_MASK) / (1.0 + surface_tolerance(nearest, float(1u << level)));
    precise float sum = 0.0;
    float weight = 0.0;
    vec3 vector = vec3(0.0);
    for (int i = 0; i < 4; i++) {
        float w = inverse_depth(word[i], SPACING_MASK), share = word[i] != 0u && w >= least ? 1.0 : 0.0;
        sum += share * w;
        weight += share;
        vector += share * payload_vector(payload[i]);
    }
    precise float average = sum / max(weight, 1.0);
    uint mean = (floatBitsToUint(average) & ~SPACING_MASK) | (nearest & SPACING_MASK);
    planes[frame.fill_to + gl_GlobalInvocationID.x] = weight > 0.0 ? mean : 0u;
    planes[frame.fill_to + frame.fill_stride + gl_GlobalInvocationID.x] =
        payload_of(vector, max(weight, 1.0), nearest_payload);
}
