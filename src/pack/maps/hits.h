/* The leaf splats that one station sees, as it sees them. */
#ifndef SPL_PACK_MAPS_HITS_H
#define SPL_PACK_MAPS_HITS_H

#include "pack/maps/sees.h"

struct spl_hit {
    float direction[3]; /* unit, the station's frame */
    float range, radius;
    uint8_t color[3];
};

struct spl_hits {
    struct spl_hit *list; // owned
    size_t count;
    uint32_t *texel; /* of each, where spl_hits_place() was asked last. owned */
};

/* Of a station that scanned its splats, those that are its own; of one that is only said to have stood there, all that
 * it sees: as its `map` has it, or before there is one (NULL) as a z-buffer has. In the order of splats. Parallel;
 * blocks. On failure nothing is held. */
int spl_hits_init(struct spl_hits *hits, const struct spl_splats *splats, const struct spl_stations *stations,
                  uint32_t station, const struct spl_map_sight *map, unsigned threads, struct spl_error *err);
void spl_hits_finish(struct spl_hits *hits);

/* Finds the texel of each hit in an atlas (geom/polar.h). Parallel. */
void spl_hits_place(struct spl_hits *hits, uint32_t side, uint32_t apron, unsigned threads);

/* How far splats of one scan lie off each other's discs: sigma of half of them, by the nearest two of each chunk of
 * leaves. Parallel; blocks. */
int spl_hits_find_noise(const struct spl_splats *splats, const struct spl_stations *stations, unsigned threads,
                        double *sigma, struct spl_error *err);

#endif
