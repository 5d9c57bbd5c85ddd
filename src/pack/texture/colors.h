/* From candidates to one photograph and one colour a splat. */
#ifndef SPL_PACK_TEXTURE_COLORS_H
#define SPL_PACK_TEXTURE_COLORS_H

#include "pack/texture/gains.h"

struct spl_chosen {
    uint16_t *photo;     /* by splat id; SPL_NO_PHOTO where no photograph shows it */
    uint8_t (*color)[3]; /* by splat id */
    uint64_t unseen;
};

/* `own` as for spl_gains_find(): what unseen splats keep, evened out like a photograph; without, they take the colours
 * of the nearest splats of their chunk, else of their node or the nodes above it. Owned by the caller. */
int spl_chosen_init(struct spl_chosen *chosen, const struct spl_splats *splats, const struct spl_candidates *candidates,
                    const struct spl_gain *gains, uint32_t photos, const uint8_t (*own)[3], struct spl_stage *stage,
                    struct spl_error *err);
void spl_chosen_finish(struct spl_chosen *chosen);

#endif
