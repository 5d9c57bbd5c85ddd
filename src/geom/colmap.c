/* COLMAP's camera models. Only pinholes are drawn, so a model with distortion is accepted for a view when its
 * coefficients are 0 and refused otherwise, rather than drawn wrong; photographs keep it. Pure functions, any thread.
 */
#include <string.h>

#include "geom/camera_json.h"

/* Numbered as COLMAP numbers them. Parameters: focal lengths, cx, cy, and the coefficients that `order` names: digits
 * are k, p and q the tangential ones. */
static const struct {
    const char *name;
    unsigned focals, count;
    enum spl_distortion_kind kind;
    const char *order; /* NULL: known, not taken */
} models[] = {
    {"SIMPLE_PINHOLE", 1, 3, SPL_DISTORTION_RADIAL, ""},
    {"PINHOLE", 2, 4, SPL_DISTORTION_RADIAL, ""},
    {"SIMPLE_RADIAL", 1, 4, SPL_DISTORTION_RADIAL, "0"},
    {"RADIAL", 1, 5, SPL_DISTORTION_RADIAL, "01"},
    {"OPENCV", 2, 8, SPL_DISTORTION_RADIAL, "01pq"},
    {"OPENCV_FISHEYE", 2, 8, SPL_DISTORTION_FISHEYE, "0123"},
    {"FULL_OPENCV", 2, 12, SPL_DISTORTION_RADIAL, "01pq2345"},
    {"FOV", 2, 5, SPL_DISTORTION_NONE, NULL},
    {"SIMPLE_RADIAL_FISHEYE", 1, 4, SPL_DISTORTION_FISHEYE, "0"},
    {"RADIAL_FISHEYE", 1, 5, SPL_DISTORTION_FISHEYE, "01"},
    {"THIN_PRISM_FISHEYE", 2, 12, SPL_DISTORTION_NONE, NULL},
};
enum { MODELS = sizeof models / sizeof *models };

const char spl_colmap_model_names[] = "SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV, OPENCV_FISHEYE, "
                                      "FULL_OPENCV, SIMPLE_RADIAL_FISHEYE, RADIAL_FISHEYE";

int spl_colmap_model_from_name(const char *name)
{
    for (int i = 0; i < MODELS; i++)
        if (models[i].order && !strcmp(name, models[i].name))
            return i;
    return -1;
}

const char *spl_colmap_model_from_id(int64_t id, unsigned *count)
{
    if (id < 0 || id >= MODELS)
        return NULL;
    *count = models[id].count;
    return models[id].name;
}

int spl_colmap_apply(int model, const struct spl_value *params, struct spl_camera *camera,
                     struct spl_distortion *distortion, struct spl_error *err)
{
    unsigned focals = models[model].focals, count = models[model].count;
    struct spl_distortion lens = {.kind = models[model].kind};
    if (params->count != count)
        return spl_fail_field(err, SPL_E_INPUT, "params", "params of model %s needs %u numbers, not %u",
                              models[model].name, count, params->count);
    for (unsigned i = focals + 2; i < count; i++) {
        char slot = models[model].order[i - focals - 2];
        *(slot >= 'p' ? &lens.p[slot - 'p'] : &lens.k[slot - '0']) = params->n[i];
        if (!distortion && params->n[i] != 0)
            return spl_fail_field(
                err, SPL_E_INPUT, "params",
                "params has the distortion coefficient %g; undistort the camera, only pinholes are drawn",
                params->n[i]);
    }
    if (!distortion && lens.kind == SPL_DISTORTION_FISHEYE)
        return spl_fail_field(err, SPL_E_INPUT, "model", "model %s: undistort the camera, only pinholes are drawn",
                              models[model].name);
    int rc = spl_distortion_init(&lens, err);
    if (rc)
        return rc;
    if (distortion)
        *distortion = lens;
    camera->fx = params->n[0];
    camera->fy = params->n[focals - 1];
    camera->cx = params->n[focals];
    camera->cy = params->n[focals + 1];
    return 0;
}
