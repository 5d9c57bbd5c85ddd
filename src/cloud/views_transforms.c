/* Photographs of nerfstudio, instant-ngp and Open3D.
 *
 * Their matrices go through spl_camera_set_matrix(), so that mirrored and scaled poses are refused by name. Any thread;
 * no state. */
#include <dirent.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "cloud/path_reader.h"
#include "cloud/view_list.h"
#include "geom/camera_matrix.h"
#include "geom/size.h"

/* A lens value of the frame, or of all frames. */
static const json_t *get(const json_t *document, const json_t *frame, const char *name)
{
    const json_t *own = json_object_get(frame, name);
    return own ? own : json_object_get(document, name);
}

static int get_real(const json_t *document, const json_t *frame, const char *name, double otherwise, double *out,
                    struct spl_error *err)
{
    const json_t *json = get(document, frame, name);
    if (json && !json_is_number(json))
        return spl_fail_field(err, SPL_E_INPUT, name, "%s must be a number, not %s", name, spl_json_type_name(json));
    *out = json ? json_number_value(json) : otherwise;
    return SPL_OK;
}

/* COLMAP's names are nerfstudio's; instant-ngp says is_fisheye instead. */
static int get_model(const json_t *document, const json_t *frame, struct spl_distortion *distortion,
                     struct spl_error *err)
{
    const json_t *json = get(document, frame, "camera_model");
    const char *name = json_is_string(json) ? json_string_value(json) : "OPENCV";
    static const char *const kinds[][2] = {{"OPENCV_FISHEYE", "fisheye"}, {"OPENCV", "radial"}};
    if (json_is_true(get(document, frame, "is_fisheye")))
        name = kinds[0][0];
    if (json && !json_is_string(json))
        return spl_fail_field(err, SPL_E_INPUT, "camera_model", "camera_model must be text, not %s",
                              spl_json_type_name(json));
    distortion->kind = !strcmp(name, kinds[0][0]) ? SPL_DISTORTION_FISHEYE : SPL_DISTORTION_RADIAL;
    if (distortion->kind == SPL_DISTORTION_FISHEYE || spl_colmap_model_from_name(name) >= 0)
        return SPL_OK;
    return spl_fail_field(err, SPL_E_UNSUPPORTED, "camera_model", "camera_model '%.32s' is not known; known are %s",
                          name, spl_colmap_model_names);
}

/* Its panoramas have no lens. */
static int refuse_panorama(const json_t *document, const json_t *frame, struct spl_error *err)
{
    const char *model = json_string_value(get(document, frame, "camera_model"));
    if (!model || strcmp(model, "EQUIRECTANGULAR"))
        return SPL_OK;
    return spl_fail_field(err, SPL_E_UNSUPPORTED, "camera_model",
                          "camera_model EQUIRECTANGULAR is a panorama, which panoramas.json takes; api/panoramas.md "
                          "says how to make that of this file");
}

/* instant-ngp and Blender write neither w nor h, which are the image's; nor may one that is drawn have none. */
static int get_size(const json_t *document, const json_t *frame, const char *image,
                    const struct spl_photograph_options *photographs, double size[2], struct spl_error *err)
{
    uint32_t width = 0, height = 0;
    bool asks = !get(document, frame, "w") && !get(document, frame, "h") && photographs && photographs->get_size;
    int rc = asks ? photographs->get_size(image, &width, &height, err) : SPL_OK;
    if (rc || (rc = get_real(document, frame, "w", width, &size[0], err)) ||
        (rc = get_real(document, frame, "h", height, &size[1], err)))
        return rc;
    for (int i = 0; i < 2; i++)
        if (!(size[i] >= 1 && size[i] <= spl_view_list_limits.side_px && size[i] == floor(size[i])) ||
            size[0] * size[1] > (double)spl_view_list_limits.pixels)
            return spl_fail_field(err, SPL_E_INPUT, i ? "h" : "w", "an image of w %g and h %g pixels", size[0],
                                  size[1]);
    return SPL_OK;
}

static int get_lens(const json_t *document, const json_t *frame, const char *image,
                    const struct spl_photograph_options *photographs, struct spl_camera *camera,
                    struct spl_distortion *distortion, struct spl_error *err)
{
    static const char *const k[] = {"k1", "k2", "k3", "k4"}, *const p[] = {"p1", "p2"};
    double size[2] = {0}, angle = NAN;
    int rc;
    if ((rc = refuse_panorama(document, frame, err)) ||
        (rc = get_size(document, frame, image, photographs, size, err)) ||
        (rc = get_real(document, frame, "camera_angle_x", NAN, &angle, err)))
        return rc;
    const double w = size[0], h = size[1];
    camera->width = (uint32_t)w;
    camera->height = (uint32_t)h;
    if ((rc = get_real(document, frame, "fl_x", w / 2 / tan(angle / 2), &camera->fx, err)) ||
        (rc = get_real(document, frame, "fl_y", camera->fx, &camera->fy, err)) ||
        (rc = get_real(document, frame, "cx", w / 2, &camera->cx, err)) ||
        (rc = get_real(document, frame, "cy", h / 2, &camera->cy, err)))
        return rc;
    if (isnan(camera->fx))
        return spl_fail_field(err, SPL_E_INPUT, "fl_x", "neither fl_x nor camera_angle_x says the focal length");
    if ((rc = get_model(document, frame, distortion, err)))
        return rc;
    for (int i = 0; !rc && i < 4; i++)
        rc = get_real(document, frame, k[i], 0, &distortion->k[i], err);
    for (int i = 0; !rc && i < 2; i++)
        rc = get_real(document, frame, p[i], 0, &distortion->p[i], err);
    if (!rc && distortion->kind == SPL_DISTORTION_RADIAL && distortion->k[3] != 0)
        rc =
            spl_fail_field(err, SPL_E_UNSUPPORTED, "k4", "k4 %g of a lens that is no OPENCV_FISHEYE", distortion->k[3]);
    return rc ? rc : spl_distortion_init(distortion, err);
}

/* Where a frame's image lies: beside the JSON where it is nowhere. `name` loses what says "here". NULL: no memory. */
static char *find_image(const char *folder, char *name, const struct spl_photograph_options *photographs,
                        struct spl_error *err)
{
    const bool images = photographs && photographs->images;
    while (!strncmp(name, "./", 2))
        memmove(name, name + 2, strlen(name) - 1);
    if (*name == '/' && !images)
        return spl_view_list_print(err, "%s", name);
    char *found = spl_view_list_find(folder, name, photographs, err);
    if (!found || images || spl_view_list_is_file(found))
        return found;
    free(found);
    return spl_view_list_print(err, "%s/%s", folder, name);
}

/* Blender's exporter leaves the extension out, and on Windows slashes are others, unless a file is called so. The
 * caller frees both. */
static int name_image(const char *folder, const char *file, const struct spl_photograph_options *photographs,
                      char **name, char **image, struct spl_error *err)
{
    const char *last = file + strlen(file) - 1;
    while (last > file && !strchr("./\\", *last))
        last--;
    if (!(*name = spl_view_list_print(err, "%s%s", file, *last == '.' && last > file ? "" : ".png")) ||
        !(*image = find_image(folder, *name, photographs, err)))
        return SPL_E_NOMEM;
    if (!strchr(*name, '\\') || spl_view_list_is_file(*image))
        return SPL_OK;
    for (char *c = *name; *c; c++)
        *c = *c == '\\' ? '/' : *c;
    free(*image);
    *image = find_image(folder, *name, photographs, err);
    return *image ? SPL_OK : SPL_E_NOMEM;
}

static int add_found(struct spl_view_list *list, const char *path, const char *name, char **image,
                     const json_t *document, const json_t *frame, const struct spl_photograph_options *photographs,
                     struct spl_error *err)
{
    struct spl_camera camera = {.near = SPL_CAMERA_NEAR_DEFAULT, .far = INFINITY};
    struct spl_distortion distortion = {0};
    struct spl_error why = {0};
    double matrix[16];
    int rc;
    if ((rc = get_lens(document, frame, *image, photographs, &camera, &distortion, err)) ||
        (rc = spl_json_get_matrix(json_object_get(frame, "transform_matrix"), "transform_matrix", 4, 4, SPL_ROW_MAJOR,
                                  matrix, err)))
        return rc;
    if ((rc = spl_camera_set_matrix(&camera, matrix, SPL_AXES_OPENGL, &why)))
        return spl_fail_field(err, rc, "transform_matrix", "transform_matrix: %s", why.message);
    if (!photographs && distortion.kind != SPL_DISTORTION_NONE)
        return spl_fail_field(err, SPL_E_INPUT, "k1", "the lens is distorted; only pinholes are drawn");
    if ((rc = spl_camera_check(&camera, err)) ||
        (rc = spl_view_list_add_image(list, path, name, &camera, &distortion, NULL, photographs, err)))
        return rc;
    list->views[list->count - 1].photograph = *image;
    *image = NULL;
    return SPL_OK;
}

static int add_frame(struct spl_view_list *list, const char *path, const char *folder, const json_t *document,
                     const json_t *frame, const struct spl_photograph_options *photographs, struct spl_error *err)
{
    const char *file = json_string_value(json_object_get(frame, "file_path"));
    char *name = NULL, *image = NULL;
    if (!file || !*file)
        return spl_fail_field(err, SPL_E_INPUT, "file_path", "file_path must be text, not %s",
                              file ? "empty" : spl_json_type_name(json_object_get(frame, "file_path")));
    int rc = name_image(folder, file, photographs, &name, &image, err);
    if (!rc)
        rc = add_found(list, path, name, &image, document, frame, photographs, err);
    free(name);
    free(image);
    return rc;
}

static char *folder_of(const char *path, struct spl_error *err)
{
    const char *slash = strrchr(path, '/');
    return slash ? spl_view_list_print(err, "%.*s", (int)(slash - path) + (slash == path), path)
                 : spl_view_list_print(err, ".");
}

int spl_view_list_read_transforms(struct spl_view_list *list, const char *path, const json_t *document,
                                  const struct spl_photograph_options *photographs, struct spl_error *err)
{
    const json_t *frames = json_object_get(document, "frames");
    if (!json_is_array(frames))
        return spl_fail_field(err, SPL_E_INPUT, "frames", "%s: frames must be an array, not %s", path,
                              spl_json_type_name(frames));
    char *folder = folder_of(path, err);
    int rc = folder ? SPL_OK : SPL_E_NOMEM;
    for (size_t i = 0; !rc && i < json_array_size(frames); i++) {
        struct spl_error why = {0}, place = {0};
        if (!(rc = add_frame(list, path, folder, document, json_array_get(frames, i), photographs, &why)))
            continue;
        spl_fail_field(&place, rc, why.field, "%s: frames[%zu]: %s", path, i, why.message);
        rc = spl_view_list_refuse(photographs, rc, &place, err);
    }
    free(folder);
    return rc;
}

static int is_image(const struct dirent *entry)
{
    const char *dot = strrchr(entry->d_name, '.');
    return entry->d_name[0] != '.' && dot &&
           (!strcasecmp(dot, ".jpg") || !strcasecmp(dot, ".jpeg") || !strcasecmp(dot, ".png"));
}

/* The images that belong to a trajectory: of `images`, else of the folder that has its customary name. */
static int list_images(const char *folder, const struct spl_photograph_options *photographs, char **found,
                       struct dirent ***entries, int *count, struct spl_error *err)
{
    static const char *const places[] = {"/color", "/image", "/rgb", "/images"};
    *count = -1;
    for (int i = 0; i < 4 && *count < 0; i++) {
        free(*found);
        *found = photographs && photographs->images ? spl_view_list_print(err, "%s", photographs->images)
                                                    : spl_view_list_print(err, "%s%s", folder, places[i]);
        if (!*found)
            return SPL_E_NOMEM;
        *count = scandir(*found, entries, is_image, alphasort);
    }
    return *count >= 0
               ? SPL_OK
               : spl_fail(err, SPL_E_NOT_FOUND,
                          "%s: a trajectory names no photographs, and there is no folder of them: name it", *found);
}

static int add_open3d(struct spl_view_list *list, const char *path, const char *folder, const char *image,
                      const json_t *frame, const struct spl_photograph_options *photographs, struct spl_error *err)
{
    struct spl_camera camera = {.near = SPL_CAMERA_NEAR_DEFAULT, .far = INFINITY};
    struct spl_photograph_options here = photographs ? *photographs : (struct spl_photograph_options){0};
    int rc = spl_camera_from_open3d(frame, &camera, err);
    if (!rc)
        rc = spl_camera_check(&camera, err);
    if (!rc && (uint64_t)camera.width * camera.height > spl_view_list_limits.pixels)
        rc = spl_fail_field(err, SPL_E_LIMIT, "width", "%u x %u pixels; the limit is %llu", camera.width, camera.height,
                            (unsigned long long)spl_view_list_limits.pixels);
    here.images = folder;
    return rc ? rc : spl_view_list_add_image(list, path, image, &camera, NULL, folder, &here, err);
}

int spl_view_list_read_open3d(struct spl_view_list *list, const char *path, const json_t *document,
                              const struct spl_photograph_options *photographs, struct spl_error *err)
{
    const json_t *frames = json_object_get(document, "parameters");
    char *folder = folder_of(path, err), *found = NULL;
    struct dirent **entries = NULL;
    char shape[40];
    int count = 0, rc = folder ? list_images(folder, photographs, &found, &entries, &count, err) : SPL_E_NOMEM;
    if (!rc && (!json_is_array(frames) || json_array_size(frames) != (size_t)count))
        rc = spl_fail_field(err, SPL_E_INPUT, "parameters",
                            "%s: parameters is %s; %s holds %d photographs, and cameras must be as many", path,
                            spl_json_show_shape(frames, shape), found, count);
    for (int i = 0; !rc && i < count; i++) {
        struct spl_error why = {0}, place = {0};
        if (!(rc = add_open3d(list, path, found, entries[i]->d_name, json_array_get(frames, (size_t)i), photographs,
                              &why)))
            continue;
        spl_fail_field(&place, rc, why.field, "%s: parameters[%d]: %s", path, i, why.message);
        rc = spl_view_list_refuse(photographs, rc, &place, err);
    }
    for (int i = 0; entries && i < count; i++)
        free(entries[i]);
    free(entries);
    free(found);
    free(folder);
    return rc;
}
