/* One tile: opened, held against the first, its root's splats read, closed. Only the head of its first page is kept
 * meanwhile, so that a tile costs the same however large it is. The caller's thread. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "pack/collect/collect.h"

/* What no collection has, whatever the other tiles are. */
static int check(const struct spl_collect_tile *tile, const struct spl_dataset_info *info, struct spl_error *err)
{
    if (info->atoms)
        return spl_fail_field(err, SPL_E_INPUT, "inputs",
                              "%.200s: it has textures (%u atoms), which a collection has not; pack it with "
                              "--textures none",
                              tile->path, info->atoms);
    if (info->maps)
        return spl_fail_field(err, SPL_E_INPUT, "inputs",
                              "%.200s: it has maps of %u stations, which a collection has not; pack it with "
                              "--no-panoramas",
                              tile->path, info->maps);
    if (!spl_collect_is_place(info->bounds_min) || !spl_collect_is_place(info->bounds_max))
        return spl_fail_field(err, SPL_E_INPUT, "inputs",
                              "%.200s: its bounds (x from %g to %g) are not finite; pack it again", tile->path,
                              info->bounds_min[0], info->bounds_max[0]);
    return SPL_OK;
}

/* META's up, or z. */
static void read_up(const json_t *up, double out[3])
{
    const json_t *vector = json_object_get(up, "vector");
    double v[3], length = 0;
    out[0] = out[1] = 0;
    out[2] = 1;
    for (size_t a = 0; a < 3; a++) {
        v[a] = json_number_value(json_array_get(vector, a));
        length += v[a] * v[a];
    }
    for (int a = 0; a < 3 && length > 0 && isfinite(length); a++)
        out[a] = v[a] / sqrt(length);
}

static void take_first(struct spl_collect *c, const struct spl_dataset_info *info, const json_t *meta)
{
    snprintf(c->unit, sizeof c->unit, "%s", info->unit);
    c->crs = json_incref(json_object_get(meta, "crs"));
    c->up = json_incref(json_object_get(meta, "up"));
    read_up(c->up, c->up_vector);
    c->has_surface = info->has_surface;
    c->has_sides = info->has_sides;
    c->points.no_surface = !info->has_surface;
    memcpy(c->points.up, c->up_vector, sizeof c->points.up);
    memcpy(c->bounds[0], info->bounds_min, sizeof c->bounds[0]);
    memcpy(c->bounds[1], info->bounds_max, sizeof c->bounds[1]);
}

/* Where stations stand, as long as all tiles know the same ones, by the same numbers. */
static int take_stations(struct spl_collect *c, const struct spl_dataset_info *info, struct spl_error *err)
{
    const size_t bytes = info->station_count * sizeof *info->stations;
    if (!info->station_count || info->stations_of_maps)
        return SPL_OK;
    if (!(c->points.stations = spl_alloc_raw(info->station_count, sizeof *c->points.stations, err)))
        return SPL_E_NOMEM;
    memcpy(c->points.stations, info->stations, bytes);
    c->points.station_count = info->station_count;
    return SPL_OK;
}

static void compare_stations(struct spl_collect *c, const struct spl_dataset_info *info)
{
    const size_t bytes = info->station_count * sizeof *info->stations;
    if (info->station_count != c->points.station_count || (bytes && memcmp(info->stations, c->points.stations, bytes)))
        c->points.station_count = 0;
}

/* The id of the job that the tile is a part of; NULL: none. */
static const char *get_job(const json_t *meta)
{
    return json_string_value(json_object_get(json_object_get(meta, "job"), "id"));
}

/* Parts of two plans have points in common, or lack some. */
static int compare_jobs(const struct spl_collect *c, const struct spl_collect_tile *tile, const json_t *meta,
                        struct spl_error *err)
{
    const char *job = get_job(meta);
    if (!strcmp(job ? job : "", c->job))
        return SPL_OK;
    return spl_fail_field(err, SPL_E_INPUT, "inputs",
                          "%.160s is %s%.16s, and %.120s %s%.16s; parts of a plan are put together by themselves: "
                          "\"splatd pack --part K JOB\" of each that is older, then \"splatd pack --join JOB\"",
                          tile->path, job ? "a part of plan " : "no part of a plan", job ? job : "", c->first,
                          *c->job ? "one of plan " : "is none", c->job);
}

static const char *text_of(const json_t *crs)
{
    return json_is_string(crs) ? json_string_value(crs) : "none";
}

static int compare(const struct spl_collect *c, const struct spl_collect_tile *tile,
                   const struct spl_dataset_info *info, const json_t *meta, struct spl_error *err)
{
    const json_t *crs = json_object_get(meta, "crs");
    double up[3];
    read_up(json_object_get(meta, "up"), up);
    if (strcmp(c->unit, info->unit))
        return spl_fail_field(err, SPL_E_INPUT, "inputs",
                              "%.160s: its coordinates are in \"%s\", those of %.120s in \"%s\"; pack both with the "
                              "--unit that holds",
                              tile->path, info->unit, c->first, c->unit);
    if (strcmp(text_of(crs), text_of(c->crs)))
        return spl_fail_field(err, SPL_E_INPUT, "inputs",
                              "%.160s: its coordinate system (crs) is %.80s, that of %.120s is %.80s; pack both with "
                              "the --crs that holds",
                              tile->path, text_of(crs), c->first, text_of(c->crs));
    if (memcmp(up, c->up_vector, sizeof up))
        return spl_fail_field(err, SPL_E_INPUT, "inputs",
                              "%.160s: up is %g, %g, %g there, and %g, %g, %g in %.120s; pack both with the same --up",
                              tile->path, up[0], up[1], up[2], c->up_vector[0], c->up_vector[1], c->up_vector[2],
                              c->first);
    if (info->has_surface != c->has_surface)
        return spl_fail_field(err, SPL_E_INPUT, "inputs",
                              "%.160s has %s, and %.120s has %s; pack both with --points-only, or both without",
                              tile->path, info->has_surface ? "normals and radii" : "bare points", c->first,
                              c->has_surface ? "normals and radii" : "bare points");
    return SPL_OK;
}

static json_t *vector(const double v[3])
{
    return json_pack("[f, f, f]", v[0], v[1], v[2]);
}

/* The tile in META; NULL: no memory. */
static json_t *describe(const struct spl_collect_tile *tile, const struct spl_dataset *dataset)
{
    const struct spl_dataset_info *i = spl_dataset_get_info(dataset);
    const struct spl_page_row *rows = spl_dataset_get_page_rows(dataset);
    json_t *pages = json_array();
    char version[24];
    bool failed = false;
    snprintf(version, sizeof version, "%016llx", (unsigned long long)i->version);
    for (uint32_t p = 0; p < i->pages; p++)
        failed |= json_array_append_new(pages, json_pack("[I, I, I, I]",
                                                         (json_int_t)(rows[p + 1].first_node - rows[p].first_node),
                                                         (json_int_t)(rows[p + 1].first_chunk - rows[p].first_chunk),
                                                         (json_int_t)(rows[p + 1].first_id - rows[p].first_id),
                                                         (json_int_t)spl_dataset_get_page_bytes(dataset, p))) != 0;
    json_t *entry = json_pack("{s:s, s:s, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:{s:o, s:o}, s:o}", "file",
                              tile->name, "version", version, "node", (json_int_t)0, "levels", (json_int_t)i->levels,
                              "points", (json_int_t)i->points, "leaf_splats", (json_int_t)i->leaf_splats, "splats",
                              (json_int_t)i->splats, "pieces", (json_int_t)i->pieces, "panels", (json_int_t)i->panels,
                              "panel_points", (json_int_t)i->panel_points, "meshes", (json_int_t)i->meshes, "bounds",
                              "min", vector(i->bounds_min), "max", vector(i->bounds_max), "pages", pages);
    failed |= !entry || json_object_set_new(entry, "splat_radius", json_real(i->splat_radius)) != 0;
    failed |= !entry || json_object_set_new(entry, "mesh_points", json_integer((json_int_t)i->mesh_points)) != 0;
    failed |= !entry || json_object_set_new(entry, "bytes", json_integer((json_int_t)i->file_bytes)) != 0;
    if (!failed)
        return entry;
    json_decref(entry);
    return NULL;
}

/* A collection is no tile, whether it can be opened or not, and one that was merged holds what its tiles hold, which
 * may lie beside it: left out of a folder; a collection is refused where it was named itself. */
static int refuse(const struct spl_collect *c, const struct spl_collect_tile *tile, const char *what,
                  struct spl_error *err)
{
    struct spl_error why = {0};
    int rc = spl_fail_field(tile->in_folder ? &why : err, SPL_E_INPUT, "inputs", "%.200s: it is %s%s", tile->path, what,
                            tile->in_folder ? ", and no tile" : "; name its tiles instead");
    if (tile->in_folder && c->options->left_out)
        c->options->left_out(c->options->progress_context, &why);
    return tile->in_folder ? 1 : rc;
}

int spl_collect_read(struct spl_collect *c, struct spl_collect_tile *tile, struct spl_error *err)
{
    enum spl_file_kind kind = SPL_FILE_OTHER;
    const struct spl_dataset_opening how = {.tables_bytes = 1, .cancelled = c->stage->cancelled, .kind = &kind};
    struct spl_dataset *dataset = NULL;
    struct spl_error why = {0};
    int rc = spl_dataset_open_as(tile->path, &how, &dataset, &why);
    if (kind == SPL_FILE_COLLECTION && rc != SPL_E_CANCELLED) {
        spl_dataset_close(dataset);
        return refuse(c, tile, "a collection itself (\"tiles\")", err);
    }
    if (rc)
        return spl_fail_field(err, rc, why.field, "%s", why.message);
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    const json_t *meta = spl_dataset_get_meta(dataset);
    if (tile->in_folder && json_object_get(meta, "merged")) {
        spl_dataset_close(dataset);
        return refuse(c, tile, "a collection made one file (\"merged\"), which is taken where it is named", err);
    }
    rc = check(tile, info, err);
    if (!rc && !c->first) {
        take_first(c, info, meta);
        snprintf(c->job, sizeof c->job, "%s", get_job(meta) ? get_job(meta) : "");
        rc = take_stations(c, info, err);
    } else if (!rc) {
        compare_stations(c, info);
        rc = compare(c, tile, info, meta, err);
        if (!rc)
            rc = compare_jobs(c, tile, meta, err);
    }
    if (!rc)
        rc = spl_collect_take_streams(c, dataset, tile->path, err);
    if (!rc)
        rc = spl_collect_add_values(c, info, err);
    if (!rc && !c->first && !(c->first = strdup(tile->name)))
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory for the names of tiles");
    if (!rc)
        rc = spl_collect_take_root(c, tile, dataset, err);
    if (!rc && !(tile->entry = describe(tile, dataset)))
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory while describing %.200s", tile->path);
    if (!rc) {
        tile->version = info->version;
        tile->leaf_splats = info->leaf_splats;
        c->has_sides &= info->has_sides;
        c->points.has_color |= info->has_color;
        for (int a = 0; a < 3; a++) {
            c->bounds[0][a] = fmin(c->bounds[0][a], info->bounds_min[a]);
            c->bounds[1][a] = fmax(c->bounds[1][a], info->bounds_max[a]);
        }
    }
    spl_dataset_close(dataset);
    return rc;
}
