/* Exposure and white balance evened out: one factor a photograph and channel, from the splats that several show. */
#ifndef SPL_PACK_TEXTURE_GAINS_H
#define SPL_PACK_TEXTURE_GAINS_H

#include "pack/texture/candidates.h"

/* What was found of photograph i, or of the scan's own colours (the last entry). */
struct spl_gain {
    float factor[3];  /* colours are to be multiplied by it; 1/3 to 3 */
    uint64_t shared;  /* comparisons with others that it rests on */
    double deviation; /* from the others, logarithm, root mean square in green after the factors */
    double agreement; /* correlation of its brightness with the others', -1 to 1 */
};

/* Robust least squares over the logarithms of colours; the mean logarithm over photographs stays. `own`: colours that
 * splats have without photographs (by id), NULL for none. Fills gains[photos + 1]. Photographs that share nothing keep
 * factor 1. */
int spl_gains_find(const struct spl_candidates *candidates, const uint8_t (*own)[3], uint32_t photos,
                   struct spl_gain *gains, struct spl_error *err);

/* A photograph that contradicts the others: it was taken elsewhere, or the model is mirrored or scaled. */
bool spl_gain_contradicts(const struct spl_gain *gain);

void spl_gain_apply(const struct spl_gain *gain, const uint8_t in[3], float out[3]);

#endif
