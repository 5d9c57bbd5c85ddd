/* Pursuit that keeps several sums of atoms for a texture instead of the best so far. */
#ifndef SPL_SPARSE_BEAM_H
#define SPL_SPARSE_BEAM_H

#include "sparse/code.h"
#include "sparse/pursuit.h"

struct spl_beam; /* one thread's scratch */

/* What a texture takes: squared error + price an atom is to be small, no atom is wanted once the error is `enough`. */
struct spl_beam_aim {
    uint32_t atoms; /* at most, 0..SPL_ATOMS_MAX */
    double price, enough;
};

/* `atoms` (borrowed) must have their Gram matrix. NULL: SPL_E_NOMEM. */
struct spl_beam *spl_beam_create(const struct spl_atoms *atoms, struct spl_error *err);
void spl_beam_destroy(struct spl_beam *beam);

/* Finds the atoms of a texture of squared norm `norm` that matches each of all atoms by match[count]; out->count and
 * out->atom are set, in the order of the pursuit. Returns the squared error that the best weights leave. */
double spl_beam_search(struct spl_beam *beam, const float *match, double norm, const struct spl_beam_aim *aim,
                       struct spl_splat_code *out);

#endif
