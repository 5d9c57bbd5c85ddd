/* spl_pack(): the stages in a row, and what the file says about itself.
 *
 * Memory, bytes a point: 30 while reading (42 with given normals), 54 (66) while sorting, 59 while neighbours are
 * found, 63 while clip lines are, and the inner levels' 12 on top of 54 while encoding. Where planes are looked for, 93
 * meanwhile and 4 more from then on; outlining them for an export takes 4, and each thread 60 MB and 20 a point of a
 * plane. Each scalar adds the 1 to 8 of its type (those of LAS 4 in all), and while encoding 1.3. Each on a wire takes 60
 * more while wires are joined, and besides about 50 of pairs, or of the vertex that becomes of it and stays until the
 * end. Stations have seen points, not panels: where there are both, the scan is written once more without panels.
 * The output's temporary file is made first, so that an unwritable place is known before hours of work, and is gone
 * unless the last rename succeeded. Runs on the caller's thread; parallel loops end before it goes on. */
#include <splatd/pack.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/sized.h"
#include "dataset/dataset.h"
#include "geom/unit.h"
#include "pack/check.h"
#include "pack/emit.h"
#include "pack/export/export.h"
#include "pack/eyes.h"
#include "pack/kept.h"
#include "pack/linear.h"
#include "pack/maps/maps.h"
#include "pack/median.h"
#include "pack/part.h"
#include "pack/passes.h"
#include "pack/planes/planes.h"
#include "pack/prune.h"
#include "pack/system.h"
#include "pack/texture/pass.h"
#include "pack/up.h"
#include "pack/view.h"
#include "pack/wires/wires.h"

static const double prune_near = 1.1; /* times the factor, or as much less: not worth a word */

struct pack {
    const struct spl_pack_options *options;
    struct spl_chunk_options chunk;
    unsigned neighbours;
    struct spl_stage *stage;
    struct spl_keep keep;
    struct spl_scans scans;
    struct spl_system system;
    const char *up_from; // static; NULL: z is up, because nobody says otherwise
    struct spl_points points;
    struct spl_planes planes; /* none unless options->primitives */
    struct spl_wires wires;
    struct spl_panel_maker panels;
    struct spl_tree tree;
    struct spl_emitted emitted;
    struct spl_dataset_writer *writer;
};

static int median_radius(const struct spl_points *points, double *median, struct spl_error *err)
{
    size_t sample = points->count < 65536 ? points->count : 65536;
    float *radii = spl_alloc_raw(sample, sizeof *radii, err);
    if (!radii)
        return SPL_E_NOMEM;
    for (size_t i = 0; i < sample; i++)
        radii[i] = points->radius[i * points->count / sample];
    *median = spl_median(radii, sample);
    free(radii);
    return 0;
}

static json_t *json_vector(const double v[3])
{
    return json_pack("[f, f, f]", v[0], v[1], v[2]);
}

/* Of all splats; 0 where panels have taken the place of all of them. */
static double mean_error(const struct pack *p, double sum)
{
    return p->emitted.splats ? sum / (double)p->emitted.splats : 0;
}

static json_t *make_meta(const struct pack *p, double radius, const struct spl_default_view *view)
{
    const struct spl_points *points = &p->points;
    json_t *bits = json_object(), *sources = spl_scans_describe_names(&p->scans),
           *stations = json_array();
    char unit[SPL_UNIT_TEXT_MAX];
    for (int a = 0; a < SPL_ATTRIBUTE_COUNT; a++)
        json_object_set_new(bits, spl_attribute_name(a), json_integer((json_int_t)p->emitted.bits[a]));
    for (uint32_t s = 0; s < p->emitted.streams.count; s++)
        json_object_set_new(bits, p->emitted.streams.list[s].name, json_integer((json_int_t)p->emitted.streams.bits[s]));
    for (uint32_t s = 0; s < points->station_count; s++) {
        json_t *pose = json_array();
        for (int i = 0; i < 16; i++)
            json_array_append_new(pose, json_real(points->stations[s][i]));
        json_array_append_new(stations, pose);
    }
    return json_pack("{s:I, s:I, s:i, s:f, s:{s:o, s:o}, s:{s:o, s:o, s:o, s:f}, s:{s:b, s:b}, s:o, s:s, s:s?, s:o, s:o,"
                     " s:o, s:{s:i, s:f, s:f, s:I, s:I, s:f, s:f}}",
                     "points", (json_int_t)points->points_read, "leaf_splats", (json_int_t)points->count, "levels",
                     (int)p->tree.levels, "splat_radius", radius, "bounds", "min", json_vector(points->bounds_min),
                     "max", json_vector(points->bounds_max), "default_view", "eye", json_vector(view->eye), "target",
                     json_vector(view->target), "up", json_vector(view->up), "fov", view->fov, "attributes", "color",
                     (int)points->has_color, "surface", !points->no_surface, "bits", bits, "unit",
                     spl_unit_print(p->system.unit_m, unit), "crs", p->system.crs,
                     "sources", sources, "stations", stations, "color",
                     spl_scans_describe(&p->scans), "pack", "neighbours", (int)p->neighbours, "position_error_bound",
                     p->chunk.position_error, "normal_error_bound", p->chunk.normal_error * 180 / M_PI,
                     "points_skipped", (json_int_t)points->points_skipped, "duplicates", (json_int_t)points->duplicates,
                     "position_error", mean_error(p, p->emitted.error.position_over_radius),
                     "normal_error", mean_error(p, p->emitted.error.normal_radians) * 180 / M_PI);
}

static int write_dataset(struct pack *p, struct spl_error *err)
{
    struct spl_default_view view;
    double radius;
    int rc = spl_default_view_find(&p->points, &view, err);
    if (!rc)
        rc = median_radius(&p->points, &radius, err);
    if (!rc)
        rc = spl_emit(&p->tree, &p->points, &p->wires, &p->chunk, p->writer, p->stage, &p->emitted, err);
    if (rc)
        return rc;
    if ((rc = spl_stage_check(p->stage, err)))
        return rc;
    json_t *meta = make_meta(p, radius, &view);
    if (!meta)
        return spl_fail(err, SPL_E_NOMEM, "out of memory while describing the dataset");
    if (spl_part_of(&p->scans))
        json_object_set_new(meta, "part_of", json_integer((json_int_t)spl_part_of(&p->scans)));
    if (p->up_from)
        json_object_set_new(meta, "up",
                            json_pack("{s:o, s:s}", "vector", json_vector(p->points.up), "from", p->up_from));
    if (p->scans.inputs->left_out_count)
        json_object_set_new(meta, "skipped", spl_scans_describe_left_out(&p->scans));
    if (p->options->primitives != SPL_PRIMITIVES_OFF)
        json_object_set_new(meta, "primitives",
                            json_pack("{s:s, s:I, s:I, s:f, s:f}", "which", "all", "planes", (json_int_t)p->planes.flat,
                                      "pieces", (json_int_t)(p->planes.count - p->planes.flat), "error_bound",
                                      p->planes.bound, "noise", p->planes.noise));
    spl_stage_begin(p->stage, "writing", NULL, 0);
    rc = spl_dataset_writer_finish(p->writer, p->emitted.nodes, p->tree.count, p->emitted.chunks,
                                   p->emitted.chunk_count, meta, err);
    json_decref(meta);
    spl_stage_end(p->stage);
    return rc;
}

static void fill_report(const struct pack *p, uint64_t begin_ns, struct spl_pack_report *report)
{
    *report = (struct spl_pack_report){
        .points_read = p->points.points_read,
        .points_skipped = p->points.points_skipped,
        .duplicates = p->points.duplicates,
        .leaf_splats = p->points.count,
        .splats = p->emitted.splats,
        .pieces = p->emitted.pieces,
        .panels = p->emitted.panels,
        .panel_points = p->emitted.panel_points,
        .meshes = p->emitted.meshes,
        .mesh_points = p->emitted.mesh_points,
        .levels = p->tree.levels,
        .nodes = p->tree.count,
        .chunks = p->emitted.chunk_count,
        .pages = p->emitted.pages,
        .position_error = mean_error(p, p->emitted.error.position_over_radius),
        .normal_error = mean_error(p, p->emitted.error.normal_radians) * 180 / M_PI,
        .seconds = (double)(spl_now_ns() - begin_ns) / 1e9,
        .part_of = spl_part_of(&p->scans),
    };
    for (size_t i = 0; p->points.linear && i < p->points.count; i++)
        report->linear += p->points.linear[i];
    memcpy(report->attribute_bits, p->emitted.bits, sizeof report->attribute_bits);
    report->stream_count = p->emitted.streams.count;
    for (uint32_t s = 0; s < report->stream_count; s++) {
        snprintf(report->streams[s].name, SPL_STREAM_TEXT_MAX, "%s", p->emitted.streams.list[s].name);
        report->streams[s].bits = p->emitted.streams.bits[s];
    }
}

/* Seconds a million points on two cores, of the vault and the street. Reading costs most where it is text. */
static void plan(const struct pack *p, const struct spl_passes *later)
{
    static const struct {
        const char *name;
        double seconds;
        bool of_surface;
    } parts[] = {{"reading", 0.4, false},        {"ordering", 0.15, false},  {"wires", 0.25, false},
                 {"normals and radii", 1, true}, {"clip lines", 0.15, true}, {"planes", 0.5, true},
                 {"joining wires", 0.05, false}, {"outlines", 0.2, true}, {"panels", 0.3, true},
                 {"levels", 0.2, false}, {"encoding", 0.25, false}, {"writing", 0.3, false}};
    uint64_t points = 0;
    bool twice = later && p->options->maps && p->options->primitives != SPL_PRIMITIVES_OFF; /* the end, without panels */
    for (size_t i = 0; i < p->scans.count; i++)
        points += p->scans.list[i].points_expected;
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
        if ((!parts[i].of_surface || !p->options->points_only) &&
            ((strcmp(parts[i].name, "planes") && strcmp(parts[i].name, "panels")) ||
             p->options->primitives != SPL_PRIMITIVES_OFF) &&
            (strcmp(parts[i].name, "outlines") || p->options->export_primitives))
            spl_stage_plan(p->stage, parts[i].name,
                           (parts[i].seconds + (twice && i + 1 == sizeof parts / sizeof *parts ? 0.75 : 0)) * 1e-6 *
                               (double)points,
                           i ? 0 : points);
    if (later && later->photographs.count)
        spl_photos_plan(p->options->photos, p->stage, (uint32_t)later->photographs.count,
                        (uint64_t)(1.33 * (double)points), 0);
    if (later && p->options->maps) /* scans say with their points how many stations they have */
        spl_maps_plan(p->stage, &later->pictures, 1, points);
}

static int find_planes(struct pack *p, struct spl_error *err)
{
    double unit = p->system.unit_m > 0 ? p->system.unit_m : 1;
    const struct spl_planes_options planes = {.error = p->options->error / unit, .relief = true};
    if (p->options->primitives == SPL_PRIMITIVES_OFF || p->options->points_only)
        return 0;
    return spl_planes_find(&p->planes, &p->points, &planes, p->stage, err);
}

/* The tree with its levels; panels first, which inner nodes are made of too. */
static int build_tree(struct pack *p, struct spl_error *err)
{
    int rc = spl_tree_build(&p->tree, &p->points, err);
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
static int write_points(const struct pack *p, const char *output, struct spl_error *err)
{
    struct pack discs = *p;
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

static int join_wires(struct pack *p, struct spl_error *err)
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

/* The file of --export-primitives, which is written after the dataset. */
struct drawing {
    char *text; /* owned; NULL = none */
    size_t length;
};

static int export_primitives(struct pack *p, struct drawing *drawing, struct spl_error *err)
{
    if (!p->options->export_primitives)
        return 0;
    return spl_export_primitives(p->options->export_primitives, &p->points, &p->planes, &p->wires, p->system.unit_m,
                                 p->stage, &drawing->text, &drawing->length, err);
}

/* What is up: as the user says; else, in a world that only photographs hold together, as they do; else z. */
static void settle_up(struct pack *p, const struct spl_view_list *photographs)
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
static int gather(struct pack *p, struct spl_system_options *said, struct spl_error *err)
{
    size_t count = p->scans.count;
    int rc = spl_points_gather(&p->points, &p->scans, p->stage, err);
    if (rc || p->scans.count == count)
        return rc;
    spl_system_finish(&p->system);
    said->warn = NULL;
    return spl_system_find(&p->system, &p->scans, said, err);
}

/* Where there are panels and `later` makes maps, *points becomes true and the scan without panels is written to
 * `points_path`. */
static int pack_scan(const struct spl_pack_options *options, struct spl_inputs *inputs, const char *output,
                     const char *points_path, bool *points, const struct spl_passes *later, struct drawing *drawing,
                     struct spl_stage *stage, struct spl_pack_report *report, struct spl_error *err)
{
    struct pack p = {.options = options, .stage = stage};
    struct spl_system_options said = {options->unit, options->crs, options->warn, options->progress_context};
    uint64_t begin_ns = spl_now_ns();
    int rc = spl_pack_check(options, &p.neighbours, &p.chunk, err);
    if (!rc && options->export_primitives)
        rc = spl_export_check(options->export_primitives, (const char *const *)inputs->paths, inputs->count, err);
    if (!rc)
        rc = spl_kept_read(&p.keep, options->keep, err);
    if (!rc)
        rc = spl_dataset_writer_create(output, &p.writer, err);
    if (!rc)
        rc = spl_scans_init(&p.scans, inputs,
                            &(struct spl_cloud_options){.columns = options->columns,
                                                        .intensity = options->intensity,
                                                        .keep = &p.keep,
                                                        .max_points = options->max_points},
                            stage, err);
    if (!rc)
        rc = spl_kept_check(&p.scans, err);
    if (!rc)
        rc = spl_system_find(&p.system, &p.scans, &said, err);
    if (!rc) {
        plan(&p, later);
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
    if (!rc && options->warn)
        spl_scans_compare(&p.scans, options->warn, options->progress_context);
    if (!rc)
        rc = spl_points_order(&p.points, stage, err);
    if (!rc)
        rc = spl_stage_check(stage, err);
    if (!rc && !options->no_linear)
        rc = spl_linear_find(&p.points, stage, err);
    if (!rc)
        rc = options->points_only ? spl_bare_points(&p.points, stage, err)
                                  : spl_surface(&p.points, p.neighbours, !options->no_clip_lines, stage, err);
    if (!rc)
        rc = find_planes(&p, err);
    if (!rc)
        rc = join_wires(&p, err);
    if (!rc)
        rc = export_primitives(&p, drawing, err);
    if (options->prune > 1)
        p.tree.pruned_to = p.points.count / options->prune + 1;
    if (!rc)
        rc = build_tree(&p, err);
    if (!rc)
        rc = write_dataset(&p, err);
    if (!rc && report)
        fill_report(&p, begin_ns, report);
    spl_dataset_writer_destroy(p.writer);
    spl_emitted_finish(&p.emitted);
    spl_tree_finish(&p.tree);
    if (!rc && later && options->maps && p.planes.count) {
        rc = write_points(&p, points_path, err);
        *points = !rc;
    }
    spl_wires_finish(&p.wires);
    spl_planes_finish(&p.planes);
    spl_points_finish(&p.points);
    spl_system_finish(&p.system);
    spl_scans_finish(&p.scans);
    return rc;
}

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
    snprintf(text, sizeof text, "--prune %u leaves one splat of %.1f: no nodes of the octree come closer", options->prune,
             reached);
    options->warn(options->progress_context, text);
}

static int pack_passes(struct spl_passes *p, struct spl_inputs *inputs, struct drawing *drawing,
                       struct spl_pack_report *report, struct spl_error *err)
{
    const struct spl_pack_options *options = p->options;
    struct spl_dataset *dataset = NULL;
    uint64_t begin_ns = spl_now_ns();
    char *part = NULL, *points_part = NULL;
    bool points = false;
    int rc = spl_passes_load(p, err);
    if (!rc && asprintf(&part, "%s.part-%ld-scan", options->output, (long)getpid()) < 0) {
        part = NULL;
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory for the name of %s", options->output);
    }
    if (!rc && asprintf(&points_part, "%s.part-%ld-points", options->output, (long)getpid()) < 0) {
        points_part = NULL;
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory for the name of %s", options->output);
    }
    if (!rc && (rc = pack_scan(options, inputs, part, points_part, &points, p, drawing, p->stage, report, err)))
        unlink(part); /* where the points alone failed */
    if (!rc)
        rc = spl_passes_run(p, part, points ? points_part : NULL, err);
    if (!rc && report && !(rc = spl_dataset_open(options->output, false, &dataset, err))) {
        fill_rewritten(spl_dataset_get_info(dataset), report);
        report->photos = p->photos;
        report->maps = p->maps;
        tell_what_is_left(options, report);
        report->seconds = (double)(spl_now_ns() - begin_ns) / 1e9;
    }
    spl_dataset_close(dataset);
    free(part);
    free(points_part);
    return rc;
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
    found.inputs = (const char *const *)inputs.paths;
    found.input_count = inputs.count;
    struct spl_passes p = {.options = &found, .stage = &stage};
    struct drawing drawing = {0};
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
                 ? pack_passes(&p, &inputs, &drawing, report, err)
                 : pack_scan(&found, &inputs, found.output, NULL, NULL, NULL, &drawing, &stage, report, err);
    if (!rc && drawing.text)
        rc = spl_file_replace(found.export_primitives, drawing.text, drawing.length, err);
    free(drawing.text);
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
