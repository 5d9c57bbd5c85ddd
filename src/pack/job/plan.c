/* A plan: the scans looked at, all that parts do alike decided, space cut. The caller's thread. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "pack/bound.h"
#include "pack/check.h"
#include "pack/job/part.h"
#include "pack/job/paths.h"
#include "pack/job/plan_parts.h"
#include "pack/job/stamp.h"
#include "pack/kept.h"
#include "pack/maps/pictures.h"
#include "pack/points.h"
#include "pack/said.h"
#include "pack/warn.h"

static const double linear_points = 10, cells_finest = 0x1p-30; /* wires are looked for in cells of so many points */

/* Spacings that a halo is wide: of what half of the points have, and of what nearly all have. A point's radius is held
 * against those of its neighbours, of which the 36th is 3.4 spacings away. */
static const double halo_usual = 5, halo_wide = 3;

/* What is put onto a packed scan, or found in all of it at once. */
static int check_options(const struct spl_plan_options *options, struct spl_error *err)
{
    const struct spl_pack_options *o = &options->pack;
    const char *what = o->photos                       ? "photographs (--cameras)"
                       : o->maps && !o->maps->find     ? "maps of stations (--panoramas)"
                       : o->maps && o->maps->edits     ? "maps of stations (--maps)"
                       : o->maps && o->maps->export_to ? "maps of stations (--export-maps)"
                       : o->prune > 1                  ? "--prune"
                       : o->export_primitives          ? "--export-primitives"
                       : o->max_points                 ? "--max-points"
                                                       : NULL;
    if (o->default_view || o->view_count)
        return spl_fail_field(err, SPL_E_USAGE, "plan",
                              "%s is of the dataset that parts become: name it to --join",
                              o->default_view ? "--default-view" : "--view");
    if (what)
        return spl_fail_field(err, SPL_E_USAGE, "plan",
                              "%s cannot be split into parts: leave it out, or pack without --plan and --parts, in one "
                              "piece",
                              what);
    if (o->primitives != SPL_PRIMITIVES_OFF && !(o->error > 0)) /* each would choose by its own noise and spacing */
        return spl_fail_field(err, SPL_E_USAGE, "error",
                              "--primitives in parts needs one bound for all of them: say how far a primitive may be "
                              "off its points, such as --error 5mm");
    if (options->parts < 1 || options->parts > SPL_JOB_PARTS_MAX)
        return spl_fail_field(err, SPL_E_USAGE, "plan", "%u parts; 1 to %d can be planned", options->parts,
                              SPL_JOB_PARTS_MAX);
    if (!(options->halo <= SPL_COORDINATE_MAX))
        return spl_fail_field(err, SPL_E_USAGE, "halo", "%g; a halo is a length of at most %g", options->halo,
                              SPL_COORDINATE_MAX);
    struct spl_pack_options checked = *o;
    struct spl_chunk_options chunk;
    unsigned neighbours;
    checked.output = SPL_JOB_FILE; /* a folder is no output that is checked there */
    int rc = spl_pack_check_primitives(o, err);
    if (!rc)
        rc = spl_pack_check(&checked, &neighbours, &chunk, err);
    return rc ? rc : spl_said_check(o, err);
}

/* Whose points say which of them saw each: of others nothing is numbered. */
static bool has_stations(const struct spl_scan *scan)
{
    return scan->poses && scan->attributes & SPL_CLOUD_STATION;
}

/* Where they stand, by their numbers: a part reads some of the scans, and knows all stations. */
static int take_stations(struct spl_planning *p, struct spl_error *err)
{
    struct spl_job *job = p->job;
    uint32_t count = 0;
    for (size_t i = 0; i < p->scans.count; i++)
        count += has_stations(&p->scans.list[i]) ? p->scans.list[i].stations : 0;
    if (!count)
        return SPL_OK;
    if (count >= SPL_NO_STATION)
        return spl_fail_field(err, SPL_E_LIMIT, "inputs", "%u stations are more than the %u that a dataset may have",
                              count, SPL_NO_STATION - 1);
    if (!(job->poses = spl_alloc_raw(count, sizeof *job->poses, err)))
        return SPL_E_NOMEM;
    job->rules.poses = (const double(*)[16])job->poses;
    for (size_t i = 0; i < p->scans.count; i++) {
        const struct spl_scan *scan = &p->scans.list[i];
        if (!has_stations(scan))
            continue;
        memcpy(job->poses + job->rules.pose_count, scan->poses, scan->stations * sizeof *scan->poses);
        job->rules.pose_count += scan->stations;
    }
    return SPL_OK;
}

/* Which scan a point is of is kept as in a pack of all. */
static void number_scans(struct spl_planning *p)
{
    struct spl_part_rules *rules = &p->job->rules;
    bool stations, missing = false;
    uint64_t numbers = 0;
    bool has = spl_kept_has_scan(&p->scans, &stations);
    for (size_t i = 0; i < p->scans.count; i++) {
        struct spl_scan *scan = &p->scans.list[i];
        bool known = !stations || scan->attributes & SPL_CLOUD_STATION;
        scan->first_number = (uint32_t)(stations ? numbers : i);
        missing |= !known && scan->points_inside;
        numbers += !known ? 0 : stations ? scan->stations : 1;
        rules->has_class |= scan->attributes & SPL_CLOUD_CLASS;
    }
    rules->stations = stations;
    rules->has_scan = has && (numbers > 1 || missing || p->keep.scan);
    if (rules->has_scan)
        rules->scalars |= 1u << SPL_SCALAR_SCAN;
    rules->steps[SPL_SCALAR_SCAN] = (struct spl_scalar_steps){!missing, 0, 1};
}

static int take_input(struct spl_planning *p, struct spl_scan *scan, struct spl_error *err)
{
    struct spl_job *job = p->job;
    struct spl_job_input *input = &job->inputs[job->input_count];
    int rc = spl_job_relate(job->folder, scan->path, &input->path, err);
    if (!rc)
        rc = spl_stamp_take(scan->path, &input->bytes, &input->ends, err);
    if (!rc && !(input->file = strdup(scan->path)))
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory for the names of scans");
    job->input_count++;
    input->points = scan->points_inside;
    input->colors = scan->colors;
    input->first_number = scan->first_number;
    input->block_rows = scan->blocks.rows;
    input->block_count = scan->blocks.boxes ? scan->blocks.count : 0;
    input->blocks = (double(*)[6])scan->blocks.boxes;
    scan->blocks.boxes = NULL;
    for (int c = 0; c < 3 && input->points; c++) { /* as the packer keeps them */
        input->box[0][c] = spl_points_coordinate(scan->min[c]);
        input->box[1][c] = spl_points_coordinate(scan->max[c]);
    }
    return rc;
}

static int take_inputs(struct spl_planning *p, struct spl_error *err)
{
    int rc = SPL_OK;
    if (!(p->job->inputs = spl_alloc(p->scans.count, sizeof *p->job->inputs, err)))
        return SPL_E_NOMEM;
    spl_stage_begin(&p->stage, "hashing the scans' ends", "scans", p->scans.count);
    for (size_t i = 0; !rc && i < p->scans.count; i++) {
        rc = take_input(p, &p->scans.list[i], err);
        spl_stage_add(&p->stage, 1, 0);
        if (!rc)
            rc = spl_stage_check(&p->stage, err);
    }
    spl_stage_end(&p->stage);
    return rc;
}

/* A part may be small beside what primitives may be off, where the whole is not. */
static int check_error(const struct spl_planning *p, struct spl_error *err)
{
    const double unit = p->system.unit_m > 0 ? p->system.unit_m : 1;
    const struct spl_bound bound = {.error = p->options->pack.error / unit, .unit_m = unit};
    struct spl_points all = {.bounds_min = {INFINITY, INFINITY, INFINITY},
                             .bounds_max = {-INFINITY, -INFINITY, -INFINITY}};
    for (size_t i = 0; i < p->job->input_count; i++)
        for (int c = 0; c < 3 && p->job->inputs[i].points; c++) {
            all.bounds_min[c] = fmin(all.bounds_min[c], p->job->inputs[i].box[0][c]);
            all.bounds_max[c] = fmax(all.bounds_max[c], p->job->inputs[i].box[1][c]);
        }
    return spl_bound_check_size(&bound, &all, err);
}

static int cut(struct spl_planning *p, struct spl_error *err)
{
    struct spl_job *job = p->job;
    const double asked = p->options->halo;
    if (!p->cell_count)
        return spl_fail_field(err, SPL_E_INPUT, "inputs", "%.300s%s: no usable point", p->scans.list[0].path,
                              p->scans.count > 1 ? " and the other inputs" : "");
    job->rules.halo = asked >= 0 ? asked : fmax(halo_usual * p->spacing.usual, halo_wide * p->spacing.wide);
    if (p->spacing.mean > 0) /* with ten points a cell, where a pack of all has five to twenty */
        job->rules.cells = fmax(cells_finest, ldexp(1, (int)lround(log2(sqrt(linear_points) * p->spacing.mean))));
    job->part_count = p->options->parts;
    if (!(job->parts = spl_alloc(job->part_count, sizeof *job->parts, err)))
        return SPL_E_NOMEM;
    spl_stage_begin(&p->stage, "cutting", NULL, 0);
    int rc = spl_job_cut(p->cells, p->cell_count, job->rules.halo, job->parts, job->part_count, err);
    spl_stage_end(&p->stage);
    return rc;
}

/* Parts do what the plan's options say. */
static int take_options(struct spl_planning *p, struct spl_error *err)
{
    const struct spl_pack_options *from = &p->options->pack;
    struct spl_job *job = p->job;
    struct spl_pack_options *to = &job->options;
    spl_pack_options_init(to);
    to->columns = from->columns;
    to->intensity = from->intensity;
    to->keep = from->keep;
    to->neighbours = from->neighbours;
    to->position_error = from->position_error;
    to->normal_error = from->normal_error;
    to->points_only = from->points_only;
    to->no_linear = from->no_linear;
    to->no_clip_lines = from->no_clip_lines;
    memcpy(to->up, from->up, sizeof to->up);
    to->error = from->error;
    to->primitives = from->primitives;
    to->title = from->title;
    to->description = from->description;
    job->unit_m = p->system.unit_m;
    if (!(job->document = json_pack("{s:s?}", "crs", p->system.crs)))
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the coordinate system");
    job->crs = json_string_value(json_object_get(job->document, "crs"));
    return SPL_OK;
}

/* Nobody asked for what scans bring along, so it is no reason to refuse them. */
static int mention_panoramas(const struct spl_planning *p, struct spl_error *err)
{
    const struct spl_pack_options *o = &p->options->pack;
    struct spl_map_sources found = {0};
    if (!o->maps || !o->warn)
        return SPL_OK;
    int rc = spl_map_sources_find((const char *const *)p->inputs.paths, p->inputs.count, &found, err);
    if (!rc && found.count)
        spl_pack_warn(o->warn, o->progress_context,
                      "%.300s%s: the panoramas that lie there are left, since maps of stations cannot be split into "
                      "parts; --no-panoramas says so",
                      found.paths[0], found.count > 1 ? " and others" : "");
    spl_map_sources_finish(&found);
    return rc;
}

static int plan(struct spl_planning *p, struct spl_error *err)
{
    const struct spl_pack_options *o = &p->options->pack;
    const struct spl_inputs_listener listener = {o->warn, o->left_out, o->progress_context};
    const struct spl_cloud_options how = {.columns = o->columns, .intensity = o->intensity, .keep = &p->keep};
    const struct spl_system_options said = {o->unit, o->crs, o->warn, o->progress_context};
    int rc = spl_kept_read(&p->keep, o->keep, err);
    if (!rc)
        rc = spl_inputs_find(&p->inputs, o->inputs, o->input_count, &listener, err);
    if (rc)
        return rc;
    spl_inputs_sort(&p->inputs);
    rc = mention_panoramas(p, err);
    if (!rc)
        rc = spl_scans_init(&p->scans, &p->inputs, &how, &p->stage, err);
    if (!rc)
        rc = spl_kept_check(&p->scans, err);
    if (!rc && o->note)
        spl_scans_tell(&p->scans, o->note, o->progress_context);
    if (!rc)
        rc = spl_plan_find_points(p, err);
    if (!rc)
        rc = spl_system_find(&p->system, &p->scans, &said, err);
    if (!rc && o->note && !o->unit && !(p->system.unit_m > 0))
        spl_scans_tell_unit(&p->scans, o->note, o->progress_context);
    if (!rc && o->warn)
        spl_scans_compare(&p->scans, o->warn, o->progress_context);
    if (!rc)
        number_scans(p);
    if (!rc)
        rc = take_stations(p, err);
    if (!rc)
        rc = take_inputs(p, err);
    if (!rc)
        rc = check_error(p, err);
    if (!rc)
        rc = cut(p, err);
    return rc ? rc : take_options(p, err);
}

/* The same plan that is there already is left. */
static int write_plan(const struct spl_job *job, bool *unchanged, struct spl_error *err)
{
    struct spl_job before;
    *unchanged = false;
    if (!spl_job_read(&before, job->folder, NULL)) {
        *unchanged = !strcmp(before.id, job->id);
        spl_job_finish(&before);
    }
    return spl_job_write(job, err);
}

int spl_job_plan(const struct spl_plan_options *options, struct spl_job *job, bool *unchanged, struct spl_error *err)
{
    const struct spl_pack_options *o = &options->pack;
    struct spl_planning p = {.options = options,
                         .job = job,
                         .stage = {.callback = o->progress,
                                   .context = o->progress_context,
                                   .threads = spl_thread_count(o->threads),
                                   .cancelled = spl_cancel_get_flag(o->cancel)}};
    bool made = false;
    *job = (struct spl_job){0};
    int rc = check_options(options, err);
    if (!rc)
        rc = spl_job_make_folder(o->output, &made, err);
    if (!rc && !(job->folder = strdup(o->output)))
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory for the name of %.300s", o->output);
    if (!rc)
        rc = plan(&p, err);
    if (!rc)
        rc = spl_job_name(job, err);
    if (!rc)
        rc = write_plan(job, unchanged, err);
    if (rc && made)
        rmdir(o->output);
    if (rc)
        spl_job_finish(job);
    free(p.cells);
    for (size_t i = 0; p.scans.list && i < p.scans.count; i++)
        free((void *)p.scans.list[i].blocks.boxes);
    spl_system_finish(&p.system);
    spl_scans_finish(&p.scans);
    spl_inputs_finish(&p.inputs);
    return rc;
}
