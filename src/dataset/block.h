/* Blocks of 4 x 4 texels, of maps of stations and of panels; shaders/shared.h has their layout. Pure; any thread. */
#ifndef SPL_DATASET_BLOCK_H
#define SPL_DATASET_BLOCK_H

#include <stdint.h>

/* The two words of 4 x 4 texels, row by row, sRGB 0..255. Returns the squared error that is left, summed over channels,
 * as a kernel decodes them. */
double spl_block_encode(const float texels[16][3], uint32_t words[2]);

/* Texel 0..15 of a block, 0..255, as shaders/common/block.glsl decodes it. */
void spl_block_get_color(const uint32_t words[2], uint32_t texel, float color[3]);

#endif
