/* Camera paths of nerfstudio and Open3D. Both hold more than is needed; what is not listed here is not looked at.
 *
 * Matrices go through spl_camera_set_matrix(), so that a scaled or mirrored one is refused here as in a view. Any
 * thread; no state. */
#include <math.h>
#include <string.h>

#include "cloud/path_reader.h"

static int get_list(struct spl_path_reader *reader, const json_t *json, const char *name, const json_t **list,
                    struct spl_error *err)
{
    *list = json_object_get(json, name);
    reader->list = name;
    reader->path->whole = true;
    if (json_is_array(*list))
        return 0;
    return spl_fail_field(err, SPL_E_INPUT, name, "%s must be an array; it is %s", name, spl_json_type_name(*list));
}

static int read_nerfstudio_frame(struct spl_path_reader *reader, const json_t *frame, struct spl_error *err)
{
    double matrix[16], fov;
    struct spl_camera camera;
    struct spl_error why = {0};
    int rc;
    if ((rc = spl_path_get_numbers(frame, "camera_to_world", 16, matrix, err)) ||
        (rc = spl_path_get_number(frame, "fov", &fov, err)) || (rc = spl_path_set_fov(reader, fov, &camera, err)))
        return rc;
    if ((rc = spl_camera_set_matrix(&camera, matrix, SPL_AXES_OPENGL, &why)))
        return spl_fail_field(err, rc, "camera_to_world", "camera_to_world: %s", why.message);
    return spl_path_take(reader, &camera, NAN, err);
}

/* `keyframes` are what its editor shows; camera_path is what nerfstudio itself renders. */
int spl_path_read_nerfstudio(struct spl_path_reader *reader, const json_t *json, struct spl_error *err)
{
    const json_t *list, *type = json_object_get(json, "camera_type");
    double width = 0, height = 0;
    int rc;
    if (type && (!json_is_string(type) || strcmp(json_string_value(type), "perspective")))
        return spl_fail_field(err, SPL_E_UNSUPPORTED, "camera_type",
                              "camera_type %.32s is not drawn; only perspective is",
                              json_is_string(type) ? json_string_value(type) : spl_json_type_name(type));
    if ((rc = get_list(reader, json, "camera_path", &list, err)) ||
        (rc = spl_path_get_number(json, "render_width", &width, err)) ||
        (rc = spl_path_get_number(json, "render_height", &height, err)) ||
        (rc = spl_path_set_size(reader, width, height, err)))
        return rc;
    double fps = json_number_value(json_object_get(json, "fps"));
    reader->path->fps = fps > 0 && fps <= 1000 ? fps : 0;
    reader->path->closed = json_is_true(json_object_get(json, "is_cycle"));
    for (size_t i = 0; !rc && i < json_array_size(list); i++) {
        struct spl_error why = {0};
        if ((rc = read_nerfstudio_frame(reader, json_array_get(list, i), &why)))
            spl_path_fail(reader, i, rc, &why, err);
    }
    return rc;
}

/* extrinsic is column-major, world to camera: its columns are rows of the inverse's rotation. */
static int set_extrinsic(struct spl_camera *camera, const double e[16], struct spl_error *err)
{
    double inverse[16] = {e[0], e[1], e[2], 0, e[4], e[5], e[6], 0, e[8], e[9], e[10], 0, 0, 0, 0, 1};
    struct spl_error why = {0};
    if (e[3] != 0 || e[7] != 0 || e[11] != 0 || e[15] != 1)
        return spl_fail_field(err, SPL_E_INPUT, "extrinsic",
                              "the last row of extrinsic is %g %g %g %g instead of 0 0 0 1; it is stored by columns",
                              e[3], e[7], e[11], e[15]);
    int rc = spl_camera_set_matrix(camera, inverse, SPL_AXES_OPENCV, &why);
    if (rc)
        return spl_fail_field(err, rc, "extrinsic", "extrinsic: %s", why.message);
    const double *r = camera->rotation;
    for (int i = 0; i < 3; i++)
        camera->eye[i] = -(r[i] * e[12] + r[3 + i] * e[13] + r[6 + i] * e[14]);
    return 0;
}

int spl_path_get_open3d(const json_t *frame, struct spl_camera *camera, struct spl_error *err)
{
    const json_t *intrinsic = json_object_get(frame, "intrinsic");
    double size[2], k[9], extrinsic[16];
    int rc;
    if ((rc = spl_path_get_number(intrinsic, "width", &size[0], err)) ||
        (rc = spl_path_get_number(intrinsic, "height", &size[1], err)) ||
        (rc = spl_path_get_numbers(intrinsic, "intrinsic_matrix", 9, k, err)) ||
        (rc = spl_path_get_numbers(frame, "extrinsic", 16, extrinsic, err)))
        return rc;
    for (int i = 0; i < 2; i++)
        if (!(size[i] >= 1 && size[i] <= 1e6 && size[i] == floor(size[i])))
            return spl_fail_field(err, SPL_E_INPUT, i ? "height" : "width", "an image side of %g pixels", size[i]);
    if (k[1] != 0 || k[2] != 0 || k[3] != 0 || k[5] != 0 || k[8] != 1)
        return spl_fail_field(err, SPL_E_INPUT, "intrinsic_matrix",
                              "intrinsic_matrix must be fx 0 0 0 fy 0 cx cy 1: by columns, without skew");
    if ((rc = set_extrinsic(camera, extrinsic, err)))
        return rc;
    camera->width = (uint32_t)size[0];
    camera->height = (uint32_t)size[1];
    camera->fx = k[0];
    camera->fy = k[4];
    camera->cx = k[6] + 0.5; // Open3D's first pixel centre is (0, 0)
    camera->cy = k[7] + 0.5;
    return 0;
}

/* The first camera's size is the path's. */
static int read_open3d_frame(struct spl_path_reader *reader, const json_t *frame, struct spl_error *err)
{
    struct spl_camera camera = {0}, lens;
    int rc = spl_path_get_open3d(frame, &camera, err);
    if (rc || (!reader->width && (rc = spl_path_set_size(reader, camera.width, camera.height, err))) ||
        (rc = spl_path_set_fov(reader, NAN, &lens, err)))
        return rc;
    camera.near = lens.near;
    camera.far = lens.far;
    return spl_path_take(reader, &camera, NAN, err);
}

int spl_path_read_open3d(struct spl_path_reader *reader, const json_t *json, struct spl_error *err)
{
    const json_t *list;
    int rc = get_list(reader, json, "parameters", &list, err);
    for (size_t i = 0; !rc && i < json_array_size(list); i++) {
        struct spl_error why = {0};
        if ((rc = read_open3d_frame(reader, json_array_get(list, i), &why)))
            spl_path_fail(reader, i, rc, &why, err);
    }
    return rc;
}
