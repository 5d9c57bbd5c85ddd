/* One part: the scans that reach into it, held against the plan, packed by spl_build() as any scans are. Whether it is
 * there already its META says. The caller's thread. */
#include "pack/job/part.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "dataset/dataset.h"
#include "pack/build.h"
#include "pack/job/stamp.h"
#include "pack/view.h"
#include "pack/warn.h"

static int check_input(const struct spl_job_input *input, struct spl_error *err)
{
    struct spl_error why = {0};
    uint64_t bytes = 0, ends = 0;
    int rc = spl_stamp_take(input->file, &bytes, &ends, &why);
    if (rc)
        return spl_fail_field(
            err, rc, "path", "%.400s; the plan reads it: bring it back, or make the plan anew without it", why.message);
    if (bytes != input->bytes)
        return spl_fail_field(
            err, SPL_E_INPUT, "bytes",
            "%.300s: has %llu bytes, and %llu when the plan was made: bring that file back, or make the "
            "plan and all parts anew",
            input->file, (unsigned long long)bytes, (unsigned long long)input->bytes);
    if (ends != input->ends)
        return spl_fail_field(
            err, SPL_E_INPUT, "ends",
            "%.300s: its first or last 64 KiB are others than when the plan was made: bring that file "
            "back, or make the plan and all parts anew",
            input->file);
    return SPL_OK;
}

/* Of a file that has blocks, which of them are read: *scan has the rows of the file that was opened. */
static int choose_rows(const struct spl_part *part, const struct spl_job_input *input, struct spl_scan *scan,
                       struct spl_error *err)
{
    uint64_t row = 0, begin, end;
    if (!input->blocks)
        return SPL_OK;
    if (scan->rows != input->points)
        return spl_fail_field(err, SPL_E_INPUT, "points",
                              "%.300s: has %llu points, and %llu when the plan was made: make the plan and all parts "
                              "anew",
                              input->file, (unsigned long long)scan->rows, (unsigned long long)input->points);
    scan->blocks = (struct spl_part_blocks){(const double(*)[6])input->blocks, input->block_count, input->block_rows,
                                            input->points};
    scan->points_expected = 0;
    for (; spl_part_next_rows(&part->rules, &scan->blocks, row, &begin, &end); row = end)
        scan->points_expected += end - begin;
    return SPL_OK;
}

int spl_part_open(const struct spl_part *part, struct spl_scans *scans, struct spl_system *system,
                  struct spl_inputs *inputs, const struct spl_cloud_options *how, struct spl_stage *stage,
                  struct spl_error *err)
{
    const struct spl_job *job = part->job;
    int rc = SPL_OK;
    *scans = (struct spl_scans){.inputs = inputs, .how = *how, .rules = &part->rules};
    *system = (struct spl_system){.unit_m = job->unit_m};
    scans->how.threads = stage->threads;
    scans->how.cancelled = stage->cancelled;
    if (!(scans->list = spl_alloc(job->input_count, sizeof *scans->list, err)))
        return SPL_E_NOMEM;
    spl_stage_begin(stage, "looking at the scans", "scans", job->input_count);
    for (size_t i = 0; !rc && i < job->input_count; i++) {
        const struct spl_job_input *input = &job->inputs[i];
        struct spl_scan *scan = &scans->list[scans->count];
        spl_stage_add(stage, 1, 0);
        if (!spl_job_reads(job, part->number, input))
            continue;
        struct spl_cloud_options options = scans->how;
        options.colors = &input->colors;
        rc = check_input(input, err);
        if (!rc)
            rc = spl_scan_open(scan, input->file, &options, scans->count ? NULL : scans->fields, err);
        if (rc)
            break;
        scans->count++;
        scan->colors = scan->own_colors = input->colors;
        memcpy(scan->box, input->box, sizeof scan->box);
        scan->first_number = input->first_number;
        rc = choose_rows(part, input, scan, err);
        if (!rc)
            rc = spl_stage_check(stage, err);
    }
    spl_stage_end(stage);
    if (!rc && job->crs && !(system->crs = strdup(job->crs)))
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory for the coordinate system");
    if (rc)
        spl_scans_finish(scans);
    return rc;
}

uint64_t spl_part_get_expected(const struct spl_part *part)
{
    const struct spl_job_box *box = &part->job->parts[part->number];
    return box->points + box->halo_points;
}

void spl_part_view(const struct spl_points *points, struct spl_default_view *view)
{
    static const double fov = 60, above = 0.6, beside = 0.8;
    const double *up = points->up;
    double side[3] = {0}, length = 0, diagonal = 0;
    int flat = 0; /* the axis that is farthest from up */
    for (int c = 1; c < 3; c++)
        flat = fabs(up[c]) < fabs(up[flat]) ? c : flat;
    for (int c = 0; c < 3; c++) {
        side[c] = (c == flat) - up[flat] * up[c];
        length = hypot(length, side[c]);
        diagonal = hypot(diagonal, points->bounds_max[c] - points->bounds_min[c]);
    }
    diagonal = diagonal > 0 ? diagonal : 1;
    *view = (struct spl_default_view){.fov = fov, .fit = {fov, fov}};
    for (int c = 0; c < 3; c++) {
        view->target[c] = points->bounds_min[c] / 2 + points->bounds_max[c] / 2;
        view->eye[c] = view->target[c] + diagonal * (above * up[c] - beside * side[c] / length);
        view->eye[c] = fmin(fmax(view->eye[c], -SPL_COORDINATE_MAX), SPL_COORDINATE_MAX);
        view->up[c] = up[c];
    }
}

json_t *spl_part_describe(const struct spl_part *part, uint64_t halo_points)
{
    return json_pack("{s:s, s:I, s:I, s:I}", "id", part->job->id, "part", (json_int_t)part->number, "parts",
                     (json_int_t)part->job->part_count, "halo_points", (json_int_t)halo_points);
}

int spl_part_recognise(const struct spl_job *job, uint32_t number, const json_t *said, const char *path, bool *older,
                       struct spl_error *err)
{
    const json_t *of = json_object_get(said, "job"), *part = json_object_get(of, "part");
    const char *id = json_string_value(json_object_get(of, "id"));
    *older = false;
    if (!id || !json_is_integer(part))
        return spl_fail_field(err, SPL_E_INPUT, "part",
                              "%.300s: it is no part of a job, but a dataset of its own; move it away, or name another "
                              "folder to --plan",
                              path);
    *older = strcmp(id, job->id) != 0;
    if (*older)
        return spl_fail_field(
            err, SPL_E_INPUT, "part",
            "%.300s: it is a part of another plan (%.16s, this one is %s); make it anew with \"splatd "
            "pack --part %u %.200s\"",
            path, id, job->id, number, job->folder);
    if (json_integer_value(part) != (json_int_t)number)
        return spl_fail_field(err, SPL_E_INPUT, "part",
                              "%.300s: it is part %lld of this job under another name; give it its own back", path,
                              (long long)json_integer_value(part));
    return SPL_OK;
}

/* What lies under the part's names. */
struct there {
    bool done;    /* the part, or the mark that it has no point */
    bool replace; /* a dataset that is none of this plan any more */
};

static int look_at_dataset(const struct spl_job *job, uint32_t number, const char *path,
                           const struct spl_pack_options *o, struct there *there, struct spl_error *err)
{
    const struct spl_dataset_opening how = {.verify = true, .verify_all = true, .tables_bytes = SPL_TABLES_BYTES};
    struct spl_dataset *dataset = NULL;
    struct spl_error why = {0};
    bool older = false;
    if (access(path, F_OK))
        return SPL_OK;
    int rc = spl_dataset_open_as(path, &how, &dataset, &why);
    if (rc == SPL_E_INPUT || rc == SPL_E_CORRUPT) {
        there->replace = true;
        spl_pack_warn(o->warn, o->progress_context, "%.300s: it is broken, and packed anew: %.300s", path, why.message);
        return SPL_OK;
    }
    if (!rc)
        rc = spl_part_recognise(job, number, spl_dataset_get_meta(dataset), path, &older, &why);
    spl_dataset_close(dataset);
    if (!rc)
        there->done = true;
    if (older) {
        there->replace = true;
        spl_pack_warn(o->warn, o->progress_context, "%.300s: it is a part of an older plan, and packed anew", path);
        return SPL_OK;
    }
    return rc ? spl_fail_field(err, rc, why.field, "%s", why.message) : SPL_OK;
}

json_t *spl_part_read_mark(const char *path)
{
    struct stat status;
    return stat(path, &status) || !S_ISREG(status.st_mode) ? NULL
                                                           : json_load_file(path, JSON_REJECT_DUPLICATES, NULL);
}

static void look_at_mark(const struct spl_job *job, uint32_t number, const char *path, struct there *there)
{
    bool older;
    json_t *mark = spl_part_read_mark(path);
    if (mark && !spl_part_recognise(job, number, mark, path, &older, NULL))
        there->done = true;
    json_decref(mark);
}

static int write_mark(const struct spl_part *part, const char *path, struct spl_error *err)
{
    json_t *mark = json_pack("{s:o}", "job", spl_part_describe(part, 0));
    char *text = mark ? json_dumps(mark, JSON_INDENT(1)) : NULL;
    int rc = text ? spl_file_replace(path, text, strlen(text), err)
                  : spl_fail(err, SPL_E_NOMEM, "out of memory for %.300s", path);
    if (!rc && spl_file_sync_folder(path))
        rc = spl_fail_errno(err, errno, "cannot bring '%s' to disk", path);
    free(text);
    json_decref(mark);
    return rc;
}

static int build(const struct spl_part *part, const struct spl_pack_options *given, const char *path, bool *empty,
                 struct spl_pack_report *report, struct spl_error *err)
{
    struct spl_pack_options o = part->job->options;
    struct spl_stage stage = {.callback = given->progress,
                              .context = given->progress_context,
                              .threads = spl_thread_count(given->threads),
                              .cancelled = spl_cancel_get_flag(given->cancel)};
    struct spl_inputs inputs = {.listener = {given->warn, NULL, given->progress_context}};
    struct spl_build_outputs out = {.dataset = path};
    bool reads = false;
    for (size_t i = 0; i < part->job->input_count && !reads; i++)
        reads = spl_job_reads(part->job, part->number, &part->job->inputs[i]);
    *empty = !reads;
    if (!reads)
        return SPL_OK;
    o.inputs = (const char *const[]){part->job->folder};
    o.input_count = 1;
    o.output = path;
    o.title = o.description = NULL;
    o.memory_bytes = given->memory_bytes;
    o.threads = given->threads;
    o.progress = given->progress;
    o.warn = given->warn;
    o.progress_context = given->progress_context;
    o.cancel = given->cancel;
    int rc = spl_build(&o, &inputs, part, NULL, &out, &stage, report, err);
    *empty = out.empty;
    return rc;
}

int spl_job_pack(const struct spl_job *job, uint32_t number, const struct spl_pack_options *options,
                 struct spl_pack_report *report, enum spl_part_outcome *outcome, struct spl_error *err)
{
    struct there there = {0};
    if (number >= job->part_count)
        return spl_fail_field(err, SPL_E_USAGE, "part", "%.300s has parts 0 to %u, and none of number %u", job->folder,
                              job->part_count - 1, number);
    struct spl_part part = {.job = job, .number = number, .rules = job->rules};
    memcpy(part.rules.min, job->parts[number].min, sizeof part.rules.min);
    memcpy(part.rules.max, job->parts[number].max, sizeof part.rules.max);
    char *path = spl_job_part_path(job, number, false), *mark = spl_job_part_path(job, number, true);
    bool empty = false;
    int rc = path && mark ? SPL_OK : spl_fail(err, SPL_E_NOMEM, "out of memory for the names of parts");
    if (!rc)
        rc = look_at_dataset(job, number, path, options, &there, err);
    if (!rc && !there.done)
        look_at_mark(job, number, mark, &there);
    if (!rc && there.done && there.replace) /* killed before what the mark stands for was removed */
        unlink(path);
    *outcome = SPL_PART_WAS_THERE;
    if (!rc && !there.done) {
        rc = build(&part, options, path, &empty, report, err);
        if (!rc && empty)
            rc = write_mark(&part, mark, err);
        if (!rc)
            unlink(empty ? path : mark); /* of an older plan, if there is one */
        *outcome = empty ? SPL_PART_EMPTY : SPL_PART_MADE;
    }
    free(path);
    free(mark);
    return rc;
}
