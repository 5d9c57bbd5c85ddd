/* Every so manieth splat by id: ids go by place, so that samples lie as splats do. The caller's thread. */
#include "pack/maps/samples.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "geom/vector.h"

static const double cosine_least = 0.2;

int spl_samples_init(struct spl_samples *samples, const struct spl_splats *splats, const struct spl_stations *stations,
                     uint64_t most, struct spl_error *err)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(splats->dataset);
    struct spl_world_splat list[SPL_CHUNK_SPLATS];
    uint64_t step = info->leaf_splats / most + 1;
    size_t capacity = 0;
    *samples = (struct spl_samples){0};
    for (uint32_t c = 0; c < splats->chunk_count; c++) {
        uint64_t id = splats->chunks[c].first_id, ids = splats->chunks[c].count, first = (step - id % step) % step;
        if (first >= ids || !spl_splats_is_leaf(splats, c) || !spl_splats_is_discs(splats, c))
            continue;
        if (spl_array_reserve(samples->list, capacity, samples->count + SPL_CHUNK_SPLATS, err)) {
            spl_samples_finish(samples);
            return SPL_E_NOMEM;
        }
        spl_splats_get(splats, c, list);
        for (uint64_t i = first; i < ids; i += step) {
            struct spl_sample *sample = &samples->list[samples->count++];
            memcpy(sample->position, list[i].position, sizeof sample->position);
            memcpy(sample->normal, list[i].splat.normal, sizeof sample->normal);
            memcpy(sample->color, list[i].splat.color, sizeof sample->color);
            sample->radius = list[i].splat.radius;
            sample->of = stations->of[id + i];
            samples->colored |= sample->color[0] != sample->color[1] || sample->color[1] != sample->color[2];
        }
    }
    samples->colored &= info->has_color;
    return SPL_OK;
}

void spl_samples_finish(struct spl_samples *samples)
{
    free(samples->list);
    *samples = (struct spl_samples){0};
}

bool spl_sample_is_seen(const struct spl_sample *sample, const struct spl_station *station,
                        const struct spl_map_sight *map, double own[3])
{
    const double normal[3] = {(double)sample->normal[0], (double)sample->normal[1], (double)sample->normal[2]};
    double turned[3];
    spl_station_to_own(station, sample->position, own);
    spl_station_turn(station, normal, turned);
    double range = sqrt(dot3(own, own)), cosine = fabs(dot3(own, turned)) / fmax(range, 1e-30);
    return range > 0 && cosine >= cosine_least && spl_map_shows(map, own, (double)sample->radius, cosine) >= 1;
}
