/* Where a sample's surface lies, for maps: the view depth that its sums of depths blend to; SPL_NOTHING where there is
 * none. */
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/samples.glsl"

layout(local_size_x = SPL_WORKGROUP) in;
layout(std430, binding = SPL_STORAGE_SURFACE) writeonly buffer surface_buffer { uint surface[]; };

void main()
{
    load_frame();
    uint at = gl_GlobalInvocationID.x;
    if (at >= frame.entries)
        return;
    uint bits = depth_word(at);
    surface[at] = bits != SPL_NOTHING ? floatBitsToUint(summed_depth(at, uintBitsToFloat(bits))) : SPL_NOTHING;
}
