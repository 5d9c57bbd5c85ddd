/* Splats picked evenly from the leaves, to hold maps against. */
#ifndef SPL_PACK_MAPS_SAMPLES_H
#define SPL_PACK_MAPS_SAMPLES_H

#include "pack/maps/sees.h"

struct spl_sample {
    double position[3]; /* world */
    float normal[3], radius;
    uint8_t color[3];
    uint16_t of; /* as of struct spl_stations */
};

struct spl_samples {
    struct spl_sample *list; // owned
    size_t count;
    bool colored; /* they have colours to be compared: not all of them are grey, as intensities are */
};

/* At most about `most` discs. On failure nothing is held. */
int spl_samples_init(struct spl_samples *samples, const struct spl_splats *splats, const struct spl_stations *stations,
                     uint64_t most, struct spl_error *err);
void spl_samples_finish(struct spl_samples *samples);

/* Whether the sample lies where nothing ends beside it: its station sees it square enough, and all four texels of the
 * map around it show it. `own`: where it lies in the station's frame. */
bool spl_sample_is_seen(const struct spl_sample *sample, const struct spl_station *station,
                        const struct spl_map_sight *map, double own[3]);

#endif
