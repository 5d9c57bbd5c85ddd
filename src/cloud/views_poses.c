/* Folders as RGB-D tools write them (7-Scenes, TSDF fusion): camera-intrinsics.txt with a 3 x 3 matrix for all, and for
 * each photograph NAME.color.jpg (.png) a NAME.pose.txt with a 4 x 4 matrix, camera to world, z forward.
 *
 * The first pixel's centre is (0, 0) there, half a pixel from ours. Any thread; no state. */
#include <dirent.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cloud/fields.h"
#include "cloud/view_list.h"
#include "geom/size.h"

static const char pose_suffix[] = ".pose.txt";

/* `count` numbers in rows; a file that holds more or fewer is refused. */
static int read_matrix(const char *path, const char *field, unsigned count, double *out, struct spl_error *err)
{
    struct spl_source source;
    const char *line;
    size_t length;
    unsigned found = 0;
    int got, rc = spl_source_open(&source, path, err);
    if (rc)
        return rc;
    while (!rc && (got = spl_source_line(&source, &line, &length, err)) != 0) {
        struct spl_fields fields = spl_fields_begin(line, length, ' ');
        enum spl_field kind = SPL_FIELD_END;
        double number;
        char text[32];
        rc = got < 0 ? got : SPL_OK;
        while (!rc && (kind = spl_fields_number(&fields, &number)) == SPL_FIELD_OK && found++ < count)
            out[found - 1] = number;
        if (!rc && kind == SPL_FIELD_BAD)
            rc = spl_source_fail_line(&source, source.line, field, err, "'%s' is no number",
                                      spl_fields_show(&fields, text));
    }
    if (!rc && found != count)
        rc = spl_source_fail(&source, SPL_E_INPUT, field, err, "%s%u numbers; the matrix has %u",
                             found > count ? "more than " : "", found > count ? count : found, count);
    spl_source_close(&source);
    return rc;
}

static int is_pose(const struct dirent *entry)
{
    size_t length = strlen(entry->d_name), suffix = sizeof pose_suffix - 1;
    return entry->d_name[0] != '.' && length > suffix && !strcmp(entry->d_name + length - suffix, pose_suffix);
}

static int add_pose(struct spl_view_list *list, const char *folder, const char *name, const double k[9],
                    const struct spl_photograph_options *photographs, struct spl_error *err)
{
    static const char *const endings[] = {".color.png", ".color.jpg"};
    struct spl_camera camera = {.near = SPL_CAMERA_NEAR_DEFAULT, .far = INFINITY, .fx = k[0], .fy = k[4]};
    struct spl_photograph_options here = photographs ? *photographs : (struct spl_photograph_options){0};
    struct spl_error why = {0};
    char *path = spl_view_list_print(err, "%s/%s", folder, name), *image = NULL, *photograph = NULL;
    double matrix[16];
    int rc = path ? read_matrix(path, "matrix", 16, matrix, err) : SPL_E_NOMEM;
    camera.cx = k[2] + 0.5;
    camera.cy = k[5] + 0.5;
    if (!rc && (rc = spl_camera_set_matrix(&camera, matrix, SPL_AXES_OPENCV, &why)))
        spl_fail_field(err, rc, why.field, "%s: %s", path, why.message);
    here.images = here.images ? here.images : folder;
    for (int i = 0; !rc && i < 2; i++) {
        free(image);
        free(photograph);
        image = spl_view_list_print(err, "%.*s%s", (int)(strlen(name) - sizeof pose_suffix + 1), name, endings[i]);
        photograph = image ? spl_view_list_find(folder, image, &here, err) : NULL;
        rc = photograph ? here.get_size(photograph, &camera.width, &camera.height, &why) : SPL_E_NOMEM;
        if (rc == SPL_E_NOT_FOUND && i == 0) {
            why = (struct spl_error){0};
            rc = SPL_OK;
        } else if (rc) {
            spl_fail_field(err, rc, why.field, "%s", why.message);
        } else {
            break;
        }
    }
    if (!rc && (rc = spl_camera_check(&camera, &why)))
        spl_fail_field(err, rc, why.field, "%s: %s", path, why.message);
    if (!rc)
        rc = spl_view_list_add_image(list, path, image, &camera, NULL, folder, &here, err);
    free(photograph);
    free(image);
    free(path);
    return rc;
}

int spl_view_list_load_poses(struct spl_view_list *list, const char *folder,
                             const struct spl_photograph_options *photographs, struct spl_error *err)
{
    struct dirent **entries = NULL;
    double k[9];
    int count = 0;
    if (!photographs || !photographs->get_size)
        return spl_fail(err, SPL_E_UNSUPPORTED, "%s: its poses say no image size; only photographs are read so",
                        folder);
    char *path = spl_view_list_print(err, "%s/camera-intrinsics.txt", folder);
    int rc = path ? read_matrix(path, "intrinsics", 9, k, err) : SPL_E_NOMEM;
    if (!rc && (k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1))
        rc = spl_fail_field(err, SPL_E_INPUT, "intrinsics", "%s must be fx 0 cx, 0 fy cy, 0 0 1: without skew", path);
    if (!rc && (count = scandir(folder, &entries, is_pose, alphasort)) < 0)
        rc = spl_fail(err, SPL_E_IO, "%s cannot be listed", folder);
    for (int i = 0; !rc && i < count; i++) {
        struct spl_error why = {0};
        rc = add_pose(list, folder, entries[i]->d_name, k, photographs, &why);
        rc = spl_view_list_refuse(photographs, rc, &why, err);
    }
    for (int i = 0; i < count; i++)
        free(entries[i]);
    free(entries);
    free(path);
    return rc;
}
