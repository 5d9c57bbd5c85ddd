/* The atoms that all textures of a dataset are sums of, as they are drawn: 8 bit texels and a scale an atom.
 *
 * A texture is size × size colours in sRGB as photographs store them, one byte a channel, channel-planar: the R plane
 * row by row, then G, then B; n = 3·size² values. Its mean colour is kept apart (it is the splat's colour), so atoms
 * have mean zero in each plane up to their rounding. Values of atoms are in units of the colour range: 1 = the 255 of a
 * byte. */
#ifndef SPL_SPARSE_DICTIONARY_H
#define SPL_SPARSE_DICTIONARY_H

#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

enum {
    SPL_TEXTURE_SIZE_MAX = 32,
    SPL_TEXTURE_VALUES_MAX = 3 * SPL_TEXTURE_SIZE_MAX * SPL_TEXTURE_SIZE_MAX,
    SPL_DICTIONARY_MAX = 65536, /* atoms: an index is 16 bits at most */
};

/* Atom a is scale[a] · texels[a·n …], of norm 1 up to rounding. Sorted by use, the most used first, so that planes of
 * common atoms need narrow indices. count may be 0: then all textures are plain. */
struct spl_dictionary {
    uint32_t count, size;  /* size: 1..SPL_TEXTURE_SIZE_MAX */
    float *scale;          /* [count] */
    int8_t *texels;        /* [count][3][size][size], -127..127 */
    int16_t *coefficients; /* [count][3·size²], atom.h: what a file holds; NULL where it is for none */
};

static inline uint32_t spl_texture_values(uint32_t size)
{
    return 3 * size * size;
}

/* Frees the arrays and zeroes the struct; a zeroed struct is fine. */
void spl_dictionary_finish(struct spl_dictionary *dictionary);

#endif
