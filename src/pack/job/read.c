/* job.json as a struct. It is a file from outside: counts are bounded before anything is allocated, every number and
 * text is checked and named where it is wrong, and the whole must have the id that it says, so that a plan that
 * somebody changed by hand mixes no parts. Unknown members are ignored, but count for nothing. Any thread. */
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/memory.h"
#include "geom/json.h"
#include "geom/station.h"
#include "pack/inputs.h"
#include "pack/job/fields.h"
#include "pack/job/names.h"
#include "pack/kept.h"
#include "pack/points.h"
#include "pack/scans.h"

enum { file_most = 512 << 20 };
static const double count_most = 0x1p53; /* of points, bytes */

static int read_options(struct spl_job_reader *r, const json_t *root, struct spl_pack_options *o)
{
    const json_t *of = json_object_get(root, "options");
    const char *primitives = NULL;
    uint64_t neighbours = 0;
    if (!json_is_object(of))
        return spl_job_fail(r, "options", "must be an object");
    snprintf(r->where, sizeof r->where, "options: ");
    int rc = spl_job_get_text(r, of, "columns", false, &o->columns);
    rc = rc ? rc : spl_job_get_bool(r, of, "intensity", &o->intensity);
    rc = rc ? rc : spl_job_get_text(r, of, "keep", false, &o->keep);
    rc = rc ? rc : spl_job_get_count(r, of, "neighbours", 64, &neighbours);
    rc = rc ? rc : spl_job_get_number(r, of, "position_error", 0, 1, &o->position_error);
    rc = rc ? rc : spl_job_get_number(r, of, "normal_error", 0, 30, &o->normal_error);
    rc = rc ? rc : spl_job_get_bool(r, of, "points_only", &o->points_only);
    rc = rc ? rc : spl_job_get_bool(r, of, "no_linear", &o->no_linear);
    rc = rc ? rc : spl_job_get_bool(r, of, "no_clip_lines", &o->no_clip_lines);
    rc = rc ? rc : spl_job_get_place(r, of, "up", (double)NAN, o->up);
    rc = rc ? rc : spl_job_get_number(r, of, "error", 0, 1e300, &o->error);
    rc = rc ? rc : spl_job_get_text(r, of, "primitives", true, &primitives);
    if (!rc && strcmp(primitives, "off") != 0 && strcmp(primitives, "all") != 0)
        rc = spl_job_fail(r, "primitives", "must be \"off\" or \"all\"");
    r->where[0] = '\0';
    if (rc)
        return rc;
    o->neighbours = (unsigned)neighbours;
    o->primitives = strcmp(primitives, "all") ? SPL_PRIMITIVES_OFF : SPL_PRIMITIVES_ALL;
    rc = spl_job_get_text(r, root, "title", false, &o->title);
    return rc ? rc : spl_job_get_text(r, root, "description", false, &o->description);
}

static int read_attribute(const struct spl_job_reader *r, const json_t *of, const struct spl_keep *keep,
                          struct spl_part_rules *rules)
{
    const char *name = "";
    struct spl_scalar_steps steps;
    int s = 0, rc = spl_job_get_text(r, of, "name", true, &name);
    rc = rc ? rc : spl_job_get_bool(r, of, "plain", &steps.plain);
    rc = rc ? rc : spl_job_get_number(r, of, "first", -0x1p53, 0x1p53, &steps.first);
    rc = rc ? rc : spl_job_get_number(r, of, "steps_a_unit", 0x1p-1000, 0x1p1000, &steps.steps_a_unit);
    if (rc)
        return rc;
    const int places = SPL_SCALAR_KEPT + (int)keep->count;
    while (s < SPL_POINT_SCALARS &&
           ((s >= places && s != SPL_SCALAR_SCAN) || strcmp(spl_kept_name(keep, s), name) != 0))
        s++;
    if (s == SPL_POINT_SCALARS || rules->scalars >> s & 1)
        return spl_job_fail(r, "name", "is %s",
                            s == SPL_POINT_SCALARS ? "no attribute of these options" : "there twice");
    if (steps.first != rint(steps.first) || (steps.plain && (steps.first != 0 || steps.steps_a_unit != 1)))
        return spl_job_fail(r, "first", "must be a whole number, and 0 in steps of 1 where \"plain\" is true");
    rules->scalars |= 1u << s;
    rules->steps[s] = steps;
    return SPL_OK;
}

static int read_attributes(struct spl_job_reader *r, const json_t *root, struct spl_job *job)
{
    const json_t *list = json_object_get(root, "attributes");
    struct spl_keep keep;
    int rc = spl_kept_read(&keep, job->options.keep, NULL) ? spl_job_fail(r, "keep", "is no list of fields") : SPL_OK;
    if (!rc && (!json_is_array(list) || json_array_size(list) > SPL_POINT_SCALARS))
        rc = spl_job_fail(r, "attributes", "must be an array of at most %d", SPL_POINT_SCALARS);
    for (size_t i = 0; !rc && i < json_array_size(list); i++) {
        snprintf(r->where, sizeof r->where, "attributes[%zu]: ", i);
        rc = read_attribute(r, json_array_get(list, i), &keep, &job->rules);
    }
    r->where[0] = '\0';
    return rc;
}

static int read_colors(const struct spl_job_reader *r, const json_t *of, struct spl_cloud_colors *colors)
{
    const char *from = NULL;
    int kind = 0, rc = json_is_object(of) ? spl_job_get_text(r, of, "from", true, &from)
                                          : spl_job_fail(r, "colors", "must be an object");
    while (!rc && kind < 3 && strcmp(spl_job_color_names[kind], from) != 0)
        kind++;
    if (!rc && kind == 3)
        rc = spl_job_fail(r, "from", "must be \"constant\", \"rgb\" or \"intensity\"");
    rc = rc ? rc : spl_job_get_number(r, of, "black", -1e300, 1e300, &colors->black);
    rc = rc ? rc : spl_job_get_number(r, of, "white", -1e300, 1e300, &colors->white);
    rc = rc ? rc : spl_job_get_bool(r, of, "guessed", &colors->guessed);
    rc = rc ? rc : spl_job_get_bool(r, of, "blank", &colors->blank);
    rc = rc ? rc : spl_job_get_bool(r, of, "sampled", &colors->sampled);
    if (!rc && kind != SPL_COLORS_CONSTANT && !(colors->white > colors->black))
        rc = spl_job_fail(r, "white", "must be above \"black\"");
    if (!rc)
        colors->from = kind == 1 ? SPL_COLORS_RGB : kind == 2 ? SPL_COLORS_INTENSITY : SPL_COLORS_CONSTANT;
    return rc;
}

/* Rows in blocks, and all of their boxes, of which none is empty. */
static int read_blocks(const struct spl_job_reader *r, const json_t *of, struct spl_job_input *input)
{
    const json_t *list = json_object_get(of, "blocks");
    int rc = spl_job_get_count(r, of, "block_rows", count_most, &input->block_rows);
    if (rc || json_is_null(list))
        return rc;
    const uint64_t points = input->points, rows = input->block_rows;
    const size_t count = json_array_size(list) / 6;
    if (!rows || !count || json_array_size(list) % 6 || count != (points + rows - 1) / rows)
        return spl_job_fail(r, "blocks",
                            "must be null, or an array of six numbers for each \"block_rows\" of the points");
    if (!(input->blocks = spl_alloc_raw(count, sizeof *input->blocks, r->err)))
        return SPL_E_NOMEM;
    input->block_count = count;
    for (size_t i = 0; i < 6 * count; i++) {
        const json_t *v = json_array_get(list, i);
        input->blocks[i / 6][i % 6] = json_number_value(v);
        if (!json_is_number(v) || !(fabs(json_number_value(v)) <= SPL_COORDINATE_MAX))
            return spl_job_fail(r, "blocks", "must be numbers from %g to %g", -SPL_COORDINATE_MAX, SPL_COORDINATE_MAX);
    }
    return SPL_OK;
}

static int read_input(const struct spl_job_reader *r, const json_t *of, const char *folder, struct spl_job_input *input)
{
    const char *path = NULL;
    uint64_t number = 0;
    int rc = spl_job_get_text(r, of, "path", true, &path);
    if (!rc && (!*path || !*spl_input_name(path) || strlen(path) >= PATH_MAX))
        rc = spl_job_fail(r, "path", "must be that of a file, of at most %d bytes", PATH_MAX - 1);
    rc = rc ? rc : spl_job_get_count(r, of, "bytes", count_most, &input->bytes);
    rc = rc ? rc : spl_job_get_hash(r, of, "ends", &input->ends);
    rc = rc ? rc : spl_job_get_count(r, of, "points", count_most, &input->points);
    rc = rc ? rc : spl_job_get_place(r, of, "min", (double)NAN, input->box[0]);
    rc = rc ? rc : spl_job_get_place(r, of, "max", (double)NAN, input->box[1]);
    rc = rc ? rc : read_colors(r, json_object_get(of, "colors"), &input->colors);
    rc = rc ? rc : spl_job_get_count(r, of, "first_number", UINT32_MAX, &number);
    rc = rc ? rc : read_blocks(r, of, input);
    for (int c = 0; !rc && c < 3; c++)
        if (!(input->box[0][c] <= input->box[1][c]))
            rc = spl_job_fail(r, "min", "must be at most \"max\"");
    if (rc)
        return rc;
    input->first_number = (uint32_t)number;
    if (!(input->path = strdup(path)) ||
        asprintf(&input->file, "%s%s%s", *path == '/' ? "" : folder, *path == '/' ? "" : "/", path) < 0) {
        free(input->path);
        input->path = input->file = NULL;
        return spl_fail(r->err, SPL_E_NOMEM, "out of memory for the names of scans");
    }
    return SPL_OK;
}

static int read_inputs(struct spl_job_reader *r, const json_t *root, struct spl_job *job)
{
    const json_t *list = json_object_get(root, "inputs");
    size_t count = json_array_size(list);
    if (!count || count > SPL_INPUTS_MAX)
        return spl_job_fail(r, "inputs", "must be an array of 1 to %d scans", SPL_INPUTS_MAX);
    if (!(job->inputs = spl_alloc(count, sizeof *job->inputs, r->err)))
        return SPL_E_NOMEM;
    int rc = SPL_OK;
    for (; !rc && job->input_count < count; job->input_count++) { /* one that fails is freed with the others */
        snprintf(r->where, sizeof r->where, "inputs[%zu]: ", job->input_count);
        rc = read_input(r, json_array_get(list, job->input_count), job->folder, &job->inputs[job->input_count]);
    }
    r->where[0] = '\0';
    return rc;
}

static int read_parts(struct spl_job_reader *r, const json_t *root, struct spl_job *job)
{
    const json_t *list = json_object_get(root, "parts");
    size_t count = json_array_size(list);
    if (!count || count > SPL_JOB_PARTS_MAX)
        return spl_job_fail(r, "parts", "must be an array of 1 to %d boxes", SPL_JOB_PARTS_MAX);
    if (!(job->parts = spl_alloc(count, sizeof *job->parts, r->err)))
        return SPL_E_NOMEM;
    job->part_count = (uint32_t)count;
    int rc = SPL_OK;
    for (size_t i = 0; !rc && i < count; i++) {
        const json_t *of = json_array_get(list, i);
        struct spl_job_box *part = &job->parts[i];
        snprintf(r->where, sizeof r->where, "parts[%zu]: ", i);
        rc = spl_job_get_place(r, of, "min", -INFINITY, part->min);
        rc = rc ? rc : spl_job_get_place(r, of, "max", INFINITY, part->max);
        rc = rc ? rc : spl_job_get_count(r, of, "points", count_most, &part->points);
        rc = rc ? rc : spl_job_get_count(r, of, "halo_points", count_most, &part->halo_points);
        for (int c = 0; !rc && c < 3; c++)
            if (!(part->min[c] <= part->max[c]))
                rc = spl_job_fail(r, "min", "must be at most \"max\"");
    }
    r->where[0] = '\0';
    return rc;
}

static int read_poses(struct spl_job_reader *r, const json_t *root, struct spl_job *job)
{
    const json_t *list = json_object_get(root, "poses");
    const size_t count = json_array_size(list);
    if (!json_is_array(list) || count >= SPL_NO_STATION)
        return spl_job_fail(r, "poses", "must be an array of at most %d matrices", SPL_NO_STATION - 1);
    if (count && !(job->poses = spl_alloc_raw(count, sizeof *job->poses, r->err)))
        return SPL_E_NOMEM;
    for (size_t i = 0; i < count; i++)
        if (!spl_json_get_numbers(json_array_get(list, i), 16, job->poses[i]) || spl_station_judge(job->poses[i]))
            return spl_job_fail(r, "poses", "must be 4 x 4 matrices of finite numbers, whose last row is 0, 0, 0, 1");
    job->rules.poses = (const double(*)[16])job->poses;
    job->rules.pose_count = (uint32_t)count;
    return SPL_OK;
}

static bool is_power_of_two(double v)
{
    int exponent;
    return frexp(v, &exponent) == 0.5;
}

static int read_all(struct spl_job_reader *r, const json_t *root, struct spl_job *job)
{
    const char *format = NULL;
    double version = 0;
    char id[SPL_JOB_ID_MAX];
    uint64_t hash = 0;
    int rc = spl_job_get_text(r, root, "format", true, &format);
    if (!rc && strcmp(format, SPL_JOB_FORMAT) != 0)
        rc = spl_job_fail(r, "format", "must be \"" SPL_JOB_FORMAT "\"");
    rc = rc ? rc : spl_job_get_number(r, root, "format_version", SPL_JOB_VERSION, SPL_JOB_VERSION, &version);
    rc = rc ? rc : spl_job_get_hash(r, root, "id", &hash);
    rc = rc ? rc : spl_job_get_number(r, root, "unit_m", 0, 1e15, &job->unit_m);
    rc = rc ? rc : spl_job_get_text(r, root, "crs", false, &job->crs);
    rc = rc ? rc : spl_job_get_number(r, root, "halo", 0, SPL_COORDINATE_MAX, &job->rules.halo);
    rc = rc ? rc : spl_job_get_number(r, root, "cells", 0, SPL_COORDINATE_MAX, &job->rules.cells);
    if (!rc && job->rules.cells > 0 && !(job->rules.cells >= 0x1p-40 && is_power_of_two(job->rules.cells)))
        rc = spl_job_fail(r, "cells", "must be 0, or a power of two");
    rc = rc ? rc : spl_job_get_bool(r, root, "class", &job->rules.has_class);
    rc = rc ? rc : spl_job_get_bool(r, root, "scan", &job->rules.has_scan);
    rc = rc ? rc : spl_job_get_bool(r, root, "stations", &job->rules.stations);
    rc = rc ? rc : read_poses(r, root, job);
    rc = rc ? rc : read_options(r, root, &job->options);
    rc = rc ? rc : read_attributes(r, root, job);
    rc = rc ? rc : read_parts(r, root, job);
    rc = rc ? rc : read_inputs(r, root, job);
    if (rc)
        return rc;
    snprintf(id, sizeof id, "%016" PRIx64, hash);
    if ((rc = spl_job_name(job, r->err)))
        return rc;
    return strcmp(id, job->id)
               ? spl_job_fail(r, "id", "is %s, and that of what it says %s: it was changed by hand", id, job->id)
               : SPL_OK;
}

int spl_job_parse(struct spl_job *job, const char *bytes, size_t length, const char *folder, const char *name,
                  struct spl_error *err)
{
    struct spl_job_reader r = {.name = name, .err = err};
    json_error_t where;
    *job = (struct spl_job){.folder = strdup(folder)};
    int rc = job->folder ? SPL_OK : spl_fail(err, SPL_E_NOMEM, "out of memory for the name of %.300s", folder);
    spl_pack_options_init(&job->options);
    if (!rc && !(job->document = json_loadb(bytes, length, JSON_REJECT_DUPLICATES, &where)))
        rc = spl_fail(err, SPL_E_INPUT, "%.300s: broken JSON at line %d, column %d: %s; make the plan anew", name,
                      where.line, where.column, where.text);
    if (!rc)
        rc = read_all(&r, job->document, job);
    if (rc)
        spl_job_finish(job);
    return rc;
}

int spl_job_read(struct spl_job *job, const char *folder, struct spl_error *err)
{
    char *path = NULL, *bytes = NULL;
    struct stat status;
    *job = (struct spl_job){0};
    if (asprintf(&path, "%s/" SPL_JOB_FILE, folder) < 0)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the name of %.300s", folder);
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK), rc = SPL_OK; // a pipe would wait for who writes
    if (fd < 0 || fstat(fd, &status))
        rc = spl_fail_field(err, errno == ENOENT || errno == ENOTDIR ? SPL_E_NOT_FOUND : SPL_E_IO, "job",
                            "%.300s: %s; a job is a folder that \"splatd pack --plan N IN... -o JOB\" makes", path,
                            strerror(errno));
    else if (!S_ISREG(status.st_mode) || status.st_size > file_most)
        rc = spl_fail_field(err, SPL_E_INPUT, "job", "%.300s: no file of at most %d MiB, which plans are", path,
                            file_most >> 20);
    size_t size = rc ? 0 : (size_t)status.st_size, have = 0;
    if (!rc && !(bytes = spl_alloc_raw(size + 1, 1, err)))
        rc = SPL_E_NOMEM;
    for (ssize_t n = 1; !rc && have < size && n > 0; have += (size_t)n)
        if ((n = read(fd, bytes + have, size - have)) < 0)
            rc = spl_fail_errno(err, errno, "%.300s: cannot be read", path);
    if (fd >= 0)
        close(fd);
    if (!rc)
        rc = spl_job_parse(job, bytes, have, folder, path, err);
    free(bytes);
    free(path);
    return rc;
}
