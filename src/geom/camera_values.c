/* From given parameters to a checked camera: defaults, conflicts, caps, and the pose and intrinsics in any of their
 * forms.
 *
 * Invariant: what comes out has passed spl_camera_check() and lies within the caps, so that no later stage refuses it
 * for a reason that this one could have named. Pure functions, any thread. */
#include "geom/camera_json.h"

#include <math.h>
#include <string.h>

#include "geom/fit.h"
#include "geom/size.h"

static const char *const names[SPL_CAMERA_PARAMS] = {
#define PARAM(name, alias, kind, places, help) #name,
#include "geom/camera_params.def"
#undef PARAM
};

static bool given(const struct spl_value *v, enum spl_camera_param param)
{
    return v[param].given;
}

static double get(const struct spl_value *v, enum spl_camera_param param, double otherwise)
{
    return v[param].given ? v[param].n[0] : otherwise;
}

/* As the request says it. */
static const char *name_of(const struct spl_value *v, enum spl_camera_param param)
{
    return v[param].source ? v[param].source : names[param];
}

static int conflict(const struct spl_value *v, enum spl_camera_param param, enum spl_camera_param with,
                    struct spl_error *err)
{
    return spl_fail_field(err, SPL_E_INPUT, names[param], "'%s' and '%s' exclude each other", name_of(v, param),
                          name_of(v, with));
}

static int missing(enum spl_camera_param param, enum spl_camera_param because, struct spl_error *err)
{
    const char *choices = param == SPL_CAMERA_convention ? "opengl or opencv"
                          : param == SPL_CAMERA_model    ? spl_colmap_model_names
                                                         : "";
    return spl_fail_field(err, SPL_E_INPUT, names[param], "'%s' is needed where '%s' is given%s%s", names[param],
                          names[because], *choices ? ": " : "", choices);
}

/* glTF's aspect ratio is that of the image: sides that are given may differ from it by the rounding to pixels. */
static int check_aspect(double aspect, const double size[2], struct spl_error *err)
{
    if (aspect == 0 || fabs(size[1] * aspect - size[0]) < 0.501 || fabs(size[0] / aspect - size[1]) < 0.501)
        return 0;
    return spl_fail_field(err, SPL_E_INPUT, SPL_GLTF_ASPECT,
                          SPL_GLTF_ASPECT " %g contradicts %.0f x %.0f pixels; leave it out, or width or height",
                          aspect, size[0], size[1]);
}

static int resolve_size(const struct spl_value *v, const struct spl_camera_limits *limits, uint32_t *width,
                        uint32_t *height, struct spl_error *err)
{
    static const enum spl_camera_param sides[] = {SPL_CAMERA_width, SPL_CAMERA_height};
    double aspect = v[SPL_CAMERA_fov].n[1], size[2] = {get(v, sides[0], 0), get(v, sides[1], 0)};
    const double shape[2] = {aspect != 0 ? SPL_HEIGHT_DEFAULT * aspect : SPL_WIDTH_DEFAULT, SPL_HEIGHT_DEFAULT};
    const char *const fields[] = {"width", "height"};
    for (int i = 0; i < 2; i++)
        if (given(v, sides[i]) && !(size[i] >= 1 && size[i] <= limits->side_px))
            return spl_fail_field(err, SPL_E_INPUT, fields[i], "%s %.0f is outside 1 to %u", fields[i], size[i],
                                  limits->side_px);
    spl_size_follow(size, shape);
    int rc = check_aspect(aspect, size, err);
    const char *cause = given(v, sides[0])                   ? fields[0]
                        : aspect != 0 && !given(v, sides[1]) ? SPL_GLTF_ASPECT
                                                             : fields[1];
    for (int i = 0; !rc && i < 2; i++)
        if (size[i] > limits->side_px)
            rc = spl_fail_field(err, SPL_E_INPUT, cause, "the %s that follows from %s is %.0f; at most %u is allowed",
                                fields[i], cause, size[i], limits->side_px);
    if (rc)
        return rc;
    if (size[0] * size[1] > (double)limits->pixels)
        return spl_fail_field(err, SPL_E_INPUT, cause, "%.0f x %.0f is %.0f pixels; the limit is %llu", size[0],
                              size[1], size[0] * size[1], (unsigned long long)limits->pixels);
    *width = (uint32_t)size[0];
    *height = (uint32_t)size[1];
    return 0;
}

static int resolve_intrinsics(const struct spl_value *v, const struct spl_camera_defaults *defaults,
                              struct spl_camera *camera, struct spl_error *err)
{
    static const enum spl_camera_param pinhole[] = {SPL_CAMERA_fx, SPL_CAMERA_fy, SPL_CAMERA_cx, SPL_CAMERA_cy};
    double fov = defaults->fit[0] > 0 ? spl_fit_fov(defaults->fit, camera->width, camera->height) : defaults->fov;
    int rc = spl_camera_set_fov(camera, get(v, SPL_CAMERA_fov, fov), camera->width, camera->height, err);
    if (rc)
        return rc;
    if (given(v, SPL_CAMERA_params) && !given(v, SPL_CAMERA_model))
        return missing(SPL_CAMERA_model, SPL_CAMERA_params, err);
    if (given(v, SPL_CAMERA_model)) {
        if (!given(v, SPL_CAMERA_params))
            return missing(SPL_CAMERA_params, SPL_CAMERA_model, err);
        for (int i = 0; i < 4; i++)
            if (given(v, pinhole[i]))
                return conflict(v, pinhole[i], SPL_CAMERA_params, err);
        if (given(v, SPL_CAMERA_fov))
            return conflict(v, SPL_CAMERA_fov, SPL_CAMERA_params, err);
        return spl_colmap_apply((int)v[SPL_CAMERA_model].n[0], &v[SPL_CAMERA_params], camera, NULL, err);
    }
    if (given(v, SPL_CAMERA_fov) && given(v, SPL_CAMERA_fx))
        return conflict(v, SPL_CAMERA_fov, SPL_CAMERA_fx, err);
    if (given(v, SPL_CAMERA_fy) && !given(v, SPL_CAMERA_fx))
        return missing(SPL_CAMERA_fx, SPL_CAMERA_fy, err);
    camera->fx = get(v, SPL_CAMERA_fx, camera->fx);
    camera->fy = get(v, SPL_CAMERA_fy, camera->fx);
    camera->cx = get(v, SPL_CAMERA_cx, camera->cx);
    camera->cy = get(v, SPL_CAMERA_cy, camera->cy);
    return 0;
}

/* What is given in another coordinate system must be a point, and the dataset must know where that lies. */
static int check_places(const struct spl_value *v, const struct spl_camera_defaults *defaults, struct spl_error *err)
{
    if (!given(v, SPL_CAMERA_crs))
        return 0;
    for (enum spl_camera_param other = SPL_CAMERA_matrix; other <= SPL_CAMERA_t; other++)
        if (given(v, other))
            return conflict(v, SPL_CAMERA_crs, other, err);
    if (!defaults->places)
        return spl_fail_field(err, SPL_E_INPUT, "crs",
                              "no dataset stands behind this that could say where its coordinates lie; leave crs out");
    return defaults->places->to_world(defaults->places, (uint32_t)v[SPL_CAMERA_crs].n[0], "crs", NULL, NULL, err);
}

/* Eye or target in the world. */
static int get_point(const struct spl_value *v, enum spl_camera_param param, const double otherwise[3],
                     const struct spl_camera_defaults *defaults, double out[3], struct spl_error *err)
{
    memcpy(out, given(v, param) ? v[param].n : otherwise, 3 * sizeof *out);
    if (!given(v, param) || !given(v, SPL_CAMERA_crs))
        return 0;
    return defaults->places->to_world(defaults->places, (uint32_t)v[SPL_CAMERA_crs].n[0], names[param], v[param].n, out,
                                      err);
}

static int resolve_pose(const struct spl_value *v, const struct spl_camera_defaults *defaults,
                        struct spl_camera *camera, struct spl_error *err)
{
    static const enum spl_camera_param look_at[] = {SPL_CAMERA_eye, SPL_CAMERA_target, SPL_CAMERA_up},
                                       colmap[] = {SPL_CAMERA_q, SPL_CAMERA_t};
    double eye[3], target[3];
    int rc = check_places(v, defaults, err);
    if (rc)
        return rc;
    if (given(v, SPL_CAMERA_convention) && !given(v, SPL_CAMERA_matrix))
        return missing(SPL_CAMERA_matrix, SPL_CAMERA_convention, err);
    for (int i = 0; i < 3; i++) {
        if (!given(v, look_at[i]))
            continue;
        for (enum spl_camera_param other = SPL_CAMERA_matrix; other <= SPL_CAMERA_t; other++)
            if (given(v, other))
                return conflict(v, look_at[i], other, err);
    }
    if (given(v, SPL_CAMERA_matrix)) {
        for (int i = 0; i < 2; i++)
            if (given(v, colmap[i]))
                return conflict(v, colmap[i], SPL_CAMERA_matrix, err);
        if (!given(v, SPL_CAMERA_convention))
            return missing(SPL_CAMERA_convention, SPL_CAMERA_matrix, err);
        return spl_camera_set_matrix(camera, v[SPL_CAMERA_matrix].n, (enum spl_axes)v[SPL_CAMERA_convention].n[0], err);
    }
    if (given(v, SPL_CAMERA_q) != given(v, SPL_CAMERA_t))
        return given(v, SPL_CAMERA_q) ? missing(SPL_CAMERA_t, SPL_CAMERA_q, err)
                                      : missing(SPL_CAMERA_q, SPL_CAMERA_t, err);
    if (given(v, SPL_CAMERA_q))
        return spl_camera_set_colmap(camera, v[SPL_CAMERA_q].n, v[SPL_CAMERA_t].n, err);
    if ((rc = get_point(v, SPL_CAMERA_eye, defaults->eye, defaults, eye, err)) ||
        (rc = get_point(v, SPL_CAMERA_target, defaults->target, defaults, target, err)))
        return rc;
    return spl_camera_look_at(camera, eye, target, given(v, SPL_CAMERA_up) ? v[SPL_CAMERA_up].n : defaults->up, err);
}

/* Without a default view, a camera that says only where it stands would be drawn from a made-up angle. */
static int check_complete(const struct spl_value *v, struct spl_error *err)
{
    bool free_pose = given(v, SPL_CAMERA_matrix) || given(v, SPL_CAMERA_q) || given(v, SPL_CAMERA_t);
    if (!free_pose && !given(v, SPL_CAMERA_eye))
        return spl_fail_field(err, SPL_E_INPUT, "eye",
                              "a pose is missing: eye and target, matrix, q and t, gltf.matrix, open3d or nerfstudio");
    if (!free_pose && !given(v, SPL_CAMERA_target))
        return missing(SPL_CAMERA_target, SPL_CAMERA_eye, err);
    if (!given(v, SPL_CAMERA_fov) && !given(v, SPL_CAMERA_fx) && !given(v, SPL_CAMERA_model))
        return spl_fail_field(
            err, SPL_E_INPUT, "fov",
            "intrinsics are missing: fov, fx, model and params, gltf.perspective, open3d, ros or nerfstudio");
    return 0;
}

static int resolve(const struct spl_value *values, const struct spl_camera_defaults *defaults,
                   const struct spl_camera_limits *limits, struct spl_camera *camera, struct spl_error *err)
{
    static const struct spl_camera_defaults fallback = {
        .up = {0, 0, 1}, .fov = 60, .near = SPL_CAMERA_NEAR_DEFAULT, .far = INFINITY};
    int rc;
    *camera = (struct spl_camera){0};
    if (!defaults && (rc = check_complete(values, err)))
        return rc;
    if (!defaults)
        defaults = &fallback;
    if ((rc = resolve_size(values, limits, &camera->width, &camera->height, err)) ||
        (rc = resolve_intrinsics(values, defaults, camera, err)) || (rc = resolve_pose(values, defaults, camera, err)))
        return rc;
    camera->near = get(values, SPL_CAMERA_near, defaults->near);
    camera->far = get(values, SPL_CAMERA_far, defaults->far);
    if (given(values, SPL_CAMERA_near) && !given(values, SPL_CAMERA_far) && camera->far <= camera->near)
        camera->far = INFINITY;
    return spl_camera_check(camera, err);
}

/* A value's fault is that of the member that said it. */
int spl_camera_from_values(const struct spl_value values[SPL_CAMERA_PARAMS], const struct spl_camera_defaults *defaults,
                           const struct spl_camera_limits *limits, struct spl_camera *camera, struct spl_error *err)
{
    struct spl_error why = {0};
    int rc = resolve(values, defaults, limits, camera, &why);
    if (!rc)
        return 0;
    for (int i = 0; i < SPL_CAMERA_PARAMS; i++)
        if (values[i].source && !strcmp(why.field, names[i]))
            return spl_fail_field(err, rc, values[i].source, "%s: %s", values[i].source, why.message);
    return spl_fail_field(err, rc, why.field, "%s", why.message);
}
