/* spl_pack(): options checked, scans into a dataset (build.c), then the passes over it (passes.c), which read a part
 * that is written beside the output; last the drawing of the primitives: the one is not new where the other is old.
 * Runs on the caller's thread. */
#include <splatd/pack.h>

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <jansson.h>

#include "base/clock.h"
#include "base/file.h"
#include "base/parallel.h"
#include "base/sized.h"
#include "dataset/dataset.h"
#include "pack/build.h"
#include "pack/check.h"
#include "pack/prune.h"
#include "pack/said.h"

static const double prune_near = 1.1; /* times the factor, or as much less: not worth a word */

/* What the file that was written last has. */
static void fill_rewritten(const struct spl_dataset_info *info, struct spl_pack_report *report)
{
    memcpy(report->attribute_bits, info->attribute_bits, sizeof report->attribute_bits);
    report->pruned_of = info->leaf_splats < report->leaf_splats ? report->leaf_splats : 0;
    report->leaf_splats = info->leaf_splats;
    report->splats = info->splats;
    report->pieces = info->pieces;
    report->panels = info->panels;
    report->panel_points = info->panel_points;
    report->meshes = info->meshes;
    report->mesh_points = info->mesh_points;
    report->levels = info->levels;
    report->nodes = info->nodes;
    report->chunks = info->chunks;
    report->pages = info->pages;
    for (uint32_t s = 0; s < report->stream_count; s++)
        report->streams[s].bits = info->streams[s].bits;
}

/* Whole nodes are kept or dropped, so that not every number can be reached. */
static void tell_what_is_left(const struct spl_pack_options *options, const struct spl_pack_report *report)
{
    char text[160];
    double all = (double)(report->pruned_of ? report->pruned_of : report->leaf_splats);
    double reached = all / (double)report->leaf_splats, off = reached / options->prune;
    if (options->prune <= 1 || !options->warn || (off > 1 / prune_near && off < prune_near))
        return;
    snprintf(text, sizeof text, "--prune %u leaves one splat of %.1f: no nodes of the octree come closer",
             options->prune, reached);
    options->warn(options->progress_context, text);
}

static int pack_passes(struct spl_passes *p, struct spl_inputs *inputs, struct spl_build_outputs *out,
                       struct spl_pack_report *report, struct spl_error *err)
{
    const struct spl_pack_options *options = p->options;
    struct spl_dataset *dataset = NULL;
    uint64_t begin_ns = spl_now_ns();
    char *part = NULL, *points = NULL;
    int rc = spl_passes_load(p, err);
    if (!rc && asprintf(&part, "%s" SPL_UNFINISHED "-scan", options->output, (long)getpid()) < 0) {
        part = NULL;
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory for the name of %s", options->output);
    }
    if (!rc && options->maps && asprintf(&points, "%s" SPL_UNFINISHED "-points", options->output, (long)getpid()) < 0) {
        points = NULL;
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory for the name of %s", options->output);
    }
    out->dataset = part;
    out->points = points;
    if (!rc && (rc = spl_build(options, inputs, NULL, p, out, p->stage, report, err)))
        unlink(part); /* where the points alone failed */
    if (!rc)
        rc = spl_passes_run(p, part, out->has_points ? points : NULL, err);
    if (!rc && report && !(rc = spl_dataset_open(options->output, false, &dataset, err))) {
        fill_rewritten(spl_dataset_get_info(dataset), report);
        report->photos = p->photos;
        report->maps = p->maps;
        tell_what_is_left(options, report);
        report->seconds = (double)(spl_now_ns() - begin_ns) / 1e9;
    }
    spl_dataset_close(dataset);
    free(part);
    free(points);
    return rc;
}

/* The dataset is written by now. */
static int write_drawing(const struct spl_pack_options *options, const struct spl_build_outputs *out,
                         struct spl_error *err)
{
    struct spl_error why = {0};
    const char *path = options->export_primitives;
    spl_file_sweep_beside(path);
    int rc = spl_file_replace(path, out->drawing, out->drawing_length, &why);
    if (!rc && spl_file_sync_folder(path))
        rc = spl_fail_errno(&why, errno, "cannot bring '%s' to disk", path);
    return rc ? spl_fail_field(err, rc, "export-primitives",
                               "%s; the dataset '%s' is written, and a drawing there is an older one", why.message,
                               options->output)
              : SPL_OK;
}

/* A dataset names its scans in JSON. */
static int check_names(const struct spl_inputs *inputs, struct spl_error *err)
{
    for (size_t i = 0; i < inputs->count; i++) {
        json_t *text = json_string(spl_input_name(inputs->paths[i]));
        if (!text)
            return spl_fail_field(err, SPL_E_INPUT, "inputs",
                                  "%.300s: this name is no UTF-8, in which a dataset names its scans; rename the file",
                                  inputs->paths[i]);
        json_decref(text);
    }
    return SPL_OK;
}

static int pack(const struct spl_pack_options *options, struct spl_pack_report *report, struct spl_error *err)
{
    if (options->points_only && options->photos)
        return spl_fail_field(err, SPL_E_USAGE, "points-only",
                              "photographs are put onto discs; pack without --points-only, or without --cameras");
    if (options->points_only && options->prune > 1)
        return spl_fail_field(err, SPL_E_USAGE, "points-only",
                              "pruning weighs discs against each other; pack without --points-only, or without "
                              "--prune");
    if (options->prune > SPL_PRUNE_FACTOR_MAX)
        return spl_fail_field(err, SPL_E_USAGE, "prune", "%u; of so many splats about one stays, 1 to %d",
                              options->prune, SPL_PRUNE_FACTOR_MAX);
    if (options->points_only && options->maps && !options->maps->find)
        return spl_fail_field(err, SPL_E_USAGE, "points-only",
                              "maps of stations are put onto discs; pack without --points-only, or without "
                              "--panoramas");
    int rc = spl_pack_check_primitives(options, err);
    if (!rc)
        rc = spl_said_check_pack(options, err);
    if (rc)
        return rc;
    struct spl_stage stage = {.callback = options->progress,
                              .context = options->progress_context,
                              .threads = spl_thread_count(options->threads),
                              .cancelled = spl_cancel_get_flag(options->cancel)};
    const struct spl_inputs_listener listener = {options->warn, options->left_out, options->progress_context};
    struct spl_pack_options found = *options;
    struct spl_inputs inputs;
    rc = spl_inputs_find(&inputs, options->inputs, options->input_count, &listener, err);
    if (rc)
        return rc;
    spl_inputs_sort(&inputs);
    if ((rc = check_names(&inputs, err))) {
        spl_inputs_finish(&inputs);
        return rc;
    }
    found.inputs = (const char *const *)inputs.paths;
    found.input_count = inputs.count;
    struct spl_passes p = {.options = &found, .stage = &stage};
    struct spl_build_outputs out = {.dataset = found.output};
    if (found.maps && found.maps->find && options->points_only)
        found.maps = NULL;
    if (found.maps)
        rc = spl_maps_check(found.maps, err);
    if (!rc && found.maps && found.maps->find && !found.maps->panoramas)
        rc = spl_passes_find_pictures(&p, &found, err);
    if (!rc && found.prune > 1 && !found.maps && found.warn)
        found.warn(found.progress_context, "without maps of stations (--panoramas) the colours of the splats that "
                                           "pruning drops are lost");
    if (!rc)
        rc = found.photos || found.maps || found.prune > 1
                 ? pack_passes(&p, &inputs, &out, report, err)
                 : spl_build(&found, &inputs, NULL, NULL, &out, &stage, report, err);
    if (!rc && out.drawing)
        rc = write_drawing(&found, &out, err);
    if (!rc && report)
        report->drawing = out.drawn;
    free(out.drawing);
    spl_passes_finish(&p);
    spl_inputs_finish(&inputs);
    return rc;
}

int spl_pack(const struct spl_pack_options *options, struct spl_pack_report *report, struct spl_error *err)
{
    struct spl_pack_options known = {0};
    struct spl_photo_options photos = {0};
    struct spl_map_options maps = {0};
    int rc = spl_sized_read(options, &known, sizeof known, "spl_pack_options", err);
    if (!rc && known.photos) {
        rc = spl_sized_read(known.photos, &photos, sizeof photos, "spl_photo_options", err);
        known.photos = &photos;
    }
    if (!rc && known.maps) {
        rc = spl_sized_read(known.maps, &maps, sizeof maps, "spl_map_options", err);
        known.maps = &maps;
    }
    return rc ? rc : pack(&known, report, err);
}
