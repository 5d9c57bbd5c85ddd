/* spl_pack(): the stages in a row, and what the file says about itself.
 *
 * Memory, bytes a point: 30 while reading (42 with given normals), 54 (66) while sorting, 59 while neighbours are
 * found, 63 while clip lines are, and the inner levels' 12 on top of 54 while encoding. Each scalar adds the 1 to 8 of
 * its type (those of LAS 4 in all), and while encoding 1.3. Each on a wire takes 60 more while wires are joined, and
 * besides about 50 of pairs, or of the vertex that becomes of it and stays until the end.
 * The output's temporary file is made first, so that an unwritable place is known before hours of work, and is gone
 * unless the last rename succeeded. Runs on the caller's thread; parallel loops end before it goes on. */
#include <splatd/pack.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/sized.h"
#include "dataset/dataset.h"
#include "dataset/rewrite.h"
#include "geom/unit.h"
#include "pack/emit.h"
#include "pack/kept.h"
#include "pack/linear.h"
#include "pack/maps/maps.h"
#include "pack/median.h"
#include "pack/part.h"
#include "pack/prune.h"
#include "pack/system.h"
#include "pack/texture/pass.h"
#include "pack/texture/photographs.h"
#include "pack/up.h"
#include "pack/view.h"
#include "pack/wires/wires.h"

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
    struct spl_wires wires;
    struct spl_tree tree;
    struct spl_emitted emitted;
    struct spl_dataset_writer *writer;
};

/* What there is to put onto the scan: photographs, pictures for maps. Loaded before anything is packed. */
struct passes {
    const struct spl_pack_options *options;
    struct spl_stage *stage;
    struct spl_map_options with; /* of maps, where the scans bring pictures along */
    struct spl_view_list photographs, pictures;
    struct spl_photo_report photos;
    struct spl_map_report maps;
};

static int check_options(struct pack *p, struct spl_error *err)
{
    const struct spl_pack_options *o = p->options;
    if (!o->input_count)
        return spl_fail_field(err, SPL_E_USAGE, "inputs", "name at least one scan to pack");
    if (!o->output || !o->output[0])
        return spl_fail_field(err, SPL_E_USAGE, "output", "name the dataset to write, such as scan.spld");
    p->neighbours = o->neighbours ? o->neighbours : 12;
    if (p->neighbours < 3 || p->neighbours > SPL_NEIGHBOURS_MAX)
        return spl_fail_field(err, SPL_E_USAGE, "neighbours", "%u neighbours; 3 to %d can be used", p->neighbours,
                              SPL_NEIGHBOURS_MAX);
    double position = o->position_error != 0 ? o->position_error : 0.016;
    double normal = o->normal_error != 0 ? o->normal_error : 1;
    if (!(position >= 1e-6 && position <= 1))
        return spl_fail_field(err, SPL_E_USAGE, "position-error",
                              "%g; the mean error is a share of the splat radius, "
                              "1e-6 to 1",
                              position);
    if (!(normal >= 0.01 && normal <= 30))
        return spl_fail_field(err, SPL_E_USAGE, "normal-error", "%g; the mean error is an angle of 0.01 to 30 degrees",
                              normal);
    if (!(isfinite(o->up[0]) && isfinite(o->up[1]) && isfinite(o->up[2])))
        return spl_fail_field(err, SPL_E_USAGE, "up", "%g, %g, %g; up is a direction of three finite numbers", o->up[0],
                              o->up[1], o->up[2]);
    p->chunk = (struct spl_chunk_options){
        .position_error = position, .normal_error = normal * M_PI / 180, .radius_error = 0.05};
    struct stat output, input;
    if (stat(o->output, &output) == 0) {
        for (size_t i = 0; i < o->input_count; i++)
            if (stat(o->inputs[i], &input) == 0 && input.st_dev == output.st_dev && input.st_ino == output.st_ino)
                return spl_fail_field(err, SPL_E_USAGE, "output", "%s is an input too; choose another name", o->output);
        if (!S_ISREG(output.st_mode))
            return spl_fail_field(err, SPL_E_USAGE, "output", "%s exists and is no file", o->output);
    }
    return 0;
}

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
                     "position_error", p->emitted.error.position_over_radius / (double)p->emitted.splats,
                     "normal_error", p->emitted.error.normal_radians / (double)p->emitted.splats * 180 / M_PI);
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
        .levels = p->tree.levels,
        .nodes = p->tree.count,
        .chunks = p->emitted.chunk_count,
        .pages = p->emitted.pages,
        .position_error = p->emitted.error.position_over_radius / (double)p->emitted.splats,
        .normal_error = p->emitted.error.normal_radians / (double)p->emitted.splats * 180 / M_PI,
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
static void plan(const struct pack *p, const struct passes *later)
{
    static const struct {
        const char *name;
        double seconds;
        bool of_surface;
    } parts[] = {{"reading", 0.4, false},        {"ordering", 0.15, false},  {"wires", 0.25, false},
                 {"normals and radii", 1, true}, {"clip lines", 0.15, true}, {"joining wires", 0.05, false},
                 {"levels", 0.2, false},         {"encoding", 0.25, false},  {"writing", 0.3, false}};
    uint64_t points = 0;
    for (size_t i = 0; i < p->scans.count; i++)
        points += p->scans.list[i].points_expected;
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
        if (!parts[i].of_surface || !p->options->points_only)
            spl_stage_plan(p->stage, parts[i].name, parts[i].seconds * 1e-6 * (double)points, i ? 0 : points);
    if (later && later->photographs.count)
        spl_photos_plan(p->options->photos, p->stage, (uint32_t)later->photographs.count,
                        (uint64_t)(1.33 * (double)points), 0);
    if (p->options->maps)
        spl_maps_plan(p->stage, later ? (uint32_t)later->pictures.count : 0, points);
}

static int join_wires(struct pack *p, struct spl_error *err)
{
    int rc = spl_wires_find(&p->wires, &p->points, p->stage, err);
    if (!rc && p->wires.cut_short && p->options->warn)
        p->options->warn(p->options->progress_context,
                         "points on wires, poles and cables take more steps to join than those of a scan; the rest of "
                         "them stays open: pack with --no-linear if there are none");
    return rc;
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

static int pack_scan(const struct spl_pack_options *options, struct spl_inputs *inputs, const char *output,
                     const struct passes *later, struct spl_stage *stage, struct spl_pack_report *report,
                     struct spl_error *err)
{
    struct pack p = {.options = options, .stage = stage};
    struct spl_system_options said = {options->unit, options->crs, options->warn, options->progress_context};
    uint64_t begin_ns = spl_now_ns();
    int rc = check_options(&p, err);
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
    if (!rc)
        settle_up(&p, later && options->photos ? &later->photographs : NULL);
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
        rc = join_wires(&p, err);
    p.tree.for_pruning = options->prune > 1;
    if (!rc)
        rc = spl_tree_build(&p.tree, &p.points, err);
    if (!rc)
        rc = spl_levels_build(&p.tree, &p.points, stage, err);
    if (!rc)
        rc = write_dataset(&p, err);
    if (!rc && report)
        fill_report(&p, begin_ns, report);
    spl_dataset_writer_destroy(p.writer);
    spl_emitted_finish(&p.emitted);
    spl_tree_finish(&p.tree);
    spl_wires_finish(&p.wires);
    spl_points_finish(&p.points);
    spl_system_finish(&p.system);
    spl_scans_finish(&p.scans);
    return rc;
}

/* Two names of one file, which need not be there yet. */
static bool is_same(const char *a, const char *b)
{
    const char *const paths[2] = {a, b}, *names[2];
    struct stat files[2], folders[2];
    bool there[2];
    for (int i = 0; i < 2; i++) {
        char folder[4096];
        const char *slash = strrchr(paths[i], '/');
        names[i] = slash ? slash + 1 : paths[i];
        snprintf(folder, sizeof folder, "%.*s", slash ? (int)(slash + 1 - paths[i]) : 1, slash ? paths[i] : ".");
        there[i] = stat(paths[i], &files[i]) == 0;
        if (stat(folder, &folders[i]))
            return false;
    }
    if (there[0] && there[1])
        return files[0].st_dev == files[1].st_dev && files[0].st_ino == files[1].st_ino;
    return !strcmp(names[0], names[1]) && folders[0].st_dev == folders[1].st_dev &&
           folders[0].st_ino == folders[1].st_ino;
}

/* The file of textures replaces nothing that is read, nor the dataset. */
static int check_kept(const struct spl_pack_options *o, const struct spl_view_list *photographs, struct spl_error *err)
{
    const char *kept = o->photos->keep_textures;
    if (!kept)
        return SPL_OK;
    bool input = is_same(kept, o->photos->cameras);
    for (size_t i = 0; i < o->input_count && !input; i++)
        input = is_same(kept, o->inputs[i]);
    for (size_t i = 0; i < photographs->count && !input; i++)
        input = is_same(kept, photographs->views[i].photograph);
    if (!input && !(o->output && is_same(kept, o->output)))
        return SPL_OK;
    return spl_fail_field(err, SPL_E_USAGE, "keep-textures", "--keep-textures %s is an %s too; choose another name",
                          kept, input ? "input" : "output");
}

/* A dataset that the next pass reads, without its name, so that nothing of it is left when the process dies. */
static int open_part(const char *path, struct spl_dataset **dataset, struct spl_error *err)
{
    int rc = spl_dataset_open_whole(path, false, dataset, err);
    unlink(path);
    return rc;
}

static int run_passes(struct passes *p, const char *part, struct spl_error *err)
{
    const struct spl_pack_options *o = p->options;
    struct spl_dataset *dataset = NULL;
    bool more = o->maps || o->prune > 1;
    int rc = open_part(part, &dataset, err);
    if (!rc && o->photos) {
        rc = spl_photos_apply(o->photos, &p->photographs, dataset, more ? part : o->output, p->stage, &p->photos, err);
        spl_dataset_close(dataset);
        dataset = NULL;
        if (!rc && more)
            rc = open_part(part, &dataset, err);
    }
    if (!rc && o->maps)
        rc = spl_maps_apply(o, &p->pictures, dataset, p->stage, &p->maps, err);
    else if (!rc && more)
        rc = spl_prune_apply(dataset, o->prune, o->output, NULL, p->stage, err);
    spl_dataset_close(dataset);
    return rc;
}

static void warn_of_picture(void *context, const struct spl_error *why)
{
    const struct spl_pack_options *options = context;
    if (options->warn)
        options->warn(options->progress_context, why->message);
}

/* Options of maps and their pictures become those that the scans bring along, or none. Nobody asked for these, so what
 * is wrong with them fails nothing. */
static int find_pictures(struct passes *p, struct spl_pack_options *options, struct spl_error *err)
{
    struct spl_map_sources found;
    struct spl_error why = {0};
    int rc = spl_map_sources_find(options->inputs, options->input_count, &found, &why);
    p->with = *options->maps;
    if (!p->with.refused) {
        p->with.refused = warn_of_picture;
        p->with.context = options;
    }
    if (!rc && !found.count && (p->with.export_to || p->with.edits))
        rc = spl_fail_field(&why, SPL_E_USAGE, "panoramas",
                            "these scans bring no panoramas along, so there are no maps to be edited: name --panoramas "
                            "PATH, or scan");
    if (!rc && found.count)
        rc = spl_maps_load(&p->with, &found, &p->pictures, &p->maps, &why);
    options->maps = p->pictures.count ? &p->with : NULL;
    spl_map_sources_finish(&found);
    if (rc && rc != SPL_E_NOMEM && rc != SPL_E_USAGE) {
        warn_of_picture(options, &why);
        return SPL_OK;
    }
    return rc ? spl_fail_field(err, rc, why.field, "%s", why.message) : SPL_OK;
}

/* What the file that was written last has. */
static void fill_rewritten(const struct spl_dataset_info *info, struct spl_pack_report *report)
{
    memcpy(report->attribute_bits, info->attribute_bits, sizeof report->attribute_bits);
    report->pruned_of = info->leaf_splats < report->leaf_splats ? report->leaf_splats : 0;
    report->leaf_splats = info->leaf_splats;
    report->splats = info->splats;
    report->pieces = info->pieces;
    report->levels = info->levels;
    report->nodes = info->nodes;
    report->chunks = info->chunks;
    report->pages = info->pages;
    for (uint32_t s = 0; s < report->stream_count; s++)
        report->streams[s].bits = info->streams[s].bits;
}

static int pack_passes(struct passes *p, struct spl_inputs *inputs, struct spl_pack_report *report,
                       struct spl_error *err)
{
    const struct spl_pack_options *options = p->options;
    struct spl_dataset *dataset = NULL;
    uint64_t begin_ns = spl_now_ns();
    char *part = NULL;
    int rc = SPL_OK;
    if (options->photos && !(rc = spl_photos_load(options->photos, &p->photographs, &p->photos, err)))
        rc = check_kept(options, &p->photographs, err);
    if (!rc && options->maps && !p->pictures.count)
        rc = spl_maps_load(options->maps, &(struct spl_map_sources){0}, &p->pictures, &p->maps, err);
    if (!rc && asprintf(&part, "%s.part-%ld-scan", options->output, (long)getpid()) < 0) {
        part = NULL;
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory for the name of %s", options->output);
    }
    if (!rc)
        rc = pack_scan(options, inputs, part, p, p->stage, report, err);
    if (!rc)
        rc = run_passes(p, part, err);
    if (!rc && report && !(rc = spl_dataset_open(options->output, false, &dataset, err))) {
        fill_rewritten(spl_dataset_get_info(dataset), report);
        report->photos = p->photos;
        report->maps = p->maps;
        report->seconds = (double)(spl_now_ns() - begin_ns) / 1e9;
    }
    spl_dataset_close(dataset);
    free(part);
    return rc;
}

static int pack(const struct spl_pack_options *options, struct spl_pack_report *report, struct spl_error *err)
{
    if (options->points_only && options->photos)
        return spl_fail_field(err, SPL_E_USAGE, "points-only",
                              "photographs are put onto discs; pack without --points-only, or without --cameras");
    if (options->points_only && options->prune > 1)
        return spl_fail_field(err, SPL_E_USAGE, "points-only",
                              "pruning weighs discs against each other; pack without --points-only, or without --prune");
    if (options->prune > SPL_PRUNE_FACTOR_MAX)
        return spl_fail_field(err, SPL_E_USAGE, "prune", "%u; of so many splats about one stays, 1 to %d",
                              options->prune, SPL_PRUNE_FACTOR_MAX);
    if (options->points_only && options->maps && !options->maps->find)
        return spl_fail_field(err, SPL_E_USAGE, "points-only",
                              "maps of stations are put onto discs; pack without --points-only, or without --panoramas");
    struct spl_stage stage = {.callback = options->progress,
                              .context = options->progress_context,
                              .threads = spl_thread_count(options->threads),
                              .cancelled = spl_cancel_get_flag(options->cancel)};
    const struct spl_inputs_listener listener = {options->warn, options->left_out, options->progress_context};
    struct spl_pack_options found = *options;
    struct spl_inputs inputs;
    int rc = spl_inputs_find(&inputs, options->inputs, options->input_count, &listener, err);
    if (rc)
        return rc;
    found.inputs = (const char *const *)inputs.paths;
    found.input_count = inputs.count;
    struct passes p = {.options = &found, .stage = &stage};
    if (found.maps && found.maps->find && options->points_only)
        found.maps = NULL;
    if (found.maps)
        rc = spl_maps_check(found.maps, err);
    if (!rc && found.maps && found.maps->find && !found.maps->panoramas)
        rc = find_pictures(&p, &found, err);
    if (!rc && found.prune > 1 && !found.maps && found.warn)
        found.warn(found.progress_context, "without maps of stations (--panoramas) the colours of the splats that "
                                           "pruning drops are lost");
    if (!rc)
        rc = found.photos || found.maps || found.prune > 1 ? pack_passes(&p, &inputs, report, err)
                                        : pack_scan(&found, &inputs, found.output, NULL, &stage, report, err);
    spl_view_list_finish(&p.photographs);
    spl_view_list_finish(&p.pictures);
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
