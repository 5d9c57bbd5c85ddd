/* What textures look like after block compression: the baselines of splat textures. Only quality is wanted, so nothing
 * is packed into bits. Blocks are 4 × 4 texels; pixels are RGB bytes in one row after another. Any thread. */
#ifndef SPL_MEASURE_BLOCKS_H
#define SPL_MEASURE_BLOCKS_H

#include <stdint.h>

#include "image/pyramid.h"

/* BC1 (DXT1), 4 bits a texel: what decoding the better of stb_dxt's two encoders gives. */
void spl_block_bc1(const uint8_t in[16][3], uint8_t out[16][3]);

/* BC7 (BPTC), 8 bits a texel, mode 6 alone: end points of 7 bits a channel and one that the channels share, 16 steps
 * between them. A full encoder, which may choose of eight modes, is better by up to a decibel or two where a block has
 * two colours. */
void spl_block_bc7(const uint8_t in[16][3], uint8_t out[16][3]);

/* Fills `out` with what `from` looks like when every level of it is coded block by block, by all `threads`; where a
 * side is no multiple of 4 the last texel is repeated, alpha stays. SPL_E_NOMEM; nothing is held then. */
int spl_blocks_code(const struct spl_pyramid *from, void (*code)(const uint8_t in[16][3], uint8_t out[16][3]),
                    unsigned threads, struct spl_pyramid *out, struct spl_error *err);

#endif
