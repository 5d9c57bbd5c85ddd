/* Bindings and parameters that every kernel of the frame sees. */
#ifndef SPL_FRAME_GLSL
#define SPL_FRAME_GLSL

#include "shared.h"

layout(std430, binding = SPL_BIND_FRAME) readonly buffer frame_buffer { spl_frame_params frame; };

/* The buffers' dimension in samples is frame.width x frame.height. */
uint sample_index(ivec2 at)
{
    return uint(at.y) * frame.width + uint(at.x);
}

#endif
