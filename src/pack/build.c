/* Scans into a dataset: the stages in a row.
 *
 * Memory, bytes a point: 28 while reading (40 with given normals), 40 (52) while sorting; then, where coordinates stay
 * doubles, 57 while neighbours are found, 57 while clip lines are, and the inner levels' 11 on top of 53 while
 * encoding; 12 less of each where they are 32 bits (narrow.c). Where memory is bounded nodes are encoded while levels
 * are built, and what they were made of is given back meanwhile (early.c): no more than clip lines take. Where planes
 * are looked for, 93 meanwhile and 4 more from then on; outlining them for an export takes 4, and each thread 60 MB and
 * 20 a point of a plane. Each scalar adds the 1 to 8 of its type (those of LAS 4 in all), and while encoding 1.3. Each
 * on a wire takes 60 more while wires are joined, and besides about 50 of pairs, or of the vertex that becomes of it
 * and stays until the end. Stations have seen points, not panels: where there are both, the scan is written once more
 * without panels.
 * All that grows with the points, but for tables of a byte a point and what joins wires, is in arrays that may lie on
 * disk (spill.h): where memory is bounded these are what is beyond. The same work is done on them, so that nothing
 * depends on the bound.
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

/* Bytes a point in large arrays, at most: see above. */
static const double bytes_bare = 42, bytes_surface = 50, bytes_planes = 88, bytes_doubles = 12, bytes_normal = 12;
static const double bytes_scalar = 8, bytes_las[] = {2, 1, 1}; /* intensity and returns of LAS */
static const double bytes_written = 16; /* a point, scalars apart: 8 of a wall, 12 of clusters, 15 on wires */

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

/* The end once more, without panels, for the maps of stations. */
static bool writes_twice(const struct spl_build *p, const struct spl_passes *later)
{
    return later && p->options->maps && p->options->primitives != SPL_PRIMITIVES_OFF;
}

/* Seconds a million points on two cores, of the vault and the street. Reading costs most where it is text. */
static void plan(const struct spl_build *p, const struct spl_passes *later)
{
    static const struct {
        const char *name;
        double seconds;
        bool of_surface;
        double early; /* more, where nodes are encoded while levels are built */
    } parts[] = {{"reading", 0.4, false},        {"ordering", 0.15, false},        {"wires", 0.25, false},
                 {"normals and radii", 1, true}, {"clip lines", 0.15, true},       {"planes", 0.5, true},
                 {"joining wires", 0.05, false}, {"outlines", 0.2, true},          {"panels", 0.3, true},
                 {"levels", 0.2, false, 0.2},    {"encoding", 0.25, false, -0.2}, {"writing", 0.3, false}};
    uint64_t points = 0;
    bool twice = writes_twice(p, later), early = p->stage->spill && p->options->primitives == SPL_PRIMITIVES_OFF;
    for (size_t i = 0; i < p->scans.count; i++)
        points += p->scans.list[i].points_expected;
    uint64_t read = points; /* of which a part keeps some */
    points = p->part ? spl_part_get_expected(p->part) : points;
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
        if ((!parts[i].of_surface || !p->options->points_only) &&
            ((strcmp(parts[i].name, "planes") && strcmp(parts[i].name, "panels")) ||
             p->options->primitives != SPL_PRIMITIVES_OFF) &&
            (strcmp(parts[i].name, "outlines") || p->options->export_primitives))
            spl_stage_plan(p->stage, parts[i].name,
                           (parts[i].seconds + (early ? parts[i].early : 0) +
                            (twice && i + 1 == sizeof parts / sizeof *parts ? 0.75 : 0)) * 1e-6 *
                               (double)(i ? points : read),
                           i ? 0 : read);
    if (later && later->photographs.count)
        spl_photos_plan(p->options->photos, p->stage, (uint32_t)later->photographs.count,
                        (uint64_t)(1.33 * (double)points), 0);
    if (later && p->options->maps) /* scans say with their points how many stations they have */
        spl_maps_plan(p->stage, &later->pictures, 1, points);
}

static int check_disk(const struct spl_build *p, double points, double bytes, double written, struct spl_error *err)
{
    double beyond = points * bytes + SPL_SPILL_POOL - (double)spl_spill_get_share(p->options->memory_bytes);
    return beyond > 0
               ? spl_spill_check_disk(p->options->output, (uint64_t)beyond, (uint64_t)(points * written), err)
               : SPL_OK;
}

/* Bytes that a scan's scalars take a point. */
static double count_scalars(const struct spl_scan *scan)
{
    const bool las = scan->coordinates.step[0] > 0;
    double bytes = 0;
    for (int s = 0; s < SPL_SCALAR_COUNT; s++)
        if (scan->scalars >> s & 1)
            bytes += las && s < SPL_SCALAR_KEPT ? bytes_las[s] : bytes_scalar;
    return bytes;
}

/* Whether all coordinates are floats, or steps from one place, so that 32 bits keep them (narrow.c). */
static bool keeps_narrow(const struct spl_scans *scans)
{
    const struct spl_cloud_coordinates *first = scans->count ? &scans->list[0].coordinates : NULL;
    for (size_t i = 0; i < scans->count; i++) {
        const struct spl_cloud_coordinates *c = &scans->list[i].coordinates;
        if (c->floats != first->floats || (!c->floats && !(c->step[0] > 0)) ||
            memcmp(c->step, first->step, sizeof c->step) || memcmp(c->first, first->first, sizeof c->first))
            return false;
    }
    return true;
}

/* Where memory is bounded: what is beyond it goes to disk, of which there must be enough, for the dataset too. Where
 * points are guessed, or cells may be none, half of them must have room; else it is said alone. Says how much it will
 * be, and where the disk is none. */
static int begin_spill(struct spl_build *p, const struct spl_passes *later, struct spl_error *err)
{
    const struct spl_pack_options *o = p->options;
    double points = 0, least = 0, normals = 0, scalars = 0;
    double bytes = o->points_only ? bytes_bare : o->primitives == SPL_PRIMITIVES_OFF ? bytes_surface : bytes_planes;
    struct spl_error why = {0};
    char text[400];
    for (size_t i = 0; i < p->scans.count; i++) {
        const struct spl_scan *scan = &p->scans.list[i];
        double own = (double)(scan->max_points ? scan->max_points : scan->points_expected);
        points += own;
        least += scan->max_points || scan->counted ? own : own / 2;
        normals = scan->attributes & SPL_CLOUD_NORMAL ? bytes_normal : normals;
        scalars = fmax(scalars, count_scalars(scan));
    }
    bytes += keeps_narrow(&p->scans) ? 0 : bytes_doubles;
    if (p->part) {
        points = (double)spl_part_get_expected(p->part);
        least = points / 2;
    }
    bytes += normals + scalars;
    double beyond = points * bytes + SPL_SPILL_POOL - (double)spl_spill_get_share(o->memory_bytes);
    double written = (bytes_written + scalars) * (writes_twice(p, later) ? 2 : 1);
    if (beyond <= 0)
        return SPL_OK;
    if (o->warn) {
        snprintf(text, sizeof text,
                 "%.0f points take up to %.1f GB while they are packed, which is beyond --memory: %.1f GB of it lie on "
                 "disk beside %.60s meanwhile, which takes up to %.1f GB itself",
                 points, points * bytes / 1e9, beyond / 1e9, spl_input_name(o->output), points * written / 1e9);
        o->warn(o->progress_context, text);
    }
    char *folder = spl_spill_find_memory_folder(o->output);
    if (o->warn && folder) {
        snprintf(
            text, sizeof text,
            "'%.200s' lies in memory (tmpfs), and so does what is beyond --memory, which bounds nothing there: write "
            "the dataset (-o) to a folder on a disk",
            folder);
        o->warn(o->progress_context, text);
    }
    free(folder);
    int rc = check_disk(p, points, bytes, written, &why);
    if (rc && !check_disk(p, least, bytes, written, NULL)) {
        if (o->warn)
            o->warn(o->progress_context, why.message);
        return SPL_OK;
    }
    return rc ? spl_fail_field(err, rc, why.field, "%s", why.message) : SPL_OK;
}

/* What does not lie in arrays of points (each thread's work, tables of chunks, wires) may be more than a small
 * bound. */
static int end_spill(const struct spl_pack_options *o, struct spl_stage *stage, int rc, struct spl_error *err)
{
    char text[160];
    uint64_t most = stage->spill ? spl_spill_memory_most(stage->spill) : 0;
    rc = spl_spill_explain(stage->spill, rc, err);
    if (!rc && o->warn && most > o->memory_bytes) {
        snprintf(text, sizeof text, "the process took %.0f MB at most, where --memory says %.0f MB%s",
                 (double)most / 1048576, (double)o->memory_bytes / 1048576,
                 stage->threads > 1 ? ": with fewer --threads it takes less" : "");
        o->warn(o->progress_context, text);
    }
    spl_spill_destroy(stage->spill);
    stage->spill = NULL;
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
    if (!rc && p->options->warn && spl_bound_find_doubt(&bound, &p->planes, doubt))
        p->options->warn(p->options->progress_context, doubt);
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
    if (!rc && p->wires.cut_short && p->options->warn)
        p->options->warn(p->options->progress_context,
                         "points on wires, poles and cables take more steps to join than those of a scan; the rest of "
                         "them stays open: pack with --no-linear if there are none");
    return rc;
}

static int export_primitives(struct spl_build *p, struct spl_build_outputs *out, struct spl_error *err)
{
    if (!p->options->export_primitives)
        return 0;
    if (p->options->warn && p->planes.count && !p->sides_known)
        p->options->warn(
            p->options->progress_context,
            "no scan says where it was taken from, so which side of a plane is its front is guessed: in the "
            "drawing the ceiling of a room can be a floor");
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
        options->warn(options->progress_context, strays);
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
    if (!rc)
        rc = spl_said_check(options, err);
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
    if (!rc) {
        plan(&p, later);
        rc = stage->spill ? begin_spill(&p, later, err) : SPL_OK;
    }
    if (!rc) {
        rc = gather(&p, &said, err);
    }
    if (!rc && later && options->maps)
        spl_maps_plan(stage, &later->pictures, p.points.station_count, p.points.count);
    if (!rc)
        settle_up(&p, later && options->photos ? &later->photographs : NULL);
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
    return end_spill(options, stage, rc, err);
}
