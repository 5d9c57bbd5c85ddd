/* What splatd info says of a dataset, as JSON. The command's thread. */
#include "cmd/info_report.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "dataset/classes.h"
#include "dataset/saved_views.h"
#include "dataset/stations.h"
#include "render/soft/suggest.h"

static json_t *vector(const double v[3])
{
    return json_pack("[f,f,f]", v[0], v[1], v[2]);
}

/* null where there are none; NULL when memory is refused. */
static json_t *textures_to_json(const struct spl_info_report *report)
{
    const struct spl_dataset_info *info = report->info;
    json_t *counts = info->atoms ? json_array() : NULL;
    if (!info->atoms)
        return json_null();
    for (int count = 0; count <= SPL_ATOMS_MAX; count++)
        json_array_append_new(counts, json_integer((json_int_t)report->atoms[count]));
    return json_pack("{s:I, s:I, s:I, s:o}", "size", (json_int_t)info->texture_size, "atoms", (json_int_t)info->atoms,
                     "dictionary_bytes", (json_int_t)info->dictionary_bytes, "splats_by_atoms", counts);
}

/* The same of maps. */
static json_t *maps_to_json(const struct spl_info_report *report)
{
    const struct spl_dataset_info *info = report->info;
    const struct spl_map_row *rows = spl_dataset_get_maps(report->dataset, &(uint32_t){0});
    json_t *list = info->maps ? json_array() : json_null();
    if (!info->maps)
        return list;
    for (uint32_t i = 0; i < info->maps; i++)
        json_array_append_new(list, json_pack("{s:o, s:i, s:i, s:i, s:I}", "position", vector(rows[i].position), "side",
                                              (int)rows[i].side, "levels", (int)rows[i].levels, "range_side",
                                              (int)rows[i].range_side, "bytes",
                                              (json_int_t)spl_dataset_get_map_bytes(report->dataset, i)));
    return json_pack("{s:i, s:I, s:I, s:f, s:o, s:O?}", "stations", (int)info->maps, "texels",
                     (json_int_t)info->map_texels, "bytes", (json_int_t)info->map_bytes, "bytes_per_texel",
                     (double)info->map_bytes / (double)info->map_texels, "by_station", list, "made",
                     json_object_get(spl_dataset_get_meta(report->dataset), "maps"));
}

static json_t *stations_to_json(const struct spl_dataset_info *info)
{
    json_t *list = json_array();
    for (uint32_t i = 0; i < info->station_count; i++)
        json_array_append_new(list, spl_station_to_json(info, i));
    return list;
}

/* Bytes with the chunks' headers. */
static json_t *kinds_to_json(const struct spl_info_report *report)
{
    static const char *const item_names[SPL_CHUNK_KINDS] = {"splats", "pieces", "panels", "meshes"};
    json_t *kinds = json_object();
    for (uint32_t kind = 0; kind < SPL_CHUNK_KINDS; kind++)
        json_object_set_new(kinds, spl_chunk_get_codec(kind)->name,
                            json_pack("{s:I, s:I, s:I}", "chunks", (json_int_t)report->chunks[kind],
                                      item_names[kind], (json_int_t)report->items[kind],
                                      "bytes", (json_int_t)report->bytes[kind]));
    return kinds;
}

static json_t *panels_to_json(const struct spl_info_report *report, enum spl_chunk_kind kind)
{
    return json_pack("{s:I, s:I, s:I, s:f, s:f}", "count", (json_int_t)report->items[kind], "points",
                     (json_int_t)report->points[kind], "bytes", (json_int_t)report->bytes[kind], "error_mean",
                     spl_info_error_mean(report, kind), "error_most", report->error_most[kind]);
}

/* What is said as something else than a splat a point. */
static json_t *primitives_to_json(const struct spl_info_report *report)
{
    json_t *packed = json_object_get(spl_dataset_get_meta(report->dataset), "primitives");
    json_t *panels = panels_to_json(report, SPL_CHUNK_PANELS);
    json_object_set(panels, "packed", packed ? packed : json_null());
    return json_pack("{s:o, s:o, s:{s:I, s:I, s:I}}", "panels", panels, "meshes",
                     panels_to_json(report, SPL_CHUNK_MESHES), "lines", "count",
                     (json_int_t)report->items[SPL_CHUNK_LINES], "points", (json_int_t)report->linear, "bytes",
                     (json_int_t)report->bytes[SPL_CHUNK_LINES]);
}

/* Times this, bytes a splat are bytes a point that was kept: coarser levels have splats besides. */
static double splats_a_point(const struct spl_dataset_info *info)
{
    return spl_info_has_primitives(info) ? 1 : (double)info->splats / (double)info->leaf_splats;
}

static json_t *bytes_to_json(const struct spl_dataset_info *info, double times)
{
    json_t *bytes = json_pack("{s:f}", "total", times * spl_info_total_bytes_per_splat(info));
    for (int a = 0; a < spl_info_count(info); a++)
        json_object_set_new(bytes, spl_info_name(info, a), json_real(times * spl_info_bytes_per_splat(info, a)));
    return bytes;
}

/* How many points have each; null where the dataset has none, or more than are counted. */
static json_t *classes_to_json(const struct spl_dataset_info *info)
{
    for (uint32_t s = 0; s < info->stream_count; s++) {
        const struct spl_stream_values *values = spl_dataset_info_get_values(info, s);
        if (!values || !values->kind_count || strcmp(info->streams[s].name, "class"))
            continue;
        json_t *kinds = json_array();
        for (uint32_t i = 0; i < values->kind_count; i++)
            json_array_append_new(kinds, json_pack("{s:f, s:I, s:s?}", "value", values->kinds[i].value, "count",
                                                   (json_int_t)values->kinds[i].count, "name",
                                                   spl_class_name(values->kinds[i].value)));
        return kinds;
    }
    return json_null();
}

static json_t *suggestions_to_json(const struct spl_dataset_info *info)
{
    char terms[SPL_SUGGESTIONS_MAX][SPL_SUGGESTION_MAX];
    const uint32_t count = spl_soft_suggest(info, terms);
    json_t *list = json_array();
    for (uint32_t i = 0; i < count; i++)
        json_array_append_new(list, json_string(terms[i]));
    return list;
}

/* As `faulty_tiles` of GET /v1/datasets; null of what is no collection. */
static json_t *lost_to_json(const struct spl_info_report *report)
{
    json_t *first = json_array();
    for (uint32_t i = 0; i < report->lost_count && i < SPL_INFO_LOST_MAX; i++)
        json_array_append_new(first, json_pack("{s:s, s:s}", "file", report->lost[i].file, "reason",
                                               report->lost[i].reason));
    json_t *lost = json_pack("{s:I, s:o}", "count", (json_int_t)report->lost_count, "first", first);
    if (report->info->tiles)
        return lost;
    json_decref(lost);
    return json_null();
}

/* NULL when memory is refused: json_pack passes it on. */
json_t *spl_info_to_json(const struct spl_info_report *report)
{
    const struct spl_dataset_info *info = report->info;
    const json_t *meta = spl_dataset_get_meta(report->dataset);
    json_t *bytes = bytes_to_json(info, 1);
    json_t *bytes_of_points = bytes_to_json(info, splats_a_point(info));
    json_t *levels = json_array();
    for (uint32_t i = 0; i < report->level_count; i++) {
        const struct spl_info_level *l = &report->levels[i];
        json_array_append_new(levels, json_pack("{s:I, s:I, s:I, s:I, s:I, s:I, s:f}", "nodes", (json_int_t)l->nodes,
                                                "chunks", (json_int_t)l->chunks, "splats", (json_int_t)l->splats,
                                                "pieces", (json_int_t)l->pieces, "panels", (json_int_t)l->panels,
                                                "meshes", (json_int_t)l->meshes, "spacing", l->spacing));
    }
    json_t *widths = json_object();
    for (int k = 0; k < SPL_INFO_CODES + (int)info->stream_count; k++) {
        json_t *histogram = json_object();
        for (int width = 0; width <= SPL_INFO_WIDTH_MAX; width++) {
            char key[16];
            snprintf(key, sizeof key, "%d", width);
            if (report->widths[k][width] > 0)
                json_object_set_new(histogram, key, json_real(report->widths[k][width]));
        }
        const char *name = k < SPL_INFO_CODES ? spl_info_codes[k].name : info->streams[k - SPL_INFO_CODES].name;
        json_object_set_new(widths, name, histogram);
    }
    return json_pack(
        "{s:s, s:I, s:I, s:o, s:o, s:I, s:I, s:I, s:I, s:i, s:I, s:I, s:I, s:{s:o, s:o}, s:{s:o, s:o, s:o, s:f}, s:f, "
        "s:{s:b, s:b, s:b, s:b}, s:I, s:I, s:I, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:O, s:O?, s:O?, s:s, s:O?, s:O?, "
        "s:O?, s:O?, s:o, s:s?, s:s?, s:o, s:o, s:o, s:o}",
        "id", info->id, "tiles", (json_int_t)info->tiles, "tile_bytes", (json_int_t)info->tile_bytes,
        "faulty_tiles", lost_to_json(report), "version", json_sprintf("%016" PRIx64, info->version),
        "file_bytes", (json_int_t)info->file_bytes, "points", (json_int_t)info->points, "leaf_splats",
        (json_int_t)info->leaf_splats, "splats", (json_int_t)info->splats, "levels", (int)info->levels, "nodes",
        (json_int_t)info->nodes, "chunks", (json_int_t)info->chunks, "pages", (json_int_t)info->pages, "bounds", "min",
        vector(info->bounds_min), "max",
        vector(info->bounds_max), "default_view", "eye", vector(info->default_eye), "target",
        vector(info->default_target), "up", vector(info->default_up), "fov", info->default_fov, "splat_radius",
        info->splat_radius, "attributes", "color", (int)info->has_color, "class", (int)info->has_class, "uncertainty",
        (int)info->has_uncertainty, "surface", (int)info->has_surface, "linear", (json_int_t)report->linear,
        "clip_lines", (json_int_t)report->clips, "page_bytes", (json_int_t)info->page_bytes, "kinds",
        kinds_to_json(report), "bytes_per_splat", bytes, "bytes_per_point", bytes_of_points, "by_level", levels,
        "widths", widths, "textures", textures_to_json(report), "maps", maps_to_json(report), "sources",
        json_object_get(meta, "sources"), "color", json_object_get(meta, "color"), "streams",
        json_object_get(meta, "streams"), "unit", info->unit, "crs", json_object_get(meta, "crs"), "part_of",
        json_object_get(meta, "part_of"), "pruned", json_object_get(meta, "pruned"), "up", json_object_get(meta, "up"),
        "primitives", primitives_to_json(report), "title",
        info->title, "description", info->description, "views", spl_saved_views_to_json(info->views, info->view_count),
        "classes", classes_to_json(info), "soft", suggestions_to_json(info), "stations", stations_to_json(info));
}
