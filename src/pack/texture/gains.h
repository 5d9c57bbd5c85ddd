/* Exposure, white balance, vignetting and veiling glare evened out: a coarse grid of factors a photograph and channel,
 * from the splats that several show. */
#ifndef SPL_PACK_TEXTURE_GAINS_H
#define SPL_PACK_TEXTURE_GAINS_H

#include "pack/texture/candidates.h"

enum { SPL_GAIN_ACROSS = 6, SPL_GAIN_DOWN = 5, SPL_GAIN_NODES = SPL_GAIN_ACROSS * SPL_GAIN_DOWN };

/* What was found of photograph i, or of the scan's own colours (the last entry). */
struct spl_gain {
    float factor[SPL_GAIN_NODES]
                [3];  /* colours are to be multiplied by it, bilinear between corners of the grid; 1/3 to 3 */
    uint64_t shared;  /* comparisons with others that it rests on */
    double deviation; /* from the others, logarithm, root mean square in green after the factors */
    double agreement; /* correlation of its brightness with the others', -1 to 1 */
};

/* Robust least squares over the logarithms of colours; the mean logarithm over photographs stays. `own`: colours that
 * splats have without photographs (by id), NULL for none. Fills gains[photos + 1]. What few splats say of a part of a
 * photograph is drawn towards the parts around it. Photographs that share nothing keep factor 1. */
int spl_gains_find(const struct spl_candidates *candidates, const uint8_t (*own)[3], uint32_t photos,
                   struct spl_gain *gains, unsigned threads, struct spl_error *err);

/* A photograph that contradicts the others: it was taken elsewhere, or the model is mirrored or scaled. */
bool spl_gain_contradicts(const struct spl_gain *gain);

/* A photograph that agrees with the others no better than by chance can happen. One may; where most do, it is the
 * model. */
bool spl_gain_doubtful(const struct spl_gain *gain);

/* The factors at a place in the photograph, and what they make of a colour. */
void spl_gain_get(const struct spl_gain *gain, const uint8_t place[2], float factor[3]);
void spl_gain_apply(const struct spl_gain *gain, const uint8_t place[2], const uint8_t in[3], float out[3]);

/* Where the scan's own colours are, which have no photograph. */
extern const uint8_t spl_gain_middle[2];

#endif
