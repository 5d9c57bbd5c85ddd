/* A dataset's splat textures as a file, for measuring coders beside each other on the same input: a header, the
 * textures as in dictionary.h, by splat the photograph it was textured from (16 bits), and the photographs' names, each
 * with a zero behind it. Little-endian. Working data of one machine, not a format to keep. */
#ifndef SPL_SPARSE_TEXTURE_FILE_H
#define SPL_SPARSE_TEXTURE_FILE_H

#include "sparse/train.h"

#define SPL_TEXTURE_NO_PHOTO UINT16_MAX

struct spl_texture_file_header {
    char magic[8]; /* "SPLTEXT2" */
    uint32_t size, photographs;
    uint64_t count;       /* textures */
    uint64_t splats;      /* of the dataset, those without a texture too */
    uint64_t pixels;      /* of all photographs that were taken */
    uint64_t names_bytes; /* of their names */
};

/* The splats that textures are of, and the photographs that they come from. */
struct spl_texture_origin {
    uint64_t splats, pixels;  /* as in the header */
    uint32_t photographs;     /* below SPL_TEXTURE_NO_PHOTO */
    const uint16_t *photo;    /* by splat: its photograph, or SPL_TEXTURE_NO_PHOTO */
    const char *const *names; /* by photograph, without the extension; "" = refused, no splat has it */
};

/* Writes the textures of `source` to `path`, replaced when all of it is there. Blocks. SPL_E_IO, the source's own. */
int spl_texture_file_write(const char *path, const struct spl_texture_source *source,
                           const struct spl_texture_origin *origin, struct spl_error *err);

struct spl_texture_file {
    struct spl_texture_file_header header;
    struct spl_texture_source source; /* reads the file; valid until spl_texture_file_close() */
    struct spl_texture_origin origin; /* the same */
    int fd;
    char *path, *text; /* text: the names */
};

/* Opens `path`; a file that is no such, or shorter than it says, is refused. On failure nothing is held.
 * SPL_E_NOT_FOUND, SPL_E_IO, SPL_E_INPUT. The struct must stay where it is while it is open. */
int spl_texture_file_open(const char *path, struct spl_texture_file *file, struct spl_error *err);
void spl_texture_file_close(struct spl_texture_file *file);

#endif
