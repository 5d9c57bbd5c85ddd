/* The decoders behind spl_image_load(): each reads an open file from its start and fills `out`, whose layer is set.
 * What they allocate for `out` is released by the caller, also after a failure. Inside src/image only; any thread. */
#ifndef SPL_IMAGE_DECODE_H
#define SPL_IMAGE_DECODE_H

#include <stdint.h>
#include <stdio.h>

#include "image/load.h"

int spl_decode_png(FILE *file, const char *path, struct spl_image *out, struct spl_error *err);
int spl_decode_jpeg(FILE *file, const char *path, struct spl_image *out, struct spl_error *err);
int spl_decode_npy(FILE *file, const char *path, struct spl_image *out, struct spl_error *err);

/* load_npy.c: the text between magic and numbers, as a string, with the file left at the numbers; what stands behind
 * 'key': there, or NULL; and of a shape its sides, none where it is broken. */
enum { SPL_NPY_HEADER_MAX = 4096, SPL_NPY_SHAPE_MAX = 4 };
int spl_npy_read_header(FILE *file, const char *path, char text[SPL_NPY_HEADER_MAX], struct spl_error *err);
const char *spl_npy_find(const char *header, const char *key);
unsigned spl_npy_parse_shape(const char *at, uint64_t shape[SPL_NPY_SHAPE_MAX]);

/* The headers alone. */
int spl_inspect_png(FILE *file, const char *path, struct spl_image_info *out, struct spl_error *err);
int spl_inspect_jpeg(FILE *file, const char *path, struct spl_image_info *out, struct spl_error *err);

/* Checks the size, then allocates out->pixels for out->type. */
int spl_decode_begin(const char *path, uint64_t width, uint64_t height, struct spl_image *out, struct spl_error *err);

#endif
