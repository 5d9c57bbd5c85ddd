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
#include "geom/station.h"

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
static int check_aspect(double aspect, const char *name, const double size[2], struct spl_error *err)
{
    if (aspect == 0 || fabs(size[1] * aspect - size[0]) < 0.501 || fabs(size[0] / aspect - size[1]) < 0.501)
        return 0;
    if (!strcmp(name, SPL_GLTF_XMAG))
        return spl_fail_field(err, SPL_E_INPUT, name, "%s over ymag, %g, contradicts %.0f x %.0f pixels; leave out width or height",
                              name, aspect, size[0], size[1]);
    return spl_fail_field(err, SPL_E_INPUT, name, "%s %g contradicts %.0f x %.0f pixels; leave it out, or width or height",
                          name, aspect, size[0], size[1]);
}

static int resolve_size(const struct spl_value *v, const struct spl_camera_limits *limits, uint32_t *width,
                        uint32_t *height, struct spl_error *err)
{
    static const enum spl_camera_param sides[] = {SPL_CAMERA_width, SPL_CAMERA_height};
    const enum spl_projection projection = given(v, SPL_CAMERA_projection) ? (enum spl_projection)v[SPL_CAMERA_projection].n[0] : SPL_PERSPECTIVE;
    const bool parallel = v[SPL_CAMERA_view_height].n[1] != 0;
    const char *said = parallel ? SPL_GLTF_XMAG : SPL_GLTF_ASPECT;
    double aspect = v[parallel ? SPL_CAMERA_view_height : SPL_CAMERA_fov].n[1], size[2] = {get(v, sides[0], 0), get(v, sides[1], 0)};
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

/* Is the view one of parallel rays? A size of one that is said is enough. */
static bool is_orthographic(const struct spl_value *v)
{
    return given(v, SPL_CAMERA_projection)
               ? v[SPL_CAMERA_projection].n[0] == SPL_ORTHOGRAPHIC
               : given(v, SPL_CAMERA_view_height) || given(v, SPL_CAMERA_units_per_pixel);
}

static bool is_around(const struct spl_value *v)
{
    const double projection = v[SPL_CAMERA_projection].n[0];
    return given(v, SPL_CAMERA_projection) &&
           (projection == SPL_EQUIRECTANGULAR || projection == SPL_CUBE || projection == SPL_RAYS);
}

static bool is_fisheye(const struct spl_value *v)
{
    return given(v, SPL_CAMERA_projection) && v[SPL_CAMERA_projection].n[0] == SPL_FISHEYE;
}

/* A scanner's rays: where the first and the last column and row look, and how many there are. Their counts become the size
 * in `own`, a copy of the values. */
static const enum spl_camera_param scan[] = {SPL_CAMERA_azimuth, SPL_CAMERA_elevation}, scan_sides[] = {SPL_CAMERA_width,
                                                                                                       SPL_CAMERA_height};

static int take_scan(const struct spl_value *v, struct spl_value own[SPL_CAMERA_PARAMS], struct spl_error *err)
{
    for (int i = 0; i < 2; i++) {
        const double *n = v[scan[i]].n, most = i ? 90 : 360;
        if (!given(v, scan[!i]))
            return missing(scan[!i], scan[i], err);
        if (!given(v, SPL_CAMERA_projection) || v[SPL_CAMERA_projection].n[0] != SPL_EQUIRECTANGULAR)
            return spl_fail_field(err, SPL_E_INPUT, names[scan[i]], "'%s' goes with projection equirectangular alone",
                                  names[scan[i]]);
        if (given(v, scan_sides[i]))
            return conflict(v, scan_sides[i], scan[i], err);
        if (!(fabs(n[0]) <= most && fabs(n[1]) <= most && fabs(n[1] - n[0]) <= 360))
            return spl_fail_field(err, SPL_E_INPUT, names[scan[i]], "%s from %g to %g is not within -%g and %g, or more than a turn",
                                  names[scan[i]], n[0], n[1], most, most);
        if (!(n[2] >= 1 && n[2] == floor(n[2])) || (n[2] > 1 && n[0] == n[1]))
            return spl_fail_field(err, SPL_E_INPUT, names[scan[i]], "%g is no number of rays from %g to %g", n[2], n[0], n[1]);
        own[scan_sides[i]] = (struct spl_value){.given = true, .count = 1, .n = {n[2]}};
    }
    return 0;
}

/* From one ray to the next; a full turn's last is one before its first. */
static double scan_step(const double n[3])
{
    const bool turn = fabs(fabs(n[1] - n[0]) - 360) < 1e-9;
    return (n[2] > 1 ? (n[1] - n[0]) / (n[2] - (turn ? 0 : 1)) : 1) * (M_PI / 180);
}

/* Of all directions there are no two ways to draw. */
static int resolve_around(const struct spl_value *v, struct spl_camera *camera, struct spl_error *err)
{
    for (enum spl_camera_param other = SPL_CAMERA_model; other <= SPL_CAMERA_cy; other++)
        if (other != SPL_CAMERA_projection && given(v, other))
            return conflict(v, other, SPL_CAMERA_projection, err);
    if (v[SPL_CAMERA_projection].n[0] == SPL_RAYS) { // their list is the caller's: spl_camera_set_rays()
        camera->projection = SPL_RAYS;
        camera->fx = camera->fy = 1;
        camera->cx = camera->cy = 0.5;
        return SPL_OK;
    }
    int rc = spl_camera_set_around(camera, (enum spl_projection)v[SPL_CAMERA_projection].n[0], camera->width, camera->height,
                                   err);
    if (rc || !given(v, scan[0]))
        return rc;
    const double *azimuth = v[scan[0]].n, *elevation = v[scan[1]].n;
    camera->fx = 1 / scan_step(azimuth);
    camera->fy = -1 / scan_step(elevation);
    camera->cx = 0.5 - azimuth[0] * (M_PI / 180) * camera->fx;
    camera->cy = 0.5 + elevation[0] * (M_PI / 180) * camera->fy;
    return 0;
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
            return conflict(v, others[i], given(v, SPL_CAMERA_projection) ? SPL_CAMERA_projection : sizes[!given(v, sizes[0])],
                            err);
    for (int i = 1; i < 3; i++)
        for (int j = 0; j < i; j++)
            if (given(v, sizes[i]) && given(v, sizes[j]))
                return conflict(v, sizes[i], sizes[j], err);
    if (given(v, SPL_CAMERA_fy) && !given(v, SPL_CAMERA_fx))
        return missing(SPL_CAMERA_fx, SPL_CAMERA_fy, err);
    if (given(v, SPL_CAMERA_units_per_pixel)) {
        double step = v[SPL_CAMERA_units_per_pixel].n[0];
        if (!(step >= 1e-9 && step <= 1e9))
            return spl_fail_field(err, SPL_E_INPUT, "units_per_pixel", "units_per_pixel %g is not within 1e-9 and 1e9", step);
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
    if (!given(v, SPL_CAMERA_projection) || v[SPL_CAMERA_projection].source || v[SPL_CAMERA_projection].n[0] == SPL_PERSPECTIVE)
        return 0;
    for (enum spl_camera_param lens = SPL_CAMERA_fov; lens <= SPL_CAMERA_cy; lens++)
        if (given(v, lens) && v[lens].source)
            return conflict(v, SPL_CAMERA_projection, lens, err);
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
            return conflict(v, size, SPL_CAMERA_projection, err);
    }
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
        struct spl_distortion lens;
        if ((rc = spl_colmap_apply((int)v[SPL_CAMERA_model].n[0], &v[SPL_CAMERA_params], camera, &lens, err)) ||
            (rc = spl_camera_set_lens(camera, &lens, err)))
            return rc;
        if (given(v, SPL_CAMERA_projection) && v[SPL_CAMERA_projection].n[0] != camera->projection)
            return conflict(v, SPL_CAMERA_projection, SPL_CAMERA_model, err);
        return 0;
    }
    if (given(v, SPL_CAMERA_fov) && given(v, SPL_CAMERA_fx))
        return conflict(v, SPL_CAMERA_fov, SPL_CAMERA_fx, err);
    if (given(v, SPL_CAMERA_fy) && !given(v, SPL_CAMERA_fx))
        return missing(SPL_CAMERA_fx, SPL_CAMERA_fy, err);
    camera->fx = get(v, SPL_CAMERA_fx, camera->fx);
    camera->fy = get(v, SPL_CAMERA_fy, camera->fx);
    camera->cx = get(v, SPL_CAMERA_cx, camera->cx);
    camera->cy = get(v, SPL_CAMERA_cy, camera->cy);
    if (fisheye && given(v, SPL_CAMERA_fx))
        camera->lens.reach = M_PI; /* no field of view ends it */
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

/* What is up where nobody says so: of a plan, which looks along the default, +y, or +z where that is along it. */
static void get_up(const struct spl_value *v, const double usual[3], const double eye[3], const double target[3],
                   double up[3])
{
    const double *given_up = given(v, SPL_CAMERA_up) ? v[SPL_CAMERA_up].n : usual;
    double along[3], square = 0, product = 0, length = 0;
    memcpy(up, given_up, 3 * sizeof *up);
    for (int i = 0; i < 3; i++) {
        along[i] = target[i] - eye[i];
        square += along[i] * along[i];
        length += up[i] * up[i];
        product += along[i] * up[i];
    }
    if (given(v, SPL_CAMERA_up) || !is_orthographic(v) || product * product < square * length * (1 - 1e-12))
        return;
    const bool lies = fabs(up[1]) > fabs(up[2]); /* +y itself is up */
    memcpy(up, lies ? (double[]){0, 0, -1} : (double[]){0, 1, 0}, 3 * sizeof *up);
}

/* Has what is seen all around stand upright: `up` is up in the image, and what is looked at in its middle column. Where that
 * lies straight up or down, it stays, to be refused. */
static void level(const double eye[3], double target[3], const double given_up[3])
{
    double along = 0, square = 0, moved[3], left = 0, up[3];
    const double largest = fmax(fmax(fabs(given_up[0]), fabs(given_up[1])), fabs(given_up[2]));
    for (int i = 0; i < 3; i++)
        up[i] = largest > 0 ? given_up[i] / largest : 0; /* its length says nothing, and its square may be none */
    for (int i = 0; i < 3; i++) {
        along += (target[i] - eye[i]) * up[i];
        square += up[i] * up[i];
    }
    for (int i = 0; i < 3; i++) {
        moved[i] = target[i] - (square > 0 ? along / square * up[i] : 0);
        left += (moved[i] - eye[i]) * (moved[i] - eye[i]);
    }
    if (left * square > along * along * 1e-12)
        memcpy(target, moved, sizeof moved);
}

/* The pose of the station that is named: it says where the eye is, and where it looks unless `target` does. */
static int find_station(const struct spl_value *v, const struct spl_camera_defaults *defaults, const double **pose,
                        struct spl_error *err)
{
    static const enum spl_camera_param others[] = {SPL_CAMERA_eye, SPL_CAMERA_matrix, SPL_CAMERA_q, SPL_CAMERA_t};
    static const char *const name = "station";
    const struct spl_dataset_info *dataset = defaults->dataset;
    const double number = v[SPL_CAMERA_station].n[0];
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        if (given(v, others[i]))
            return conflict(v, SPL_CAMERA_station, others[i], err);
    if (!dataset)
        return spl_fail_field(err, SPL_E_INPUT, name, "no dataset stands behind this that could say where station %.0f is",
                              number);
    if (!dataset->station_count)
        return spl_fail_field(err, SPL_E_INPUT, name, "station %.0f: no scan of dataset '%s' says where it was taken from",
                              number, dataset->id);
    if (number >= dataset->station_count)
        return spl_fail_field(err, SPL_E_INPUT, name, "station %.0f is none of dataset '%s', which has 0 to %u", number,
                              dataset->id, dataset->station_count - 1);
    *pose = dataset->stations[(uint32_t)number];
    for (int i = 0; i < 3; i++)
        if (!(fabs((*pose)[4 * i + 3]) <= SPL_CAMERA_COORDINATE_MAX))
            return spl_fail_field(err, SPL_E_INPUT, name, "station %.0f is at %g, beyond where a camera can be", number,
                                  (*pose)[4 * i + 3]);
    return 0;
}

/* From there ahead and level. Directions are found around the origin, where coordinates are no coarser than they. */
static int look_ahead(struct spl_camera *camera, const double pose[16], const double about[3], struct spl_error *err)
{
    double forward[3] = {1, 0, 0}, up[3] = {0};
    if (about[0] != 0 || about[1] != 0 || about[2] != 0) // else it is refused below
        spl_station_look(pose, about, forward, up);
    int rc = spl_camera_look_at(camera, (double[3]){0}, forward, up, err);
    for (int i = 0; i < 3; i++)
        camera->eye[i] = pose[4 * i + 3];
    return rc;
}

/* *distance: from the eye to what it looks at, 0 where the pose does not say. */
static int resolve_pose(const struct spl_value *v, const struct spl_camera_defaults *defaults,
                        struct spl_camera *camera, double *distance, struct spl_error *err)
{
    static const enum spl_camera_param look_at[] = {SPL_CAMERA_eye, SPL_CAMERA_target, SPL_CAMERA_up},
                                       colmap[] = {SPL_CAMERA_q, SPL_CAMERA_t};
    const double *station = NULL, *usual_up = defaults->up;
    double eye[3], target[3], up[3];
    int rc = check_places(v, defaults, err);
    *distance = 0;
    if (rc)
        return rc;
    if (given(v, SPL_CAMERA_convention) && !given(v, SPL_CAMERA_matrix))
        return missing(SPL_CAMERA_matrix, SPL_CAMERA_convention, err);
    if (given(v, SPL_CAMERA_station)) { /* a view by name does not say what is up there */
        if ((rc = find_station(v, defaults, &station, err)))
            return rc;
        usual_up = defaults->dataset->default_up;
        if (!given(v, SPL_CAMERA_target))
            return look_ahead(camera, station, given(v, SPL_CAMERA_up) ? v[SPL_CAMERA_up].n : usual_up, err);
    }
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
    for (int i = 0; station && i < 3; i++)
        eye[i] = station[4 * i + 3];
    get_up(v, usual_up, eye, target, up);
    if (is_around(v))
        level(eye, target, up);
    *distance = hypot(hypot(target[0] - eye[0], target[1] - eye[1]), target[2] - eye[2]);
    return spl_camera_look_at(camera, eye, target, up, err);
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
        return missing(SPL_CAMERA_target, SPL_CAMERA_eye, err);
    bool sized = is_orthographic(v) || given(v, SPL_CAMERA_view_height) || given(v, SPL_CAMERA_units_per_pixel);
    sized = sized || is_around(v) || is_fisheye(v);
    if (!given(v, SPL_CAMERA_fov) && !given(v, SPL_CAMERA_fx) && !given(v, SPL_CAMERA_model) && !sized)
        return spl_fail_field(
            err, SPL_E_INPUT, "fov",
            "intrinsics are missing: fov, fx, model and params, view_height, gltf.perspective, open3d, ros or nerfstudio");
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
    if (given(values, scan[0]) || given(values, scan[1])) {
        memcpy(own, values, sizeof own);
        if ((rc = take_scan(values, own, err)))
            return rc;
        values = own;
    }
    if (!defaults && (rc = check_complete(values, err)))
        return rc;
    if (!defaults)
        defaults = &fallback;
    if ((rc = check_form(values, err)) || (rc = resolve_size(values, limits, &camera->width, &camera->height, err)) ||
        (is_around(values) ? (rc = resolve_around(values, camera, err))
                           : !is_orthographic(values) && (rc = resolve_intrinsics(values, defaults, camera, err))) ||
        (rc = resolve_pose(values, defaults, camera, &distance, err)) ||
        (is_orthographic(values) && (rc = resolve_orthographic(values, defaults, camera, distance, err))))
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
