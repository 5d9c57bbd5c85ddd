/* From given parameters to a checked view: defaults, conflicts, caps, and the camera in any of its three forms.
 *
 * Invariant: what comes out has passed spl_view_check() and lies within the server's caps, so that no later stage
 * refuses it for a reason that this one could have named. Pure functions, any thread. */
#include "service/request.h"

#include <math.h>

#include "service/values.h"

enum { width_default = 1280, height_default = 720 };

static bool given(const struct values *values, enum param param)
{
    return values->v[param].given;
}

static double get(const struct values *values, enum param param, double otherwise)
{
    return values->v[param].given ? values->v[param].n[0] : otherwise;
}

static int conflict(enum param param, enum param with, struct spl_error *err)
{
    return spl_fail_field(err, SPL_E_INPUT, spl_params[param].name, "'%s' and '%s' exclude each other",
                          spl_params[param].name, spl_params[with].name);
}

static int missing(enum param param, enum param because, struct spl_error *err)
{
    return spl_fail_field(err, SPL_E_INPUT, spl_params[param].name, "'%s' is needed where '%s' is given",
                          spl_params[param].name, spl_params[because].name);
}

static int resolve_size(const struct values *values, const struct spl_view_limits *limits, uint32_t *width,
                        uint32_t *height, struct spl_error *err)
{
    double size[2] = {get(values, PARAM_width, width_default), get(values, PARAM_height, height_default)};
    for (int i = 0; i < 2; i++) {
        const char *name = i ? "height" : "width";
        if (size[i] < 1 || size[i] > limits->side_px)
            return spl_fail_field(err, SPL_E_INPUT, name, "%s %.0f is outside 1 to %u", name, size[i], limits->side_px);
    }
    if (size[0] * size[1] > (double)limits->pixels)
        return spl_fail_field(err, SPL_E_INPUT, given(values, PARAM_width) ? "width" : "height",
                              "%.0f x %.0f is %.0f pixels; the server's limit is %llu", size[0], size[1],
                              size[0] * size[1], (unsigned long long)limits->pixels);
    *width = (uint32_t)size[0];
    *height = (uint32_t)size[1];
    return 0;
}

static int resolve_intrinsics(const struct values *values, const struct spl_view_defaults *defaults,
                              struct spl_camera *camera, struct spl_error *err)
{
    static const enum param pinhole[] = {PARAM_fx, PARAM_fy, PARAM_cx, PARAM_cy};
    int rc = spl_camera_set_fov(camera, get(values, PARAM_fov, defaults->fov), camera->width, camera->height, err);
    if (rc)
        return rc;
    if (given(values, PARAM_params) && !given(values, PARAM_model))
        return missing(PARAM_model, PARAM_params, err);
    if (given(values, PARAM_model)) {
        if (!given(values, PARAM_params))
            return missing(PARAM_params, PARAM_model, err);
        for (int i = 0; i < 4; i++)
            if (given(values, pinhole[i]))
                return conflict(pinhole[i], PARAM_params, err);
        if (given(values, PARAM_fov))
            return conflict(PARAM_fov, PARAM_params, err);
        return spl_colmap_apply((int)values->v[PARAM_model].n[0], &values->v[PARAM_params], camera, err);
    }
    if (given(values, PARAM_fov) && given(values, PARAM_fx))
        return conflict(PARAM_fov, PARAM_fx, err);
    if (given(values, PARAM_fy) && !given(values, PARAM_fx))
        return missing(PARAM_fx, PARAM_fy, err);
    camera->fx = get(values, PARAM_fx, camera->fx);
    camera->fy = get(values, PARAM_fy, camera->fx);
    camera->cx = get(values, PARAM_cx, camera->cx);
    camera->cy = get(values, PARAM_cy, camera->cy);
    return 0;
}

static int resolve_pose(const struct values *values, const struct spl_view_defaults *defaults,
                        struct spl_camera *camera, struct spl_error *err)
{
    static const enum param look_at[] = {PARAM_eye, PARAM_target, PARAM_up}, colmap[] = {PARAM_q, PARAM_t};
    const struct value *v = values->v;
    if (given(values, PARAM_convention) && !given(values, PARAM_matrix))
        return missing(PARAM_matrix, PARAM_convention, err);
    for (int i = 0; i < 3; i++) {
        if (!given(values, look_at[i]))
            continue;
        for (enum param other = PARAM_matrix; other <= PARAM_t; other++)
            if (given(values, other))
                return conflict(look_at[i], other, err);
    }
    if (given(values, PARAM_matrix)) {
        for (int i = 0; i < 2; i++)
            if (given(values, colmap[i]))
                return conflict(colmap[i], PARAM_matrix, err);
        if (!given(values, PARAM_convention))
            return missing(PARAM_convention, PARAM_matrix, err);
        return spl_camera_set_matrix(camera, v[PARAM_matrix].n, (enum spl_axes)v[PARAM_convention].n[0], err);
    }
    if (given(values, PARAM_q) != given(values, PARAM_t))
        return given(values, PARAM_q) ? missing(PARAM_t, PARAM_q, err) : missing(PARAM_q, PARAM_t, err);
    if (given(values, PARAM_q))
        return spl_camera_set_colmap(camera, v[PARAM_q].n, v[PARAM_t].n, err);
    return spl_camera_look_at(camera, given(values, PARAM_eye) ? v[PARAM_eye].n : defaults->eye,
                              given(values, PARAM_target) ? v[PARAM_target].n : defaults->target,
                              given(values, PARAM_up) ? v[PARAM_up].n : defaults->up, err);
}

static int resolve_encoding(const struct values *values, struct spl_view_request *out, struct spl_error *err)
{
    enum spl_format natural = out->layer == SPL_LAYER_COLOR ? SPL_FORMAT_JPEG : SPL_FORMAT_PNG;
    double quality = get(values, PARAM_quality, 90), scale = get(values, PARAM_depth_scale, 1000);
    if (quality < 1 || quality > 100)
        return spl_fail_field(err, SPL_E_INPUT, "quality", "quality %g is outside 1 to 100", quality);
    if (!(scale >= 1e-6 && scale <= 1e9))
        return spl_fail_field(err, SPL_E_INPUT, "depth_scale", "depth_scale %g is outside 1e-6 to 1e9", scale);
    out->encode = (struct spl_encode_options){
        .format = (enum spl_format)get(values, PARAM_format, natural), .quality = (int)quality, .depth_scale = scale};
    return 0;
}

static int resolve_drawing(const struct values *values, struct spl_view_request *out, struct spl_error *err)
{
    struct spl_view *view = &out->view;
    double margin = get(values, PARAM_margin, view->margin), supersample = get(values, PARAM_supersample, 1);
    if (given(values, PARAM_margin) && margin < 0) // negative means "default" further down
        return spl_fail_field(err, SPL_E_INPUT, "margin", "margin %g is negative", margin);
    if (supersample != 1 && supersample != 2 && supersample != 4)
        return spl_fail_field(err, SPL_E_INPUT, "supersample", "supersample %g is none of 1, 2, 4", supersample);
    out->layer = (enum spl_layer)get(values, PARAM_layer, SPL_LAYER_COLOR);
    view->layers = 1u << out->layer;
    view->method = (enum spl_method)get(values, PARAM_method, view->method);
    view->lod = get(values, PARAM_lod, view->lod);
    view->supersample = (uint32_t)supersample;
    view->margin = margin;
    if (given(values, PARAM_background))
        for (int i = 0; i < 4; i++)
            view->background[i] = (uint8_t)values->v[PARAM_background].n[i];
    if (get(values, PARAM_transparent, 0) != 0)
        view->background[3] = 0;
    return 0;
}

int spl_values_resolve(const struct values *values, const struct spl_view_defaults *defaults,
                       const struct spl_view_limits *limits, struct spl_view_request *out, struct spl_error *err)
{
    *out = (struct spl_view_request){0};
    spl_view_init(&out->view);
    struct spl_camera *camera = &out->view.camera;
    int rc;
    if ((rc = resolve_size(values, limits, &camera->width, &camera->height, err)) ||
        (rc = resolve_intrinsics(values, defaults, camera, err)) ||
        (rc = resolve_pose(values, defaults, camera, err)) || (rc = resolve_drawing(values, out, err)) ||
        (rc = resolve_encoding(values, out, err)))
        return rc;
    camera->near = get(values, PARAM_near, defaults->near);
    camera->far = get(values, PARAM_far, defaults->far);
    if (given(values, PARAM_near) && !given(values, PARAM_far) && camera->far <= camera->near)
        camera->far = INFINITY;
    return spl_view_check(&out->view, err);
}
