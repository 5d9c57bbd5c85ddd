/* Clip lines of a chunk, both ways: where discs at silhouettes and creases end. shaders/common/clip.glsl is the
 * decoding once more. Pure functions; any thread. */
#ifndef SPL_DATASET_CHUNK_CLIP_H
#define SPL_DATASET_CHUNK_CLIP_H

#include "dataset/chunk.h"

/* How many splats of the chunk have a line, and the words of its stream: 0 where none has. */
uint32_t spl_clip_count(const struct spl_chunk *chunk);
uint32_t spl_clip_words(const struct spl_chunk *chunk);

/* Writes the stream of chunk->count lines, `normals` being what theirs decode to, and its count into chunk->extra_bits.
 * A line that the disc does not reach is left out. `words` has room for SPL_CLIP_WORDS_MAX. Returns the words. */
uint32_t spl_clip_encode(const struct spl_clip *clips, const float (*normals)[3], struct spl_chunk *chunk,
                         uint32_t *words);

/* The line of splat `i`, whose normal is `normal`; no direction where it has none. `words` is the stream. */
void spl_clip_decode(const struct spl_chunk *chunk, const uint32_t *words, uint32_t i, const float normal[3],
                     struct spl_clip *clip);

#endif
