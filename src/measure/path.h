/* Camera paths for measurements: from one view to another, the same on every machine. */
#ifndef SPL_MEASURE_PATH_H
#define SPL_MEASURE_PATH_H

#include <splatd/dataset.h>

#include "base/error.h"

struct spl_path_view {
    double eye[3], target[3];
    double fov;       /* vertical, degrees */
    double near, far;
};

struct spl_path {
    struct spl_path_view from, to;
    double up[3];
    double turn;      /* how far the eye goes round the target on the way, radians */
};

/* Views "overview" and "close" of the entry `set` in a JSON file:
 *     {"NAME": {"overview": {"eye": [x, y, z], "target": […], "up": […], "vfov_deg": 40, "near": 0.1, "far": 50},
 *               "close": {…}}, …}
 * up is the overview's. `set` NULL takes the only entry. Errors name file, entry and field. */
int spl_path_load(struct spl_path *path, const char *file, const char *set, struct spl_error *err);

/* Once round the default view's target, closing in to a third of the distance. */
int spl_path_orbit(struct spl_path *path, const struct spl_dataset *dataset, struct spl_error *err);

/* The camera at `share` of the way, 0 … 1. */
int spl_path_get_camera(const struct spl_path *path, double share, uint32_t width, uint32_t height,
                        struct spl_camera *camera, struct spl_error *err);

#endif
