/* Depth words of the samples of a tile. */
#ifndef SPL_DEPTHS_GLSL
#define SPL_DEPTHS_GLSL

#include "common/frame.glsl"

SPL_TEXEL_BUFFER(SPL_TEXELS_DEPTH) depth_texels; /* with 64 bit atomics payload, depth of the nearest */

uint depth_word(uint at)
{
#ifdef SPL_ATOMICS_64
    return imageLoad(depth_texels, int(2u * at + 1u)).x;
#else
    return imageLoad(depth_texels, int(at)).x;
#endif
}

#endif
