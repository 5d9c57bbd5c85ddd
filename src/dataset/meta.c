/* Opening, second stage: META, the JSON section with what pack knew about the dataset as a whole. Every key that
 * readers rely on is checked here once, so that nobody after this handles a missing or absurd one; a refusal says which
 * key, what it is and what it may be. The opener's thread.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "dataset/open.h"
#include "dataset/saved_views.h"
#include "geom/ground.h"
#include "geom/json.h"
#include "geom/station.h"
#include "geom/unit.h"

/* `what` is what is allowed: "FILE: section META: "KEY" is VALUE, and must be WHAT". `path` is the key's, from the top.
 */
static int wrong(const struct spl_dataset *dataset, struct spl_error *err, const char *path, const json_t *value,
                 const char *what)
{
    char shape[40], *text = NULL;
    const char *shown = spl_json_show_shape(value, shape);
    if (json_is_string(value) || json_is_number(value))
        shown = text = json_dumps(value, JSON_ENCODE_ANY | JSON_REAL_PRECISION(17));
    int rc = spl_fail_field(err, SPL_E_CORRUPT, path,
                            "%s: section META: \"%s\" is %.60s, and must be %s; pack the dataset again", dataset->name,
                            path, shown ? shown : shape, what);
    free(text);
    return rc;
}

/* The same of entry `index` of the array at `path`, or of `member` of it where that is not NULL. */
static int wrong_entry(const struct spl_dataset *dataset, struct spl_error *err, const char *path, size_t index,
                       const char *member, const json_t *value, const char *what)
{
    char entry[128];
    snprintf(entry, sizeof entry, "%s[%zu]%s%s", path, index, member ? "." : "", member ? member : "");
    return wrong(dataset, err, entry, value, what);
}

static int get_count(const struct spl_dataset *dataset, const char *key, uint64_t most, const char *what, uint64_t *out,
                     struct spl_error *err)
{
    const json_t *value = json_object_get(dataset->meta, key);
    if (!json_is_integer(value) || json_integer_value(value) < 1 || (uint64_t)json_integer_value(value) > most)
        return wrong(dataset, err, key, value, what);
    *out = (uint64_t)json_integer_value(value);
    return SPL_OK;
}

/* "parent.member", three coordinates. */
static int get_vector(const struct spl_dataset *dataset, const char *parent, const char *member, double out[3],
                      struct spl_error *err)
{
    char path[64];
    const json_t *array = json_object_get(json_object_get(dataset->meta, parent), member);
    snprintf(path, sizeof path, "%s.%s", parent, member);
    if (!json_is_array(array) || json_array_size(array) != 3)
        return wrong(dataset, err, path, array, "an array of three numbers");
    for (size_t i = 0; i < 3; i++) {
        const json_t *number = json_array_get(array, i);
        if (!json_is_number(number) || fabs(json_number_value(number)) > 1e15)
            return wrong_entry(dataset, err, path, i, NULL, number, "a coordinate, from -1e15 to 1e15");
        out[i] = json_number_value(number);
    }
    return SPL_OK;
}

static int get_bounds(struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_dataset_info *info = &dataset->info;
    int rc = get_vector(dataset, "bounds", "min", info->bounds_min, err);
    if (!rc)
        rc = get_vector(dataset, "bounds", "max", info->bounds_max, err);
    for (int a = 0; !rc && a < 3; a++)
        if (info->bounds_min[a] > info->bounds_max[a])
            rc =
                wrong_entry(dataset, err, "bounds.min", (size_t)a, NULL,
                            json_array_get(json_object_get(json_object_get(dataset->meta, "bounds"), "min"), (size_t)a),
                            "at most that of \"bounds.max\"");
    return rc;
}

static int get_view(struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_dataset_info *info = &dataset->info;
    const char *key = "default_view";
    const json_t *view = json_object_get(dataset->meta, key), *fov = json_object_get(view, "fov");
    int rc = get_vector(dataset, key, "eye", info->default_eye, err);
    if (!rc)
        rc = get_vector(dataset, key, "target", info->default_target, err);
    if (!rc)
        rc = get_vector(dataset, key, "up", info->default_up, err);
    if (rc)
        return rc;
    if (!json_is_number(fov) || !(json_number_value(fov) > 0 && json_number_value(fov) <= 179))
        return wrong(dataset, err, "default_view.fov", fov, "a number of degrees above 0, up to 179");
    info->default_fov = json_number_value(fov);
    struct spl_camera camera = {0};
    struct spl_error why = {0};
    if (spl_camera_look_at(&camera, info->default_eye, info->default_target, info->default_up, &why))
        return spl_fail_field(err, SPL_E_CORRUPT, key,
                              "%s: section META: \"%s\" is no view: %s; pack the dataset again", dataset->name, key,
                              why.message);
    return SPL_OK;
}

/* Optional: what an image of another shape than 16:9 shows. */
static int get_fit(struct spl_dataset *dataset, struct spl_error *err)
{
    const char *path = "default_view.fit";
    const json_t *fit = json_object_get(json_object_get(dataset->meta, "default_view"), "fit");
    double *angles = dataset->info.default_fit;
    if (!fit)
        return SPL_OK;
    bool good = spl_json_get_numbers(fit, 2, angles);
    for (int i = 0; good && i < 2; i++)
        good = angles[i] > 0 && angles[i] <= 179;
    return good ? SPL_OK : wrong(dataset, err, path, fit, "two numbers of degrees above 0, up to 179");
}

/* Optional: what its packer has said of it. */
static int get_said(struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_dataset_info *info = &dataset->info;
    const json_t *title = json_object_get(dataset->meta, "title");
    const json_t *description = json_object_get(dataset->meta, "description");
    const json_t *views = json_object_get(dataset->meta, "views");
    struct spl_error why = {0};
    if (title && (!json_is_string(title) || json_string_length(title) > SPL_TITLE_BYTES_MAX))
        return wrong(dataset, err, "title", title, "a text of at most 200 bytes");
    if (description && (!json_is_string(description) || json_string_length(description) > SPL_DESCRIPTION_BYTES_MAX))
        return wrong(dataset, err, "description", description, "a text of at most 4000 bytes");
    info->title = json_string_value(title);
    info->description = json_string_value(description);
    if (views && spl_saved_views_from_json(views, info->default_up, dataset->views, &info->view_count, &why))
        return spl_fail_field(err, SPL_E_CORRUPT, why.field, "%s: section META: %s; pack the dataset again",
                              dataset->name, why.message);
    info->views = dataset->views;
    return SPL_OK;
}

static int get_attributes(struct spl_dataset *dataset, struct spl_error *err)
{
    const json_t *attributes = json_object_get(dataset->meta, "attributes");
    const json_t *color = json_object_get(attributes, "color"), *surface = json_object_get(attributes, "surface");
    if (!json_is_boolean(color))
        return wrong(dataset, err, "attributes.color", color, "true or false");
    if (surface && !json_is_boolean(surface))
        return wrong(dataset, err, "attributes.surface", surface, "true, which a missing one means too, or false");
    dataset->info.has_color = json_is_true(color);
    dataset->info.has_surface = !json_is_false(surface);
    return SPL_OK;
}

/* Optional. Scanner poses: what a panorama or an orientation refers to. */
static int get_stations(struct spl_dataset *dataset, struct spl_error *err)
{
    const char *key = "stations";
    const json_t *stations = json_object_get(dataset->meta, key);
    const size_t count = json_array_size(stations); /* META's length bounds it */
    if (stations && !json_is_array(stations))
        return wrong(dataset, err, key, stations, "an array");
    if (count && !(dataset->stations = spl_alloc_raw(count, sizeof *dataset->stations, err)))
        return SPL_E_NOMEM;
    for (size_t i = 0; i < count; i++) {
        const json_t *matrix = json_array_get(stations, i);
        if (!spl_json_get_numbers(matrix, 16, dataset->stations[i]))
            return wrong_entry(dataset, err, key, i, NULL, matrix, "a matrix of 16 numbers");
        const char *needed = spl_station_judge(dataset->stations[i]);
        if (needed)
            return wrong_entry(dataset, err, key, i, NULL, matrix, needed);
    }
    dataset->info.has_sides = dataset->info.has_surface && count > 0;
    dataset->info.station_count = (uint32_t)count;
    dataset->info.stations = (const double (*)[16])dataset->stations;
    return SPL_OK;
}

static int check_sources(struct spl_dataset *dataset, struct spl_error *err)
{
    const json_t *sources = json_object_get(dataset->meta, "sources");
    if (!json_is_array(sources))
        return wrong(dataset, err, "sources", sources, "an array of names");
    for (size_t i = 0; i < json_array_size(sources); i++)
        if (!json_is_string(json_array_get(sources, i)))
            return wrong_entry(dataset, err, "sources", i, NULL, json_array_get(sources, i), "a name");
    return SPL_OK;
}

/* Optional: how many leaf splats there were before nodes were dropped. */
static int check_pruned(struct spl_dataset *dataset, struct spl_error *err)
{
    const json_t *pruned = json_object_get(dataset->meta, "pruned"), *of = json_object_get(pruned, "of");
    const struct spl_dataset_info *info = &dataset->info;
    if (pruned && (!json_is_integer(of) || json_integer_value(of) < (json_int_t)info->leaf_splats ||
                   json_integer_value(of) > (json_int_t)info->points))
        return wrong(dataset, err, "pruned.of", of, "a whole number from \"leaf_splats\" to \"points\"");
    return SPL_OK;
}

enum { crs_bytes_max = 64 << 10 };

/* Optional: what coordinates are in, and where on earth. */
static int get_unit(struct spl_dataset *dataset, struct spl_error *err)
{
    const json_t *unit = json_object_get(dataset->meta, "unit"), *crs = json_object_get(dataset->meta, "crs");
    double metres = 0;
    if (unit && (!json_is_string(unit) || !spl_unit_parse(json_string_value(unit), &metres)))
        return wrong(dataset, err, "unit", unit, SPL_UNIT_FORMS);
    if (crs && !json_is_null(crs) && (!json_is_string(crs) || json_string_length(crs) > crs_bytes_max))
        return wrong(dataset, err, "crs", crs, "a text (WKT, or EPSG and a number) of at most 64 KiB, or null");
    spl_unit_print(metres, dataset->info.unit);
    dataset->info.epsg = spl_epsg_from_text(json_string_value(crs));
    dataset->info.crs = json_string_value(crs);
    return SPL_OK;
}

/* Optional. */
static int check_color(struct spl_dataset *dataset, struct spl_error *err)
{
    const char *key = "color";
    const json_t *all = json_object_get(dataset->meta, key);
    if (all && !json_is_array(all))
        return wrong(dataset, err, key, all, "an array");
    for (size_t i = 0; i < json_array_size(all); i++) {
        const json_t *one = json_array_get(all, i), *points = json_object_get(one, "points");
        const json_t *source = json_object_get(one, "source"), *from_json = json_object_get(one, "from");
        const char *from = json_string_value(from_json);
        if (!json_is_string(source))
            return wrong_entry(dataset, err, key, i, "source", source, "a name");
        if (!json_is_integer(points) || json_integer_value(points) < 0)
            return wrong_entry(dataset, err, key, i, "points", points, "a whole number, 0 or more");
        if (!from || (strcmp(from, "rgb") && strcmp(from, "intensity") && strcmp(from, "constant") &&
                      strcmp(from, "photographs")))
            return wrong_entry(dataset, err, key, i, "from", from_json, "rgb, intensity, constant or photographs");
    }
    return SPL_OK;
}

/* What nodes and chunks add up to; held against them where all are read. */
static int get_counts(struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_dataset_info *info = &dataset->info;
    struct spl_counts *counts = &dataset->counts;
    const json_t *json = json_object_get(dataset->meta, "counts");
    if (!spl_counts_from_json(json, info->stream_count, counts))
        return wrong(
            dataset, err, "counts", json,
            "an object that says how many \"splats\", \"pieces\" and \"linear_chunks\" there are, and \"bits\" and "
            "\"stream_bits\" of each attribute");
    if (counts->panel_points > info->leaf_splats)
        return wrong(dataset, err, "counts.panel_points", json_object_get(json, "panel_points"),
                     "at most \"leaf_splats\"");
    if (counts->mesh_points > info->leaf_splats - counts->panel_points)
        return wrong(dataset, err, "counts.mesh_points", json_object_get(json, "mesh_points"),
                     "at most \"leaf_splats\" without \"panel_points\"");
    if (counts->splats < info->leaf_splats - counts->panel_points - counts->mesh_points)
        return wrong(dataset, err, "counts.splats", json_object_get(json, "splats"),
                     "at least \"leaf_splats\" without \"panel_points\" and \"mesh_points\"");
    counts->leaf_splats = info->leaf_splats;
    counts->levels = info->levels;
    info->splats = counts->splats;
    info->pieces = counts->pieces;
    info->panels = counts->panels;
    info->panel_points = counts->panel_points;
    info->meshes = counts->meshes;
    info->mesh_points = counts->mesh_points;
    info->has_linear = counts->linear_chunks > 0;
    memcpy(info->attribute_bits, counts->bits, sizeof info->attribute_bits);
    for (uint32_t s = 0; s < info->stream_count; s++)
        info->streams[s].bits = counts->stream_bits[s];
    return SPL_OK;
}

/* Behind the numbers of points and levels, in this order. */
static int (*const checks[])(struct spl_dataset *dataset, struct spl_error *err) = {
    check_pruned,  get_bounds,   get_view,    get_fit,  get_said,                get_attributes,
    check_sources, get_stations, check_color, get_unit, spl_dataset_read_streams};

int spl_dataset_check_meta(struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_dataset_info *info = &dataset->info;
    uint64_t bytes;
    const char *text = spl_dataset_get_copy(dataset, SPL_KIND_META, &bytes);
    json_error_t where;
    dataset->meta = json_loadb(text, bytes, JSON_REJECT_DUPLICATES, &where);
    if (!dataset->meta)
        return spl_fail(err, SPL_E_CORRUPT, "%s: section META is no JSON object: %s at byte %d; pack the dataset again",
                        dataset->name, where.text, where.position);
    if (!json_is_object(dataset->meta))
        return spl_fail(err, SPL_E_CORRUPT, "%s: section META is no JSON object; pack the dataset again",
                        dataset->name);
    if (json_object_get(dataset->meta, "tiles"))
        dataset->kind = SPL_FILE_COLLECTION;
    const json_t *radius = json_object_get(dataset->meta, "splat_radius");
    const char *count = "a whole number, 1 or more";
    uint64_t levels = 0, whole = UINT64_MAX;
    int rc = spl_dataset_clean_meta(dataset, err);
    if (!rc)
        rc = get_count(dataset, "points", INT64_MAX, count, &info->points, err);
    if (!rc)
        rc = get_count(dataset, "leaf_splats", INT64_MAX, count, &info->leaf_splats, err);
    if (!rc && json_object_get(dataset->meta, "part_of"))
        rc = get_count(dataset, "part_of", INT64_MAX, count, &whole, err);
    if (!rc && whole <= info->points)
        rc = wrong(dataset, err, "part_of", json_object_get(dataset->meta, "part_of"), "more than \"points\"");
    if (!rc && info->leaf_splats > info->points)
        rc = wrong(dataset, err, "leaf_splats", json_object_get(dataset->meta, "leaf_splats"), "at most \"points\"");
    if (!rc)
        rc = get_count(dataset, "levels", UINT8_MAX + 1, "a whole number from 1 to 256", &levels, err);
    for (size_t i = 0; !rc && i < sizeof checks / sizeof *checks; i++)
        rc = checks[i](dataset, err);
    if (!rc && (!json_is_number(radius) || !(json_number_value(radius) > 0)))
        rc = wrong(dataset, err, "splat_radius", radius, "a number above 0");
    if (rc)
        return rc;
    info->splat_radius = json_number_value(radius);
    info->levels = (uint32_t)levels;
    return get_counts(dataset, err);
}
