/* What a chunk holds: a row for each kind. Whoever adds a kind adds its row here, a value of enum spl_chunk_kind, and
 * how a method draws it (src/render/select_draw.c). All kinds share the chunk's header; a row says what of it they
 * use. */
#ifndef SPL_DATASET_CODEC_H
#define SPL_DATASET_CODEC_H

#include "dataset/chunk.h"

struct spl_chunk_codec {
    const char *name; /* of the kind, as `splatd info` prints it */
    /* What is wrong with the header in itself, or NULL: then any code decodes to finite numbers. A few comparisons. */
    const char *(*judge)(const struct spl_chunk *chunk);
    /* As the functions of chunk.h, which look the row up. */
    uint32_t (*words)(const struct spl_chunk *chunk);
    /* NULL of panels and meshes, which are no splats: panels.h. */
    uint32_t (*encode)(const struct spl_splat *splats, const double (*position)[3], uint32_t count,
                       const struct spl_chunk_options *options, struct spl_chunk *chunk, uint32_t *words,
                       struct spl_chunk_error *error);
    void (*decode)(const struct spl_chunk *chunk, const uint32_t *page, uint32_t i, struct spl_splat *splat);
    void (*add_bits)(const struct spl_chunk *chunk, uint64_t bits[SPL_ATTRIBUTE_COUNT]);
};

/* The row of `kind`; NULL where there is none, which is a file's mistake. */
const struct spl_chunk_codec *spl_chunk_get_codec(uint32_t kind);

/* The rows' functions. Lines are vertices that are encoded as discs without clip line. */
uint32_t spl_discs_words(const struct spl_chunk *chunk);
uint32_t spl_discs_encode(const struct spl_splat *splats, const double (*position)[3], uint32_t count,
                          const struct spl_chunk_options *options, struct spl_chunk *chunk, uint32_t *words,
                          struct spl_chunk_error *error);
void spl_discs_decode(const struct spl_chunk *chunk, const uint32_t *page, uint32_t i, struct spl_splat *splat);
/* Its position alone; returns the bit behind it, counted from the chunk's first word. */
uint32_t spl_discs_decode_position(const struct spl_chunk *chunk, const uint32_t *page, uint32_t i, float position[3]);
void spl_discs_add_bits(const struct spl_chunk *chunk, uint64_t bits[SPL_ATTRIBUTE_COUNT]);
const char *spl_discs_judge(const struct spl_chunk *chunk);

extern const struct spl_chunk_codec spl_codec_lines, spl_codec_panels, spl_codec_meshes;

#endif
