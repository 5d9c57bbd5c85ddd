/* The textures of all splats, out of memory, and their codes. */
#ifndef SPL_PACK_TEXTURE_TEXTURES_H
#define SPL_PACK_TEXTURE_TEXTURES_H

#include <jansson.h>

#include "pack/texture/colors.h"
#include "pack/texture/resample.h"
#include "sparse/texture_file.h"

/* Texture of splat `id` at id * values of an unlinked file; only those of splats with `has[id]` are there. */
struct spl_textures {
    int fd; /* -1 = none */
    uint32_t size, values;
    bool *has;    /* by splat id; owned */
    uint32_t *id; /* of the i-th texture, rising; owned; made by spl_textures_list() */
    uint64_t count;
};

/* Makes the file beside `output`. */
int spl_textures_init(struct spl_textures *textures, const char *output, uint64_t splats, uint32_t size,
                      struct spl_error *err);
void spl_textures_finish(struct spl_textures *textures);

/* Resamples all splats that chose photograph `index`; their `seen` colour comes from their candidates. Parallel; the
 * stage counts chunks. SPL_E_IO. */
int spl_textures_take(struct spl_textures *textures, const struct spl_splats *splats,
                      const struct spl_candidates *candidates, const struct spl_chosen *chosen,
                      const struct spl_gain *gains, const struct spl_photo *photo, uint16_t index,
                      struct spl_stage *stage, struct spl_error *err);

/* Lists what was taken. */
int spl_textures_list(struct spl_textures *textures, uint64_t splats, struct spl_error *err);

/* The squared error of resampling leaves that chose the photograph, every `stride`-th, at sizes 8, 16 and 32. */
void spl_textures_compare(const struct spl_splats *splats, const struct spl_candidates *candidates,
                          const struct spl_chosen *chosen, const struct spl_gain *gains, const struct spl_photo *photo,
                          uint16_t index, uint32_t stride, struct spl_resample_error error[3]);

/* A dictionary and, by chunk, the words of its codes. */
struct spl_coded {
    struct spl_dictionary dictionary;
    uint32_t **words; /* by chunk, as spl_texture_encode() makes them; NULL: none of its splats has an atom */
    uint8_t *planes;  /* by chunk */
    uint32_t chunk_count;
    struct spl_code_sums sums;
    json_t *epochs; /* of training: [{"epoch", "psnr", "atoms", "dictionary"}] */
};

/* Trains and codes; sets chosen->color of textured splats to their textures' mean. `trained` as in
 * struct spl_photo_options. */
int spl_coded_init(struct spl_coded *coded, const struct spl_textures *textures, const struct spl_splats *splats,
                   const struct spl_photo_options *options, struct spl_chosen *chosen, struct spl_stage *stage,
                   struct spl_error *err);
void spl_coded_finish(struct spl_coded *coded);

/* Writes the listed textures to `path`, for measuring coders, and where they come from. */
int spl_textures_keep(const struct spl_textures *textures, const char *path, const struct spl_texture_origin *origin,
                      struct spl_error *err);

/* For spl_dataset_rewrite(); the context is a struct spl_coded_chunks. */
struct spl_coded_chunks {
    const struct spl_coded *coded;
    const struct spl_splats *splats;
};
int spl_coded_get(void *context, uint64_t chunk, struct spl_chunk_code *code, struct spl_error *err);

#endif
