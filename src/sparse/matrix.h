/* Textures as vectors. */
#ifndef SPL_SPARSE_MATRIX_H
#define SPL_SPARSE_MATRIX_H

#include "sparse/dictionary.h"

/* out[n] = the texture, 0..1, less its mean colour, which goes to mean[3]; returns the squared norm. */
double spl_texture_centre(const uint8_t *texture, uint32_t size, float *out, float mean[3]);

#endif
