/* A dataset's splat textures as a file, for measuring coders beside each other on the same input: a header, then the
 * textures as in dictionary.h. Little-endian. Working data of one machine, not a format to keep. */
#ifndef SPL_SPARSE_TEXTURE_FILE_H
#define SPL_SPARSE_TEXTURE_FILE_H

#include "sparse/train.h"

struct spl_texture_file_header {
    char magic[8]; /* "SPLTEXT1" */
    uint32_t size, photographs;
    uint64_t count;  /* textures */
    uint64_t splats; /* of the dataset, those without a texture too */
    uint64_t pixels; /* of all photographs */
};

/* Writes the textures of `source` to `path`, replaced when all of it is there. Blocks. SPL_E_IO, the source's own. */
int spl_texture_file_write(const char *path, const struct spl_texture_source *source, uint64_t splats,
                           uint32_t photographs, uint64_t pixels, struct spl_error *err);

struct spl_texture_file {
    struct spl_texture_file_header header;
    struct spl_texture_source source; /* reads the file; valid until spl_texture_file_close() */
    int fd;
    char *path;
};

/* Opens `path`; a file that is no such, or shorter than it says, is refused. On failure nothing is held.
 * SPL_E_NOT_FOUND, SPL_E_IO, SPL_E_INPUT. The struct must stay where it is while it is open. */
int spl_texture_file_open(const char *path, struct spl_texture_file *file, struct spl_error *err);
void spl_texture_file_close(struct spl_texture_file *file);

#endif
