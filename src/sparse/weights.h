/* The weights of a chunk whose atoms are chosen. */
#ifndef SPL_SPARSE_WEIGHTS_H
#define SPL_SPARSE_WEIGHTS_H

#include "sparse/code.h"
#include "sparse/pursuit.h"

/* Textures of a chunk: row r is splat splat[r]'s, of squared norm norm[r], and matches atom a as match[r·count + a]. */
struct spl_weights_input {
    const struct spl_atoms *atoms; /* with their Gram matrix */
    const struct spl_code_settings *settings;
    const float *match;
    const double *norm;
    const uint8_t *splat;
    uint32_t rows;
};

/* Given each splat's count and atoms in `code`, chooses the planes' widths and grids and sets the weights, each plane
 * knowing how those before it were rounded; then they settle on their grids against each other, and last atoms that no
 * longer pay for their bits go. error[r] receives the squared error. SPL_E_NOMEM. */
int spl_weights_fit(const struct spl_weights_input *in, struct spl_chunk_code *code, double *error,
                    struct spl_error *err);

#endif
