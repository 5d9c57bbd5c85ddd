/* The parts of a job as a collection, once all are there, and as one file. The caller's thread. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/file.h"
#include "base/memory.h"
#include "dataset/dataset.h"
#include "pack/collect/collect.h"
#include "pack/collect/merge.h"
#include "pack/inputs.h"
#include "pack/job/part.h"
#include "pack/names.h"

/* "3, 7-9 and 12" of what is missing, cut where it is long. */
struct missing {
    char text[300];
    uint32_t count, first, last;
};

static void add_run(struct missing *m)
{
    size_t used = strlen(m->text);
    const char *comma = used ? ", " : "";
    if (used > sizeof m->text - 40) {
        if (m->text[used - 1] != '.')
            snprintf(m->text + used, sizeof m->text - used, ", ...");
    } else if (m->first == m->last)
        snprintf(m->text + used, sizeof m->text - used, "%s%u", comma, m->first);
    else
        snprintf(m->text + used, sizeof m->text - used, "%s%u-%u", comma, m->first, m->last);
}

static void add_missing(struct missing *m, uint32_t number)
{
    if (m->count++ && number == m->last + 1) {
        m->last = number;
        return;
    }
    if (m->count > 1)
        add_run(m);
    m->first = m->last = number;
}

static bool has_text(const json_t *list, const char *text)
{
    const json_t *one;
    size_t i;
    json_array_foreach(list, i, one)
        if (!strcmp(json_string_value(one) ? json_string_value(one) : "", text))
            return true;
    return false;
}

/* What the parts were packed without, each name once; spl_scans_describe_left_out() names no more. */
static void add_skipped(json_t *skipped, const json_t *more)
{
    json_t *one;
    size_t i;
    json_array_foreach(more, i, one)
        if (i <= SPL_NAMES_KEPT && json_array_size(skipped) <= SPL_NAMES_KEPT && json_string_value(one) &&
            !has_text(skipped, json_string_value(one)))
            json_array_append(skipped, one);
}

/* *points grows by those of the part, as they were read. */
static int check_dataset(const struct spl_job *job, uint32_t number, const char *path, uint64_t *points,
                         json_t *skipped, struct spl_error *err)
{
    const struct spl_dataset_opening how = {.tables_bytes = 1};
    struct spl_dataset *dataset = NULL;
    bool older;
    int rc = spl_dataset_open_as(path, &how, &dataset, err);
    if (!rc)
        rc = spl_part_recognise(job, number, spl_dataset_get_meta(dataset), path, &older, err);
    if (!rc) {
        const uint64_t more = spl_dataset_get_info(dataset)->points;
        *points = more > UINT64_MAX - *points ? UINT64_MAX : *points + more;
        add_skipped(skipped, json_object_get(spl_dataset_get_meta(dataset), "skipped"));
    }
    spl_dataset_close(dataset);
    return rc;
}

static bool is_marked(const struct spl_job *job, uint32_t number)
{
    char *path = spl_job_part_path(job, number, true);
    json_t *mark = path ? spl_part_read_mark(path) : NULL;
    bool older, is = mark && !spl_part_recognise(job, number, mark, path, &older, NULL);
    json_decref(mark);
    free(path);
    return is;
}

/* Each point is in one part. A scan that changed in its middle, where no part looks for it, moved some. */
static int check_points(const struct spl_job *job, uint64_t points, struct spl_error *err)
{
    uint64_t planned = 0;
    for (size_t i = 0; i < job->input_count; i++)
        planned += job->inputs[i].points;
    return points == planned
               ? SPL_OK
               : spl_fail_field(err, SPL_E_INPUT, "part",
                                "%.300s: its parts have %llu points and the plan %llu: a scan has changed "
                                "since; make the plan and all parts anew",
                                job->folder, (unsigned long long)points, (unsigned long long)planned);
}

/* Fills `paths` with those of parts that have points, and `skipped` with what these were packed without. */
static int find_parts(const struct spl_job *job, char **paths, size_t *count, json_t *skipped, struct spl_error *err)
{
    struct missing missing = {0};
    uint64_t points = 0;
    int rc = SPL_OK;
    for (uint32_t k = 0; !rc && k < job->part_count; k++) {
        char *path = spl_job_part_path(job, k, false);
        if (!path)
            return spl_fail(err, SPL_E_NOMEM, "out of memory for the names of parts");
        if (!access(path, F_OK)) {
            paths[(*count)++] = path;
            rc = check_dataset(job, k, path, &points, skipped, err);
            continue;
        }
        free(path);
        if (!is_marked(job, k))
            add_missing(&missing, k);
    }
    if (rc || !missing.count)
        return rc ? rc : check_points(job, points, err);
    add_run(&missing);
    return spl_fail_field(
        err, SPL_E_NOT_FOUND, "part",
        "%.300s: %u of %u parts are missing: %s; make each with \"splatd pack --part K %.200s\", on any "
        "machine",
        job->folder, missing.count, job->part_count, missing.text, job->folder);
}

/* A job's parts while they are put together. */
struct parts {
    char **paths; // owned, `count` of them; of those that have points
    size_t count;
    json_t *skipped; // owned
};

static int open_parts(const struct spl_job *job, struct parts *parts, struct spl_error *err)
{
    *parts = (struct parts){.paths = spl_alloc(job->part_count, sizeof *parts->paths, err), .skipped = json_array()};
    if (!parts->paths)
        return SPL_E_NOMEM;
    int rc = find_parts(job, parts->paths, &parts->count, parts->skipped, err);
    return rc || parts->count
               ? rc
               : spl_fail_field(err, SPL_E_INPUT, "part",
                                "%.300s: no part has a point; the headers of the scans promised some", job->folder);
}

static void close_parts(struct parts *parts)
{
    for (size_t i = 0; parts->paths && i < parts->count; i++)
        free(parts->paths[i]);
    free(parts->paths);
    json_decref(parts->skipped);
}

/* The options of the collection that they become. */
static struct spl_collect_options complete(const struct spl_job *job, const struct spl_collect_options *options,
                                           const struct parts *parts)
{
    struct spl_collect_options o = *options;
    o.inputs = (const char *const *)parts->paths;
    o.input_count = parts->count;
    o.title = o.title ? o.title : job->options.title;
    o.description = o.description ? o.description : job->options.description;
    return o;
}

int spl_job_join(const struct spl_job *job, const struct spl_collect_options *options, struct spl_error *err)
{
    struct parts parts;
    const size_t length = strlen(options->output);
    if (length < 5 || strcmp(options->output + length - 5, ".spld") != 0)
        return spl_fail_field(err, SPL_E_USAGE, "output",
                              "the joined dataset lies beside its parts, under a name that ends in .spld: -o "
                              "%.300s/NAME.spld, not '%.300s'",
                              job->folder, options->output);
    int rc = open_parts(job, &parts, err);
    if (!rc) {
        const struct spl_collect_options o = complete(job, options, &parts);
        rc = spl_collect(&o, err);
    }
    close_parts(&parts);
    return rc;
}

static const char *name_of_input(const void *job, size_t i)
{
    return spl_input_name(((const struct spl_job *)job)->inputs[i].path);
}

/* It is written over none of the scans. */
static int check_output(const struct spl_job *job, const char *output, struct spl_error *err)
{
    for (size_t i = 0; i < job->input_count; i++)
        if (spl_file_is_same(output, job->inputs[i].file))
            return spl_fail_field(err, SPL_E_USAGE, "output", "%.300s is an input too; choose another name", output);
    return SPL_OK;
}

/* The collection of the parts is made beside the output, which may be written, and lasts until it is open. */
int spl_job_merge(const struct spl_job *job, const struct spl_collect_options *options, struct spl_error *err)
{
    struct parts parts;
    char *collection = NULL;
    int rc = check_output(job, options->output, err);
    if (rc)
        return rc;
    rc = open_parts(job, &parts, err);
    json_t *sources = spl_names_describe(name_of_input, job, job->input_count);
    if (!rc && (!sources || asprintf(&collection, "%s" SPL_UNFINISHED "-tiles", options->output, (long)getpid()) < 0))
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory for the names of the scans");
    if (!rc) {
        struct spl_collect_options o = complete(job, options, &parts);
        o.output = collection;
        rc = spl_collect_apart(&o, err);
    }
    if (!rc) {
        const struct spl_merge_options how = {.collection = collection,
                                              .output = options->output,
                                              .threads = options->threads,
                                              .progress = options->progress,
                                              .progress_context = options->progress_context,
                                              .cancel = options->cancel};
        rc = spl_merge_of(&how,
                          &(struct spl_merge_of){.beside = parts.paths[0],
                                                 .sources = sources,
                                                 .skipped = json_array_size(parts.skipped) ? parts.skipped : NULL},
                          err);
    }
    free(collection);
    json_decref(sources);
    close_parts(&parts);
    return rc;
}
