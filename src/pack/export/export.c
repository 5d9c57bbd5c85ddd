/* Primitives to a file: outlined, printed to memory, and put in place in one step. Numbers are printed in the C locale,
 * which programs of ours never leave. Runs on the caller's thread. */
#include "pack/export/export.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/memory.h"
#include "geom/unit.h"

static const struct {
    const char *ending;
    void (*write)(const struct spl_shapes *shapes, const char *unit, FILE *out);
} formats[] = {{"ply", spl_shapes_write_ply}, {"obj", spl_shapes_write_obj}, {"dxf", spl_shapes_write_dxf}};
enum { format_count = sizeof formats / sizeof *formats };

static int find_format(const char *path)
{
    const char *name = strrchr(path, '/'), *dot = strrchr(name ? name : path, '.');
    for (int k = 0; dot && k < format_count; k++)
        if (!strcasecmp(dot + 1, formats[k].ending))
            return k;
    return -1;
}

int spl_export_check(const char *path, const char *const *scans, size_t count, struct spl_error *err)
{
    struct stat at, scan;
    const char *name = strrchr(path, '/');
    if (find_format(path) < 0)
        return spl_fail_field(err, SPL_E_USAGE, "export-primitives",
                              "--export-primitives %s: primitives are written as .ply, .obj or .dxf", path);
    bool exists = !stat(path, &at);
    if (exists && !S_ISREG(at.st_mode))
        return spl_fail_field(err, SPL_E_USAGE, "export-primitives",
                              "--export-primitives %s: exists and is no file", path);
    for (size_t i = 0; exists && i < count; i++)
        if (!stat(scans[i], &scan) && scan.st_dev == at.st_dev && scan.st_ino == at.st_ino)
            return spl_fail_field(err, SPL_E_USAGE, "export-primitives",
                                  "--export-primitives %s: is a scan that is packed; choose another name", path);
    size_t length = name ? (size_t)(name - path) + 1 : 2;
    char *folder = spl_alloc(length + 1, 1, err);
    if (!folder)
        return SPL_E_NOMEM;
    memcpy(folder, name ? path : "./", length);
    int rc = SPL_OK;
    if (access(folder, W_OK | X_OK))
        rc = spl_fail_errno(err, errno, "--export-primitives %s: no file can be made there", path);
    free(folder);
    return rc;
}

static void describe(const struct spl_shapes *s, struct spl_drawing_report *r)
{
    r->planes = s->plane_count;
    r->meshes = s->mesh_count;
    r->lines = s->line_count;
    for (uint32_t k = 0; k < s->plane_count; k++) {
        r->polygons += s->planes[k].outline.polygon_count;
        r->polygon_area += s->planes[k].area;
    }
    for (uint32_t k = 0; k < s->mesh_count; k++) {
        r->triangles += s->meshes[k].triangle_count;
        r->triangle_area += s->meshes[k].area;
    }
    for (size_t k = 0; k < s->line_count; k++)
        r->line_length += s->lines[k].length;
}

int spl_export_primitives(const char *path, const struct spl_points *points, const struct spl_planes *planes,
                          const struct spl_wires *wires, double unit_m, struct spl_stage *stage, char **text,
                          size_t *length, struct spl_drawing_report *report, struct spl_error *err)
{
    struct spl_shapes shapes;
    *report = (struct spl_drawing_report){0};
    spl_unit_print(unit_m, report->unit);
    *text = NULL;
    *length = 0;
    int format = find_format(path);
    if (format < 0)
        return spl_export_check(path, NULL, 0, err);
    int rc = spl_shapes_init(&shapes, points, planes, wires, stage, err);
    FILE *out = rc ? NULL : open_memstream(text, length);
    if (out)
        formats[format].write(&shapes, report->unit, out);
    if (!rc && (!out || ferror(out)))
        rc = SPL_E_NOMEM;
    if (out && fclose(out))
        rc = SPL_E_NOMEM;
    if (rc == SPL_E_NOMEM)
        spl_fail(err, rc, "out of memory for what is written to %s", path);
    if (rc) {
        free(*text);
        *text = NULL;
    } else {
        describe(&shapes, report);
    }
    spl_shapes_finish(&shapes);
    return rc;
}
