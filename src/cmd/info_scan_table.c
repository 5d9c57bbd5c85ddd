/* The same as a table to read. Owned by the command's thread. */
#include "cmd/info_scan_parts.h"

#include <stdio.h>

#include "cmd/info_panoramas.h"
#include "cmd/output.h"

static void print_list(const char *label, const json_t *list)
{
    size_t i;
    const json_t *item;
    printf("  %-14s", label);
    json_array_foreach(list, i, item)
    {
        printf("%s", i ? ", " : "");
        spl_cmd_put_text(stdout, json_string_value(item), 0);
    }
    printf("%s\n", json_array_size(list) ? "" : "none but position");
}

void spl_info_print_pack(const json_t *pack)
{
    const json_t *warnings = json_object_get(pack, "warnings"), *warning;
    size_t i;
    const char *refused = json_string_value(json_object_get(pack, "refused"));
    if (refused)
        spl_cmd_put_row("refused", refused);
    printf("  as a dataset  about %.1f MB; packing takes about %.0f MB of memory\n",
           json_number_value(json_object_get(pack, "dataset_bytes")) / 1e6,
           json_number_value(json_object_get(pack, "memory_bytes")) / 1e6);
    spl_info_print_panoramas(json_object_get(pack, "panoramas"));
    json_array_foreach(warnings, i, warning) spl_cmd_put_row(i ? "" : "warnings", json_string_value(warning));
}

void spl_info_print_scan(const json_t *json, const struct spl_scan *scan, const struct spl_cloud_info *info, bool read)
{
    const json_t *points = json_object_get(json, "points"), *header = json_object_get(json, "header_bounds");
    const char *crs = json_string_value(json_object_get(json, "crs")), *name = info->coordinates.name;
    char text[32];
    spl_cmd_put_text(stdout, scan->path, 0);
    printf("  %s%s%s, %.1f MB\n", info->format, info->version[0] ? " " : "", info->version,
           (double)info->file_bytes / 1e6);
    if (info->named)
        printf("  ending        of %s, which it is not\n", info->named);
    if (json_is_null(points))
        printf("  points        not in the header\n");
    else
        printf("  points        %s%s\n", spl_cmd_group((uint64_t)json_integer_value(points), text),
               read ? "" : " as the header says");
    if (read && info->points_skipped)
        printf("  skipped       %s without a place\n", spl_cmd_group(info->points_skipped, text));
    print_list("attributes", json_object_get(json, "attributes"));
    if (info->fields[0])
        spl_cmd_put_row("fields", info->fields);
    if (info->guessed[0])
        printf("  columns       %s by the values%s\n", info->guessed,
               info->guessed[0] == '-' ? ": the first numbers, names or times the points" : "");
    if (info->north_first)
        printf(
            "  columns       %s, as where the north comes before the east: then y and x change places in --columns\n",
            info->north_first);
    if (info->surveyors)
        printf("  columns       Y is the east and X the north, as surveyors have it: x and y here\n");
    if (info->units[0])
        spl_cmd_put_row("headings", info->units);
    if (info->footer[0])
        spl_cmd_put_row("end", info->footer);
    if (info->unused[0])
        spl_cmd_put_row("not used", info->unused);
    if (scan->colors.from != SPL_COLORS_CONSTANT)
        printf("  color from    %s, %g is black and %g white%s%s\n",
               scan->colors.from == SPL_COLORS_RGB ? "rgb" : "intensity", scan->colors.black, scan->colors.white,
               scan->colors.guessed ? " by the values" : "", scan->colors.dark > 0 ? ", which are nearly black" : "");
    if (crs || name[0]) /* of a system without a number the name; --json has its text */
        spl_cmd_put_row("crs", crs && (info->coordinates.epsg || !name[0]) ? crs : name);
    spl_cmd_put_row("unit", json_string_value(json_object_get(json, "unit")));
    if (scan->min[0] <= scan->max[0])
        printf("  bounds        %.10g %.10g %.10g to\n                %.10g %.10g %.10g%s\n", scan->min[0],
               scan->min[1], scan->min[2], scan->max[0], scan->max[1], scan->max[2], read ? "" : " as the header says");
    else
        printf("  bounds        %s\n", read ? "none" : "not in the header");
    if (header)
        printf("                the header says %.10g %.10g %.10g to %.10g %.10g %.10g\n", info->bounds[0][0],
               info->bounds[0][1], info->bounds[0][2], info->bounds[1][0], info->bounds[1][1], info->bounds[1][2]);
    if (info->station_count)
        printf("  stations      %u\n", info->station_count);
    for (uint32_t i = 0; i < info->image_count; i++) {
        const struct spl_cloud_image *image = &info->images[i];
        printf("  %-14s%s, %.10g x %.10g %s, %s bytes%s", i ? "" : "images", image->kind, image->width, image->height,
               image->coding[0] ? image->coding : "without data", spl_cmd_group(image->bytes, text),
               image->posed ? "" : ", no pose");
        printf("%s", image->name[0] ? ": " : "");
        spl_cmd_put_text(stdout, image->name, 0);
        putchar('\n');
    }
    spl_info_print_pack(json_object_get(json, "pack"));
}
