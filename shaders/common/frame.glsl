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

/* Splats are laid on the samples of the image, whose first is the first that is drawn of it: floats that were rounded
 * from a tile's own corner would put some on another sample than in the tile beside it. */
ivec2 tile_corner()
{
    return ivec2(int(frame.tile_x), int(frame.tile_y));
}

ivec2 tile_end()
{
    return tile_corner() + ivec2(int(frame.width), int(frame.height));
}

/* Of sample `at` of the image. */
uint image_sample_index(ivec2 at)
{
    return sample_index(at - tile_corner());
}

#endif
