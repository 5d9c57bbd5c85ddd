/* Colours as blocks of a map; shaders/shared.h has their layout. */
#ifndef SPL_PACK_MAPS_BLOCKS_H
#define SPL_PACK_MAPS_BLOCKS_H

#include <stdint.h>

/* The two words of 4 x 4 texels, row by row, sRGB 0..255. Returns the squared error that is left, summed over channels,
 * as a kernel decodes them. Pure; any thread. */
double spl_map_block_encode(const float texels[16][3], uint32_t words[2]);

#endif
