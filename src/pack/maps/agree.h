/* Whether the colours of a station's map and of the splats that it shows are of one scene, in one place. */
#ifndef SPL_PACK_MAPS_AGREE_H
#define SPL_PACK_MAPS_AGREE_H

#include "pack/maps/atlas.h"
#include "pack/maps/samples.h"
#include "pack/maps/sees.h"

struct spl_agreement {
    size_t shared;      /* samples that it rests on; below SPL_AGREEMENT_LEAST it says nothing */
    double correlation; /* of brightness within bands of elevation, -1 to 1; NaN: there is no contrast */
    double other;       /* the best correlation of the map mirrored or turned around the vertical; and which that is: */
    bool mirrored;
    double turned;      /* degrees, -180 to 180 */
    double shift[3];    /* by how much the eye would have to move for edges to lie on edges, world; its deviation */
    double shift_error;
    double turn, turn_error; /* and by which angle it would have to turn, radians */
};

enum { SPL_AGREEMENT_LEAST = 500 };

/* `atlas` without holes, of `station`, whose ranges are `map`; samples of other stations do not count where `scanned`.
 * Least squares over the map's gradient (Lucas and Kanade, "An iterative image registration technique", 1981) for six
 * unknowns of the pose beside brightness and contrast, coarse to fine, outliers weighed down. The caller's thread. */
int spl_agreement_find(struct spl_agreement *agreement, const struct spl_atlas *atlas,
                       const struct spl_station *station, uint32_t index, bool scanned, const struct spl_map_sight *map,
                       const struct spl_samples *samples, struct spl_error *err);

#endif
