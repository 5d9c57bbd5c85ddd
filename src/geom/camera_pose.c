/* The pose among the values: eye and target, in another coordinate system too, a matrix, COLMAP's q and t, or a station
 * of the dataset; what of it stands for what is left out. Pure functions, any thread. */
#include <math.h>
#include <string.h>

#include "geom/camera_parts.h"
#include "geom/size.h"
#include "geom/station.h"

/* What is given in another coordinate system must be a point, and the dataset must know where that lies. */
static int check_places(const struct spl_value *v, const struct spl_camera_defaults *defaults, struct spl_error *err)
{
    if (!given(v, SPL_CAMERA_crs))
        return 0;
    for (enum spl_camera_param other = SPL_CAMERA_matrix; other <= SPL_CAMERA_t; other++)
        if (given(v, other))
            return spl_camera_conflict(v, SPL_CAMERA_crs, other, err);
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
    const char *name = spl_camera_param_names[param];
    return defaults->places->to_world(defaults->places, (uint32_t)v[SPL_CAMERA_crs].n[0], name, v[param].n, out, err);
}

void spl_camera_choose_up(const double usual[3], const double eye[3], const double target[3], double up[3])
{
    double square = 0, product = 0, length = 0;
    memmove(up, usual, 3 * sizeof *up);
    for (int i = 0; i < 3; i++) {
        const double along = target[i] - eye[i];
        square += along * along;
        length += up[i] * up[i];
        product += along * up[i];
    }
    if (product * product < square * length * (1 - 1e-12))
        return;
    const bool lies = fabs(up[1]) > fabs(up[2]); /* +y itself is up */
    memcpy(up, lies ? (double[]){0, 0, -1} : (double[]){0, 1, 0}, 3 * sizeof *up);
}

/* Has what is seen all around stand upright: `up` is up in the image, and what is looked at in its middle column. Where
 * that lies straight up or down, it stays, to be refused. */
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
            return spl_camera_conflict(v, SPL_CAMERA_station, others[i], err);
    if (!dataset)
        return spl_fail_field(err, SPL_E_INPUT, name,
                              "no dataset stands behind this that could say where station %.0f is", number);
    if (!dataset->station_count)
        return spl_fail_field(err, SPL_E_INPUT, name,
                              "station %.0f: no scan of dataset '%s' says where it was taken from", number,
                              dataset->id);
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
int spl_camera_resolve_pose(const struct spl_value *v, const struct spl_camera_defaults *defaults,
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
        return spl_camera_missing(SPL_CAMERA_matrix, SPL_CAMERA_convention, err);
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
                return spl_camera_conflict(v, look_at[i], other, err);
    }
    if (given(v, SPL_CAMERA_matrix)) {
        for (int i = 0; i < 2; i++)
            if (given(v, colmap[i]))
                return spl_camera_conflict(v, colmap[i], SPL_CAMERA_matrix, err);
        if (!given(v, SPL_CAMERA_convention))
            return spl_camera_missing(SPL_CAMERA_convention, SPL_CAMERA_matrix, err);
        return spl_camera_set_matrix(camera, v[SPL_CAMERA_matrix].n, (enum spl_axes)v[SPL_CAMERA_convention].n[0], err);
    }
    if (given(v, SPL_CAMERA_q) != given(v, SPL_CAMERA_t))
        return given(v, SPL_CAMERA_q) ? spl_camera_missing(SPL_CAMERA_t, SPL_CAMERA_q, err)
                                      : spl_camera_missing(SPL_CAMERA_q, SPL_CAMERA_t, err);
    if (given(v, SPL_CAMERA_q))
        return spl_camera_set_colmap(camera, v[SPL_CAMERA_q].n, v[SPL_CAMERA_t].n, err);
    if ((rc = get_point(v, SPL_CAMERA_eye, defaults->eye, defaults, eye, err)) ||
        (rc = get_point(v, SPL_CAMERA_target, defaults->target, defaults, target, err)))
        return rc;
    for (int i = 0; station && i < 3; i++)
        eye[i] = station[4 * i + 3];
    if (!given(v, SPL_CAMERA_up) && is_orthographic(v))
        spl_camera_choose_up(usual_up, eye, target, up);
    else
        memcpy(up, given(v, SPL_CAMERA_up) ? v[SPL_CAMERA_up].n : usual_up, sizeof up);
    if (is_around(v))
        level(eye, target, up);
    *distance = hypot(hypot(target[0] - eye[0], target[1] - eye[1]), target[2] - eye[2]);
    return spl_camera_look_at(camera, eye, target, up, err);
}
