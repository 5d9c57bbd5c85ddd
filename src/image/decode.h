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

/* The headers alone. */
int spl_inspect_png(FILE *file, const char *path, struct spl_image_info *out, struct spl_error *err);
int spl_inspect_jpeg(FILE *file, const char *path, struct spl_image_info *out, struct spl_error *err);

/* Checks the size, then allocates out->pixels for out->type. */
int spl_decode_begin(const char *path, uint64_t width, uint64_t height, struct spl_image *out, struct spl_error *err);

#endif
