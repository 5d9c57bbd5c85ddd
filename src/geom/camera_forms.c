/* Cameras as other programs write them, as one member of a "camera" object: a glTF 2.0 camera with its node's matrix,
 * Open3D's PinholeCameraParameters; a ROS CameraInfo (camera_ros.c), a frame of nerfstudio (camera_nerfstudio.c).
 *
 * A form is turned into values of camera_params.def, each of which keeps the name of the member that said it; what
 * they mean together, and whether they can be, is camera_values.c's business, as for values that are given one by
 * one. A lens is COLMAP's of the same polynomial. What no camera of ours has (skew, a stereo baseline) is refused here,
 * by name. Pure functions, any thread. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "geom/camera_forms.h"
#include "geom/camera_matrix.h"

const json_t *spl_form_get(const json_t *object, const char *path)
{
    const char *dot = strrchr(path, '.');
    return json_object_get(object, dot ? dot + 1 : path);
}

int spl_json_get_number(const json_t *object, const char *path, double *out, struct spl_error *err)
{
    const json_t *json = spl_form_get(object, path);
    if (!json_is_number(json))
        return spl_fail_field(err, SPL_E_INPUT, path, "%s must be a number; it is %s", path, spl_json_type_name(json));
    *out = json_number_value(json);
    return 0;
}

/* Sixteen numbers that the file's standard stores by columns; comes out by rows. */
static int read_columns(const json_t *json, const char *name, double m[16], struct spl_error *err)
{
    int rc = spl_json_get_matrix(json, name, 4, 4, SPL_COLUMN_MAJOR, m, err);
    if (rc || (m[12] == 0 && m[13] == 0 && m[14] == 0 && m[15] == 1))
        return rc;
    return spl_fail_field(err, SPL_E_INPUT, name,
                          "the last row of %s is %g %g %g %g instead of 0 0 0 1; 16 numbers are stored by columns",
                          name, m[12], m[13], m[14], m[15]);
}

/* extrinsic is world to camera: its columns are rows of the inverse's rotation. */
static int set_extrinsic(struct spl_camera *camera, const double e[16], struct spl_error *err)
{
    double inverse[16] = {e[0], e[4], e[8], 0, e[1], e[5], e[9], 0, e[2], e[6], e[10], 0, 0, 0, 0, 1};
    struct spl_error why = {0};
    int rc;
    if ((rc = spl_camera_set_matrix(camera, inverse, SPL_AXES_OPENCV, &why)))
        return spl_fail_field(err, rc, "extrinsic", "extrinsic: %s", why.message);
    const double *r = camera->rotation;
    for (int i = 0; i < 3; i++)
        camera->eye[i] = -(r[i] * e[3] + r[3 + i] * e[7] + r[6 + i] * e[11]);
    return 0;
}

int spl_camera_from_open3d(const json_t *json, struct spl_camera *camera, struct spl_error *err)
{
    const json_t *intrinsic = json_object_get(json, "intrinsic");
    double size[2] = {0}, k[9] = {0}, extrinsic[16] = {0};
    int rc;
    if ((rc = spl_json_get_number(intrinsic, "width", &size[0], err)) ||
        (rc = spl_json_get_number(intrinsic, "height", &size[1], err)) ||
        (rc = spl_json_get_matrix(json_object_get(intrinsic, "intrinsic_matrix"), "intrinsic_matrix", 3, 3,
                                  SPL_COLUMN_MAJOR, k, err)) ||
        (rc = read_columns(json_object_get(json, "extrinsic"), "extrinsic", extrinsic, err)))
        return rc;
    for (int i = 0; i < 2; i++)
        if (!(size[i] >= 1 && size[i] <= 1e6 && size[i] == floor(size[i])))
            return spl_fail_field(err, SPL_E_INPUT, i ? "height" : "width", "an image side of %g pixels", size[i]);
    if (k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1)
        return spl_fail_field(
            err, SPL_E_INPUT, "intrinsic_matrix",
            "intrinsic_matrix must be fx 0 0 0 fy 0 cx cy 1: by columns, without skew, or three rows");
    if ((rc = set_extrinsic(camera, extrinsic, err)))
        return rc;
    camera->width = (uint32_t)size[0];
    camera->height = (uint32_t)size[1];
    camera->fx = k[0];
    camera->fy = k[4];
    camera->cx = k[2] + 0.5; // Open3D's first pixel centre is (0, 0)
    camera->cy = k[5] + 0.5;
    return 0;
}

static int set(struct spl_value *values, enum spl_camera_param param, const char *source, const double *numbers,
               unsigned count, struct spl_error *err)
{
    int rc = spl_value_claim(&values[param], source, err);
    memcpy(values[param].n, numbers, count * sizeof *numbers);
    values[param].count = count;
    values[param].source = source;
    return rc;
}

int spl_form_set_number(struct spl_value *values, enum spl_camera_param param, const char *source, double number,
                        struct spl_error *err)
{
    return set(values, param, source, &number, 1, err);
}

/* fx, fy, cx, cy. */
int spl_form_set_lens(struct spl_value *values, const char *source, const double lens[4], struct spl_error *err)
{
    int rc = 0;
    for (int i = 0; !rc && i < 4; i++)
        rc = spl_form_set_number(values, (enum spl_camera_param)(SPL_CAMERA_fx + i), source, lens[i], err);
    return rc;
}

/* The same with coefficients in COLMAP's order: of OPENCV_FISHEYE four, else of FULL_OPENCV eight. */
int spl_form_set_bent_lens(struct spl_value *values, const char *source, const double lens[4], const double bend[8],
                           bool fisheye, struct spl_error *err)
{
    const unsigned count = fisheye ? 4 : 8;
    double params[12];
    memcpy(params, lens, 4 * sizeof *lens);
    memcpy(params + 4, bend, count * sizeof *bend);
    int rc = spl_form_set_number(values, SPL_CAMERA_model, source,
                                 spl_colmap_model_from_name(fisheye ? "OPENCV_FISHEYE" : "FULL_OPENCV"), err);
    return rc ? rc : set(values, SPL_CAMERA_params, source, params, 4 + count, err);
}

/* A row-major matrix, camera to world. */
int spl_form_set_pose(struct spl_value *values, const char *source, const double matrix[16], enum spl_axes axes,
                      struct spl_error *err)
{
    int rc = set(values, SPL_CAMERA_matrix, source, matrix, 16, err);
    return rc ? rc : spl_form_set_number(values, SPL_CAMERA_convention, source, axes, err);
}

int spl_form_check(const json_t *object, const char *path, const char *const *known, struct spl_error *err)
{
    const char *name;
    json_t *value;
    char list[128] = "", field[64];
    if (!json_is_object(object))
        return spl_fail_field(err, SPL_E_INPUT, path, "%s must be an object, not %s", path, spl_json_type_name(object));
    json_object_foreach((json_t *)object, name, value)
    {
        const char *const *k = known;
        while (*k && strcmp(*k, name))
            k++;
        if (*k)
            continue;
        for (k = known; *k; k++)
            strcat(strcat(list, k == known ? "" : ", "), *k);
        snprintf(field, sizeof field, "%s.%s", path, name);
        return spl_fail_field(err, SPL_E_INPUT, field, "unknown member '%.60s' of %s; known are %s", name, path, list);
    }
    return 0;
}

static int read_perspective(const json_t *json, struct spl_value *values, struct spl_error *err)
{
    static const char *const known[] = {"yfov", "aspectRatio", "znear", "zfar", NULL};
    static const char yfov_name[] = "gltf.perspective.yfov", near_name[] = "gltf.perspective.znear",
                      far_name[] = "gltf.perspective.zfar";
    double yfov = 0, aspect = 0, near = 0, far = INFINITY;
    int rc;
    if ((rc = spl_form_check(json, "gltf.perspective", known, err)) ||
        (rc = spl_json_get_number(json, yfov_name, &yfov, err)) ||
        (rc = spl_json_get_number(json, near_name, &near, err)) ||
        (json_object_get(json, "zfar") && (rc = spl_json_get_number(json, far_name, &far, err))) ||
        (json_object_get(json, "aspectRatio") && (rc = spl_json_get_number(json, SPL_GLTF_ASPECT, &aspect, err))))
        return rc;
    if (json_object_get(json, "aspectRatio") && !(aspect >= 1e-4 && aspect <= 1e4))
        return spl_fail_field(err, SPL_E_INPUT, SPL_GLTF_ASPECT, SPL_GLTF_ASPECT " %g is outside 0.0001 to 10000",
                              aspect);
    const double fov[2] = {yfov * (180 / M_PI), aspect};
    if ((rc = set(values, SPL_CAMERA_fov, yfov_name, fov, 2, err)) ||
        (rc = spl_form_set_number(values, SPL_CAMERA_near, near_name, near, err)))
        return rc;
    return spl_form_set_number(values, SPL_CAMERA_far, far_name, far, err);
}

/* Half extents; an image of another shape than theirs is refused as one of another aspect ratio is. */
static int read_orthographic(const json_t *json, struct spl_value *values, struct spl_error *err)
{
    static const char *const known[] = {"xmag", "ymag", "znear", "zfar", NULL};
    static const char path[] = "gltf.orthographic", ymag_name[] = "gltf.orthographic.ymag",
                      near_name[] = "gltf.orthographic.znear", far_name[] = "gltf.orthographic.zfar";
    double mag[2] = {0}, near = 0, far = 0;
    int rc;
    if ((rc = spl_form_check(json, path, known, err)) ||
        (rc = spl_json_get_number(json, SPL_GLTF_XMAG, &mag[0], err)) ||
        (rc = spl_json_get_number(json, ymag_name, &mag[1], err)) ||
        (rc = spl_json_get_number(json, near_name, &near, err)) ||
        (rc = spl_json_get_number(json, far_name, &far, err)))
        return rc;
    for (int i = 0; i < 2; i++)
        if (!(mag[i] > 0 && isfinite(mag[i])))
            return spl_fail_field(err, SPL_E_INPUT, i ? ymag_name : SPL_GLTF_XMAG,
                                  "%s %g is not above 0: mirrored images are not drawn", i ? ymag_name : SPL_GLTF_XMAG,
                                  mag[i]);
    const double view[2] = {2 * mag[1], mag[0] / mag[1]};
    if (!(view[1] >= 1e-4 && view[1] <= 1e4))
        return spl_fail_field(err, SPL_E_INPUT, SPL_GLTF_XMAG, "xmag over ymag is %g, outside 0.0001 to 10000",
                              view[1]);
    if ((rc = spl_form_set_number(values, SPL_CAMERA_projection, path, SPL_ORTHOGRAPHIC, err)) ||
        (rc = set(values, SPL_CAMERA_view_height, ymag_name, view, 2, err)) ||
        (rc = spl_form_set_number(values, SPL_CAMERA_near, near_name, near, err)))
        return rc;
    return spl_form_set_number(values, SPL_CAMERA_far, far_name, far, err);
}

/* Which lens the object says it has: of the two that the format knows, one alone. */
static int read_lens(const json_t *json, struct spl_value *values, struct spl_error *err)
{
    const json_t *type = json_object_get(json, "type"), *pinhole = json_object_get(json, "perspective"),
                 *parallel = json_object_get(json, "orthographic");
    const char *kind = type ? json_string_value(type) : parallel ? "orthographic" : "perspective";
    int projection = kind ? spl_projection_from_name(kind) : -1;
    if (projection < 0 || projection > SPL_ORTHOGRAPHIC)
        return spl_fail_field(err, SPL_E_INPUT, "gltf.type", "gltf.type must be perspective or orthographic, not %.32s",
                              kind ? kind : spl_json_type_name(type));
    if (projection == SPL_ORTHOGRAPHIC ? pinhole != NULL : parallel != NULL)
        return spl_fail_field(err, SPL_E_INPUT, "gltf.type", "gltf is %s and holds %s", kind,
                              pinhole ? "perspective" : "orthographic");
    if (type && projection == SPL_ORTHOGRAPHIC && !parallel)
        return spl_fail_field(err, SPL_E_INPUT, "gltf.orthographic",
                              "gltf.type is orthographic, and gltf.orthographic missing");
    return parallel ? read_orthographic(parallel, values, err) : pinhole ? read_perspective(pinhole, values, err) : 0;
}

static int read_gltf(const json_t *json, struct spl_value *values, struct spl_error *err)
{
    static const char *const known[] = {"type", "perspective", "matrix", "orthographic", NULL};
    static const char matrix_name[] = "gltf.matrix";
    const json_t *node = json_object_get(json, "matrix");
    bool lens = json_object_get(json, "perspective") || json_object_get(json, "orthographic");
    double m[16];
    int rc = spl_form_check(json, "gltf", known, err);
    if (rc)
        return rc;
    if ((rc = read_lens(json, values, err)))
        return rc;
    if (!lens && !node)
        return spl_fail_field(err, SPL_E_INPUT, "gltf", "gltf holds neither perspective, orthographic nor matrix");
    if (!node)
        return 0;
    if (json_is_array(json_array_get(node, 0)))
        return spl_fail_field(err, SPL_E_INPUT, matrix_name,
                              "%s must be 16 numbers by columns, as a glTF file has it; rows go into \"matrix\"",
                              matrix_name);
    rc = read_columns(node, matrix_name, m, err);
    return rc ? rc : spl_form_set_pose(values, matrix_name, m, SPL_AXES_OPENGL, err);
}

static int read_open3d(const json_t *json, struct spl_value *values, struct spl_error *err)
{
    static const char *const known[] = {"class_name", "version_major", "version_minor", "extrinsic", "intrinsic", NULL};
    static const char *const inner[] = {"width", "height", "intrinsic_matrix", NULL};
    struct spl_camera camera = {0};
    struct spl_error why = {0};
    char field[96];
    int rc;
    if ((rc = spl_form_check(json, "open3d", known, err)) ||
        (rc = spl_form_check(json_object_get(json, "intrinsic"), "open3d.intrinsic", inner, err)))
        return rc;
    if ((rc = spl_camera_from_open3d(json, &camera, &why))) {
        snprintf(field, sizeof field, "open3d.%s%s", strcmp(why.field, "extrinsic") ? "intrinsic." : "", why.field);
        return spl_fail_field(err, rc, field, "open3d: %s", why.message);
    }
    const double *r = camera.rotation, *eye = camera.eye, lens[4] = {camera.fx, camera.fy, camera.cx, camera.cy},
                 pose[16] = {r[0], r[3], r[6], eye[0], r[1], r[4], r[7], eye[1], r[2], r[5], r[8], eye[2], 0, 0, 0, 1};
    if ((rc = spl_form_set_lens(values, "open3d.intrinsic.intrinsic_matrix", lens, err)) ||
        (rc = spl_form_set_number(values, SPL_CAMERA_width, "open3d.intrinsic.width", camera.width, err)) ||
        (rc = spl_form_set_number(values, SPL_CAMERA_height, "open3d.intrinsic.height", camera.height, err)))
        return rc;
    return spl_form_set_pose(values, "open3d.extrinsic", pose, SPL_AXES_OPENCV, err);
}

int spl_camera_form_from_json(struct spl_value values[SPL_CAMERA_PARAMS], enum spl_camera_param form,
                              const json_t *json, struct spl_error *err)
{
    return form == SPL_CAMERA_gltf     ? read_gltf(json, values, err)
           : form == SPL_CAMERA_open3d ? read_open3d(json, values, err)
           : form == SPL_CAMERA_ros    ? spl_form_read_ros(json, values, err)
                                       : spl_form_read_nerfstudio(json, values, err);
}

bool spl_camera_form_has_size(const json_t *camera)
{
    return json_object_get(camera, "open3d") || json_object_get(camera, "ros") || json_object_get(camera, "nerfstudio");
}
