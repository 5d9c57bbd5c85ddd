/* What stations add colours to: those of the splats themselves, of a weight that counts where no station sees a sample,
 * and there alone. A power of two, so that they come out of it as they went in. Of method splat they are in the sums;
 * of method nearest (constant 0) they are smoothed payloads, which say how far they were bent, not what they weigh. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/samples.glsl"

layout(local_size_x = SPL_WORKGROUP) in;
layout(constant_id = 0) const uint BENT = 0;
layout(std430, binding = SPL_STORAGE_SUMS) writeonly buffer sums_buffer { float sums[]; };

void main()
{
    load_frame();
    uint at = gl_GlobalInvocationID.x;
    if (at >= frame.entries || depth_word(at) == SPL_NOTHING)
        return;
    vec3 color;
    if (BENT != 0u) {
        precise float row = floor((float(at) + 0.5) / float(frame.width)); /* exact below 2^23 samples */
        color = smooth_color(ivec2(int(at) - int(row) * int(frame.width), int(row)), at, false);
    } else {
        uvec4 sum = load_sums(at);
        color = vec3(sum.xyz) / float(sum.w);
    }
    sums[4u * at] = color.x * SPL_MAP_BASE;
    sums[4u * at + 1u] = color.y * SPL_MAP_BASE;
    sums[4u * at + 2u] = color.z * SPL_MAP_BASE;
    sums[4u * at + 3u] = SPL_MAP_BASE;
}
