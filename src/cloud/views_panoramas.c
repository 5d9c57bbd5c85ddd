/* Panoramas with poses, which become views as photographs are: an equirectangular image is cut into six faces of 90
 * degrees when they are loaded, a cube is six photographs already.
 *
 *   {"panoramas": [{"name": "station-1", "color": "1.jpg", "position": [x, y, z], "rotation": […9…]}]}
 *
 * "rotation", row-major, turns the panorama's axes (x to the middle of the image, y to the left of it, z up) into the
 * world's; "quaternion" [w, x, y, z] says the same. "elevation" [lowest, highest] in degrees is what the rows of a cut
 * image reach over. "faces" {"front": …, "left", "back", "right", "up", "down"} stands for "color"; where that is
 * null, a station took no picture. "width" and "height" are held against the file; what else an entry has is not looked
 * at. Any thread; no state. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "cloud/view_list.h"
#include "geom/camera_matrix.h"
#include "geom/quaternion.h"
#include "geom/size.h"

enum { probes = 16, face_side_max = 8192, face_side_min = 16 };
static const double off_px = 2, off_share = 0.01; /* that a height may differ from what a width asks for */

struct entry {
    struct spl_view_list *list;
    const char *path, *name; /* of the list of panoramas; of this one */
    const json_t *json;
    uint32_t number;
    const struct spl_photograph_options *photographs;
    double rotation[9], position[3];
};

void spl_inner_photograph_destroy(struct spl_inner_photograph *inner)
{
    if (inner)
        free(inner->path);
    free(inner);
}

int spl_view_list_add_inner(struct spl_view_list *list, const char *path, const char *name,
                            const struct spl_camera *camera, const char *photograph,
                            const struct spl_inner_photograph *inner, struct spl_error *err)
{
    int rc = spl_camera_check(camera, err);
    if (!rc)
        rc = spl_view_list_add(list, path, name, camera, photograph, err);
    if (rc || !inner)
        return rc;
    struct spl_inner_photograph *copy = list->views[list->count - 1].inner = spl_alloc(1, sizeof *copy, err);
    if (!copy)
        return SPL_E_NOMEM;
    *copy = *inner;
    return (copy->path = spl_view_list_print(err, "%s", inner->path)) ? SPL_OK : SPL_E_NOMEM;
}

static bool shows_something(const struct spl_panorama *panorama, const struct spl_camera *face)
{
    double place[2];
    for (int y = 0; y <= probes; y++)
        for (int x = 0; x <= probes; x++)
            if (spl_panorama_place(panorama, face,
                                   (double[2]){(double)face->width * x / probes, (double)face->height * y / probes},
                                   place))
                return true;
    return false;
}

/* A square pinhole of 90 degrees around `position`, by the axes of its face. */
static int make_face(const double rotation[9], const double position[3], const double face[9], uint32_t side,
                     struct spl_camera *camera, struct spl_error *err)
{
    double m[16] = {[15] = 1};
    *camera = (struct spl_camera){.fx = side / 2.0,
                                  .fy = side / 2.0,
                                  .cx = side / 2.0,
                                  .cy = side / 2.0,
                                  .width = side,
                                  .height = side,
                                  .near = SPL_CAMERA_NEAR_DEFAULT,
                                  .far = INFINITY};
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++)
                m[4 * i + j] += rotation[3 * i + k] * face[3 * k + j];
        m[4 * i + 3] = position[i];
    }
    return spl_camera_set_matrix(camera, m, SPL_AXES_OPENCV, err);
}

int spl_view_list_add_faces(struct spl_view_list *list, const struct spl_face_options *o, struct spl_error *err)
{
    struct spl_inner_photograph inner = *o->inner;
    double side = fmin(fmax(round(2 * inner.panorama.across), face_side_min), face_side_max);
    for (unsigned face = 0; face < SPL_PANORAMA_FACES; face++) {
        struct spl_camera camera;
        struct spl_error why = {0};
        const char *part = spl_panorama_face(face, inner.panorama.rotation);
        int rc = make_face(o->rotation, o->position, inner.panorama.rotation, (uint32_t)side, &camera, &why);
        if (rc)
            return spl_fail_field(err, rc, why.field, "%s: %s", o->photograph, why.message);
        if (!shows_something(&inner.panorama, &camera))
            continue;
        char *name = spl_view_list_print(err, "%s-%s", o->name, part);
        rc = name ? spl_view_list_add_inner(list, o->path, name, &camera, o->photographs ? o->photograph : NULL,
                                            o->photographs ? &inner : NULL, err)
                  : SPL_E_NOMEM;
        free(name);
        if (rc)
            return rc;
        list->views[list->count - 1].panorama = o->panorama;
    }
    return SPL_OK;
}

static double determinant(const double m[9])
{
    return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
           m[2] * (m[3] * m[7] - m[4] * m[6]);
}

static int read_pose(struct entry *e, struct spl_error *err)
{
    const json_t *position = json_object_get(e->json, "position"), *rotation = json_object_get(e->json, "rotation"),
                 *quaternion = json_object_get(e->json, "quaternion");
    double q[4], length = 0;
    if (!position)
        return spl_fail_field(err, SPL_E_INPUT, "position", "has no position: [x, y, z] in the scan's coordinates");
    if (!rotation == !quaternion)
        return spl_fail_field(err, SPL_E_INPUT, "rotation",
                              rotation ? "has a rotation and a quaternion: leave one out"
                                       : "has no rotation: 9 numbers by rows, panorama to world, or a quaternion "
                                         "[w, x, y, z]; 1, 0, 0, 0 stands upright and looks along x");
    int rc = spl_json_get_matrix(position, "position", 1, 3, SPL_ROW_MAJOR, e->position, err);
    if (rc)
        return rc;
    if (rotation) {
        if ((rc = spl_json_get_matrix(rotation, "rotation", 3, 3, SPL_ROW_MAJOR, e->rotation, err)))
            return rc;
        double turn = determinant(e->rotation);
        if (turn < 0)
            return spl_fail_field(err, SPL_E_INPUT, "rotation",
                                  "rotation has the determinant %.3g: it mirrors the panorama; it must be 1", turn);
        struct spl_camera face;
        static const double upright[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, origin[3];
        if (!(turn > 0) || make_face(e->rotation, origin, upright, face_side_min, &face, NULL))
            return spl_fail_field(err, SPL_E_INPUT, "rotation",
                                  "rotation, of determinant %.3g, is no rotation (scaled, sheared or flat)", turn);
        return SPL_OK;
    }
    if ((rc = spl_json_get_matrix(quaternion, "quaternion", 1, 4, SPL_ROW_MAJOR, q, err)))
        return rc;
    for (int k = 0; k < 4; k++)
        length += q[k] * q[k];
    if (!(length > 1e-12 && length < 1e12))
        return spl_fail_field(err, SPL_E_INPUT, "quaternion", "quaternion has the length %g, which is no rotation",
                              sqrt(length));
    spl_quaternion_to_matrix(q, e->rotation);
    return SPL_OK;
}

/* A whole number above 0, or 0 where the entry has none. */
static int read_side(const struct entry *e, const char *name, uint32_t *side, struct spl_error *err)
{
    const json_t *json = json_object_get(e->json, name);
    *side = 0;
    if (!json)
        return SPL_OK;
    if (!json_is_integer(json) || json_integer_value(json) < 1 ||
        json_integer_value(json) > spl_view_list_limits.side_px)
        return spl_fail_field(err, SPL_E_INPUT, name, "%s must be a whole number from 1 to %u", name,
                              spl_view_list_limits.side_px);
    *side = (uint32_t)json_integer_value(json);
    return SPL_OK;
}

/* Where an image lies, and its size: the file's where that can be asked, which must be what the entry says. */
static int find_image(const struct entry *e, const char *field, const json_t *name, char **file, uint32_t size[2],
                      struct spl_error *err)
{
    uint32_t said[2];
    int rc;
    if (!json_is_string(name))
        return spl_fail_field(err, SPL_E_INPUT, field, "%s must be the path of an image, not %s", field,
                              spl_json_type_name(name));
    if ((rc = read_side(e, "width", &said[0], err)) || (rc = read_side(e, "height", &said[1], err)))
        return rc;
    if (!(*file = spl_view_list_find_beside(e->path, json_string_value(name), e->photographs, err)))
        return SPL_E_NOMEM;
    size[0] = said[0];
    size[1] = said[1];
    if (e->photographs && e->photographs->get_size) {
        if ((rc = e->photographs->get_size(*file, &size[0], &size[1], err)))
            return rc;
        if ((said[0] && said[0] != size[0]) || (said[1] && said[1] != size[1]))
            return spl_fail_field(err, SPL_E_INPUT, "width", "%s has %u x %u pixels, not %u x %u as it says", *file,
                                  size[0], size[1], said[0] ? said[0] : size[0], said[1] ? said[1] : size[1]);
    }
    if (!size[0] || !size[1])
        return spl_fail_field(err, SPL_E_INPUT, size[0] ? "height" : "width", "says no %s in pixels",
                              size[0] ? "height" : "width");
    if ((uint64_t)size[0] * size[1] > SPL_PANORAMA_PIXELS_MAX)
        return spl_fail_field(err, SPL_E_LIMIT, "width", "%s has %u x %u pixels; the limit is %d: halve it", *file,
                              size[0], size[1], SPL_PANORAMA_PIXELS_MAX);
    return SPL_OK;
}

/* Degrees that the rows reach over: all, or what the entry says. */
static int read_elevation(const struct entry *e, double degrees[2], struct spl_error *err)
{
    const json_t *json = json_object_get(e->json, "elevation");
    degrees[0] = -90;
    degrees[1] = 90;
    int rc = json ? spl_json_get_matrix(json, "elevation", 1, 2, SPL_ROW_MAJOR, degrees, err) : SPL_OK;
    if (!rc && !(degrees[0] >= -90 && degrees[0] < degrees[1] && degrees[1] <= 90))
        rc = spl_fail_field(err, SPL_E_INPUT, "elevation",
                            "elevation is %g to %g; it must be the lowest and the highest of -90 to 90 degrees",
                            degrees[0], degrees[1]);
    return rc;
}

static int refuse_height(const char *file, const uint32_t size[2], const double degrees[2], double height,
                         struct spl_error *err)
{
    if (degrees[1] - degrees[0] < 180)
        return spl_fail_field(err, SPL_E_INPUT, "height",
                              "%s has %u x %u pixels; one so wide whose elevation is %g to %g degrees has %.0f rows, "
                              "as rows are as high as columns are wide",
                              file, size[0], size[1], degrees[0], degrees[1], height);
    if (size[1] > height)
        return spl_fail_field(err, SPL_E_INPUT, "height",
                              "%s has %u x %u pixels; an equirectangular panorama is twice as wide as high, %u x %.0f: "
                              "is it two of them, of a stereo camera, or stretched? Cut or scale it",
                              file, size[0], size[1], size[0], height);
    double span = 180 * size[1] / height;
    return spl_fail_field(
        err, SPL_E_INPUT, "height",
        "%s has %u x %u pixels; a whole equirectangular panorama is twice as wide as high, "
        "%u x %.0f. Of one that is cut above or below say which degrees its rows reach over, "
        "\"elevation\": [lowest, highest]: %.4g degrees in all, [%.4g, %.4g] where both are cut alike",
        file, size[0], size[1], size[0], height, span, -span / 2, span / 2);
}

static int add_sphere(const struct entry *e, const json_t *color, char **file, struct spl_error *err)
{
    uint32_t size[2];
    double degrees[2];
    int rc = read_elevation(e, degrees, err);
    if (rc || (rc = find_image(e, "color", color, file, size, err)))
        return rc;
    double span = degrees[1] - degrees[0], height = size[0] * span / 360, off = fabs(size[1] - height);
    bool whole = span == 180;
    if (height < 1)
        return spl_fail_field(err, SPL_E_INPUT, "width", "%s has %u x %u pixels, too few for a panorama", *file,
                              size[0], size[1]);
    if (off > off_px && (whole || off > off_share * height))
        return refuse_height(*file, size, degrees, height, err);
    struct spl_inner_photograph inner = {.path = *file, .is_panorama = true, .width = size[0], .height = size[1]};
    inner.panorama = (struct spl_panorama){.width = size[0],
                                           .height = size[1],
                                           .across = size[0] / (2 * M_PI),
                                           .down = size[1] / (span * M_PI / 180),
                                           .horizon = size[1] * degrees[1] / span};
    return spl_view_list_add_faces(e->list,
                                   &(struct spl_face_options){.path = e->path,
                                                              .name = e->name,
                                                              .photograph = *file,
                                                              .rotation = e->rotation,
                                                              .position = e->position,
                                                              .inner = &inner,
                                                              .panorama = e->number,
                                                              .photographs = e->photographs},
                                   err);
}

#define FACES "front, left, back, right, up, down"

static bool is_face(const char *key)
{
    double axes[9];
    bool known = false;
    for (unsigned face = 0; face < SPL_PANORAMA_FACES; face++)
        known |= !strcmp(key, spl_panorama_face(face, axes));
    return known;
}

static int add_cube(const struct entry *e, const json_t *faces, char **file, struct spl_error *err)
{
    size_t known = 0;
    int rc = SPL_OK;
    if (!json_is_object(faces))
        return spl_fail_field(err, SPL_E_INPUT, "faces", "faces must be {\"front\": …}, not %s",
                              spl_json_type_name(faces));
    for (unsigned face = 0; !rc && face < SPL_PANORAMA_FACES; face++) {
        struct spl_camera camera;
        uint32_t size[2];
        double axes[9];
        const char *part = spl_panorama_face(face, axes);
        const json_t *image = json_object_get(faces, part);
        if (!image)
            continue;
        known++;
        free(*file);
        *file = NULL;
        if ((rc = find_image(e, part, image, file, size, err)))
            return rc;
        if (size[0] != size[1])
            return spl_fail_field(err, SPL_E_INPUT, part, "%s has %u x %u pixels; a cube's face is square", *file,
                                  size[0], size[1]);
        if ((rc = make_face(e->rotation, e->position, axes, size[0], &camera, err)))
            return rc;
        char *name = spl_view_list_print(err, "%s-%s", e->name, part);
        rc = name ? spl_view_list_add_inner(e->list, e->path, name, &camera, e->photographs ? *file : NULL, NULL, err)
                  : SPL_E_NOMEM;
        free(name);
        if (!rc)
            e->list->views[e->list->count - 1].panorama = e->number;
    }
    if (!rc && known == json_object_size(faces))
        return known ? SPL_OK : spl_fail_field(err, SPL_E_INPUT, "faces", "faces is empty; it takes " FACES);
    const char *key;
    json_t *value;
    json_object_foreach((json_t *)faces, key, value)
    {
        if (!rc && !is_face(key))
            rc = spl_fail_field(err, SPL_E_INPUT, "faces", "faces has '%.60s', which is none of " FACES, key);
    }
    return rc;
}

/* Where a scanner stood that took no picture: a view without a photograph. */
static int add_place(const struct entry *e, struct spl_error *err)
{
    enum { side = 64 };
    struct spl_camera camera;
    double axes[9];
    spl_panorama_face(0, axes);
    int rc = make_face(e->rotation, e->position, axes, side, &camera, err);
    return rc ? rc : spl_view_list_add_inner(e->list, e->path, e->name, &camera, NULL, NULL, err);
}

static int add_entry(struct entry *e, char **file, struct spl_error *err)
{
    const json_t *color = json_object_get(e->json, "color"), *faces = json_object_get(e->json, "faces");
    if (!e->name)
        return spl_fail_field(err, SPL_E_INPUT, "name", "name must be text, not %s",
                              spl_json_type_name(json_object_get(e->json, "name")));
    int rc = read_pose(e, err);
    if (rc)
        return rc;
    if (json_is_null(color) && !faces)
        return add_place(e, err);
    if (!color == !faces)
        return spl_fail_field(
            err, SPL_E_INPUT, "color",
            color ? "has a color and faces: leave one out"
                  : "has no color (the path of an equirectangular image; null: a place alone) and no faces");
    return color ? add_sphere(e, color, file, err) : add_cube(e, faces, file, err);
}

int spl_view_list_read_panoramas(struct spl_view_list *list, const char *path, const json_t *document,
                                 const struct spl_photograph_options *photographs, struct spl_error *err)
{
    const json_t *panoramas = json_object_get(document, "panoramas");
    int rc = SPL_OK;
    if (!json_is_array(panoramas))
        return spl_fail_field(err, SPL_E_INPUT, "panoramas", "%s: panoramas must be an array, not %s", path,
                              spl_json_type_name(panoramas));
    for (size_t i = 0; !rc && i < json_array_size(panoramas); i++) {
        struct spl_error why = {0}, place = {0};
        size_t kept = list->count;
        char *file = NULL;
        struct entry e = {.list = list,
                          .path = path,
                          .json = json_array_get(panoramas, i),
                          .number = (uint32_t)i + 1,
                          .photographs = photographs};
        e.name = json_string_value(json_object_get(e.json, "name"));
        if ((rc = add_entry(&e, &file, &why))) {
            spl_view_list_cut(list, kept);
            spl_fail_field(&place, rc, why.field, "%s: panorama %zu%s%.60s%s: %s", path, i + 1, e.name ? " ('" : "",
                           e.name ? e.name : "", e.name ? "')" : "", why.message);
            rc = spl_view_list_refuse(photographs, rc, &place, err);
        }
        free(file);
    }
    return rc;
}
