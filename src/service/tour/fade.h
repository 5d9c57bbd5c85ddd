/* What of a view changes along a tour: what keyframes may say beside their cameras (geom/camera_path.h). Pure
 * functions, any thread. */
#ifndef SPL_SERVICE_TOUR_FADE_H
#define SPL_SERVICE_TOUR_FADE_H

#include <splatd/render.h>

#include "geom/camera_path.h"

/* For spl_path_options.values. */
void spl_fade_get_values(struct spl_path_value values[SPL_PATH_VALUES]);

/* A row for each frame into *out, the caller's to free(); NULL where no key says anything. */
int spl_fade_sample(const struct spl_camera_path *path, const struct spl_path_motion *motion, size_t frames,
                    double (**out)[SPL_PATH_VALUES], struct spl_error *err);

/* What no key says stays as it is. */
void spl_fade_apply(const double row[SPL_PATH_VALUES], struct spl_view *view);

#endif
