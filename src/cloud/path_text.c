/* Camera paths as text: TUM trajectories, and COLMAP's models through the readers of view lists.
 *
 * Any thread; no state. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/decimal.h"
#include "cloud/path_reader.h"
#include "geom/size.h"
#include "cloud/view_list.h"
#include "geom/quaternion.h"

static const double fps_least = 1, fps_most = 1000;

/* The eight numbers of a line; anything else is refused with the column's name. */
static int parse_line(const struct spl_source *source, const char *line, size_t length, double n[8],
                      struct spl_error *err)
{
    static const char *const columns[] = {"timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw"};
    static const char blanks[] = " \t,";
    const char *at = line, *end = line + length;
    int count = 0;
    for (size_t word;; count++, at += word) {
        while (at < end && *at && strchr(blanks, *at))
            at++;
        if (at == end)
            break;
        for (word = 0; at + word < end && !(at[word] && strchr(blanks, at[word])); word++)
            ;
        if (count >= 8)
            continue;
        char copy[64];
        snprintf(copy, sizeof copy, "%.*s", (int)(word < 63 ? word : 63), at);
        const char *stop = word < sizeof copy ? spl_decimal_parse(copy, &n[count]) : NULL;
        if (!stop || *stop)
            return spl_source_fail_line(source, source->line, columns[count], err, "'%.32s' is no number%s", copy,
                                        count ? "" : "; text, so it was read as a TUM trajectory; JSON begins with {");
    }
    if (count == 8)
        return 0;
    return spl_source_fail_line(source, source->line, count < 8 ? columns[count] : "", err,
                                "%d numbers; a line of a TUM trajectory has 8: timestamp tx ty tz qx qy qz qw", count);
}

/* Camera to world, so the camera's rotation is the inverse's. */
static int add_pose(struct spl_path_reader *reader, const double n[8], struct spl_error *err)
{
    double largest = fmax(fmax(fabs(n[4]), fabs(n[5])), fmax(fabs(n[6]), fabs(n[7])));
    struct spl_camera camera;
    int rc = spl_path_set_fov(reader, NAN, &camera, err);
    if (rc)
        return rc;
    if (largest == 0)
        return spl_fail_field(err, SPL_E_INPUT, "qw", "a quaternion of four zeros is no rotation");
    double inverse[4] = {n[7] / largest, -n[4] / largest, -n[5] / largest, -n[6] / largest};
    spl_quaternion_to_matrix(inverse, camera.rotation);
    memcpy(camera.eye, n + 1, sizeof camera.eye);
    return spl_path_take(reader, &camera, n[0], err);
}

int spl_path_read_tum(struct spl_path_reader *reader, struct spl_source *source, struct spl_error *err)
{
    const char *line;
    size_t length;
    int got = 0, rc = spl_path_set_size(reader, SPL_WIDTH_DEFAULT, SPL_HEIGHT_DEFAULT, err);
    reader->path->whole = true;
    while (!rc && (got = spl_source_line(source, &line, &length, err)) > 0) {
        struct spl_error why = {0};
        double n[8];
        size_t blank = 0;
        while (blank < length && (line[blank] == ' ' || line[blank] == '\t'))
            blank++;
        if (blank == length || line[blank] == '#')
            continue;
        rc = parse_line(source, line, length, n, err);
        if (!rc && (rc = add_pose(reader, n, &why)))
            spl_source_fail_line(source, source->line, strcmp(why.field, "time") ? why.field : "timestamp", err, "%s",
                                 why.message);
    }
    rc = rc ? rc : got;
    const struct spl_camera_path *path = reader->path;
    if (!rc && path->count > 1) // a video of it runs as fast as what was recorded
        reader->path->fps = fmin(
            fmax((double)(path->count - 1) / (path->times[path->count - 1] - path->times[0]), fps_least), fps_most);
    return rc;
}

static int by_name(const void *a, const void *b)
{
    return strcmp(((const struct spl_named_view *)a)->name, ((const struct spl_named_view *)b)->name);
}

int spl_path_read_views(struct spl_path_reader *reader, struct spl_view_list *views, struct spl_error *err)
{
    const struct spl_camera_defaults *defaults = reader->options->defaults;
    int rc = 0;
    reader->path->whole = true;
    reader->list = "images";
    if (!views->count)
        return 0;
    qsort(views->views, views->count, sizeof *views->views, by_name);
    rc = spl_path_set_size(reader, views->views[0].camera.width, views->views[0].camera.height, err);
    for (size_t i = 0; !rc && i < views->count; i++) {
        struct spl_camera camera = views->views[i].camera;
        struct spl_error why = {0};
        if (defaults) {
            camera.near = defaults->near;
            camera.far = defaults->far;
        }
        if ((rc = spl_path_take(reader, &camera, NAN, &why)))
            spl_path_fail(reader, i, rc, &why, err);
    }
    return rc;
}

int spl_path_read_colmap(struct spl_path_reader *reader, const json_t *json, struct spl_error *err)
{
    static const char *const names[] = {"cameras_txt", "images_txt"};
    struct spl_source sources[2] = {{.fd = -1}, {.fd = -1}};
    struct spl_view_list views = {0};
    int rc = 0;
    for (int i = 0; !rc && i < 2; i++) {
        const json_t *text = json_object_get(json, names[i]);
        if (!json_is_string(text))
            rc = spl_fail_field(err, SPL_E_INPUT, names[i], "%s must be text; it is %s", names[i],
                                spl_json_type_name(text));
        else
            rc = spl_source_open_bytes(&sources[i], names[i], json_string_value(text), json_string_length(text), err);
    }
    if (!rc)
        rc = spl_view_list_read_colmap(&views, &sources[0], &sources[1], NULL, NULL, err);
    if (!rc)
        rc = spl_path_read_views(reader, &views, err);
    spl_view_list_finish(&views);
    spl_source_close(&sources[1]);
    spl_source_close(&sources[0]);
    return rc;
}
