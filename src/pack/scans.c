/* The list of a pack's scans: each is opened once before hours of work, and described in META.
 *
 * Intensities have no white of their own: the range that is made grey is a scan's own. Tiles of one flight must not
 * differ by that, so scans of like ranges share one. 8 bit numbers beside 16 bit ones would be black in it: then each
 * keeps its own. The caller's thread. */
#include "pack/names.h"
#include "pack/scans.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "cloud/crs.h"
#include "pack/part.h"

enum { bytes_a_line = 40 };
static const double like_ranges = 8; /* times the smallest white less black: of one kind */

static bool has_points(const struct spl_scan *scan)
{
    return scan->points_from[0] + scan->points_from[1] + scan->points_from[2] > 0;
}

void spl_scans_share(struct spl_scans *scans)
{
    double black = INFINITY, white = -INFINITY, least = INFINITY;
    for (size_t i = 0; i < scans->count; i++) {
        const struct spl_cloud_colors *own = &scans->list[i].own_colors;
        if (own->from != SPL_COLORS_INTENSITY || !own->guessed)
            continue;
        black = fmin(black, own->black);
        white = fmax(white, own->white);
        least = fmin(least, own->white - own->black);
    }
    bool alike = white - black <= like_ranges * least;
    for (size_t i = 0; i < scans->count; i++) {
        struct spl_cloud_colors *colors = &scans->list[i].colors;
        *colors = scans->list[i].own_colors;
        if (colors->from == SPL_COLORS_INTENSITY && colors->guessed && alike) {
            colors->black = black;
            colors->white = white;
        }
    }
    spl_part_share(scans);
}

int spl_scan_open(struct spl_scan *scan, const char *path, const struct spl_cloud_options *options, char *fields,
                  struct spl_error *err)
{
    struct spl_cloud *cloud = NULL;
    int rc = spl_cloud_open(path, options, &cloud, err);
    if (rc)
        return rc;
    const struct spl_cloud_info *info = spl_cloud_get_info(cloud);
    *scan = (struct spl_scan){.path = path,
                              .name = spl_input_name(path),
                              .format = info->format,
                              .named = info->named,
                              .own_colors = info->colors,
                              .attributes = info->attributes,
                              .columns = info->columns,
                              .scalars = info->scalars,
                              .counted = info->points_expected > 0 && !info->points_at_most,
                              .points_total = info->points_total,
                              .points_behind = info->points_behind,
                              .points_expected =
                                  info->points_expected ? info->points_expected : info->file_bytes / bytes_a_line,
                              .min = {INFINITY, INFINITY, INFINITY},
                              .max = {-INFINITY, -INFINITY, -INFINITY},
                              .has_box = info->has_bounds,
                              .stations = info->station_count,
                              .rows = info->rows};
    memcpy(scan->box, info->bounds, sizeof scan->box);
    if (fields)
        snprintf(fields, SPL_SCANS_FIELDS, "%s", info->fields);
    rc = spl_scan_guess(info, &scan->guess, err);
    if (!rc)
        spl_cloud_take_coordinates(cloud, &scan->coordinates);
    spl_cloud_destroy(cloud);
    return rc;
}

/* Columns of texts that are named where no scan is one: whoever named them expects to see them. Beside texts other
 * scans are read as they are. */
static int check_columns(const struct spl_scans *scans, struct spl_error *err)
{
    struct spl_names names = {0};
    for (size_t i = 0; i < scans->count; i++) {
        if (!strcmp(scans->list[i].format, "text") || !strcmp(scans->list[i].format, "PTS"))
            return SPL_OK;
        spl_names_add(&names, scans->list[i].name);
    }
    return spl_fail_field(err, SPL_E_USAGE, "columns",
                          "--columns names the columns of texts (XYZ, PTS, CSV and such); %s %s%s: leave it out",
                          spl_names_list(&names), scans->count > 1 ? "are none" : "is ",
                          scans->count > 1 ? "" : scans->list[0].format);
}

int spl_scans_init(struct spl_scans *scans, struct spl_inputs *inputs, const struct spl_cloud_options *how,
                   struct spl_stage *stage, struct spl_error *err)
{
    *scans = (struct spl_scans){.inputs = inputs, .how = *how};
    scans->how.threads = stage->threads;
    scans->how.cancelled = stage->cancelled;
    scans->how.sample_colors = true;
    int rc = spl_inputs_check_there(inputs, err);
    if (rc)
        return rc;
    scans->list = spl_alloc(inputs->count, sizeof *scans->list, err);
    if (!scans->list)
        return SPL_E_NOMEM;
    spl_stage_begin(stage, "looking at colours", "scans", inputs->count);
    for (size_t i = 0; !rc && i < inputs->count; i++) {
        struct spl_error why = {0};
        char *fields = scans->count ? NULL : scans->fields;
        if ((rc = spl_scan_open(&scans->list[scans->count], inputs->paths[i], &scans->how, fields, &why)))
            rc = spl_inputs_leave_out(inputs, inputs->paths[i], rc, &why, err);
        else
            scans->count++;
        spl_stage_add(stage, 1, 0);
        if (!rc)
            rc = spl_stage_check(stage, err);
    }
    spl_stage_end(stage);
    if (!rc && !scans->count)
        rc = spl_inputs_fail_empty(inputs, err);
    if (!rc && how->columns)
        rc = check_columns(scans, err);
    if (rc)
        spl_scans_finish(scans);
    else
        spl_scans_share(scans);
    return rc;
}

void spl_scans_remove(struct spl_scans *scans, size_t place)
{
    spl_crs_finish(&scans->list[place].coordinates);
    free(scans->list[place].poses);
    free(scans->list[place].guess);
    scans->count--;
    memmove(&scans->list[place], &scans->list[place + 1], (scans->count - place) * sizeof *scans->list);
}

int spl_scan_grow(struct spl_scan *scan, const struct spl_point_batch *batch, uint64_t first, struct spl_error *err)
{
    for (size_t i = 0; i < batch->count; i++)
        for (int c = 0; c < 3; c++) {
            double v = batch->position[i][c];
            if (fabs(v) > SPL_COORDINATE_MAX)
                return spl_fail(
                    err, SPL_E_INPUT,
                    "%.300s: point %llu has %c = %g, beyond the largest coordinate %g; check the file's scale "
                    "and columns",
                    scan->path, (unsigned long long)(first + i), "xyz"[c], v, SPL_COORDINATE_MAX);
            scan->min[c] = fmin(scan->min[c], v);
            scan->max[c] = fmax(scan->max[c], v);
        }
    return SPL_OK;
}

void spl_scans_finish(struct spl_scans *scans)
{
    for (size_t i = 0; scans->list && i < scans->count; i++) {
        spl_crs_finish(&scans->list[i].coordinates);
        free(scans->list[i].poses);
        free(scans->list[i].guess);
    }
    free(scans->list);
    *scans = (struct spl_scans){0};
}

static const char *name_of_scan(const void *context, size_t i)
{
    return ((const struct spl_scans *)context)->list[i].name;
}

json_t *spl_scans_describe_names(const struct spl_scans *scans)
{
    return spl_names_describe(name_of_scan, scans, scans->count);
}

static const char *name_of_left_out(const void *context, size_t i)
{
    return spl_input_name(((const struct spl_inputs *)context)->left_out[i]);
}

json_t *spl_scans_describe_left_out(const struct spl_scans *scans)
{
    return spl_names_describe(name_of_left_out, scans->inputs, scans->inputs->left_out_count);
}

json_t *spl_scans_describe(const struct spl_scans *scans)
{
    static const char *const names[3] = {"constant", "rgb", "intensity"};
    json_t *all = json_array();
    uint64_t points_from[3] = {0};
    for (size_t i = SPL_NAMES_KEPT; i < scans->count; i++)
        for (int from = 0; from < 3; from++)
            points_from[from] += scans->list[i].points_from[from];
    for (size_t i = 0; i < scans->count && i < SPL_NAMES_KEPT; i++) {
        const struct spl_scan *scan = &scans->list[i];
        for (int from = 0; from < 3; from++)
            if (scan->points_from[from] || (from == (int)scan->colors.from && !has_points(scan)))
                json_array_append_new(all,
                                      json_pack("{s:o, s:s, s:I}", "source", json_string_nocheck(scan->name), "from",
                                                names[from], "points", (json_int_t)scan->points_from[from]));
    }
    for (int from = 0; from < 3; from++)
        if (points_from[from])
            json_array_append_new(all, json_pack("{s:s, s:s, s:I}", "source", "the others", "from", names[from],
                                                 "points", (json_int_t)points_from[from]));
    return all;
}
