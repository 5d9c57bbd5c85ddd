/* Camera paths: eye, target and field of view go linearly from one view to the other, and the eye turns about the
 * target on the way where the path says so. Pure functions but for the file that is read; any thread. */
#include "measure/path.h"

#include <jansson.h>
#include <math.h>
#include <string.h>

#include "geom/json.h"

static int read_number(const json_t *view, const char *where, const char *key, double *out, struct spl_error *err)
{
    const json_t *value = json_object_get(view, key);
    if (!json_is_number(value))
        return spl_fail_field(err, SPL_E_INPUT, key, "%s needs a number '%s'", where, key);
    *out = json_number_value(value);
    return 0;
}

static int read_vector(const json_t *view, const char *where, const char *key, double out[3], struct spl_error *err)
{
    if (!spl_json_get_numbers(json_object_get(view, key), 3, out))
        return spl_fail_field(err, SPL_E_INPUT, key, "%s needs three numbers '%s'", where, key);
    return 0;
}

static int read_view(const json_t *set, const char *file, const char *name, struct spl_path_view *view, double up[3],
                     struct spl_error *err)
{
    char where[256];
    snprintf(where, sizeof where, "%.200s: view '%s'", file, name);
    const json_t *object = json_object_get(set, name);
    if (!json_is_object(object))
        return spl_fail_field(err, SPL_E_INPUT, name, "%s is missing", where);
    int status = read_vector(object, where, "eye", view->eye, err);
    if (!status)
        status = read_vector(object, where, "target", view->target, err);
    if (!status)
        status = read_vector(object, where, "up", up, err);
    if (!status)
        status = read_number(object, where, "vfov_deg", &view->fov, err);
    if (!status)
        status = read_number(object, where, "near", &view->near, err);
    if (!status)
        status = read_number(object, where, "far", &view->far, err);
    return status;
}

/* The entry called `name`, or the only object there is; borrowed from root. */
static const json_t *find_set(json_t *root, const char *name)
{
    if (name)
        return json_object_get(root, name);
    const json_t *only = NULL;
    const char *key;
    json_t *value;
    json_object_foreach(root, key, value) {
        if (!json_is_object(value))
            continue;
        if (only)
            return NULL;
        only = value;
    }
    return only;
}

int spl_path_load(struct spl_path *path, const char *file, const char *set, struct spl_error *err)
{
    memset(path, 0, sizeof *path);
    json_error_t wrong;
    json_t *root = spl_json_load_file(file, &wrong);
    if (!root && wrong.line < 0)
        return spl_fail(err, SPL_E_INPUT, "%s", wrong.text); /* names the file */
    if (!root)
        return spl_fail(err, SPL_E_INPUT, "%s: line %d: %s", file, wrong.line, wrong.text);
    int status;
    double close_up[3];
    const json_t *entry = find_set(root, set);
    if (!json_is_object(entry)) {
        status = set ? spl_fail(err, SPL_E_INPUT, "%s has no views called '%s'", file, set)
                     : spl_fail(err, SPL_E_INPUT, "%s holds not one set of views; name one with --set", file);
        goto done;
    }
    status = read_view(entry, file, "overview", &path->from, path->up, err);
    if (!status)
        status = read_view(entry, file, "close", &path->to, close_up, err);
done:
    json_decref(root);
    return status;
}

int spl_path_orbit(struct spl_path *path, const struct spl_dataset *dataset, struct spl_error *err)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    struct spl_camera camera = {0};
    int status = spl_dataset_get_default_camera(dataset, 16, 9, &camera, err);
    if (status)
        return status;
    memset(path, 0, sizeof *path);
    memcpy(path->from.eye, info->default_eye, sizeof path->from.eye);
    memcpy(path->from.target, info->default_target, sizeof path->from.target);
    memcpy(path->up, info->default_up, sizeof path->up);
    path->from.fov = info->default_fov;
    path->from.near = camera.near;
    path->from.far = camera.far;
    path->to = path->from;
    for (int i = 0; i < 3; i++)
        path->to.eye[i] = path->to.target[i] + (path->from.eye[i] - path->from.target[i]) / 3;
    path->turn = 2 * M_PI;
    return 0;
}

/* Turns `v` about the axis `up` (any length) by `angle` (Rodrigues). */
static void turn_about(double v[3], const double up[3], double angle)
{
    double length = sqrt(up[0] * up[0] + up[1] * up[1] + up[2] * up[2]);
    double k[3] = {up[0] / length, up[1] / length, up[2] / length};
    double c = cos(angle), s = sin(angle), along = (k[0] * v[0] + k[1] * v[1] + k[2] * v[2]) * (1 - c);
    double cross[3] = {k[1] * v[2] - k[2] * v[1], k[2] * v[0] - k[0] * v[2], k[0] * v[1] - k[1] * v[0]};
    for (int i = 0; i < 3; i++)
        v[i] = v[i] * c + cross[i] * s + k[i] * along;
}

static double mix(double a, double b, double share)
{
    return a + (b - a) * share;
}

int spl_path_get_camera(const struct spl_path *path, double share, uint32_t width, uint32_t height,
                        struct spl_camera *camera, struct spl_error *err)
{
    double eye[3], target[3], arm[3];
    for (int i = 0; i < 3; i++) {
        target[i] = mix(path->from.target[i], path->to.target[i], share);
        arm[i] = mix(path->from.eye[i], path->to.eye[i], share) - target[i];
    }
    if (path->turn != 0)
        turn_about(arm, path->up, path->turn * share);
    for (int i = 0; i < 3; i++)
        eye[i] = target[i] + arm[i];
    memset(camera, 0, sizeof *camera);
    camera->near = mix(path->from.near, path->to.near, share);
    camera->far = path->from.far == path->to.far ? path->to.far : mix(path->from.far, path->to.far, share);
    int status = spl_camera_set_fov(camera, mix(path->from.fov, path->to.fov, share), width, height, err);
    if (!status)
        status = spl_camera_look_at(camera, eye, target, path->up, err);
    return status;
}
