/* What one station sees of all splats, whoever scanned them: a z-buffer around it. */
#ifndef SPL_PACK_MAPS_SIGHT_H
#define SPL_PACK_MAPS_SIGHT_H

#include <stdatomic.h>

#include "pack/maps/stations.h"

enum { SPL_SIGHT_LEVELS = 8 };

struct spl_sight {
    const struct spl_station *station; // borrowed
    /* By level, each half as fine: bits of the least range in each texel, which order as ranges do. The first owned */
    _Atomic uint32_t *nearest[SPL_SIGHT_LEVELS];
};

/* Draws the leaves' discs, parallel. SPL_E_NOMEM; nothing is held then. */
int spl_sight_init(struct spl_sight *sight, const struct spl_station *station, const struct spl_splats *splats,
                   unsigned threads, struct spl_error *err);
void spl_sight_finish(struct spl_sight *sight);

/* Whether nothing lies in front of the splat's centre; how squarely (0 to 1) and from how far away it is seen. Any
 * thread. */
bool spl_sight_sees(const struct spl_sight *sight, const struct spl_world_splat *splat, double *cosine, double *range);

#endif
