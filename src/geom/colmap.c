/* COLMAP's camera models. Only pinholes are drawn, so a model with distortion is accepted when its coefficients are 0
 * and refused otherwise, rather than drawn wrong. Pure functions, any thread. */
#include <string.h>

#include "geom/camera_json.h"

static const struct {
    const char *name;
    unsigned focals, count; /* focal lengths, then cx, cy, then distortion */
} models[] = {
    {"SIMPLE_PINHOLE", 1, 3}, {"PINHOLE", 2, 4}, {"SIMPLE_RADIAL", 1, 4}, {"RADIAL", 1, 5}, {"OPENCV", 2, 8},
};

int spl_colmap_model_from_name(const char *name)
{
    for (size_t i = 0; i < sizeof models / sizeof *models; i++)
        if (!strcmp(name, models[i].name))
            return (int)i;
    return -1;
}

int spl_colmap_apply(int model, const struct spl_value *params, struct spl_camera *camera, struct spl_error *err)
{
    unsigned focals = models[model].focals, count = models[model].count;
    if (params->count != count)
        return spl_fail_field(err, SPL_E_INPUT, "params", "params of model %s needs %u numbers, not %u",
                              models[model].name, count, params->count);
    for (unsigned i = focals + 2; i < count; i++)
        if (params->n[i] != 0)
            return spl_fail_field(
                err, SPL_E_INPUT, "params",
                "params has the distortion coefficient %g; undistort the camera, only pinholes are drawn",
                params->n[i]);
    camera->fx = params->n[0];
    camera->fy = params->n[focals - 1];
    camera->cx = params->n[focals];
    camera->cy = params->n[focals + 1];
    return 0;
}
