/* Exported maps. Each file is there as a whole or not at all; maps.json comes last, so a folder that has it is
 * complete. A map is found again by its name, and refused where its station stands elsewhere: then the scans, or how
 * they were packed, have changed. Owned by the caller's thread. */
#include "pack/maps/export.h"

#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"
#include "base/memory.h"
#include "geom/camera_json.h"
#include "geom/polar.h"
#include "image/load.h"

static const char list_name[] = "maps.json";
static const double same_place = 0.01, same_turn = 1e-3; /* of stations, in the dataset's unit and radians */
static const long list_bytes_max = 64 << 20;

static char *join(const char *folder, const char *name, struct spl_error *err)
{
    size_t length = strlen(folder) + strlen(name) + 2;
    char *path = spl_alloc_raw(length, 1, err);
    if (path)
        snprintf(path, length, "%s/%s", folder, name);
    return path;
}

int spl_map_picture_init(struct spl_image *picture, uint32_t side, struct spl_error *err)
{
    *picture = (struct spl_image){
        .layer = SPL_LAYER_COLOR, .type = SPL_PIXEL_RGBA8, .width = spl_polar_width(side, 0), .height = side};
    picture->pixels = spl_alloc_raw((size_t)picture->width * side, 4, err);
    return picture->pixels ? SPL_OK : SPL_E_NOMEM;
}

int spl_map_export_init(struct spl_map_export *out, const char *folder, struct spl_error *err)
{
    *out = (struct spl_map_export){.folder = folder, .made = !mkdir(folder, 0777)};
    if (!out->made && errno != EEXIST)
        return spl_fail_errno(err, errno, "--export-maps %s: the folder cannot be made", folder);
    if (!out->made) {
        DIR *dir = opendir(folder);
        bool empty = true;
        if (!dir)
            return spl_fail_field(err, SPL_E_USAGE, "export-maps", "--export-maps %s: is no folder that can be read",
                                  folder);
        for (const struct dirent *entry; empty && (entry = readdir(dir));)
            empty = !strcmp(entry->d_name, ".") || !strcmp(entry->d_name, "..");
        closedir(dir);
        if (!empty)
            return spl_fail_field(err, SPL_E_USAGE, "export-maps",
                                  "--export-maps %s: holds files, which may be edited maps: name a new folder", folder);
    }
    out->list = json_array();
    return out->list ? SPL_OK : spl_fail(err, SPL_E_NOMEM, "out of memory for a list of maps");
}

static int write_picture(const struct spl_map_export *out, const char *name, const struct spl_image *image,
                         const struct spl_encode_options *how, struct spl_error *err)
{
    struct spl_encoded encoded = {0};
    char *path = join(out->folder, name, err);
    int rc = path ? spl_image_encode(image, how, &encoded, err) : SPL_E_NOMEM;
    if (!rc)
        rc = spl_file_replace(path, encoded.bytes, encoded.length, err);
    spl_encoded_finish(&encoded);
    free(path);
    return rc;
}

static void name_files(uint32_t index, char color[40], char range[40])
{
    snprintf(color, 40, "station-%u.color.png", index + 1);
    snprintf(range, 40, "station-%u.range.png", index + 1);
}

static int write_ranges(const struct spl_map_export *out, const char *name, const struct spl_map_row *row,
                        const uint32_t *words, struct spl_error *err)
{
    const struct spl_encode_options how = {
        .size = sizeof how, .format = SPL_FORMAT_PNG, .depth_scale = 1, .unit = "65535th of 1 - near / range"};
    struct spl_image codes = {.layer = SPL_LAYER_RANGE,
                              .type = SPL_PIXEL_F32,
                              .width = spl_polar_width(row->range_side, 0),
                              .height = row->range_side};
    float *texels = codes.pixels = spl_alloc_raw((size_t)codes.width * codes.height, sizeof *texels, err);
    size_t across = spl_polar_width(row->range_side, SPL_MAP_RANGE_APRON);
    for (uint32_t y = 0; texels && y < codes.height; y++)
        for (uint32_t x = 0; x < codes.width; x++) {
            uint32_t at[2];
            spl_map_picture_texel(row->range_side, SPL_MAP_RANGE_APRON, x, y, at);
            uint16_t code = spl_map_get_code(words, at[1] * across + at[0]);
            *texels++ = code == SPL_MAP_UNKNOWN ? -1 : code; /* below 0 is stored as 0 */
        }
    int rc = texels ? write_picture(out, name, &codes, &how, err) : SPL_E_NOMEM;
    spl_image_finish(&codes);
    return rc;
}

static json_t *numbers(const double *values, size_t count)
{
    json_t *list = json_array();
    for (size_t i = 0; i < count; i++)
        json_array_append_new(list, json_real(values[i]));
    return list;
}

int spl_map_export_add(struct spl_map_export *out, const struct spl_map_row *row, const struct spl_image *picture,
                       const uint32_t *words, struct spl_error *err)
{
    const struct spl_encode_options how = {.size = sizeof how, .format = SPL_FORMAT_PNG};
    char color[40], range[40], name[40];
    name_files(out->count, color, range);
    snprintf(name, sizeof name, "station-%u", ++out->count);
    int rc = write_picture(out, color, picture, &how, err);
    if (!rc)
        rc = write_ranges(out, range, row, words, err);
    if (!rc && json_array_append_new(
                   out->list, json_pack("{s:s, s:s, s:s, s:I, s:I, s:f, s:f, s:o, s:o}", "name", name, "color", color,
                                        "range", range, "side", (json_int_t)row->side, "range_side",
                                        (json_int_t)row->range_side, "near", (double)row->near, "slack",
                                        (double)row->slack, "position", numbers(row->position, 3), "rotation",
                                        numbers(row->rotation, 9))))
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory for a list of maps");
    return rc;
}

int spl_map_export_commit(struct spl_map_export *out, struct spl_error *err)
{
    static const char layout[] =
        "NAME.color.png is 6 side x side: bottom cap, top cap, band (4 side wide). (x, y) in shares of a chart, from "
        "its upper left corner: a cap's u = x - 0.5, v = y - 0.5 (of the bottom cap 0.5 - y), r = |(u, v)| has "
        "direction d = (u / r sin(pi r / 2), v / r sin(pi r / 2), cos(pi r / 2)), of the bottom cap -cos; the band's "
        "has azimuth 2 pi (1 - x) and elevation (0.5 - y) pi / 2. p = rotation * range * d + position. NAME.range.png: "
        "code 0 not "
        "scanned, 65535 nothing came back, else range = near / (1 - (code - 1) / 65533)";
    json_t *document = json_pack("{s:s, s:O}", "layout", layout, "maps", out->list);
    char *text = document ? json_dumps(document, JSON_INDENT(1) | JSON_REAL_PRECISION(17)) : NULL;
    char *path = join(out->folder, list_name, err);
    int rc = text && path ? spl_file_replace(path, text, strlen(text), err)
                          : spl_fail(err, SPL_E_NOMEM, "out of memory for a list of maps");
    out->committed = !rc;
    free(path);
    free(text);
    json_decref(document);
    return rc;
}

void spl_map_export_finish(struct spl_map_export *out)
{
    for (uint32_t i = 0; !out->committed && i < out->count; i++) {
        char files[2][40];
        name_files(i, files[0], files[1]);
        for (int f = 0; f < 2; f++) {
            char *path = join(out->folder, files[f], NULL);
            if (path)
                unlink(path);
            free(path);
        }
    }
    if (!out->committed && out->made)
        rmdir(out->folder);
    json_decref(out->list);
    *out = (struct spl_map_export){0};
}

static int check_entry(const struct spl_map_edits *edits, size_t i, struct spl_error *err)
{
    const json_t *entry = json_array_get(edits->list, i), *side = json_object_get(entry, "side");
    const char *color = json_string_value(json_object_get(entry, "color"));
    struct spl_image_info info;
    if (!json_string_value(json_object_get(entry, "name")) || !color)
        return spl_fail_field(err, SPL_E_INPUT, "name", "%s/%s: map %zu has no name or no color", edits->folder,
                              list_name, i + 1);
    if (!json_is_integer(side))
        return spl_fail_field(err, SPL_E_INPUT, "side", "%s/%s: map %zu has no side that is a whole number, 1 to %d",
                              edits->folder, list_name, i + 1, SPL_MAP_SIDE_MAX);
    if (!(json_integer_value(side) > 0 && json_integer_value(side) <= SPL_MAP_SIDE_MAX))
        return spl_fail_field(err, SPL_E_INPUT, "side", "%s/%s: map %zu has a side of %lld; it must be 1 to %d",
                              edits->folder, list_name, i + 1, (long long)json_integer_value(side), SPL_MAP_SIDE_MAX);
    char *path = join(edits->folder, color, err);
    uint32_t high = (uint32_t)json_integer_value(side), wide = spl_polar_width(high, 0);
    int rc = path ? spl_image_get_info(path, &info, err) : SPL_E_NOMEM;
    if (!rc && (info.width != wide || info.height != high))
        rc = spl_fail_field(err, SPL_E_INPUT, "color", "%s: %u x %u pixels; a map of side %u has %u x %u", path,
                            info.width, info.height, high, wide, high);
    if (!rc && info.bits != 8)
        rc = spl_fail_field(err, SPL_E_INPUT, "color", "%s: has %u bits a channel; save it with 8, as it was exported",
                            path, info.bits);
    free(path);
    return rc;
}

int spl_map_edits_init(struct spl_map_edits *edits, const char *folder, struct spl_error *err)
{
    struct stat status;
    json_error_t where;
    json_t *document = NULL;
    *edits = (struct spl_map_edits){.folder = folder};
    char *path = join(folder, list_name, err);
    int rc = path ? SPL_OK : SPL_E_NOMEM;
    if (!rc && (stat(path, &status) || !S_ISREG(status.st_mode)))
        rc = spl_fail_field(err, SPL_E_NOT_FOUND, "maps", "--maps %s: has no %s; --export-maps writes such a folder",
                            folder, list_name);
    if (!rc && status.st_size > list_bytes_max)
        rc = spl_fail_field(err, SPL_E_LIMIT, "maps", "%s: %lld bytes; a list of maps has at most %ld", path,
                            (long long)status.st_size, list_bytes_max);
    if (!rc && !(document = spl_json_load_file(path, &where)))
        rc = spl_fail_field(err, SPL_E_INPUT, "maps", "%s: broken JSON at line %d, column %d: %s", path, where.line,
                            where.column, spl_json_fault(&where));
    edits->list = json_incref(json_object_get(document, "maps"));
    if (!rc && !json_array_size(edits->list))
        rc = spl_fail_field(err, SPL_E_INPUT, "maps", "%s: holds no maps", path);
    for (size_t i = 0; !rc && i < json_array_size(edits->list); i++)
        rc = check_entry(edits, i, err);
    json_decref(document);
    free(path);
    if (rc)
        spl_map_edits_finish(edits);
    return rc;
}

/* By how much two stations differ, at most 1 where they are the same. */
static double compare(const json_t *entry, const struct spl_map_row *row)
{
    double worst = 0;
    for (size_t i = 0; i < 12; i++) {
        const json_t *value =
            json_array_get(json_object_get(entry, i < 3 ? "position" : "rotation"), i < 3 ? i : i - 3);
        double is = i < 3 ? row->position[i] : row->rotation[i - 3];
        worst = json_is_number(value)
                    ? fmax(worst, fabs(json_number_value(value) - is) / (i < 3 ? same_place : same_turn))
                    : INFINITY;
    }
    return worst;
}

static void put_over(struct spl_image *picture, const struct spl_image *edited)
{
    const uint8_t(*from)[4] = edited->pixels;
    uint8_t(*to)[4] = picture->pixels;
    size_t count = (size_t)picture->width * picture->height;
    for (size_t t = 0; t < count; t++)
        for (int c = 0; c < 3; c++)
            to[t][c] = (uint8_t)((from[t][c] * from[t][3] + to[t][c] * (255 - from[t][3]) + 127) / 255);
}

int spl_map_edits_apply(struct spl_map_edits *edits, uint32_t index, const struct spl_map_row *row,
                        struct spl_image *picture, struct spl_error *err)
{
    const json_t *entry = NULL;
    struct spl_image edited = {0};
    char name[40];
    snprintf(name, sizeof name, "station-%u", index + 1);
    for (size_t i = 0; i < json_array_size(edits->list) && !entry; i++)
        if (!strcmp(json_string_value(json_object_get(json_array_get(edits->list, i), "name")), name))
            entry = json_array_get(edits->list, i);
    if (!entry)
        return SPL_OK;
    if (!(compare(entry, row) <= 1))
        return spl_fail_field(
            err, SPL_E_INPUT, "position",
            "%s/%s: %s stands elsewhere now, or is turned: export the maps of these scans and options "
            "anew",
            edits->folder, list_name, name);
    char *path = join(edits->folder, json_string_value(json_object_get(entry, "color")), err);
    int rc = path ? spl_image_load(path, SPL_LAYER_COLOR, &edited, err) : SPL_E_NOMEM;
    if (!rc && (edited.width != picture->width || edited.height != picture->height))
        rc = spl_fail_field(err, SPL_E_INPUT, "side",
                            "%s: %u x %u pixels; this map has %u x %u: export it anew from these scans and options",
                            path, edited.width, edited.height, picture->width, picture->height);
    if (!rc) {
        put_over(picture, &edited);
        edits->taken++;
    }
    spl_image_finish(&edited);
    free(path);
    return rc;
}

void spl_map_edits_finish(struct spl_map_edits *edits)
{
    json_decref(edits->list);
    *edits = (struct spl_map_edits){0};
}
