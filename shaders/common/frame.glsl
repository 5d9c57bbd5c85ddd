/* Bindings and parameters that every kernel of the frame sees. */
#ifndef SPL_FRAME_GLSL
#define SPL_FRAME_GLSL

#include "shared.h"

layout(std430, binding = SPL_STORAGE_FRAME) readonly buffer frame_buffer { spl_frame_params frame_in_memory; };

/* A copy in registers: software drivers load once for all lanes only where no lane can be off, else lane by lane. So
 * every main() begins with load_frame(), and nothing reads the parameters from memory in a loop or behind a branch. */
spl_frame_params frame;

void load_frame()
{
    frame = frame_in_memory;
}

/* Words of a buffer as texels, under a number SPL_TEXELS_…; these and the SPL_STORAGE_… come from the kernel's row in
 * shaders/meson.build. */
#define SPL_TEXEL_BUFFER(number) layout(binding = number, r32ui) uniform readonly uimageBuffer

/* The buffers' dimension in samples is frame.width x frame.height. */
uint sample_index(ivec2 at)
{
    return uint(at.y) * frame.width + uint(at.x);
}

#endif
