/* Lists of numbers beside images: vectors that are read, and layers of rays that are written as JSON. Any thread. */
#ifndef SPL_IMAGE_VECTORS_H
#define SPL_IMAGE_VECTORS_H

#include <stdio.h>

#include <splatd/image.h>

#include "base/error.h"

/* An NPY file of `bytes` bytes, from the start of `file` on: float32 or float64, little-endian, of shape (count, 3),
 * rows or columns first; 1 to `most` of them. The caller frees *out, x, y, z of each. SPL_E_INPUT, which says what is
 * wrong; `name` is for messages. Sizes are checked before anything is allocated. */
int spl_vectors_load_npy(FILE *file, uint64_t bytes, const char *name, size_t most, double **out, size_t *count,
                         struct spl_error *err);

/* A layer's pixels, row by row, as one array of JSON: numbers, or arrays of them; null where nothing is. */
int spl_image_list_json(const struct spl_image *image, struct spl_encoded *out, struct spl_error *err);

#endif
