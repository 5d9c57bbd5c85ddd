/* A view that shows a dataset to someone who knows nothing of it. */
#ifndef SPL_PACK_VIEW_H
#define SPL_PACK_VIEW_H

#include "pack/points.h"

struct spl_default_view {
    double eye[3], target[3], up[3];
    double fov;    /* vertical, degrees, of an image of 16:9 */
    double fit[2]; /* degrees across and upright that an image of any shape shows at least */
};

/* Through the first station that is a camera; else from inside, where the scene lies around stations, cameras or places
 * to stand; else from outside, from where most is to be seen, fitted to the bulk of the points, so that strays do not
 * matter. `points` are sorted; `unit_m` is metres a unit, 0 = not known; `sides`: normals show to where the scan was
 * taken from. */
int spl_default_view_find(const struct spl_points *points, double unit_m, bool sides, unsigned threads,
                          struct spl_default_view *view, struct spl_error *err);

#endif
