/* Images from files: references, photographs, what `splatd render` and `splatd synth` wrote. */
#ifndef SPL_IMAGE_LOAD_H
#define SPL_IMAGE_LOAD_H

#include <stdio.h>

#include <splatd/image.h>

#include "base/error.h"

enum { SPL_IMAGE_PIXELS_MAX = 128 << 20 }; /* a panorama of 16384 x 8192 */

/* Reads `path` as `layer`; what the file is, its first bytes say, not its name.
 *   PNG   color, any PNG, as RGBA8 (16 bit channels lose their lower byte); depth and range, 16 bit grey, 0 = nothing,
 *         steps of 1 mm or as a Depth-Scale note of ours says; with that note 65535 = nothing too, since it only says
 *         "farther"
 *   JPEG  color, alpha 255; an orientation in its EXIF data is not applied; truncated or damaged ones are refused
 *   NPY   every layer in its own type: |u1 (h,w,4), <f4 (h,w), <f4 (h,w,3), <u4 (h,w), C order
 * Sizes are checked before pixels are allocated: at most SPL_IMAGE_PIXELS_MAX of them, SPL_E_LIMIT beyond. Fills `out`
 * on success, which spl_image_finish() releases; leaves it zeroed on failure. SPL_E_NOT_FOUND, SPL_E_IO, SPL_E_INPUT
 * (damaged), SPL_E_UNSUPPORTED (a format that does not hold the layer); all name the file. Any thread; blocks for the
 * reading. */
int spl_image_load(const char *path, enum spl_layer layer, struct spl_image *out, struct spl_error *err);

/* The same of an open file, which stands at its start; `path` is for messages. */
int spl_image_load_of(FILE *file, const char *path, enum spl_layer layer, struct spl_image *out, struct spl_error *err);

/* What an image file is, from its header alone. */
struct spl_image_info {
    uint32_t width, height;
    unsigned bits; /* a channel: 1 to 16; 8 for JPEG, 0 for NPY */
    bool cmyk;
};

/* As spl_image_load() without its pixels: PNG and JPEG. */
int spl_image_get_info(const char *path, struct spl_image_info *out, struct spl_error *err);
int spl_image_get_size(const char *path, uint32_t *width, uint32_t *height, struct spl_error *err);
int spl_image_get_info_of(FILE *file, const char *path, struct spl_image_info *out, struct spl_error *err);

#endif
