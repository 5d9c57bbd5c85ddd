/* What a scan holds, and what a pack of it would make, as JSON. What a pack would warn of is asked of the same code
 * that warns. Owned by the command's thread. */
#include "cmd/info_scan_parts.h"

#include <math.h>
#include <stdlib.h>

#include "base/text.h"
#include "cloud/crs.h"
#include "cloud/rows.h"
#include "cmd/info_panoramas.h"
#include "geom/unit.h"
#include "pack/look.h"
#include "pack/system.h"

json_t *spl_info_text(const char *text)
{
    char shown[4096];
    json_t *json = json_string(text);
    return json ? json : json_string(spl_text_show(text, shown, sizeof shown));
}

json_t *spl_info_bounds(const double min[3], const double max[3])
{
    return json_pack("{s:[f, f, f], s:[f, f, f]}", "min", min[0], min[1], min[2], "max", max[0], max[1], max[2]);
}

/* Whether the header's box is another one than the points': beyond a step, by which programs round. */
static bool lies(const struct spl_cloud_info *info, const struct spl_scan *scan)
{
    bool off = false;
    for (int c = 0; c < 3; c++) {
        double step = fmax(info->coordinates.step[c], 1e-9 * fmax(fabs(scan->min[c]), fabs(scan->max[c])));
        off |= fabs(info->bounds[0][c] - scan->min[c]) > 1.5 * step ||
               fabs(info->bounds[1][c] - scan->max[c]) > 1.5 * step;
    }
    return info->has_bounds && off;
}

/* What a pack keeps of a scan, by the names of a dataset. */
static json_t *list_attributes(const struct spl_cloud_info *info, const struct spl_scan *scan)
{
    json_t *all = json_array();
    if (scan->points_from[SPL_COLORS_RGB] || scan->points_from[SPL_COLORS_INTENSITY])
        json_array_append_new(all, json_string("color"));
    if (info->attributes & SPL_CLOUD_NORMAL)
        json_array_append_new(all, json_string("normal"));
    for (int c = SPL_COLUMN_CLASS; c < SPL_COLUMN_KEPT; c++)
        if (info->columns >> c & 1)
            json_array_append_new(all, json_string(spl_column_name(c)));
    if (info->attributes & SPL_CLOUD_STATION)
        json_array_append_new(all, json_string("station"));
    return all;
}

static void collect(void *context, const char *text)
{
    json_array_append_new(context, spl_info_text(text));
}

uint64_t spl_info_count_points(const struct spl_scan *scan)
{
    return scan->points_from[0] + scan->points_from[1] + scan->points_from[2];
}

json_t *spl_info_describe_pack(const struct spl_scans *scans, struct spl_scan *list, size_t count)
{
    struct spl_scans some = *scans;
    uint64_t points = 0;
    json_t *warnings = json_array();
    some.list = list;
    some.count = count;
    for (size_t i = 0; i < count; i++)
        points += spl_info_count_points(&list[i]);
    struct spl_pack_estimate estimate = spl_pack_estimate(points);
    const struct spl_system_options said = {.warn = collect, .context = warnings};
    struct spl_system system;
    struct spl_error refused = {0};
    spl_system_find(&system, &some, &said, &refused);
    spl_system_finish(&system);
    spl_scans_compare(&some, collect, warnings);
    /* of thousands of tiles beside one folder of panoramas it is read once */
    json_t *panoramas =
        count == scans->count ? spl_info_list_panoramas(list, count, warnings, &estimate.dataset_bytes) : json_array();
    if (points > UINT32_MAX - 1)
        json_array_append_new(
            warnings, json_sprintf("more than %u points are refused: pack them as several datasets", UINT32_MAX - 1));
    return json_pack("{s:o, s:I, s:I, s:o, s:o}", "refused",
                     refused.code ? spl_info_text(refused.message) : json_null(), "memory_bytes",
                     (json_int_t)estimate.memory_bytes, "dataset_bytes", (json_int_t)estimate.dataset_bytes,
                     "panoramas", panoramas, "warnings", warnings);
}

static json_t *list_images(const struct spl_cloud_info *info)
{
    json_t *all = json_array();
    for (uint32_t i = 0; i < info->image_count; i++) {
        const struct spl_cloud_image *image = &info->images[i];
        json_array_append_new(all,
                              json_pack("{s:o, s:s, s:s, s:f, s:f, s:I, s:b}", "name", spl_info_text(image->name),
                                        "kind", image->kind, "coding", image->coding, "width", image->width, "height",
                                        image->height, "bytes", (json_int_t)image->bytes, "posed", (int)image->posed));
    }
    return all;
}

static void set(json_t *object, const char *name, json_t *value)
{
    json_object_set_new(object, name, value);
}

json_t *spl_info_describe_scan(const struct spl_scans *scans, struct spl_scan *scan, const struct spl_cloud_info *info,
                               const struct spl_info_scan_options *options)
{
    static const char *const from[] = {"constant", "rgb", "intensity"};
    char unit[SPL_UNIT_TEXT_MAX], *crs = spl_crs_print(&info->coordinates);
    bool counted = options->read || info->points_expected, boxed = scan->min[0] <= scan->max[0];
    json_t *json = json_object(), *colors = json_object();
    for (int k = 0; k < 3; k++)
        if (options->read && scan->points_from[k])
            set(colors, from[k], json_integer((json_int_t)scan->points_from[k]));
    set(json, "scan", spl_info_text(scan->path));
    set(json, "format", json_string(info->format));
    set(json, "version", info->version[0] ? spl_info_text(info->version) : json_null());
    set(json, "ending_of", info->named ? json_string(info->named) : json_null());
    set(json, "file_bytes", json_integer((json_int_t)info->file_bytes));
    set(json, "read", json_boolean(options->read));
    set(json, "points", counted ? json_integer((json_int_t)spl_info_count_points(scan)) : json_null());
    set(json, "points_skipped", options->read ? json_integer((json_int_t)info->points_skipped) : json_null());
    set(json, "attributes", list_attributes(info, scan));
    set(json, "fields", info->fields[0] ? spl_info_text(info->fields) : json_null());
    set(json, "columns_by_values", info->guessed[0] ? json_string(info->guessed) : json_null());
    set(json, "columns_not_used", info->unused[0] ? spl_info_text(info->unused) : json_null());
    set(json, "y_is_east", json_boolean(info->surveyors));
    set(json, "color_from", options->read ? colors : json_pack("[s]", from[scan->colors.from]));
    set(json, "stations",
        options->read || info->station_count ? json_integer((json_int_t)info->station_count) : json_null());
    set(json, "images", list_images(info));
    set(json, "crs", crs ? spl_info_text(crs) : json_null());
    set(json, "crs_name", info->coordinates.name[0] ? spl_info_text(info->coordinates.name) : json_null());
    set(json, "unit",
        json_string(info->coordinates.angles ? "degree" : spl_unit_print(info->coordinates.unit_m, unit)));
    set(json, "bounds", boxed ? spl_info_bounds(scan->min, scan->max) : json_null());
    if (boxed && lies(info, scan))
        set(json, "header_bounds", spl_info_bounds(info->bounds[0], info->bounds[1]));
    set(json, "pack", spl_info_describe_pack(scans, scan, 1));
    if (!options->read)
        json_decref(colors);
    free(crs);
    return json;
}
