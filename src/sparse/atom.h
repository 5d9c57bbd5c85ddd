/* Atoms as they are stored: whole numbers of waves. Waves are the cosines of the discrete cosine transform of each of
 * three channels, (R + G + B) / √3, (R − B) / √2 and (R − 2G + B) / √6; most of a learned atom is in few of them. */
#ifndef SPL_SPARSE_ATOM_H
#define SPL_SPARSE_ATOM_H

#include "sparse/dictionary.h"

/* The waves of a size; a coefficient stands at its place in `order`, coarse waves first. */
struct spl_waves {
    uint32_t size, n;
    double cosine[SPL_TEXTURE_SIZE_MAX * SPL_TEXTURE_SIZE_MAX];     /* [wave][texel], norm 1 */
    double transposed[SPL_TEXTURE_SIZE_MAX * SPL_TEXTURE_SIZE_MAX]; /* [texel][wave] */
    uint16_t order[SPL_TEXTURE_VALUES_MAX]; /* channel · size² + vertical · size + horizontal */
};

/* size: 1..SPL_TEXTURE_SIZE_MAX */
void spl_waves_init(struct spl_waves *waves, uint32_t size);

/* out[n] = the coefficients of atom[n] (channel-planar texels), in units of `step`, rounded. Mean colours are dropped.
 */
void spl_waves_analyse(const struct spl_waves *waves, const float *atom, float step, int16_t *out);

/* The atom of norm 1 that coefficient[n] add up to (waves of coefficient 0 cost nothing), as texels[n] and their scale;
 * false where they add up to nothing. The same on every machine up to one level of a texel. */
bool spl_waves_synthesise(const struct spl_waves *waves, const int16_t *coefficient, int8_t *texels, float *scale);

/* Allocates arrays for `count` atoms. On failure nothing is held. SPL_E_NOMEM. */
int spl_dictionary_init(struct spl_dictionary *dictionary, uint32_t count, uint32_t size, struct spl_error *err);

#endif
