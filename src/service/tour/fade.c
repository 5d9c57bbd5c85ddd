/* soft_opacity, soft_cover and soft_blend along a path. Their ranges are those of the methods' table, so that every
 * frame's view has passed what spl_view_check() asks of them. Pure functions, any thread. */
#include "service/tour/fade.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"

static const enum spl_method_param params[SPL_PATH_VALUES] = {SPL_PARAM_soft_opacity, SPL_PARAM_soft_cover,
                                                                SPL_PARAM_soft_blend};

void spl_fade_get_values(struct spl_path_value values[SPL_PATH_VALUES])
{
    for (int i = 0; i < SPL_PATH_VALUES; i++) {
        const struct spl_method_param_info *info = spl_method_param_get(params[i]);
        values[i] = (struct spl_path_value){info->name, info->least, info->most};
    }
}

int spl_fade_sample(const struct spl_camera_path *path, const struct spl_path_motion *motion, size_t frames,
                    double (**out)[SPL_PATH_VALUES], struct spl_error *err)
{
    *out = NULL;
    if (!path->values)
        return 0;
    if (!(*out = spl_alloc_raw(frames, sizeof **out, err)))
        return SPL_E_NOMEM;
    int rc = spl_camera_path_sample_values(path, motion, frames, *out, err);
    if (rc) {
        free(*out);
        *out = NULL;
    }
    return rc;
}

void spl_fade_apply(const double row[SPL_PATH_VALUES], struct spl_view *view)
{
    for (int i = 0; i < SPL_PATH_VALUES; i++)
        if (!isnan(row[i]))
            spl_view_set_param(view, params[i], row[i]);
}
