/* Camera paths of nerfstudio and Open3D. Both hold more than is needed; what is not listed here is not looked at.
 *
 * Matrices go through spl_camera_set_matrix(), so that a scaled or mirrored one is refused here as in a view. Any
 * thread; no state. */
#include <math.h>
#include <string.h>

#include "cloud/path_reader.h"
#include "geom/camera_matrix.h"

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

static int read_nerfstudio_frame(struct spl_path_reader *reader, const json_t *frame, bool around,
                                 struct spl_error *err)
{
    double matrix[16], fov = NAN;
    struct spl_camera camera;
    struct spl_error why = {0};
    int rc;
    if ((rc = spl_json_get_matrix(json_object_get(frame, "camera_to_world"), "camera_to_world", 4, 4, SPL_ROW_MAJOR,
                                  matrix, err)) ||
        (!around && (rc = spl_json_get_number(frame, "fov", &fov, err))) ||
        (rc = spl_path_set_fov(reader, fov, &camera, err)) ||
        (around && (rc = spl_camera_set_around(&camera, SPL_EQUIRECTANGULAR, camera.width, camera.height, err))))
        return rc;
    if ((rc = spl_camera_set_matrix(&camera, matrix, SPL_AXES_OPENGL, &why)))
        return spl_fail_field(err, rc, "camera_to_world", "camera_to_world: %s", why.message);
    return spl_path_take(reader, &camera, NAN, err);
}

/* `keyframes` are what its editor shows; camera_path is what nerfstudio itself renders. */
int spl_path_read_nerfstudio(struct spl_path_reader *reader, const json_t *json, struct spl_error *err)
{
    const json_t *list, *type = json_object_get(json, "camera_type");
    const bool around = json_is_string(type) && !strcmp(json_string_value(type), "equirectangular");
    double width = 0, height = 0;
    int rc;
    if (type && !around && (!json_is_string(type) || strcmp(json_string_value(type), "perspective")))
        return spl_fail_field(err, SPL_E_UNSUPPORTED, "camera_type",
                              "camera_type %.32s is not drawn; perspective and equirectangular are",
                              json_is_string(type) ? json_string_value(type) : spl_json_type_name(type));
    if ((rc = get_list(reader, json, "camera_path", &list, err)) ||
        (rc = spl_json_get_number(json, "render_width", &width, err)) ||
        (rc = spl_json_get_number(json, "render_height", &height, err)) ||
        (rc = spl_path_set_size(reader, width, height, err)) || (rc = spl_path_set_fps(reader, json, err)))
        return rc;
    reader->path->closed = json_is_true(json_object_get(json, "is_cycle"));
    for (size_t i = 0; !rc && i < json_array_size(list); i++) {
        struct spl_error why = {0};
        if ((rc = read_nerfstudio_frame(reader, json_array_get(list, i), around, &why)))
            spl_path_fail(reader, i, rc, &why, err);
    }
    return rc;
}

/* The first camera's size is the path's. */
static int read_open3d_frame(struct spl_path_reader *reader, const json_t *frame, struct spl_error *err)
{
    struct spl_camera camera = {0}, lens;
    int rc = spl_camera_from_open3d(frame, &camera, err);
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
