/* Exposure and white balance evened out between stations. */
#ifndef SPL_PACK_MAPS_EVEN_H
#define SPL_PACK_MAPS_EVEN_H

#include "pack/maps/atlas.h"
#include "pack/maps/samples.h"
#include "pack/maps/sees.h"

struct spl_sighting {
    uint32_t sample;
    uint16_t row;
    float color[3]; /* logarithms of linear light */
};

/* What maps show of samples. */
struct spl_sightings {
    struct spl_sighting *list; // owned
    size_t count, capacity;
};

/* Adds the colours of `atlas`, map `row` of `station`, at the samples that it shows; those that are nearly black or
 * white are none. */
int spl_sightings_add(struct spl_sightings *sightings, const struct spl_atlas *atlas, uint16_t row,
                      const struct spl_station *station, const struct spl_map_sight *map,
                      const struct spl_samples *samples, struct spl_error *err);
void spl_sightings_finish(struct spl_sightings *sightings);

/* Factors of linear light, 1/8 to 8, for each of `rows` maps: robust least squares of the logarithms over samples that
 * several maps show (api/photographs.md, step 3). The splats' own colours, where they have any, hold the maps' mean
 * where it is; else that stays. A map that shares nothing keeps 1. */
int spl_sightings_even_out(const struct spl_sightings *sightings, const struct spl_samples *samples, uint32_t rows,
                           float (*factors)[3], struct spl_error *err);

#endif
