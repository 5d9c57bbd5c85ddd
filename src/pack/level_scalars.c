/* Coarser levels' scalars: the mean by area, or what most have, of the parts that have any. As numbers of steps, which
 * a dataset keeps, so that a level's mean is as exact as it can be kept. Each node is one worker's. */
#include "pack/level_scalars.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "dataset/streams.h"

struct spl_scalar_mix {
    double sum, weight;
    uint32_t number, votes; /* the majority by pairing off */
};

static void add(struct spl_scalar_mix *mix, uint32_t number, double weight)
{
    if (number == SPL_STREAM_NONE)
        return;
    mix->sum += weight * number;
    mix->weight += weight;
    if (mix->votes == 0)
        mix->number = number;
    mix->votes += mix->number == number ? 1 : -1u;
}

static uint32_t finish(const struct spl_scalar_mix *mix, bool votes)
{
    if (!(mix->weight > 0))
        return SPL_STREAM_NONE;
    return votes ? mix->number : (uint32_t)(mix->sum / mix->weight + 0.5);
}

bool spl_scalars_mix(struct spl_scalar_mixer *mixer, const struct spl_points *points, const struct spl_tree *tree,
                     struct spl_tree_node *node, const uint32_t *of, const struct spl_inner_splat *inputs)
{
    int scalars[SPL_POINT_SCALARS];
    unsigned count = spl_points_list_scalars(points, scalars);
    size_t splats = node->splat_count;
    if (!count)
        return true;
    if (splats > mixer->capacity) {
        free(mixer->mixes);
        mixer->mixes = spl_alloc_raw(splats, sizeof *mixer->mixes, NULL);
        mixer->capacity = mixer->mixes ? splats : 0;
    }
    node->numbers = spl_alloc_raw(splats * count, sizeof *node->numbers, NULL);
    if (!mixer->mixes || !node->numbers)
        return false;
    for (unsigned s = 0; s < count; s++) {
        const struct spl_scalar_values *scalar = &points->scalar[scalars[s]];
        size_t input = 0;
        memset(mixer->mixes, 0, splats * sizeof *mixer->mixes);
        for (uint32_t c = 0; c < node->child_count; c++) {
            const struct spl_tree_node *child = &tree->nodes[node->first_child + c];
            for (uint32_t i = 0; i < child->splat_count; i++, input++) {
                double radius = (double)inputs[input].radius;
                add(&mixer->mixes[of[input] - 1],
                    child->child_count ? child->numbers[(size_t)i * count + s]
                                       : spl_scalar_number(scalar, child->begin + i),
                    radius * radius);
            }
        }
        for (size_t k = 0; k < splats; k++)
            node->numbers[k * count + s] = finish(&mixer->mixes[k], scalar->votes);
    }
    return true;
}

void spl_scalar_mixer_finish(struct spl_scalar_mixer *mixer)
{
    free(mixer->mixes);
    *mixer = (struct spl_scalar_mixer){0};
}
