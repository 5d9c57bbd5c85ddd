/* Coarser levels' scalars: the mean by area, or what most have, of the parts that have any. As numbers of steps, which
 * a dataset keeps, so that a level's mean is as exact as it can be kept. Each node is one worker's. */
#include "pack/level_scalars.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "dataset/streams.h"

void spl_scalar_mix_add(struct spl_scalar_mix *mix, uint32_t number, double weight)
{
    if (number == SPL_STREAM_NONE)
        return;
    mix->sum += weight * number;
    mix->weight += weight;
    if (mix->votes == 0)
        mix->number = number;
    mix->votes += mix->number == number ? 1 : -1u;
}

uint32_t spl_scalar_mix_finish(const struct spl_scalar_mix *mix, bool votes)
{
    if (!(mix->weight > 0))
        return SPL_STREAM_NONE;
    return votes ? mix->number : (uint32_t)(mix->sum / mix->weight + 0.5);
}

unsigned spl_scalars_take_point(const struct spl_points *points, size_t i, uint32_t *numbers)
{
    int scalars[SPL_POINT_SCALARS];
    unsigned count = spl_points_list_scalars(points, scalars);
    for (unsigned s = 0; s < count; s++)
        numbers[s] = spl_scalar_number(&points->scalar[scalars[s]], i);
    return count;
}

bool spl_scalars_mix(struct spl_scalar_mixer *mixer, const struct spl_points *points, const uint32_t *numbers,
                     const uint32_t *of, const struct spl_inner_splat *inputs, size_t count, size_t splats,
                     uint32_t **out)
{
    int scalars[SPL_POINT_SCALARS];
    unsigned scalar_count = spl_points_list_scalars(points, scalars);
    *out = NULL;
    if (!scalar_count)
        return true;
    if (splats > mixer->capacity) {
        free(mixer->mixes);
        mixer->mixes = spl_alloc_raw(splats, sizeof *mixer->mixes, NULL);
        mixer->capacity = mixer->mixes ? splats : 0;
    }
    *out = spl_spill_take(points->spill, splats * scalar_count, sizeof **out, NULL);
    if (!mixer->mixes || !*out)
        return false;
    for (unsigned s = 0; s < scalar_count; s++) {
        memset(mixer->mixes, 0, splats * sizeof *mixer->mixes);
        for (size_t i = 0; i < count; i++) {
            double radius = (double)inputs[i].radius;
            spl_scalar_mix_add(&mixer->mixes[of[i] - 1], numbers[i * scalar_count + s], radius * radius);
        }
        for (size_t k = 0; k < splats; k++)
            (*out)[k * scalar_count + s] = spl_scalar_mix_finish(&mixer->mixes[k], points->scalar[scalars[s]].votes);
    }
    return true;
}

void spl_scalar_mixer_finish(struct spl_scalar_mixer *mixer)
{
    free(mixer->mixes);
    *mixer = (struct spl_scalar_mixer){0};
}
