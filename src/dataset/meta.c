/* Opening, second stage: META, the JSON section with what pack knew about the dataset as a whole. Every key that
 * readers rely on is checked here once, so that nobody after this handles a missing or absurd one. The opener's thread.
 */
#include <math.h>
#include <string.h>

#include "dataset/open.h"

static int wrong(const struct spl_dataset *dataset, struct spl_error *err, const char *key, const char *what)
{
    return spl_fail_field(err, SPL_E_CORRUPT, key, "%s: section META: \"%s\" %s; pack the dataset again", dataset->name,
                          key, what);
}

static int get_count(const struct spl_dataset *dataset, const char *key, uint64_t *out, struct spl_error *err)
{
    const json_t *value = json_object_get(dataset->meta, key);
    if (!json_is_integer(value) || json_integer_value(value) < 1)
        return wrong(dataset, err, key, "must be a positive integer");
    *out = (uint64_t)json_integer_value(value);
    return SPL_OK;
}

/* `array` is the value of `key`, or of a member of it. */
static int get_vector(const struct spl_dataset *dataset, const char *key, const json_t *array, double out[3],
                      struct spl_error *err)
{
    if (json_array_size(array) != 3)
        return wrong(dataset, err, key, "must hold arrays of three numbers");
    for (size_t i = 0; i < 3; i++) {
        const json_t *number = json_array_get(array, i);
        if (!json_is_number(number) || fabs(json_number_value(number)) > 1e15)
            return wrong(dataset, err, key, "holds something else than a coordinate");
        out[i] = json_number_value(number);
    }
    return SPL_OK;
}

static int get_view(struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_dataset_info *info = &dataset->info;
    const char *key = "default_view";
    const json_t *view = json_object_get(dataset->meta, key), *fov = json_object_get(view, "fov");
    int rc = get_vector(dataset, key, json_object_get(view, "eye"), info->default_eye, err);
    if (!rc)
        rc = get_vector(dataset, key, json_object_get(view, "target"), info->default_target, err);
    if (!rc)
        rc = get_vector(dataset, key, json_object_get(view, "up"), info->default_up, err);
    if (rc)
        return rc;
    if (!json_is_number(fov) || !(json_number_value(fov) > 0 && json_number_value(fov) <= 179))
        return wrong(dataset, err, key, "has no \"fov\" between 0 and 179 degrees");
    info->default_fov = json_number_value(fov);
    struct spl_camera camera = {0};
    struct spl_error why = {0};
    if (spl_camera_look_at(&camera, info->default_eye, info->default_target, info->default_up, &why))
        return wrong(dataset, err, key, "is no view: its eye, target and up do not fit together");
    return SPL_OK;
}

static int get_color(struct spl_dataset *dataset, struct spl_error *err)
{
    const json_t *value = json_object_get(json_object_get(dataset->meta, "attributes"), "color");
    if (!json_is_boolean(value))
        return wrong(dataset, err, "attributes", "must say whether there is a \"color\", true or false");
    dataset->info.has_color = json_is_true(value);
    return SPL_OK;
}

/* Optional: a file that does not say so has normals and radii. */
static int get_surface(struct spl_dataset *dataset, struct spl_error *err)
{
    const json_t *value = json_object_get(json_object_get(dataset->meta, "attributes"), "surface");
    if (value && !json_is_boolean(value))
        return wrong(dataset, err, "attributes", "must say whether there is a \"surface\", true or false");
    dataset->info.has_surface = !json_is_false(value);
    return SPL_OK;
}

/* Optional. Scanner poses: what a panorama or an orientation refers to. */
static int check_stations(struct spl_dataset *dataset, struct spl_error *err)
{
    const char *key = "stations";
    const json_t *stations = json_object_get(dataset->meta, key);
    if (!stations)
        return SPL_OK;
    if (!json_is_array(stations))
        return wrong(dataset, err, key, "must be an array");
    for (size_t i = 0; i < json_array_size(stations); i++) {
        const json_t *matrix = json_array_get(stations, i);
        if (json_array_size(matrix) != 16)
            return wrong(dataset, err, key, "must hold matrices of 16 numbers");
        for (size_t j = 0; j < 16; j++)
            if (!json_is_number(json_array_get(matrix, j)))
                return wrong(dataset, err, key, "must hold matrices of 16 numbers");
    }
    return SPL_OK;
}

static int check_sources(struct spl_dataset *dataset, struct spl_error *err)
{
    const json_t *sources = json_object_get(dataset->meta, "sources");
    if (!json_is_array(sources))
        return wrong(dataset, err, "sources", "must be an array of names");
    for (size_t i = 0; i < json_array_size(sources); i++)
        if (!json_is_string(json_array_get(sources, i)))
            return wrong(dataset, err, "sources", "must be an array of names");
    return SPL_OK;
}

/* Optional: what coordinates are in, and where on earth. */
static int get_unit(struct spl_dataset *dataset, struct spl_error *err)
{
    static const char *const units[] = {"unknown", "m", "ft", "us-ft"};
    const json_t *unit = json_object_get(dataset->meta, "unit"), *crs = json_object_get(dataset->meta, "crs");
    const char *said = unit ? json_string_value(unit) : units[0];
    size_t i = 0;
    while (i < sizeof units / sizeof *units && (!said || strcmp(said, units[i])))
        i++;
    if (i == sizeof units / sizeof *units)
        return wrong(dataset, err, "unit", "must be m, ft, us-ft or unknown");
    if (crs && !json_is_null(crs) && !json_is_string(crs))
        return wrong(dataset, err, "crs", "must be a text (WKT, or EPSG and a number), or null");
    strcpy(dataset->info.unit, units[i]);
    return SPL_OK;
}

/* Optional. */
static int check_color(struct spl_dataset *dataset, struct spl_error *err)
{
    const char *key = "color";
    const json_t *all = json_object_get(dataset->meta, key);
    if (all && !json_is_array(all))
        return wrong(dataset, err, key, "must be an array");
    for (size_t i = 0; i < json_array_size(all); i++) {
        const json_t *one = json_array_get(all, i), *points = json_object_get(one, "points");
        const char *from = json_string_value(json_object_get(one, "from"));
        if (!json_is_string(json_object_get(one, "source")) || !json_is_integer(points) ||
            json_integer_value(points) < 0)
            return wrong(dataset, err, key, "must say of each \"source\" how many \"points\" it is of");
        if (!from || (strcmp(from, "rgb") && strcmp(from, "intensity") && strcmp(from, "constant") &&
                      strcmp(from, "photographs")))
            return wrong(dataset, err, key, "is \"from\" rgb, intensity, constant or photographs");
    }
    return SPL_OK;
}

/* What nodes and chunks add up to; held against them where all are read. */
static int get_counts(struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_dataset_info *info = &dataset->info;
    struct spl_counts *counts = &dataset->counts;
    if (!spl_counts_from_json(json_object_get(dataset->meta, "counts"), info->stream_count, counts))
        return wrong(dataset, err, "counts", "must say how many splats, pieces and bits there are");
    if (counts->splats < info->leaf_splats)
        return wrong(dataset, err, "counts", "has fewer \"splats\" than \"leaf_splats\"");
    counts->leaf_splats = info->leaf_splats;
    counts->levels = info->levels;
    info->splats = counts->splats;
    info->pieces = counts->pieces;
    info->has_linear = counts->linear_chunks > 0;
    memcpy(info->attribute_bits, counts->bits, sizeof info->attribute_bits);
    for (uint32_t s = 0; s < info->stream_count; s++)
        info->streams[s].bits = counts->stream_bits[s];
    return SPL_OK;
}

int spl_dataset_check_meta(struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_dataset_info *info = &dataset->info;
    uint64_t bytes;
    const char *text = spl_dataset_get_copy(dataset, SPL_KIND_META, 0, &bytes);
    json_error_t where;
    dataset->meta = json_loadb(text, bytes, JSON_REJECT_DUPLICATES, &where);
    if (!dataset->meta)
        return spl_fail(err, SPL_E_CORRUPT, "%s: section META is no JSON object: %s at byte %d; pack the dataset again",
                        dataset->name, where.text, where.position);
    if (!json_is_object(dataset->meta))
        return spl_fail(err, SPL_E_CORRUPT, "%s: section META is no JSON object; pack the dataset again",
                        dataset->name);
    const json_t *bounds = json_object_get(dataset->meta, "bounds");
    const json_t *radius = json_object_get(dataset->meta, "splat_radius");
    uint64_t levels = 0;
    int rc = get_count(dataset, "points", &info->points, err);
    if (!rc)
        rc = get_count(dataset, "leaf_splats", &info->leaf_splats, err);
    if (!rc)
        rc = get_count(dataset, "levels", &levels, err);
    if (!rc)
        rc = get_vector(dataset, "bounds", json_object_get(bounds, "min"), info->bounds_min, err);
    if (!rc)
        rc = get_vector(dataset, "bounds", json_object_get(bounds, "max"), info->bounds_max, err);
    if (!rc)
        rc = get_view(dataset, err);
    if (!rc)
        rc = get_color(dataset, err);
    if (!rc)
        rc = get_surface(dataset, err);
    if (!rc)
        rc = check_sources(dataset, err);
    if (!rc)
        rc = check_stations(dataset, err);
    if (!rc)
        rc = check_color(dataset, err);
    if (!rc)
        rc = get_unit(dataset, err);
    if (!rc)
        rc = spl_dataset_read_streams(dataset, err);
    if (rc)
        return rc;
    for (int a = 0; a < 3; a++)
        if (info->bounds_min[a] > info->bounds_max[a])
            return wrong(dataset, err, "bounds", "has a minimum above its maximum");
    if (!json_is_number(radius) || !(json_number_value(radius) > 0))
        return wrong(dataset, err, "splat_radius", "must be a positive number");
    info->splat_radius = json_number_value(radius);
    if (info->leaf_splats > info->points)
        return wrong(dataset, err, "leaf_splats", "is larger than \"points\"");
    if (levels > UINT8_MAX + 1)
        return wrong(dataset, err, "levels", "is absurd");
    info->levels = (uint32_t)levels;
    return get_counts(dataset, err);
}
