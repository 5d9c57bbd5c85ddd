/* Cameras as other programs write them, as one member of a "camera" object: a glTF 2.0 camera with its node's matrix,
 * Open3D's PinholeCameraParameters, a ROS CameraInfo, a frame of nerfstudio.
 *
 * A form is turned into values of camera_params.def, each of which keeps the name of the member that said it; what
 * they mean together, and whether they can be, is camera_values.c's business, as for values that are given one by
 * one. A lens is COLMAP's of the same polynomial. What no camera of ours has (skew, a stereo baseline) is refused here, by
 * name.
 * Pure functions, any thread. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "geom/camera_json.h"
#include "geom/camera_matrix.h"

static const json_t *get(const json_t *object, const char *path)
{
    const char *dot = strrchr(path, '.');
    return json_object_get(object, dot ? dot + 1 : path);
}

int spl_json_get_number(const json_t *object, const char *path, double *out, struct spl_error *err)
{
    const json_t *json = get(object, path);
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

static int set_number(struct spl_value *values, enum spl_camera_param param, const char *source, double number,
                      struct spl_error *err)
{
    return set(values, param, source, &number, 1, err);
}

/* fx, fy, cx, cy. */
static int set_lens(struct spl_value *values, const char *source, const double lens[4], struct spl_error *err)
{
    int rc = 0;
    for (int i = 0; !rc && i < 4; i++)
        rc = set_number(values, (enum spl_camera_param)(SPL_CAMERA_fx + i), source, lens[i], err);
    return rc;
}

/* The same with coefficients in COLMAP's order: of OPENCV_FISHEYE four, else of FULL_OPENCV eight. */
static int set_bent_lens(struct spl_value *values, const char *source, const double lens[4], const double bend[8],
                         bool fisheye, struct spl_error *err)
{
    const unsigned count = fisheye ? 4 : 8;
    double params[12];
    memcpy(params, lens, 4 * sizeof *lens);
    memcpy(params + 4, bend, count * sizeof *bend);
    int rc = set_number(values, SPL_CAMERA_model, source,
                        spl_colmap_model_from_name(fisheye ? "OPENCV_FISHEYE" : "FULL_OPENCV"), err);
    return rc ? rc : set(values, SPL_CAMERA_params, source, params, 4 + count, err);
}

/* A row-major matrix, camera to world. */
static int set_pose(struct spl_value *values, const char *source, const double matrix[16], enum spl_axes axes,
                    struct spl_error *err)
{
    int rc = set(values, SPL_CAMERA_matrix, source, matrix, 16, err);
    return rc ? rc : set_number(values, SPL_CAMERA_convention, source, axes, err);
}

static int check_object(const json_t *object, const char *path, const char *const *known, struct spl_error *err)
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
    if ((rc = check_object(json, "gltf.perspective", known, err)) ||
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
        (rc = set_number(values, SPL_CAMERA_near, near_name, near, err)))
        return rc;
    return set_number(values, SPL_CAMERA_far, far_name, far, err);
}

/* Half extents; an image of another shape than theirs is refused as one of another aspect ratio is. */
static int read_orthographic(const json_t *json, struct spl_value *values, struct spl_error *err)
{
    static const char *const known[] = {"xmag", "ymag", "znear", "zfar", NULL};
    static const char path[] = "gltf.orthographic", ymag_name[] = "gltf.orthographic.ymag",
                      near_name[] = "gltf.orthographic.znear", far_name[] = "gltf.orthographic.zfar";
    double mag[2] = {0}, near = 0, far = 0;
    int rc;
    if ((rc = check_object(json, path, known, err)) ||
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
        return spl_fail_field(err, SPL_E_INPUT, SPL_GLTF_XMAG, "xmag over ymag is %g, outside 0.0001 to 10000", view[1]);
    if ((rc = set_number(values, SPL_CAMERA_projection, path, SPL_ORTHOGRAPHIC, err)) ||
        (rc = set(values, SPL_CAMERA_view_height, ymag_name, view, 2, err)) ||
        (rc = set_number(values, SPL_CAMERA_near, near_name, near, err)))
        return rc;
    return set_number(values, SPL_CAMERA_far, far_name, far, err);
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
        return spl_fail_field(err, SPL_E_INPUT, "gltf.orthographic", "gltf.type is orthographic, and gltf.orthographic missing");
    return parallel ? read_orthographic(parallel, values, err) : pinhole ? read_perspective(pinhole, values, err) : 0;
}

static int read_gltf(const json_t *json, struct spl_value *values, struct spl_error *err)
{
    static const char *const known[] = {"type", "perspective", "matrix", "orthographic", NULL};
    static const char matrix_name[] = "gltf.matrix";
    const json_t *node = json_object_get(json, "matrix");
    bool lens = json_object_get(json, "perspective") || json_object_get(json, "orthographic");
    double m[16];
    int rc = check_object(json, "gltf", known, err);
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
    return rc ? rc : set_pose(values, matrix_name, m, SPL_AXES_OPENGL, err);
}

static int read_open3d(const json_t *json, struct spl_value *values, struct spl_error *err)
{
    static const char *const known[] = {"class_name", "version_major", "version_minor", "extrinsic", "intrinsic", NULL};
    static const char *const inner[] = {"width", "height", "intrinsic_matrix", NULL};
    struct spl_camera camera = {0};
    struct spl_error why = {0};
    char field[96];
    int rc;
    if ((rc = check_object(json, "open3d", known, err)) ||
        (rc = check_object(json_object_get(json, "intrinsic"), "open3d.intrinsic", inner, err)))
        return rc;
    if ((rc = spl_camera_from_open3d(json, &camera, &why))) {
        snprintf(field, sizeof field, "open3d.%s%s", strcmp(why.field, "extrinsic") ? "intrinsic." : "", why.field);
        return spl_fail_field(err, rc, field, "open3d: %s", why.message);
    }
    const double *r = camera.rotation, *eye = camera.eye, lens[4] = {camera.fx, camera.fy, camera.cx, camera.cy},
                 pose[16] = {r[0], r[3], r[6], eye[0], r[1], r[4], r[7], eye[1], r[2], r[5], r[8], eye[2], 0, 0, 0, 1};
    if ((rc = set_lens(values, "open3d.intrinsic.intrinsic_matrix", lens, err)) ||
        (rc = set_number(values, SPL_CAMERA_width, "open3d.intrinsic.width", camera.width, err)) ||
        (rc = set_number(values, SPL_CAMERA_height, "open3d.intrinsic.height", camera.height, err)))
        return rc;
    return set_pose(values, "open3d.extrinsic", pose, SPL_AXES_OPENCV, err);
}

/* k (3 columns) or p (4), row-major: fx 0 cx [0], 0 fy cy [0], 0 0 1 [0]. */
static int read_ros_matrix(const json_t *json, const char *name, unsigned columns, double lens[4],
                           struct spl_error *err)
{
    double m[12] = {0};
    int rc = spl_json_get_matrix(get(json, name), name, 3, columns, SPL_ROW_MAJOR, m, err);
    for (unsigned i = 0; !rc && i < 3 * columns; i++) {
        unsigned row = i / columns, column = i % columns;
        bool any = row < 2 && (column == row || column == 2);
        if (!any && m[i] != (row == 2 && column == 2))
            return spl_fail_field(err, SPL_E_INPUT, name, "number %u of %s is %g instead of %d: %s", i + 1, name, m[i],
                                  row == 2 && column == 2,
                                  column == 3 ? "a stereo baseline belongs into the pose" : "row-major, without skew");
    }
    for (int i = 0; !rc && i < 2; i++) {
        lens[i] = m[i * (int)columns + i];
        lens[2 + i] = m[i * (int)columns + 2] + 0.5; // ROS's first pixel centre is (0, 0)
    }
    return rc;
}

/* What bends the raw image's rays: how many of its coefficients are there in *count, 0 where none bends. */
static int read_ros_distortion(const json_t *json, double bend[8], unsigned *count, bool *fisheye, struct spl_error *err)
{
    static const struct {
        const char *name;
        size_t least, most; /* coefficients */
    } models[] = {{"plumb_bob", 4, 5}, {"rational_polynomial", 8, 8}, {"equidistant", 4, 4}};
    const json_t *d = json_object_get(json, "d"), *model = json_object_get(json, "distortion_model");
    const char *name = model ? json_string_value(model) : "";
    const size_t given = json_array_size(d);
    int found = -1;
    *count = 0;
    if (d && !json_is_array(d))
        return spl_fail_field(err, SPL_E_INPUT, "ros.d", "ros.d must be an array of numbers, not %s",
                              spl_json_type_name(d));
    for (int i = 0; name && i < 3; i++)
        found = !strcmp(name, models[i].name) ? i : found;
    if (!name || (*name && found < 0))
        return spl_fail_field(err, SPL_E_INPUT, "ros.distortion_model",
                              "ros.distortion_model must be plumb_bob, rational_polynomial or equidistant, not %.32s; "
                              "rectify the image and give p alone",
                              name ? name : spl_json_type_name(model));
    bool bends = found == 2 && (given || json_object_get(json, "k"));
    for (size_t i = 0; i < given; i++) {
        const json_t *number = json_array_get(d, i);
        if (!json_is_number(number))
            return spl_fail_field(err, SPL_E_INPUT, "ros.d", "number %zu of ros.d is %s", i + 1,
                                  spl_json_type_name(number));
        bends = bends || json_number_value(number) != 0;
        if (i < 8)
            bend[i] = json_number_value(number);
    }
    if (!bends)
        return 0;
    if (found < 0)
        return spl_fail_field(err, SPL_E_INPUT, "ros.distortion_model",
                              "ros.d bends, and ros.distortion_model is missing: plumb_bob, rational_polynomial or equidistant");
    if (given < models[found].least || given > models[found].most)
        return spl_fail_field(err, SPL_E_INPUT, "ros.d", "ros.d has %zu numbers; %s has %zu", given, name,
                              models[found].most);
    *count = (unsigned)given;
    *fisheye = found == 2;
    return 0;
}

static int read_ros(const json_t *json, struct spl_value *values, struct spl_error *err)
{
    static const char *const known[] = {"k", "p", "d", "distortion_model", "width", "height", NULL};
    double size[2] = {0}, k[4] = {0}, p[4] = {0}, bend[8] = {0};
    bool raw = json_object_get(json, "k"), rectified = json_object_get(json, "p"), fisheye = false;
    unsigned bends = 0;
    int rc;
    if ((rc = check_object(json, "ros", known, err)) || (rc = read_ros_distortion(json, bend, &bends, &fisheye, err)) ||
        (rc = spl_json_get_number(json, "ros.width", &size[0], err)) ||
        (rc = spl_json_get_number(json, "ros.height", &size[1], err)))
        return rc;
    if (!raw && !rectified)
        return spl_fail_field(err, SPL_E_INPUT, "ros.k", "ros has neither k nor p, so no focal length");
    if ((raw && (rc = read_ros_matrix(json, "ros.k", 3, k, err))) ||
        (rectified && (rc = read_ros_matrix(json, "ros.p", 4, p, err))))
        return rc;
    for (int i = 0; raw && rectified && i < 4; i++)
        if (k[i] != p[i])
            return spl_fail_field(err, SPL_E_INPUT, "ros.p",
                                  "ros.k and ros.p are two cameras; give k for the raw image or p for the rectified");
    for (int i = 0; i < 2; i++) {
        enum spl_camera_param side = i ? SPL_CAMERA_height : SPL_CAMERA_width;
        const char *name = i ? "ros.height" : "ros.width";
        if ((rc = set_number(values, side, name, size[i], err)) ||
            (rc = spl_value_check(&values[side], SPL_KIND_COUNT, name, err)))
            return rc;
    }
    if (!bends)
        return set_lens(values, raw ? "ros.k" : "ros.p", raw ? k : p, err);
    if (rectified)
        return spl_fail_field(err, SPL_E_INPUT, "ros.p",
                              "ros.p is the rectified image, which ros.d does not bend: give k and d, or p alone");
    return set_bent_lens(values, "ros.d", k, bend, fisheye, err);
}

static int read_transform(const json_t *json, struct spl_value *values, struct spl_error *err)
{
    static const char name[] = "nerfstudio.transform_matrix";
    double m[16];
    int rc = spl_json_get_matrix(get(json, name), name, 4, 4, SPL_ROW_MAJOR, m, err);
    return rc ? rc : set_pose(values, name, m, SPL_AXES_OPENGL, err);
}

/* k1 to k4, p1 and p2, in the order of FULL_OPENCV, or of OPENCV_FISHEYE. */
static int read_bend(const json_t *json, bool fisheye, bool pinhole, double bend[8], bool *bends, struct spl_error *err)
{
    static const struct {
        const char *name;
        int radial, fisheye; /* places; -1 = the model has none */
    } names[] = {{"k1", 0, 0}, {"k2", 1, 1}, {"k3", 4, 2}, {"k4", -1, 3}, {"p1", 2, -1}, {"p2", 3, -1}};
    char field[64];
    *bends = fisheye;
    for (int i = 0; i < 6; i++) {
        const int place = fisheye ? names[i].fisheye : names[i].radial;
        double value = 0;
        snprintf(field, sizeof field, "nerfstudio.%s", names[i].name);
        int rc = get(json, field) ? spl_json_get_number(json, field, &value, err) : 0;
        if (rc)
            return rc;
        if (value != 0 && (place < 0 || pinhole))
            return spl_fail_field(err, SPL_E_INPUT, field, "%s must be 0: nerfstudio.camera_model has no such coefficient",
                                  field);
        if (place >= 0)
            bend[place] = value;
        *bends = *bends || value != 0;
    }
    return 0;
}

/* A frame with its own lens, as nerfstudio and instant-ngp know it; what stands beside `frames` is copied into it. */
static int read_nerfstudio(const json_t *json, struct spl_value *values, struct spl_error *err)
{
    static const char *const known[] = {"camera_model", "fl_x", "fl_y", "cx", "cy", "w",  "h",
                                        "k1",           "k2",   "k3",   "k4", "p1", "p2", "transform_matrix",
                                        "file_path",    NULL};
    static const char *const models[] = {"OPENCV", "OPENCV_FISHEYE", "EQUIRECTANGULAR", "PINHOLE", "SIMPLE_PINHOLE"};
    enum { fisheye = 1, around = 2, straight = 3, count = 5 };
    static const struct {
        const char *name;
        enum spl_camera_param param;
        enum spl_value_kind kind;
        bool needed;
    } lens[] = {
        {"nerfstudio.w", SPL_CAMERA_width, SPL_KIND_COUNT, true},
        {"nerfstudio.h", SPL_CAMERA_height, SPL_KIND_COUNT, true},
        {"nerfstudio.fl_x", SPL_CAMERA_fx, SPL_KIND_NUMBER, true},
        {"nerfstudio.fl_y", SPL_CAMERA_fy, SPL_KIND_NUMBER, false},
        {"nerfstudio.cx", SPL_CAMERA_cx, SPL_KIND_NUMBER, false},
        {"nerfstudio.cy", SPL_CAMERA_cy, SPL_KIND_NUMBER, false},
    };
    const json_t *model = json_object_get(json, "camera_model");
    const char *name = model ? json_string_value(model) : models[0];
    double bend[8] = {0};
    bool bends = false;
    int rc = check_object(json, "nerfstudio", known, err), kind = 0;
    if (rc)
        return rc;
    while (name && kind < count && strcmp(name, models[kind]))
        kind++;
    if (!name || kind == count)
        return spl_fail_field(err, SPL_E_INPUT, "nerfstudio.camera_model",
                              "nerfstudio.camera_model must be PINHOLE, SIMPLE_PINHOLE, OPENCV, OPENCV_FISHEYE or "
                              "EQUIRECTANGULAR, not %.32s", name ? name : spl_json_type_name(model));
    if ((rc = read_bend(json, kind == fisheye, kind >= around, bend, &bends, err)))
        return rc;
    struct spl_value own[SPL_CAMERA_PARAMS] = {0};
    for (size_t i = 0; i < (kind == around ? 2 : sizeof lens / sizeof *lens); i++) {
        struct spl_value *to = i < 2 ? values : own;
        double number = 0;
        if (!lens[i].needed && !get(json, lens[i].name))
            continue;
        if ((rc = spl_json_get_number(json, lens[i].name, &number, err)) ||
            (rc = set_number(to, lens[i].param, lens[i].name, number, err)) ||
            (rc = spl_value_check(&to[lens[i].param], lens[i].kind, lens[i].name, err)))
            return rc;
    }
    const double *fx = own[SPL_CAMERA_fx].n, *fy = own[SPL_CAMERA_fy].n;
    const double straight_lens[4] = {
        *fx, own[SPL_CAMERA_fy].given ? *fy : *fx,
        own[SPL_CAMERA_cx].given ? *own[SPL_CAMERA_cx].n : *values[SPL_CAMERA_width].n / 2,
        own[SPL_CAMERA_cy].given ? *own[SPL_CAMERA_cy].n : *values[SPL_CAMERA_height].n / 2};
    if (kind == around)
        rc = set_number(values, SPL_CAMERA_projection, "nerfstudio.camera_model", SPL_EQUIRECTANGULAR, err);
    else if (bends)
        rc = set_bent_lens(values, "nerfstudio.k1", straight_lens, bend, kind == fisheye, err);
    for (int i = SPL_CAMERA_fx; !rc && !bends && i <= SPL_CAMERA_cy; i++)
        if (own[i].given)
            rc = set_number(values, (enum spl_camera_param)i, own[i].source, own[i].n[0], err);
    return rc ? rc : read_transform(json, values, err);
}

int spl_camera_form_from_json(struct spl_value values[SPL_CAMERA_PARAMS], enum spl_camera_param form,
                              const json_t *json, struct spl_error *err)
{
    return form == SPL_CAMERA_gltf     ? read_gltf(json, values, err)
           : form == SPL_CAMERA_open3d ? read_open3d(json, values, err)
           : form == SPL_CAMERA_ros    ? read_ros(json, values, err)
                                       : read_nerfstudio(json, values, err);
}

bool spl_camera_form_has_size(const json_t *camera)
{
    return json_object_get(camera, "open3d") || json_object_get(camera, "ros") || json_object_get(camera, "nerfstudio");
}
