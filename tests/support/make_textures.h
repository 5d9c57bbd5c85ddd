/* Textures without photographs: smooth atoms of random waves and random codes, on any dataset. */
#ifndef TEST_SUPPORT_MAKE_TEXTURES_H
#define TEST_SUPPORT_MAKE_TEXTURES_H

#include <stdint.h>

#include <splatd/dataset.h>

#include "sparse/code.h"

/* A dictionary of `count` atoms of norm 1 and mean 0, each a wave or two of random direction and colour; release it
 * with spl_dictionary_finish(). */
struct spl_dictionary make_dictionary(uint32_t count, uint32_t size, uint32_t seed);

/* Codes of a chunk that follow from `seed` and `chunk`: 0..`planes` atoms a splat, widths and steps that differ by
 * plane. A fifth of the chunks has no atom at all. */
void make_code(const struct spl_dictionary *dictionary, uint32_t planes, uint32_t seed, uint32_t chunk, uint32_t splats,
               struct spl_chunk_code *code);

/* Writes `from` with textures of make_code() to `path`. */
void make_textured_file(const struct spl_dataset *from, const struct spl_dictionary *dictionary, uint32_t planes,
                        uint32_t seed, const char *path);

/* The same as an open, verified dataset of id "textured" whose file is gone already. */
struct spl_dataset *make_textured(const struct spl_dataset *from, const struct spl_dictionary *dictionary,
                                  uint32_t planes, uint32_t seed);

#endif
