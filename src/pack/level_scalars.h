/* Scalars of what stands for many points: of an inner node's splats, from those of its children, and of panels. */
#ifndef SPL_PACK_LEVEL_SCALARS_H
#define SPL_PACK_LEVEL_SCALARS_H

#include "pack/tree.h"

/* One scalar of one of them while its parts are added. Zeroed at first. */
struct spl_scalar_mix {
    double sum, weight;
    uint32_t number, votes; /* the majority by pairing off */
};

/* Adds a part, as large as `weight`; SPL_STREAM_NONE has no say. */
void spl_scalar_mix_add(struct spl_scalar_mix *mix, uint32_t number, double weight);

/* What most have, where `votes`, else the mean; SPL_STREAM_NONE where no part has any. */
uint32_t spl_scalar_mix_finish(const struct spl_scalar_mix *mix, bool votes);

/* What a worker needs for it, zeroed at first. */
struct spl_scalar_mixer {
    struct spl_scalar_mix *mixes; // owned
    size_t capacity;
};

/* Numbers of steps of all scalars that the points have, splat by splat: of point i. Returns how many it wrote. */
unsigned spl_scalars_take_point(const struct spl_points *points, size_t i, uint32_t *numbers);

/* Makes *out, owned by the caller: those of `splats` splats, which stand for `count` parts, whose `numbers` these are.
 * `of` says for each part which splat, counted from 1, and `inputs` how large it is. NULL where points have no scalars.
 * False when memory is refused. */
bool spl_scalars_mix(struct spl_scalar_mixer *mixer, const struct spl_points *points, const uint32_t *numbers,
                     const uint32_t *of, const struct spl_inner_splat *inputs, size_t count, size_t splats,
                     uint32_t **out);

void spl_scalar_mixer_finish(struct spl_scalar_mixer *mixer);

#endif
