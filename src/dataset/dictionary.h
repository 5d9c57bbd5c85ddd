/* A dictionary as the kernels read it: mips of every atom, one word a texel. Pure functions; any thread.
 *
 * An atom takes spl_dictionary_atom_words(size) words: its scale (the bits of a float), then its levels from size ×
 * size texels down to SPL_TEXTURE_SIDE_MIN × SPL_TEXTURE_SIDE_MIN, row by row. Coarser levels add nothing to a splat's
 * mean colour that can be seen. A texel is (r + 128) << 16 | (g + 128) << 8 | (b + 128) with channels in units of the
 * scale; coarser levels are box averages of the finest, rounded half up. */
#ifndef SPL_DATASET_DICTIONARY_H
#define SPL_DATASET_DICTIONARY_H

#include <stdint.h>

#include "shared.h"
#include "sparse/dictionary.h"

#define SPL_DICTIONARY_BYTES_MAX (128u << 20) /* what every driver can bind as one buffer */

/* Bytes that `count` atoms of `size` × `size` (a power of two) take expanded. */
uint64_t spl_dictionary_expanded_bytes(uint32_t count, uint32_t size);

/* Words of one atom. */
uint32_t spl_dictionary_atom_words(uint32_t size);

/* Writes all atoms to `words`, which has room for spl_dictionary_expanded_bytes(). */
void spl_dictionary_expand(const struct spl_dictionary *dictionary, uint32_t *words);

#endif
