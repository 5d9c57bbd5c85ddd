/* A view that shows a dataset to someone who knows nothing of it. */
#ifndef SPL_PACK_VIEW_H
#define SPL_PACK_VIEW_H

#include "pack/points.h"

struct spl_default_view {
    double eye[3], target[3], up[3], fov; /* vertical, degrees */
};

/* From the first station where one is known, towards the most points around it; otherwise from above and outside,
 * fitted to the bulk of the points, so that strays do not matter. `points` are sorted. */
int spl_default_view_find(const struct spl_points *points, struct spl_default_view *view, struct spl_error *err);

#endif
