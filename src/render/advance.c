/* The eye of parallel rays; see advance.h. */
#include "render/advance.h"

#include <math.h>

/* What is drawn may reach beyond its bounds, or before the near plane: a disc by its radius, what is thinner than a
 * sample by that. Kernels keep depths to 2^-18 of them (common/sums.glsl), so that room for this many median radii
 * costs depths 1/256 of one at most, however far apart the bounds are: one stray point puts them anywhere. */
static const double around_share = 0.01, around_radii = 1024, around_px = 16;

double spl_camera_advance(struct spl_camera *camera, const struct spl_dataset_info *info)
{
    double square = 0, first = 0;
    if (camera->projection != SPL_ORTHOGRAPHIC)
        return 0;
    for (int a = 0; a < 3; a++) {
        double axis = camera->rotation[6 + a], low = info->bounds_min[a], high = info->bounds_max[a];
        first += axis * ((axis > 0 ? low : high) - camera->eye[a]);
        square += (high - low) * (high - low);
    }
    const double room = fmin(around_share * sqrt(square), around_radii * info->splat_radius);
    const double around = fmax(room, around_px / fmin(camera->fx, camera->fy));
    const double by = fmax(camera->near, first - around) - around;
    for (int a = 0; a < 3; a++)
        camera->eye[a] += by * camera->rotation[6 + a];
    camera->near = around;
    camera->far -= by;
    return by;
}
