/* Which reader a path belongs to, and what all of them share: the size of the images, the check of each camera, the
 * names in messages.
 *
 * Invariant: every camera that is taken has the reader's size and has passed spl_camera_check(). Any thread; no state.
 */
#include "cloud/path.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include "cloud/path_reader.h"
#include "geom/camera_json.h"
#include "geom/json.h"
#include "geom/size.h"

static const double fov_default = 60;

int spl_path_set_size(struct spl_path_reader *reader, double width, double height, struct spl_error *err)
{
    const struct spl_camera_limits *limits = reader->options->limits;
    const uint32_t wanted[2] = {reader->options->width, reader->options->height};
    const double own[2] = {width, height};
    const char *const fields[] = {"width", "height"};
    double size[2] = {wanted[0], wanted[1]};
    for (int i = 0; i < 2 && !(wanted[0] && wanted[1]); i++)
        if (!(own[i] >= 1 && own[i] <= limits->side_px && own[i] == floor(own[i])))
            return spl_fail_field(err, SPL_E_INPUT, fields[i], "%s %g of the path is no whole number of 1 to %u pixels",
                                  fields[i], own[i], limits->side_px);
    spl_size_follow(size, own);
    for (int i = 0; i < 2; i++)
        if (!(size[i] <= limits->side_px))
            return spl_fail_field(err, SPL_E_INPUT, wanted[i] ? fields[i] : fields[!i],
                                  "the path's images of %g x %g become %.0f x %.0f; a side has at most %u pixels",
                                  width, height, size[0], size[1], limits->side_px);
    if (size[0] * size[1] > (double)limits->pixels)
        return spl_fail_field(err, SPL_E_LIMIT, !wanted[0] && wanted[1] ? "height" : "width",
                              "images of %.0f x %.0f are %.0f pixels; the limit is %llu", size[0], size[1],
                              size[0] * size[1], (unsigned long long)limits->pixels);
    reader->width = (uint32_t)size[0];
    reader->height = (uint32_t)size[1];
    return 0;
}

int spl_path_set_fps(struct spl_path_reader *reader, const json_t *json, struct spl_error *err)
{
    const json_t *value = json_object_get(json, "fps");
    const double fps = json_number_value(value);
    if (value && !json_is_number(value))
        return spl_fail_field(err, SPL_E_INPUT, "fps", "fps must be a number, not %s", spl_json_type_name(value));
    if (value && !spl_camera_path_takes_fps(fps))
        return spl_fail_field(err, SPL_E_INPUT, "fps", "fps must be %g to %g, not %g", SPL_CAMERA_PATH_FPS_MIN,
                              SPL_CAMERA_PATH_FPS_MAX, fps);
    reader->path->fps = fps;
    return SPL_OK;
}

int spl_path_set_fov(const struct spl_path_reader *reader, double fov, struct spl_camera *camera, struct spl_error *err)
{
    const struct spl_camera_defaults *defaults = reader->options->defaults;
    *camera = (struct spl_camera){.near = defaults ? defaults->near : SPL_CAMERA_NEAR_DEFAULT,
                                  .far = defaults ? defaults->far : INFINITY};
    if (isnan(fov))
        fov = defaults ? defaults->fov : fov_default;
    return spl_camera_set_fov(camera, fov, reader->width, reader->height, err);
}

int spl_path_take(struct spl_path_reader *reader, struct spl_camera *camera, double time, struct spl_error *err)
{
    spl_camera_resize(camera, reader->width, reader->height);
    int rc = spl_camera_check(camera, err);
    return rc ? rc : spl_camera_path_add(reader->path, camera, time, err);
}

int spl_path_fail(const struct spl_path_reader *reader, size_t index, int rc, const struct spl_error *why,
                  struct spl_error *err)
{
    char field[sizeof why->field];
    if ((size_t)snprintf(field, sizeof field, "%s[%zu]%s%s", reader->list, index, why->field[0] ? "." : "",
                         why->field) >= sizeof field)
        snprintf(field, sizeof field, "%s[%zu]", reader->list, index);
    return spl_fail_field(err, rc, field, "%s[%zu]: %s", reader->list, index, why->message);
}

static int read_value(const struct spl_path_value *value, const json_t *json, double *out, struct spl_error *err)
{
    *out = json_is_number(json) ? json_number_value(json) : NAN;
    if (!json || (*out >= value->least && *out <= value->most))
        return 0;
    if (!json_is_number(json))
        return spl_fail_field(err, SPL_E_INPUT, value->name, "%s must be a number, not %s", value->name,
                              spl_json_type_name(json));
    return spl_fail_field(err, SPL_E_INPUT, value->name, "%s %g is not within %g and %g", value->name, *out,
                          value->least, value->most);
}

static int read_own_key(struct spl_path_reader *reader, json_t *view, json_t *crs, struct spl_error *err)
{
    static const char *const sides[] = {"width", "height"};
    const struct spl_path_value *known = reader->options->values;
    const char *others[3 + SPL_PATH_VALUES] = {"camera", "time"};
    double values[SPL_PATH_VALUES];
    json_t *time = json_object_get(view, "time"), *camera = json_object_get(view, "camera");
    struct spl_camera out;
    for (int i = 0; known && i < SPL_PATH_VALUES; i++) {
        others[2 + i] = known[i].name;
        int wrong = read_value(&known[i], json_object_get(view, known[i].name), &values[i], err);
        if (wrong)
            return wrong;
    }
    if (time && !json_is_number(time))
        return spl_fail_field(err, SPL_E_INPUT, "time", "time must be a number, not %s", spl_json_type_name(time));
    if (crs && !json_object_get(view, "crs") && !json_object_get(camera, "crs"))
        json_object_set(view, "crs", crs);
    bool sized = spl_camera_form_has_size(camera);
    for (int i = 0; i < 2; i++)
        sized = sized || json_object_get(view, sides[i]) || json_object_get(camera, sides[i]);
    sized = sized || json_object_get(camera, "azimuth"); // a scan's size is its rays
    for (int i = 0; i < 2 && !sized; i++) // a field of view needs the shape of the outcome
        json_object_set_new(view, sides[i], json_integer(i ? reader->height : reader->width));
    int rc = spl_camera_from_json(view, others, reader->options->defaults, reader->options->limits, &out, err);
    rc = rc ? rc : spl_path_take(reader, &out, time ? json_number_value(time) : NAN, err);
    return rc || !known ? rc : spl_camera_path_set_values(reader->path, values, err);
}

static int read_own(struct spl_path_reader *reader, const json_t *json, struct spl_error *err)
{
    bool closed = false;
    const char *name;
    json_t *value, *list = json_object_get(json, "keyframes");
    reader->path->whole = !list;
    reader->list = list ? "keyframes" : "frames";
    json_object_foreach((json_t *)json, name, value)
    {
        bool flag = !strcmp(name, "closed"), fps = !strcmp(name, "fps"), crs = !strcmp(name, "crs");
        if (!flag && !fps && !crs && strcmp(name, reader->list))
            return spl_fail_field(err, SPL_E_INPUT, name,
                                  "unknown field '%.60s' of a path; known are %s, closed, crs, fps", name,
                                  reader->list);
        if (flag && !spl_json_get_flag(value, &closed))
            return spl_fail_field(err, SPL_E_INPUT, name, "closed must be " SPL_JSON_FLAG_FORMS ", not %s",
                                  spl_json_flag_fault(value));
    }
    list = json_object_get(json, reader->list);
    if (!json_is_array(list))
        return spl_fail_field(err, SPL_E_INPUT, reader->list, "%s must be an array, not %s", reader->list,
                              spl_json_type_name(list));
    int rc = spl_path_set_fps(reader, json, err);
    if (rc)
        return rc;
    reader->path->closed = closed;
    const json_t *camera = json_object_get(json_array_get(list, 0), "camera");
    const char *named = json_string_value(json_object_get(camera, "projection"));
    const int projection = named ? spl_projection_from_name(named) : -1;
    double shape[2];
    spl_size_of_projection(projection < 0 ? SPL_PERSPECTIVE : (enum spl_projection)projection, shape);
    rc = spl_path_set_size(reader, shape[0], shape[1], err);
    for (size_t i = 0; !rc && i < json_array_size(list); i++) {
        struct spl_error why = {0};
        if ((rc = read_own_key(reader, json_array_get(list, i), json_object_get(json, "crs"), &why))) {
            spl_camera_locate(json_array_get(list, i), &why);
            spl_path_fail(reader, i, rc, &why, err);
        }
    }
    return rc;
}

/* `file` (may be NULL) is what was read, for the message. */
static int finish(struct spl_path_reader *reader, const char *file, int rc, struct spl_error *err)
{
    if (!rc && !reader->path->count)
        rc = spl_fail_field(err, SPL_E_INPUT, reader->list, "%s%sthe path holds no camera", file ? file : "",
                            file ? ": " : "");
    if (rc)
        spl_camera_path_finish(reader->path);
    return rc;
}

static int read_json(struct spl_path_reader *reader, json_t *json, struct spl_error *err)
{
    if (json_object_get(json, "camera_path") || json_object_get(json, "camera_type"))
        return spl_path_read_nerfstudio(reader, json, err);
    if (json_object_get(json, "parameters") || json_object_get(json, "class_name"))
        return spl_path_read_open3d(reader, json, err);
    if (json_object_get(json, "images_txt") || json_object_get(json, "cameras_txt"))
        return spl_path_read_colmap(reader, json, err);
    if (json_object_get(json, "keyframes") || json_object_get(json, "frames"))
        return read_own(reader, json, err);
    if (json_is_object(json))
        return spl_fail_field(err, SPL_E_INPUT, "path",
                              "no path that is known: it has none of camera_path (nerfstudio), parameters (Open3D), "
                              "images_txt (COLMAP), keyframes, frames");
    if (!json_is_string(json))
        return spl_fail_field(err, SPL_E_INPUT, "path", "a path is an object, or text for TUM; it is %s",
                              spl_json_type_name(json));
    struct spl_source source;
    int rc = spl_source_open_bytes(&source, "path", json_string_value(json), json_string_length(json), err);
    if (rc)
        return rc;
    rc = spl_path_read_tum(reader, &source, err);
    spl_source_close(&source);
    return rc;
}

int spl_camera_path_from_json(json_t *json, const struct spl_path_options *options, struct spl_camera_path *path,
                              struct spl_error *err)
{
    struct spl_path_reader reader = {.options = options, .path = path, .list = "path"};
    return finish(&reader, NULL, read_json(&reader, json, err), err);
}

static int load_file(struct spl_path_reader *reader, const char *file, struct spl_error *err)
{
    struct spl_source source;
    const uint8_t *bytes;
    size_t available;
    int rc = spl_source_open(&source, file, err);
    if (rc)
        return rc;
    rc = spl_source_peek(&source, 16, &bytes, &available, err);
    if (!rc && spl_json_is_marked(bytes, available)) {
        spl_source_take(&source, SPL_JSON_MARK);
        bytes += SPL_JSON_MARK;
        available -= SPL_JSON_MARK;
    }
    size_t blank = 0;
    while (!rc && blank < available && strchr(" \t\r\n", bytes[blank]) && bytes[blank])
        blank++;
    if (!rc && (blank == available || bytes[blank] != '{')) {
        rc = spl_path_read_tum(reader, &source, err);
    } else if (!rc) {
        json_error_t where;
        json_t *json = spl_json_load_file(file, &where);
        struct spl_error why = {0};
        if (!json)
            rc = spl_fail(err, SPL_E_INPUT, "%s: broken JSON at line %d, column %d: %s", file, where.line, where.column,
                          spl_json_fault(&where));
        else if ((rc = read_json(reader, json, &why)))
            spl_fail_field(err, rc, why.field, "%s: %s", file, why.message);
        json_decref(json);
    }
    spl_source_close(&source);
    return rc;
}

int spl_camera_path_load(const char *file, const struct spl_path_options *options, struct spl_camera_path *path,
                         struct spl_error *err)
{
    struct spl_path_reader reader = {.options = options, .path = path, .list = "path"};
    struct stat status;
    int rc;
    if (!stat(file, &status) && S_ISDIR(status.st_mode)) {
        struct spl_view_list views;
        if (!(rc = spl_view_list_load(&views, file, err)))
            rc = spl_path_read_views(&reader, &views, err);
        spl_view_list_finish(rc ? NULL : &views);
    } else {
        rc = load_file(&reader, file, err);
    }
    return finish(&reader, file, rc, err);
}
