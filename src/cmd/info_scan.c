/* splatd info of scans: each is opened as a pack would open it, read to its end unless that is not wanted, and
 * described before the next one, so that thousands of tiles take the memory of one. What a pack would warn of is asked
 * of the same code that warns. Owned by the command's thread. */
#include "cmd/info_scan.h"

#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include <jansson.h>

#include "base/exit.h"
#include "base/text.h"
#include "cloud/crs.h"
#include "cloud/rows.h"
#include "cmd/cmd.h"
#include "cmd/info_panoramas.h"
#include "cmd/output.h"
#include "cmd/progress.h"
#include "dataset/remote_url.h"
#include "geom/unit.h"
#include "pack/look.h"
#include "pack/system.h"

enum { batch_points = 65536 };

struct session {
    const struct spl_info_scan_options *options;
    struct spl_cmd_progress progress;
    int worst; /* exit code */
};

bool spl_info_is_scan(const char *path)
{
    char first[6] = "";
    struct stat status;
    if (path[0] == '@' || (!stat(path, &status) && S_ISDIR(status.st_mode)))
        return true;
    if (spl_remote_is_url(path) || !strcasecmp(spl_cmd_ending(path), "spld")) // scans are read from files alone
        return false;
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    ssize_t got = fd < 0 ? -1 : read(fd, first, sizeof first);
    if (fd >= 0)
        close(fd);
    return got != sizeof first || memcmp(first, "SPLD\r\n", sizeof first);
}

static void say_left_out(void *context, const struct spl_error *why)
{
    struct session *s = context;
    spl_cmd_progress_finish(&s->progress);
    int code = spl_cmd_fail(why);
    s->worst = code > s->worst ? code : s->worst;
}

static void say_warning(void *context, const char *text)
{
    struct session *s = context;
    spl_cmd_progress_finish(&s->progress);
    fprintf(stderr, "splatd: ");
    spl_cmd_put_text(stderr, text, 0);
    fputc('\n', stderr);
}

static void say_progress(void *context, const struct spl_progress *progress)
{
    spl_cmd_progress(&((struct session *)context)->progress, progress);
}

json_t *spl_info_text(const char *text)
{
    char shown[4096];
    json_t *json = json_string(text);
    return json ? json : json_string(spl_text_show(text, shown, sizeof shown));
}

static json_t *bounds_json(const double min[3], const double max[3])
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

static uint64_t count_points(const struct spl_scan *scan)
{
    return scan->points_from[0] + scan->points_from[1] + scan->points_from[2];
}

/* What a pack of `count` scans from `list` on would be. */
static json_t *describe_pack(const struct spl_scans *scans, struct spl_scan *list, size_t count)
{
    struct spl_scans some = *scans;
    uint64_t points = 0;
    json_t *warnings = json_array();
    some.list = list;
    some.count = count;
    for (size_t i = 0; i < count; i++)
        points += count_points(&list[i]);
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

/* Members that are not known are null. */
static json_t *describe(const struct spl_scans *scans, struct spl_scan *scan, const struct spl_cloud_info *info,
                        const struct spl_info_scan_options *options)
{
    static const char *const from[] = {"constant", "rgb", "intensity"};
    char unit[SPL_UNIT_TEXT_MAX], *crs = spl_crs_print(&info->coordinates);
    bool counted = options->read || info->points_expected, boxed = scan->min[0] <= scan->max[0];
    json_t *json = json_object(), *colors = json_object();
    for (int k = 0; k < 3; k++)
        if (options->read && scan->points_from[k])
            json_object_set_new(colors, from[k], json_integer((json_int_t)scan->points_from[k]));
    json_object_set_new(json, "scan", spl_info_text(scan->path));
    json_object_set_new(json, "format", json_string(info->format));
    json_object_set_new(json, "version", info->version[0] ? spl_info_text(info->version) : json_null());
    json_object_set_new(json, "ending_of", info->named ? json_string(info->named) : json_null());
    json_object_set_new(json, "file_bytes", json_integer((json_int_t)info->file_bytes));
    json_object_set_new(json, "read", json_boolean(options->read));
    json_object_set_new(json, "points", counted ? json_integer((json_int_t)count_points(scan)) : json_null());
    json_object_set_new(json, "points_skipped",
                        options->read ? json_integer((json_int_t)info->points_skipped) : json_null());
    json_object_set_new(json, "attributes", list_attributes(info, scan));
    json_object_set_new(json, "fields", info->fields[0] ? spl_info_text(info->fields) : json_null());
    json_object_set_new(json, "columns_by_values", info->guessed[0] ? json_string(info->guessed) : json_null());
    json_object_set_new(json, "columns_not_used", info->unused[0] ? spl_info_text(info->unused) : json_null());
    json_object_set_new(json, "y_is_east", json_boolean(info->surveyors));
    json_object_set_new(json, "color_from", options->read ? colors : json_pack("[s]", from[scan->colors.from]));
    json_object_set_new(json, "stations",
                        options->read || info->station_count ? json_integer((json_int_t)info->station_count)
                                                             : json_null());
    json_object_set_new(json, "images", list_images(info));
    json_object_set_new(json, "crs", crs ? spl_info_text(crs) : json_null());
    json_object_set_new(json, "crs_name",
                        info->coordinates.name[0] ? spl_info_text(info->coordinates.name) : json_null());
    json_object_set_new(
        json, "unit",
        json_string(info->coordinates.angles ? "degree" : spl_unit_print(info->coordinates.unit_m, unit)));
    json_object_set_new(json, "bounds", boxed ? bounds_json(scan->min, scan->max) : json_null());
    if (boxed && lies(info, scan))
        json_object_set_new(json, "header_bounds", bounds_json(info->bounds[0], info->bounds[1]));
    json_object_set_new(json, "pack", describe_pack(scans, scan, 1));
    if (!options->read)
        json_decref(colors);
    free(crs);
    return json;
}

static int print_json(json_t *json, struct spl_error *err)
{
    char *text = json ? json_dumps(json, JSON_COMPACT | JSON_REAL_PRECISION(17)) : NULL;
    json_decref(json);
    if (!text)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the description of a scan");
    puts(text);
    free(text);
    return SPL_OK;
}

static void print_text(const char *label, const char *text)
{
    printf("  %-14s", label);
    spl_cmd_put_text(stdout, text, 0);
    putchar('\n');
}

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

static void print_pack(const json_t *pack)
{
    const json_t *warnings = json_object_get(pack, "warnings"), *warning;
    size_t i;
    const char *refused = json_string_value(json_object_get(pack, "refused"));
    if (refused)
        print_text("refused", refused);
    printf("  as a dataset  about %.1f MB; packing takes about %.0f MB of memory\n",
           json_number_value(json_object_get(pack, "dataset_bytes")) / 1e6,
           json_number_value(json_object_get(pack, "memory_bytes")) / 1e6);
    spl_info_print_panoramas(json_object_get(pack, "panoramas"));
    json_array_foreach(warnings, i, warning) print_text(i ? "" : "warnings", json_string_value(warning));
}

static void print_table(const json_t *json, const struct spl_scan *scan, const struct spl_cloud_info *info, bool read)
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
        print_text("fields", info->fields);
    if (info->guessed[0])
        printf("  columns       %s by the values%s\n", info->guessed,
               info->guessed[0] == '-' ? ": the first numbers or names the points" : "");
    if (info->north_first)
        printf(
            "  columns       %s, as where the north comes before the east: then y and x change places in --columns\n",
            info->north_first);
    if (info->surveyors)
        printf("  columns       Y is the east and X the north, as surveyors have it: x and y here\n");
    if (info->units[0])
        print_text("headings", info->units);
    if (info->footer[0])
        print_text("end", info->footer);
    if (info->unused[0])
        print_text("not used", info->unused);
    if (scan->colors.from != SPL_COLORS_CONSTANT)
        printf("  color from    %s, %g is black and %g white%s\n",
               scan->colors.from == SPL_COLORS_RGB ? "rgb" : "intensity", scan->colors.black, scan->colors.white,
               scan->colors.guessed ? " by the values" : "");
    if (crs || name[0]) /* of a system without a number the name; --json has its text */
        print_text("crs", crs && (info->coordinates.epsg || !name[0]) ? crs : name);
    print_text("unit", json_string_value(json_object_get(json, "unit")));
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
    print_pack(json_object_get(json, "pack"));
}

static int tell(struct session *s, const struct spl_scans *scans, struct spl_scan *scan,
                const struct spl_cloud_info *info, struct spl_error *err)
{
    json_t *json = describe(scans, scan, info, s->options);
    spl_cmd_progress_finish(&s->progress);
    if (s->options->json)
        return print_json(json, err);
    print_table(json, scan, info, s->options->read);
    json_decref(json);
    return SPL_OK;
}

static int tell_together(struct session *s, const struct spl_scans *scans, struct spl_error *err)
{
    double min[3] = {INFINITY, INFINITY, INFINITY}, max[3] = {-INFINITY, -INFINITY, -INFINITY};
    uint64_t points = 0;
    char text[32];
    for (size_t i = 0; i < scans->count; i++) {
        points += count_points(&scans->list[i]);
        for (int c = 0; c < 3; c++) {
            min[c] = fmin(min[c], scans->list[i].min[c]);
            max[c] = fmax(max[c], scans->list[i].max[c]);
        }
    }
    json_t *pack = describe_pack(scans, scans->list, scans->count);
    bool boxed = min[0] <= max[0];
    if (s->options->json)
        return print_json(json_pack("{s:I, s:I, s:o, s:o}", "scans", (json_int_t)scans->count, "points",
                                    (json_int_t)points, "bounds", boxed ? bounds_json(min, max) : json_null(), "pack",
                                    pack),
                          err);
    printf("%zu scans together\n  points        %s\n", scans->count, spl_cmd_group(points, text));
    if (boxed)
        printf("  bounds        %.10g %.10g %.10g to\n                %.10g %.10g %.10g\n", min[0], min[1], min[2],
               max[0], max[1], max[2]);
    print_pack(pack);
    json_decref(pack);
    return SPL_OK;
}

static int tell_all(struct session *s, struct spl_scans *scans, struct spl_stage *stage, struct spl_error *err)
{
    struct spl_point_batch batch;
    int rc = spl_point_batch_init(&batch, batch_points, err);
    for (size_t i = 0; !rc && i < scans->count;) {
        struct spl_cloud *cloud = NULL;
        struct spl_error why = {0};
        rc = spl_scan_look(scans, &scans->list[i], s->options->read, &batch, stage, &cloud, &why);
        if (rc && !(rc = spl_inputs_leave_out(scans->inputs, scans->list[i].path, rc, &why, err))) {
            spl_scans_remove(scans, i);
            continue;
        }
        if (!rc)
            rc = tell(s, scans, &scans->list[i++], spl_cloud_get_info(cloud), err);
        spl_cloud_destroy(cloud);
    }
    spl_point_batch_finish(&batch);
    return !rc && scans->count > 1 ? tell_together(s, scans, err) : rc;
}

int spl_info_print_scans(const char *const *given, size_t count, const struct spl_info_scan_options *options)
{
    struct session s = {.options = options};
    const struct spl_inputs_listener listener = {say_warning, say_left_out, &s};
    struct spl_stage stage = {.callback = isatty(STDERR_FILENO) ? say_progress : NULL, .context = &s, .threads = 1};
    const struct spl_keep keep = {0};
    const struct spl_cloud_options how = {.columns = options->columns, .keep = &keep};
    struct spl_scans scans = {0};
    struct spl_inputs inputs = {0};
    struct spl_error err = {0};
    int rc = spl_inputs_find(&inputs, given, count, &listener, &err);
    if (!rc)
        rc = spl_scans_init(&scans, &inputs, &how, &stage, &err);
    if (!rc)
        rc = tell_all(&s, &scans, &stage, &err);
    spl_cmd_progress_finish(&s.progress);
    if (rc && strcmp(err.field, "inputs")) /* that there is nothing left has been said one by one */
        s.worst = spl_cmd_fail(&err);
    spl_scans_finish(&scans);
    spl_inputs_finish(&inputs);
    return s.worst;
}
