/* A job as JSON, its id, and the file. Members stand in the order of this file, numbers have 17 digits: the same plan
 * is the same bytes. Any thread. */
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <xxhash.h>

#include "base/file.h"
#include "pack/inputs.h"
#include "pack/job/names.h"
#include "pack/kept.h"

const char *const spl_job_color_names[3] = {"constant", "rgb", "intensity"};

#define DUMP (JSON_INDENT(1) | JSON_REAL_PRECISION(17))

static json_t *side(double v)
{
    return isfinite(v) ? json_real(v) : json_null();
}

static json_t *place(const double v[3])
{
    return json_pack("[o, o, o]", side(v[0]), side(v[1]), side(v[2]));
}

static json_t *describe_options(const struct spl_pack_options *o)
{
    return json_pack("{s:s?, s:b, s:s?, s:I, s:f, s:f, s:b, s:b, s:b, s:o, s:f, s:s}", "columns", o->columns,
                     "intensity", (int)o->intensity, "keep", o->keep, "neighbours", (json_int_t)o->neighbours,
                     "position_error", o->position_error, "normal_error", o->normal_error, "points_only",
                     (int)o->points_only, "no_linear", (int)o->no_linear, "no_clip_lines", (int)o->no_clip_lines, "up",
                     place(o->up), "error", o->error, "primitives",
                     o->primitives == SPL_PRIMITIVES_OFF ? "off" : "all");
}

static json_t *describe_attributes(const struct spl_job *job)
{
    json_t *all = json_array();
    struct spl_keep keep;
    if (spl_kept_read(&keep, job->options.keep, NULL)) /* it was read before */
        return all;
    for (int s = 0; s < SPL_POINT_SCALARS; s++)
        if (job->rules.scalars >> s & 1)
            json_array_append_new(all, json_pack("{s:s, s:b, s:f, s:f}", "name", spl_kept_name(&keep, s), "plain",
                                                 (int)job->rules.steps[s].plain, "first", job->rules.steps[s].first,
                                                 "steps_a_unit", job->rules.steps[s].steps_a_unit));
    return all;
}

/* Least and most of x, y and z of one block after the other; null where there are none. */
static json_t *describe_blocks(const struct spl_job_input *input)
{
    json_t *all = input->blocks ? json_array() : json_null();
    for (size_t i = 0; all && i < input->block_count; i++)
        for (int c = 0; c < 6; c++)
            json_array_append_new(all, json_real(input->blocks[i][c]));
    return all;
}

/* For the id a file is its name: where it lies changes no part. */
static json_t *describe_input(const struct spl_job_input *input, bool for_id)
{
    char ends[24];
    const struct spl_cloud_colors *colors = &input->colors;
    snprintf(ends, sizeof ends, "%016" PRIx64, input->ends);
    return json_pack("{s:s, s:I, s:s, s:I, s:o, s:o, s:{s:s, s:f, s:f, s:b, s:b, s:b}, s:I, s:I, s:o}", "path",
                     for_id ? spl_input_name(input->path) : input->path, "bytes", (json_int_t)input->bytes, "ends",
                     ends, "points", (json_int_t)input->points, "min", place(input->box[0]), "max",
                     place(input->box[1]), "colors", "from", spl_job_color_names[colors->from], "black", colors->black,
                     "white", colors->white, "guessed", (int)colors->guessed, "blank", (int)colors->blank, "sampled",
                     (int)colors->sampled, "first_number", (json_int_t)input->first_number, "block_rows",
                     (json_int_t)input->block_rows, "blocks", describe_blocks(input));
}

static json_t *describe_poses(const struct spl_part_rules *rules)
{
    json_t *all = json_array();
    for (uint32_t s = 0; s < rules->pose_count; s++) {
        json_t *pose = json_array();
        for (int i = 0; i < 16; i++)
            json_array_append_new(pose, json_real(rules->poses[s][i]));
        json_array_append_new(all, pose);
    }
    return all;
}

static json_t *describe_part(const struct spl_job_box *part)
{
    return json_pack("{s:o, s:o, s:I, s:I}", "min", place(part->min), "max", place(part->max), "points",
                     (json_int_t)part->points, "halo_points", (json_int_t)part->halo_points);
}

/* NULL: no memory, or a text that is no UTF-8. */
static json_t *describe(const struct spl_job *job, bool for_id)
{
    json_t *inputs = json_array(), *parts = json_array();
    bool failed = !inputs || !parts;
    for (size_t i = 0; i < job->input_count; i++)
        failed |= json_array_append_new(inputs, describe_input(&job->inputs[i], for_id)) != 0;
    for (uint32_t k = 0; k < job->part_count; k++)
        failed |= json_array_append_new(parts, describe_part(&job->parts[k])) != 0;
    json_t *all =
        json_pack("{s:s, s:i, s:s, s:s?, s:s?, s:f, s:s?, s:f, s:f, s:b, s:b, s:b, s:o, s:o, s:o, s:o, s:o}", "format",
                  SPL_JOB_FORMAT, "format_version", SPL_JOB_VERSION, "id", for_id ? "" : job->id, "title",
                  for_id ? NULL : job->options.title, "description", for_id ? NULL : job->options.description, "unit_m",
                  job->unit_m, "crs", job->crs, "halo", job->rules.halo, "cells", job->rules.cells, "class",
                  (int)job->rules.has_class, "scan", (int)job->rules.has_scan, "stations", (int)job->rules.stations,
                  "poses", describe_poses(&job->rules), "options", describe_options(&job->options), "attributes",
                  describe_attributes(job), "parts", parts, "inputs", inputs);
    if (failed) {
        json_decref(all);
        return NULL;
    }
    return all;
}

/* Names the first input whose path is no text. */
static int fail_text(const struct spl_job *job, struct spl_error *err)
{
    for (size_t i = 0; i < job->input_count; i++) {
        json_t *text = json_string(job->inputs[i].path);
        if (!text)
            return spl_fail_field(err, SPL_E_USAGE, "inputs",
                                  "%.300s: this path is no UTF-8, which a plan is; rename the file or its folders",
                                  job->inputs[i].path);
        json_decref(text);
    }
    return spl_fail(err, SPL_E_NOMEM,
                    "out of memory for the plan of %zu scans in %u parts, or a text among its options "
                    "is no UTF-8",
                    job->input_count, job->part_count);
}

int spl_job_name(struct spl_job *job, struct spl_error *err)
{
    json_t *all = describe(job, true);
    char *text = all ? json_dumps(all, DUMP) : NULL;
    json_decref(all);
    if (!text)
        return fail_text(job, err);
    snprintf(job->id, sizeof job->id, "%016" PRIx64, (uint64_t)XXH3_64bits(text, strlen(text)));
    free(text);
    return SPL_OK;
}

int spl_job_write(const struct spl_job *job, struct spl_error *err)
{
    char *path = NULL;
    json_t *all = describe(job, false);
    char *text = all ? json_dumps(all, DUMP) : NULL;
    int rc = text && asprintf(&path, "%s/" SPL_JOB_FILE, job->folder) >= 0 ? SPL_OK : fail_text(job, err);
    json_decref(all);
    if (!rc)
        rc = spl_file_replace(path, text, strlen(text), err);
    if (!rc && spl_file_sync_folder(path))
        rc = spl_fail_errno(err, errno, "cannot bring '%s' to disk", path);
    free(text);
    free(path);
    return rc;
}
