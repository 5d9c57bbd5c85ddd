/* A list of directions that a view looks along (projection RAYS), and what their faces have to be. Read-only once made;
 * any thread. */
#ifndef SPL_GEOM_RAY_LIST_H
#define SPL_GEOM_RAY_LIST_H

#include <stdatomic.h>

#include <splatd/camera.h>

#include "geom/faces.h"

struct spl_rays {
    atomic_uint references;
    uint32_t count;
    double resolution;                             /* pixels a radian: as densely as most of them lie */
    double low[SPL_FACES][2], high[SPL_FACES][2]; /* of each face what they go through; low above high: nothing */
    uint64_t hash[2];                              /* of the directions */
    double directions[][3];                        /* unit */
};

/* Another owner; each calls spl_rays_destroy(). NULL-safe. */
struct spl_rays *spl_rays_ref(const struct spl_rays *rays);

#endif
