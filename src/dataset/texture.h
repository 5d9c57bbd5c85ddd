/* The stored form of a chunk's textures (section TEXP), both ways. shaders/common/texture.glsl is the third copy of the
 * decoding. Pure functions; any thread. */
#ifndef SPL_DATASET_TEXTURE_H
#define SPL_DATASET_TEXTURE_H

#include <stddef.h>
#include <stdint.h>

#include "dataset/format.h"
#include "sparse/code.h"

/* Largest number of words that a chunk's codes can need: whole planes of the widest codes. */
enum { SPL_TEXTURE_WORDS_MAX = SPL_ATOMS_MAX * (SPL_TEXTURE_HEADER_BITS + SPL_CHUNK_SPLATS * 25) / 32 };

static inline uint32_t spl_texture_word(uint32_t chunk_texture)
{
    return chunk_texture & ((1u << SPL_CHUNK_TEXTURE_PLANES) - 1);
}

static inline uint32_t spl_texture_planes(uint32_t chunk_texture)
{
    return chunk_texture >> SPL_CHUNK_TEXTURE_PLANES;
}

/* Writes `code` to `words` (room for SPL_TEXTURE_WORDS_MAX) with the widths that its planes state, and returns the
 * number of words; with the one that its page's head has, spl_chunk_code_bits() / 32. Codes that do not fit their
 * widths are an assertion. */
uint32_t spl_texture_encode(const struct spl_chunk_code *code, uint32_t *words);

/* What is wrong with the codes of a chunk of `splats` splats and `planes` planes (> 0) at words[0 .. count), for a
 * dictionary of `atoms` atoms; NULL where all of it decodes. */
const char *spl_texture_judge(const uint32_t *words, size_t count, uint32_t planes, uint32_t splats, uint32_t atoms);

/* Decodes what spl_texture_judge() has passed, or a chunk of 0 planes. */
void spl_texture_decode(const uint32_t *words, uint32_t planes, uint32_t splats, struct spl_chunk_code *code);

/* Adds the chunk's splats to histogram[number of atoms]. */
void spl_texture_count(const uint32_t *words, uint32_t planes, uint32_t splats, uint64_t histogram[SPL_ATOMS_MAX + 1]);

#endif
