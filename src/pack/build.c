/* Scans into a dataset: the stages in a row. How long they will take build_plan.c says, what memory build_spill.c.
 *
 * The output's temporary file is made first, so that an unwritable place is known before hours of work, and is gone
 * unless the last rename succeeded. Runs on the caller's thread; parallel loops end before it goes on. */
#include "pack/build.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "pack/bound.h"
#include "pack/build_parts.h"
#include "pack/check.h"
#include "pack/early.h"
#include "pack/export/export.h"
#include "pack/eyes.h"
#include "pack/job/part.h"
#include "pack/job/rules.h"
#include "pack/linear.h"
#include "pack/median.h"
#include "pack/said.h"
#include "pack/strays.h"
#include "pack/texture/pass.h"
#include "pack/up.h"

static int median_radius(const struct spl_points *points, double *median, struct spl_error *err)
{
    size_t sample = points->count < 65536 ? points->count : 65536;
    double *radii = spl_alloc_raw(sample, sizeof *radii, err);
    if (!radii)
        return SPL_E_NOMEM;
    for (size_t i = 0; i < sample; i++)
        radii[i] = (double)points->radius[i * points->count / sample];
    *median = spl_nth(radii, sample, sample / 2);
    free(radii);
    return 0;
}

/* What the dataset says of all points, before any is given up. */
static int look_at_all(struct spl_build *p, struct spl_error *err)
{
    int rc = SPL_OK;
    if (p->part)
        spl_part_view(&p->points, &p->view);
    else if (!p->options->default_view)
        rc = spl_default_view_find(&p->points, p->system.unit_m, p->sides_known, p->stage->threads, &p->view, err);
    if (p->options->default_view)
        spl_said_view(p->options->default_view, p->points.up, &p->view);
    return rc ? rc : median_radius(&p->points, &p->radius, err);
}

static int write_dataset(struct spl_build *p, struct spl_error *err)
{
    int rc = spl_stage_check(p->stage, err);
    if (!rc)
        rc = spl_emit(&p->tree, &p->points, &p->wires, &p->chunk, p->writer, p->stage, &p->emitted, err);
    if (rc)
        return rc;
    if ((rc = spl_stage_check(p->stage, err)))
        return rc;
    json_t *meta = spl_build_describe(p, p->radius, &p->view);
    if (!meta)
        return spl_fail(err, SPL_E_NOMEM, "out of memory while describing the dataset");
    spl_stage_begin(p->stage, "writing", NULL, 0);
    rc = spl_said_add(p->options, p->points.up, meta, err);
    if (!rc)
        spl_dataset_writer_set_threads(p->writer, p->stage->threads);
    if (!rc)
        rc = spl_dataset_writer_finish(p->writer, p->emitted.nodes, p->tree.count, p->emitted.chunks,
                                   p->emitted.chunk_count, meta, err);
    json_decref(meta);
    spl_stage_end(p->stage);
    return rc;
}

static struct spl_bound get_bound(const struct spl_build *p)
{
    double unit = p->system.unit_m > 0 ? p->system.unit_m : 1;
    return (struct spl_bound){.error = p->options->error / unit, .unit_m = unit};
}

static int find_planes(struct spl_build *p, struct spl_error *err)
{
    const struct spl_bound bound = get_bound(p);
    const struct spl_planes_options planes = {.error = bound.error, .relief = true};
    char doubt[SPL_BOUND_TEXT_MAX];
    if (p->options->primitives == SPL_PRIMITIVES_OFF || p->options->points_only)
        return 0;
    int rc = p->part ? SPL_OK : spl_bound_check(&bound, &p->points, err);
    if (!rc)
        rc = spl_planes_find(&p->planes, &p->points, &planes, p->stage, err);
    if (!rc && spl_bound_find_doubt(&bound, &p->planes, doubt))
        spl_build_warn(p, "%s", doubt);
    return rc;
}

/* The tree with its levels; panels first, which inner nodes are made of too. */
static int build_tree(struct spl_build *p, struct spl_error *err)
{
    int rc = spl_tree_build(&p->tree, &p->points, err);
    if (!rc && p->stage->spill && !p->planes.count) /* points of panels are read on each level */
        rc = spl_early_create(&p->tree, &p->points, &p->wires, &p->chunk, p->stage->threads, &p->emitted,
                              &p->tree.early, err);
    if (!rc && p->planes.count) {
        p->tree.panels = &p->panels;
        rc = spl_panel_maker_init(&p->panels, &p->points, &p->planes, p->stage->threads, err);
        if (!rc)
            rc = spl_panels_make_leaves(&p->panels, &p->tree, p->stage, err);
    }
    if (!rc)
        rc = spl_levels_build(&p->tree, &p->points, p->stage, err);
    spl_panel_maker_finish(&p->panels);
    p->tree.panels = NULL;
    return rc;
}

/* The dataset as it is without panels: what stations saw, for maps. After the other, of which nothing is left in *p. */
static int write_points(const struct spl_build *p, const char *output, struct spl_error *err)
{
    struct spl_build discs = *p;
    discs.points.plane = NULL;
    discs.planes = (struct spl_planes){0};
    discs.tree = (struct spl_tree){0};
    discs.writer = NULL;
    int rc = spl_dataset_writer_create(output, &discs.writer, err);
    if (!rc)
        rc = build_tree(&discs, err);
    if (!rc)
        rc = write_dataset(&discs, err);
    spl_dataset_writer_destroy(discs.writer);
    spl_emitted_finish(&discs.emitted);
    spl_tree_finish(&discs.tree);
    return rc;
}

static int join_wires(struct spl_build *p, struct spl_error *err)
{
    double unit = p->system.unit_m > 0 ? p->system.unit_m : 1;
    const struct spl_wires_options options = {.noise = p->planes.noise, .error = p->options->error / unit};
    bool lines = p->options->primitives != SPL_PRIMITIVES_OFF && !p->options->points_only;
    int rc = spl_wires_find(&p->wires, &p->points, lines ? &options : NULL, p->stage, err);
    if (!rc && p->wires.cut_short)
        spl_build_warn(p, "points on wires, poles and cables take more steps to join than those of a scan; the rest of "
                          "them stays open: pack with --no-linear if there are none");
    return rc;
}

static int export_primitives(struct spl_build *p, struct spl_build_outputs *out, struct spl_error *err)
{
    if (!p->options->export_primitives)
        return 0;
    if (p->planes.count && !p->sides_known)
        spl_build_warn(p, "no scan says where it was taken from, so which side of a plane is its front is guessed: in "
                          "the drawing the ceiling of a room can be a floor");
    return spl_export_primitives(p->options->export_primitives, &p->points, &p->planes, &p->wires, p->system.unit_m,
                                 p->stage, &out->drawing, &out->drawing_length, &out->drawn, err);
}

/* What is up: as the user says; else, in a world that only photographs hold together, as they do; else z. */
static void settle_up(struct spl_build *p, const struct spl_view_list *photographs)
{
    const double *said = p->options->up;
    double *up = p->points.up, most = fmax(fmax(fabs(said[0]), fabs(said[1])), fabs(said[2])), length = 0;
    if (most > 0) {
        for (int c = 0; c < 3; c++)
            length += said[c] / most * (said[c] / most);
        for (int c = 0; c < 3; c++)
            up[c] = said[c] / most / sqrt(length);
        p->up_from = "given";
    } else if (photographs && !p->system.crs && spl_up_from_cameras(photographs, up))
        p->up_from = "cameras";
}

/* A scan that turns out to be broken has no say in what the others' coordinates are. */
static int gather(struct spl_build *p, struct spl_system_options *said, struct spl_error *err)
{
    size_t count = p->scans.count;
    int rc = spl_points_gather(&p->points, &p->scans, p->stage, err);
    if (rc || p->scans.count == count)
        return rc;
    spl_system_finish(&p->system);
    said->warn = NULL;
    return spl_system_find(&p->system, &p->scans, said, err);
}

static int open_scans(struct spl_build *p, struct spl_inputs *inputs, const struct spl_system_options *said,
                      struct spl_error *err)
{
    const struct spl_pack_options *options = p->options;
    const struct spl_cloud_options how = {.columns = options->columns,
                                          .intensity = options->intensity,
                                          .keep = &p->keep,
                                          .max_points = options->max_points};
    if (p->part)
        return spl_part_open(p->part, &p->scans, &p->system, inputs, &how, p->stage, err);
    int rc = spl_system_check(said, err);
    if (!rc)
        rc = spl_scans_init(&p->scans, inputs, &how, p->stage, err);
    if (!rc)
        rc = spl_kept_check(&p->scans, err);
    if (!rc)
        rc = spl_system_find(&p->system, &p->scans, said, err);
    return rc ? rc : spl_points_check_count(&p->scans, err);
}

/* What lies on wires, and what is around each point; of a part also around it. */
static int look_around(struct spl_build *p, struct spl_error *err)
{
    const struct spl_pack_options *options = p->options;
    int rc = options->no_linear ? SPL_OK : spl_linear_find(&p->points, p->stage, err);
    if (!rc)
        rc = options->points_only ? spl_bare_points(&p->points, p->stage, err)
                                  : spl_surface(&p->points, p->neighbours, !options->no_clip_lines, p->stage, err);
    if (!rc)
        spl_part_drop_halo(&p->points);
    return rc;
}

/* Of the gathered points. */
static int build(struct spl_build *p, struct spl_build_outputs *out, struct spl_error *err)
{
    const struct spl_pack_options *options = p->options;
    char strays[SPL_STRAYS_TEXT_MAX];
    int rc = spl_points_order(&p->points, p->stage, err);
    if (!rc && options->warn && spl_strays_find(&p->points, strays))
        spl_build_warn(p, "%s", strays);
    const struct spl_bound bound = get_bound(p);
    if (!rc && !p->part) /* of a part the plan has asked, of the whole */
        rc = spl_bound_check_size(&bound, &p->points, err);
    if (!rc)
        rc = spl_stage_check(p->stage, err);
    if (!rc)
        rc = spl_points_narrow(&p->points, p->scans.count ? &p->scans.list[0].coordinates : NULL, p->stage, err);
    if (!rc)
        rc = look_around(p, err);
    if (!rc && !p->points.count) {
        out->empty = true;
        return rc;
    }
    if (!rc)
        rc = find_planes(p, err);
    if (!rc)
        rc = join_wires(p, err);
    if (!rc)
        rc = export_primitives(p, out, err);
    if (options->prune > 1)
        p->tree.pruned_to = p->points.count / options->prune + 1;
    if (!rc)
        rc = look_at_all(p, err);
    if (!rc)
        rc = build_tree(p, err);
    return rc ? rc : write_dataset(p, err);
}

int spl_build(const struct spl_pack_options *options, struct spl_inputs *inputs, const struct spl_part *part,
              const struct spl_passes *later, struct spl_build_outputs *out, struct spl_stage *stage,
              struct spl_pack_report *report, struct spl_error *err)
{
    struct spl_build p = {.options = options, .part = part, .stage = stage};
    struct spl_system_options said = {options->unit, options->crs, options->warn, options->progress_context};
    uint64_t begin_ns = spl_now_ns();
    int rc = spl_pack_check(options, &p.neighbours, &p.chunk, err);
    if (!rc && options->export_primitives)
        rc = spl_export_check(options->export_primitives, (const char *const *)inputs->paths, inputs->count, err);
    if (!rc)
        rc = spl_kept_read(&p.keep, options->keep, err);
    if (!rc && options->memory_bytes)
        rc = spl_spill_create(options->output, options->memory_bytes, &stage->spill, err);
    if (!rc)
        rc = spl_dataset_writer_create(out->dataset, &p.writer, err);
    if (!rc)
        rc = open_scans(&p, inputs, &said, err);
    if (!rc && options->note && !part)
        spl_scans_tell(&p.scans, options->note, options->progress_context);
    if (!rc && options->note && !part && !options->unit && !(p.system.unit_m > 0))
        spl_scans_tell_unit(&p.scans, options->note, options->progress_context);
    if (!rc) {
        spl_build_plan(&p, later);
        rc = stage->spill ? spl_build_begin_spill(&p, later, err) : SPL_OK;
    }
    if (!rc)
        rc = gather(&p, &said, err);
    if (!rc && later && options->maps)
        spl_maps_plan(stage, &later->pictures, p.points.station_count, p.points.count);
    if (!rc)
        settle_up(&p, later && options->photos ? &later->photographs : NULL);
    if (!rc && !part)
        rc = spl_said_check_views(options, p.points.up, err);
    if (!rc && later)
        rc = spl_eyes_take(&p.points, later->photographs.count ? &later->photographs : &later->pictures, err);
    if (!rc)
        rc = spl_stage_check(stage, err);
    if (!rc && options->warn && !part)
        spl_scans_compare(&p.scans, options->warn, options->progress_context);
    p.sides_known = p.points.normal || p.points.station_count || p.points.eye_count;
    out->empty = !rc && !p.points.points_read;
    if (!rc && !out->empty)
        rc = build(&p, out, err);
    if (!rc && report && !out->empty) {
        spl_build_report(&p, report);
        report->seconds = (double)(spl_now_ns() - begin_ns) / 1e9;
    }
    spl_dataset_writer_destroy(p.writer);
    spl_early_destroy(p.tree.early);
    spl_emitted_finish(&p.emitted);
    spl_tree_finish(&p.tree);
    if (!rc && out->points && p.planes.count) {
        rc = write_points(&p, out->points, err);
        out->has_points = !rc;
    }
    spl_wires_finish(&p.wires);
    spl_planes_finish(&p.planes);
    spl_points_finish(&p.points);
    spl_system_finish(&p.system);
    spl_scans_finish(&p.scans);
    return spl_build_end_spill(&p, rc, err);
}
