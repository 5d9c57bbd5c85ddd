/* From given parameters to a checked camera: defaults, conflicts, caps, and the pose and intrinsics in any of their
 * forms.
 *
 * Invariant: what comes out has passed spl_camera_check() and lies within the caps, so that no later stage refuses it
 * for a reason that this one could have named. Pure functions, any thread. */
#include "geom/camera_parts.h"

#include <math.h>
#include <string.h>

#include "geom/fit.h"
#include "geom/size.h"

const char *const spl_camera_param_names[SPL_CAMERA_PARAMS] = {
#define PARAM(name, alias, kind, places, help) #name,
#include "geom/camera_params.def"
#undef PARAM
};

/* As the request says it. */
static const char *name_of(const struct spl_value *v, enum spl_camera_param param)
{
    return v[param].source ? v[param].source : spl_camera_param_names[param];
}

int spl_camera_conflict(const struct spl_value *v, enum spl_camera_param param, enum spl_camera_param with,
                        struct spl_error *err)
{
    return spl_fail_field(err, SPL_E_INPUT, spl_camera_param_names[param], "'%s' and '%s' exclude each other",
                          name_of(v, param), name_of(v, with));
}

int spl_camera_missing(enum spl_camera_param param, enum spl_camera_param because, struct spl_error *err)
{
    const char *choices = param == SPL_CAMERA_convention ? "opengl or opencv"
                          : param == SPL_CAMERA_model    ? spl_colmap_model_names
                                                         : "";
    return spl_fail_field(err, SPL_E_INPUT, spl_camera_param_names[param], "'%s' is needed where '%s' is given%s%s",
                          spl_camera_param_names[param], spl_camera_param_names[because], *choices ? ": " : "",
                          choices);
}

/* glTF's aspect ratio is that of the image: sides that are given may differ from it by the rounding to pixels. */
static int check_aspect(double aspect, const char *name, const double size[2], struct spl_error *err)
{
    if (aspect == 0 || fabs(size[1] * aspect - size[0]) < 0.501 || fabs(size[0] / aspect - size[1]) < 0.501)
        return 0;
    if (!strcmp(name, SPL_GLTF_XMAG))
        return spl_fail_field(err, SPL_E_INPUT, name,
                              "%s over ymag, %g, contradicts %.0f x %.0f pixels; leave out width or height", name,
                              aspect, size[0], size[1]);
    return spl_fail_field(err, SPL_E_INPUT, name,
                          "%s %g contradicts %.0f x %.0f pixels; leave it out, or width or height", name, aspect,
                          size[0], size[1]);
}

static int resolve_size(const struct spl_value *v, const struct spl_camera_limits *limits, uint32_t *width,
                        uint32_t *height, struct spl_error *err)
{
    static const enum spl_camera_param sides[] = {SPL_CAMERA_width, SPL_CAMERA_height};
    const enum spl_projection projection =
        given(v, SPL_CAMERA_projection) ? (enum spl_projection)v[SPL_CAMERA_projection].n[0] : SPL_PERSPECTIVE;
    const bool parallel = v[SPL_CAMERA_view_height].n[1] != 0;
    const char *said = parallel ? SPL_GLTF_XMAG : SPL_GLTF_ASPECT;
    double aspect = v[parallel ? SPL_CAMERA_view_height : SPL_CAMERA_fov].n[1],
           size[2] = {get(v, sides[0], 0), get(v, sides[1], 0)};
    double shape[2];
    spl_size_of_projection(projection, shape);
    if (aspect != 0)
        shape[0] = shape[1] * aspect;
    const char *const fields[] = {"width", "height"};
    for (int i = 0; i < 2; i++)
        if (given(v, sides[i]) && !(size[i] >= 1 && size[i] <= limits->side_px))
            return spl_fail_field(err, SPL_E_INPUT, fields[i], "%s %.0f is outside 1 to %u", fields[i], size[i],
                                  limits->side_px);
    spl_size_follow(size, shape);
    int rc = check_aspect(aspect, said, size, err);
    const char *cause = given(v, sides[0])                   ? fields[0]
                        : aspect != 0 && !given(v, sides[1]) ? said
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

static bool is_fisheye(const struct spl_value *v)
{
    return given(v, SPL_CAMERA_projection) && v[SPL_CAMERA_projection].n[0] == SPL_FISHEYE;
}

/* The field of view where nobody says one. */
static double usual_fov(const struct spl_camera_defaults *defaults, const struct spl_camera *camera)
{
    return defaults->fit[0] > 0 ? spl_fit_fov(defaults->fit, camera->width, camera->height) : defaults->fov;
}

/* How high its image is: said, or as high as the pinhole's image is where it looks. */
static int resolve_orthographic(const struct spl_value *v, const struct spl_camera_defaults *defaults,
                                struct spl_camera *camera, double distance, struct spl_error *err)
{
    static const enum spl_camera_param sizes[] = {SPL_CAMERA_view_height, SPL_CAMERA_units_per_pixel, SPL_CAMERA_fx},
                                       others[] = {SPL_CAMERA_fov, SPL_CAMERA_model, SPL_CAMERA_params};
    double height = 2 * tan(usual_fov(defaults, camera) * M_PI / 360) * distance;
    for (int i = 0; i < 3; i++)
        if (given(v, others[i]))
            return spl_camera_conflict(
                v, others[i], given(v, SPL_CAMERA_projection) ? SPL_CAMERA_projection : sizes[!given(v, sizes[0])],
                err);
    for (int i = 1; i < 3; i++)
        for (int j = 0; j < i; j++)
            if (given(v, sizes[i]) && given(v, sizes[j]))
                return spl_camera_conflict(v, sizes[i], sizes[j], err);
    if (given(v, SPL_CAMERA_fy) && !given(v, SPL_CAMERA_fx))
        return spl_camera_missing(SPL_CAMERA_fx, SPL_CAMERA_fy, err);
    if (given(v, SPL_CAMERA_units_per_pixel)) {
        double step = v[SPL_CAMERA_units_per_pixel].n[0];
        if (!(step >= 1e-9 && step <= 1e9))
            return spl_fail_field(err, SPL_E_INPUT, "units_per_pixel", "units_per_pixel %g is not within 1e-9 and 1e9",
                                  step);
        height = step * camera->height;
    } else if (given(v, SPL_CAMERA_view_height)) {
        height = v[SPL_CAMERA_view_height].n[0];
    } else if (given(v, SPL_CAMERA_fx)) {
        height = 1; // which fx replaces
    } else if (!(distance > 0)) {
        return spl_fail_field(err, SPL_E_INPUT, "view_height",
                              "an orthographic view of this pose needs view_height, units_per_pixel or fx");
    }
    int rc = spl_camera_set_orthographic(camera, height, camera->width, camera->height, err);
    if (rc)
        return rc;
    camera->fx = get(v, SPL_CAMERA_fx, camera->fx);
    camera->fy = get(v, SPL_CAMERA_fy, camera->fx);
    camera->cx = get(v, SPL_CAMERA_cx, camera->cx);
    camera->cy = get(v, SPL_CAMERA_cy, camera->cy);
    return 0;
}

/* A form that says a pinhole's lens is no fisheye's, and no plan's, whose numbers mean other things. */
static int check_form(const struct spl_value *v, struct spl_error *err)
{
    if (!given(v, SPL_CAMERA_projection) || v[SPL_CAMERA_projection].source ||
        v[SPL_CAMERA_projection].n[0] == SPL_PERSPECTIVE)
        return 0;
    for (enum spl_camera_param lens = SPL_CAMERA_fov; lens <= SPL_CAMERA_cy; lens++)
        if (given(v, lens) && v[lens].source)
            return spl_camera_conflict(v, SPL_CAMERA_projection, lens, err);
    return 0;
}

static int resolve_intrinsics(const struct spl_value *v, const struct spl_camera_defaults *defaults,
                              struct spl_camera *camera, struct spl_error *err)
{
    static const enum spl_camera_param pinhole[] = {SPL_CAMERA_fx, SPL_CAMERA_fy, SPL_CAMERA_cx, SPL_CAMERA_cy};
    const bool fisheye = is_fisheye(v);
    int rc = fisheye ? spl_camera_set_fisheye(camera, get(v, SPL_CAMERA_fov, 180), camera->width, camera->height, err)
                     : spl_camera_set_fov(camera, get(v, SPL_CAMERA_fov, usual_fov(defaults, camera)), camera->width,
                                          camera->height, err);
    if (rc)
        return rc;
    for (int i = 0; i < 2; i++) {
        enum spl_camera_param size = i ? SPL_CAMERA_units_per_pixel : SPL_CAMERA_view_height;
        if (given(v, size)) /* and another projection is said */
            return spl_camera_conflict(v, size, SPL_CAMERA_projection, err);
    }
    if (given(v, SPL_CAMERA_params) && !given(v, SPL_CAMERA_model))
        return spl_camera_missing(SPL_CAMERA_model, SPL_CAMERA_params, err);
    if (given(v, SPL_CAMERA_model)) {
        if (!given(v, SPL_CAMERA_params))
            return spl_camera_missing(SPL_CAMERA_params, SPL_CAMERA_model, err);
        for (int i = 0; i < 4; i++)
            if (given(v, pinhole[i]))
                return spl_camera_conflict(v, pinhole[i], SPL_CAMERA_params, err);
        if (given(v, SPL_CAMERA_fov))
            return spl_camera_conflict(v, SPL_CAMERA_fov, SPL_CAMERA_params, err);
        struct spl_distortion lens;
        if ((rc = spl_colmap_apply((int)v[SPL_CAMERA_model].n[0], &v[SPL_CAMERA_params], camera, &lens, err)) ||
            (rc = spl_camera_set_lens(camera, &lens, err)))
            return rc;
        if (given(v, SPL_CAMERA_projection) && v[SPL_CAMERA_projection].n[0] != camera->projection)
            return spl_camera_conflict(v, SPL_CAMERA_projection, SPL_CAMERA_model, err);
        return 0;
    }
    if (given(v, SPL_CAMERA_fov) && given(v, SPL_CAMERA_fx))
        return spl_camera_conflict(v, SPL_CAMERA_fov, SPL_CAMERA_fx, err);
    if (given(v, SPL_CAMERA_fy) && !given(v, SPL_CAMERA_fx))
        return spl_camera_missing(SPL_CAMERA_fx, SPL_CAMERA_fy, err);
    camera->fx = get(v, SPL_CAMERA_fx, camera->fx);
    camera->fy = get(v, SPL_CAMERA_fy, camera->fx);
    camera->cx = get(v, SPL_CAMERA_cx, camera->cx);
    camera->cy = get(v, SPL_CAMERA_cy, camera->cy);
    if (fisheye && given(v, SPL_CAMERA_fx))
        camera->lens.reach = M_PI; /* no field of view ends it */
    return 0;
}

/* Without a default view, a camera that says only where it stands would be drawn from a made-up angle. */
static int check_complete(const struct spl_value *v, struct spl_error *err)
{
    if (given(v, SPL_CAMERA_station)) /* which there is none of */
        return 0;
    bool free_pose = given(v, SPL_CAMERA_matrix) || given(v, SPL_CAMERA_q) || given(v, SPL_CAMERA_t);
    if (!free_pose && !given(v, SPL_CAMERA_eye))
        return spl_fail_field(err, SPL_E_INPUT, "eye",
                              "a pose is missing: eye and target, matrix, q and t, gltf.matrix, open3d or nerfstudio");
    if (!free_pose && !given(v, SPL_CAMERA_target))
        return spl_camera_missing(SPL_CAMERA_target, SPL_CAMERA_eye, err);
    bool sized = is_orthographic(v) || given(v, SPL_CAMERA_view_height) || given(v, SPL_CAMERA_units_per_pixel);
    sized = sized || is_around(v) || is_fisheye(v);
    if (!given(v, SPL_CAMERA_fov) && !given(v, SPL_CAMERA_fx) && !given(v, SPL_CAMERA_model) && !sized)
        return spl_fail_field(err, SPL_E_INPUT, "fov",
                              "intrinsics are missing: fov, fx, model and params, view_height, gltf.perspective, "
                              "open3d, ros or nerfstudio");
    return 0;
}

static int resolve(const struct spl_value *values, const struct spl_camera_defaults *defaults,
                   const struct spl_camera_limits *limits, struct spl_camera *camera, struct spl_error *err)
{
    static const struct spl_camera_defaults fallback = {
        .up = {0, 0, 1}, .fov = 60, .near = SPL_CAMERA_NEAR_DEFAULT, .far = INFINITY};
    double distance;
    int rc;
    *camera = (struct spl_camera){0};
    struct spl_value own[SPL_CAMERA_PARAMS];
    if (is_scan(values)) {
        memcpy(own, values, sizeof own);
        if ((rc = spl_camera_take_scan(values, own, err)))
            return rc;
        values = own;
    }
    if (!defaults && (rc = check_complete(values, err)))
        return rc;
    if (!defaults)
        defaults = &fallback;
    if ((rc = check_form(values, err)) || (rc = resolve_size(values, limits, &camera->width, &camera->height, err)) ||
        (is_around(values) ? (rc = spl_camera_resolve_around(values, camera, err))
                           : !is_orthographic(values) && (rc = resolve_intrinsics(values, defaults, camera, err))) ||
        (rc = spl_camera_resolve_pose(values, defaults, camera, &distance, err)) ||
        (is_orthographic(values) && (rc = resolve_orthographic(values, defaults, camera, distance, err))))
        return rc;
    camera->near = get(values, SPL_CAMERA_near, is_orthographic(values) ? defaults->parallel_near : defaults->near);
    camera->far = get(values, SPL_CAMERA_far, defaults->far);
    if (given(values, SPL_CAMERA_near) && !given(values, SPL_CAMERA_far) && camera->far <= camera->near)
        camera->far = INFINITY;
    return spl_camera_check(camera, err);
}

void spl_camera_inherit_projection(struct spl_value values[SPL_CAMERA_PARAMS], double view_height)
{
    struct spl_value *projection = &values[SPL_CAMERA_projection], *height = &values[SPL_CAMERA_view_height];
    bool own = projection->given && projection->n[0] != SPL_ORTHOGRAPHIC;
    for (int i = SPL_CAMERA_model; i <= SPL_CAMERA_elevation; i++) /* what says another lens, or how high */
        own = own || (values[i].given && i != SPL_CAMERA_projection && i != SPL_CAMERA_cx && i != SPL_CAMERA_cy);
    if (own || !(view_height > 0))
        return;
    *projection = (struct spl_value){.given = true, .count = 1, .n = {SPL_ORTHOGRAPHIC}};
    *height = (struct spl_value){.given = true, .count = 1, .n = {view_height}};
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
        if (values[i].source && !strcmp(why.field, spl_camera_param_names[i]))
            return spl_fail_field(err, rc, values[i].source, "%s: %s", values[i].source, why.message);
    return spl_fail_field(err, rc, why.field, "%s", why.message);
}
