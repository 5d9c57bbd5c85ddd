/* Parameters of a dispatch of soft transparency, as common/frame.glsl has those of a frame. */
#ifndef SPL_SOFT_STEP_GLSL
#define SPL_SOFT_STEP_GLSL

#include "shared_soft.h"

layout(std430, binding = SPL_STORAGE_STEP) readonly buffer step_buffer { spl_soft_step step_in_memory; };

spl_soft_step job;

void load_step()
{
    job = step_in_memory;
}

/* Invocations of a workgroup that each walk a block: few, or with SPL_MANY as GPUs want them. */
#ifdef SPL_MANY
#define SPL_BLOCK_GROUP SPL_WORKGROUP
#else
#define SPL_BLOCK_GROUP SPL_LANES
#endif

#ifndef SPL_TEXEL_BUFFER
#define SPL_TEXEL_BUFFER(number) layout(binding = number, r32ui) uniform readonly uimageBuffer
#endif

#endif
