/* Datasets as JSON. Owned by the loop's thread. */
#include <math.h>
#include <string.h>

#include "dataset/dataset.h"
#include "render/paint.h"
#include "render/soft/suggest.h"
#include "service/datasets/library.h"

static json_t *vector(const double v[3])
{
    return json_pack("[f, f, f]", v[0], v[1], v[2]);
}

static json_t *describe_layers(void)
{
    json_t *list = json_array();
    for (int i = 0; i < SPL_LAYER_COUNT; i++)
        json_array_append_new(list, json_string(spl_layer_name((enum spl_layer)i)));
    return list;
}

/* Those that are drawn as they are called: without radii something else stands in for discs. */
static json_t *describe_methods(const struct spl_dataset_info *info)
{
    json_t *list = json_array();
    for (int i = 0; i < SPL_METHOD_COUNT; i++)
        if (spl_method_for((enum spl_method)i, info) == (enum spl_method)i)
            json_array_append_new(list, json_string(spl_method_name((enum spl_method)i)));
    return list;
}

static json_t *count(uint64_t n)
{
    return json_integer((json_int_t)n);
}

/* A member that memory was refused for is left out. */
static void set(json_t *object, const char *name, json_t *value)
{
    json_object_set_new(object, name, value);
}

json_t *spl_describe_slot(const struct spl_catalog_slot *slot)
{
    json_t *json = slot->current ? spl_describe_dataset(slot->current, false) : json_object();
    const char *state = slot->current ? "ready" : slot->reason[0] ? "failed" : "loading";
    set(json, "id", json_string(slot->id));
    set(json, "state", json_string(state));
    if (slot->reason[0])
        set(json, "reason", json_string(slot->reason));
    return json;
}

/* Methods that take the parameter. */
static json_t *list_methods(uint32_t param_bit)
{
    json_t *methods = json_array();
    for (int i = 0; i < SPL_METHOD_COUNT; i++)
        if (spl_method_get((enum spl_method)i)->params & param_bit)
            json_array_append_new(methods, json_string(spl_method_name((enum spl_method)i)));
    return methods;
}

static json_t *describe_primitives(const struct spl_dataset_info *info)
{
    return json_pack("{s:o, s:o, s:o, s:o, s:o, s:o}", "panels", count(info->panels), "panel_points",
                     count(info->panel_points), "meshes", count(info->meshes), "mesh_points", count(info->mesh_points),
                     "pieces", count(info->pieces), "methods", list_methods(SPL_PARAM_BIT(primitives)));
}

static json_t *describe_textures(const struct spl_dataset_info *info)
{
    json_t *methods = json_array();
    for (int i = 0; i < SPL_METHOD_COUNT; i++)
        if (spl_method_has_textures((enum spl_method)i))
            json_array_append_new(methods, json_string(spl_method_name((enum spl_method)i)));
    return json_pack("{s:i, s:i, s:o}", "size", (int)info->texture_size, "atoms", (int)info->atoms, "methods", methods);
}

static json_t *describe_maps(const struct spl_catalog_entry *entry)
{
    const struct spl_dataset_info *info = entry->info;
    return json_pack("{s:o, s:o, s:o, s:o, s:o, s:o}", "stations", count(info->maps), "texels",
                     count(info->map_texels), "bytes", count(info->map_bytes), "methods",
                     list_methods(SPL_PARAM_BIT(maps)), "at_once",
                     count(atomic_load(&entry->maps_at_once)), "limit_bytes", count(atomic_load(&entry->limit_bytes)));
}

/* A value and how many have it; a class also as what pictures by class show of it. */
static json_t *describe_kind(double value, uint64_t n, bool class)
{
    json_t *kind = json_pack("{s:f, s:o}", "value", value, "count", count(n));
    const uint32_t number = (uint32_t)fmin(fmax(value, 0), SPL_PALETTE_COLORS - 1), color = spl_class_get_color(number);
    const char *name = spl_class_get_name(number);
    if (class) {
        set(kind, "name", name ? json_string(name) : json_null());
        set(kind, "color", json_sprintf("#%02x%02x%02x", color & 255, color >> 8 & 255, color >> 16 & 255));
    }
    return kind;
}

/* How an attribute's values are distributed, from which pages choose what is soft; null where the file does not say. */
static json_t *describe_values(const struct spl_stream_values *values, bool classes)
{
    if (!values)
        return json_null();
    json_t *quantiles = json_array(), *kinds = json_array();
    for (int i = 0; i <= SPL_VALUES_QUANTILES; i++)
        json_array_append_new(quantiles, json_real(values->quantiles[i]));
    for (uint32_t i = 0; i < values->kind_count; i++)
        json_array_append_new(kinds, describe_kind(values->kinds[i].value, values->kinds[i].count, classes));
    if (!values->kind_count) {
        json_decref(kinds);
        kinds = json_null();
    }
    return json_pack("{s:I, s:o, s:f, s:o}", "count", (json_int_t)values->count, "quantiles", quantiles, "p99",
                     values->p99, "kinds", kinds);
}

/* What picks give of a splat beside what every dataset has. */
static json_t *describe_attributes(const struct spl_dataset_info *info)
{
    json_t *all = json_array();
    for (uint32_t s = 0; s < info->stream_count; s++)
        json_array_append_new(all, json_pack("{s:s, s:s, s:o}", "name", info->streams[s].name, "unit",
                                             info->streams[s].unit, "values",
                                             describe_values(spl_dataset_info_get_values(info, s),
                                                             !strcmp(info->streams[s].name, "class"))));
    return all;
}

/* What views may begin with in soft. */
static json_t *describe_soft(const struct spl_dataset_info *info)
{
    char terms[SPL_SUGGESTIONS_MAX][SPL_SUGGESTION_MAX];
    const uint32_t terms_count = spl_soft_suggest(info, terms);
    json_t *forms = json_array();
    for (uint32_t i = 0; i < terms_count; i++)
        json_array_append_new(forms, json_string(terms[i]));
    return forms;
}

/* A copy: a reply is taken apart while other threads may read META. */
static json_t *describe_color(const struct spl_dataset *dataset)
{
    const json_t *color = json_object_get(spl_dataset_get_meta(dataset), "color");
    return color ? json_deep_copy(color) : json_null();
}

/* Of how many leaf splats those are that pruning has left. */
static json_t *describe_pruned(const struct spl_dataset *dataset)
{
    const json_t *of = json_object_get(json_object_get(spl_dataset_get_meta(dataset), "pruned"), "of");
    return json_is_integer(of) ? json_pack("{s:I}", "of", json_integer_value(of)) : json_null();
}

static json_t *describe_stations(const struct spl_catalog_entry *entry)
{
    const struct spl_dataset_info *info = entry->info;
    if (!info->station_count)
        return json_null();
    return json_pack("{s:o, s:s, s:o}", "count", count(info->station_count), "from",
                     info->stations_of_maps ? "panoramas" : "scan", "uri", json_sprintf("%s/stations", entry->uri));
}

/* Tiles that could not be read when that was tried last. */
static json_t *describe_faulty(const struct spl_catalog_entry *entry)
{
    enum { most = 10 };
    struct spl_faulty_tile tiles[most];
    const uint32_t all = spl_dataset_list_faulty(entry->dataset, tiles, most);
    json_t *list = json_array();
    for (uint32_t i = 0; i < all && i < most; i++)
        json_array_append_new(list, json_pack("{s:s, s:s}", "file", tiles[i].file, "reason", tiles[i].reason));
    return json_pack("{s:o, s:o}", "count", count(all), "first", list);
}

json_t *spl_describe_dataset(const struct spl_catalog_entry *entry, bool full)
{
    const struct spl_dataset_info *info = entry->info;
    json_t *json = json_object();
    set(json, "id", json_string(info->id));
    set(json, "version", json_sprintf("%016llx", (unsigned long long)info->version));
    set(json, "state", json_string("ready"));
    set(json, "uri", json_string(entry->uri));
    set(json, "view", json_sprintf("%s/view", entry->uri));
    set(json, "thumbnail", json_sprintf("%s/thumbnail.jpg", entry->uri));
    set(json, "title", info->title ? json_string(info->title) : json_null());
    set(json, "unit", json_string(spl_unit_word(info)));
    const char *crs = spl_places_get_crs(entry->places);
    set(json, "crs", *crs ? json_string(crs) : json_null());
    set(json, "splats", count(info->splats));
    set(json, "points", count(info->points));
    set(json, "bytes", count(info->file_bytes));
    set(json, "resident_bytes", count(spl_catalog_entry_get_resident_bytes(entry)));
    set(json, "bounds", json_pack("{s:o, s:o}", "min", vector(info->bounds_min), "max", vector(info->bounds_max)));
    if (info->tiles) {
        set(json, "tile_bytes", count(info->tile_bytes));
        set(json, "faulty_tiles", describe_faulty(entry));
    }
    if (!full)
        return json;
    struct spl_profile profile;
    bool profiled = !spl_plan_copy_profile(entry->plan, &profile, NULL);
    set(json, "profile", profiled ? json_sprintf("%s/profile", entry->uri) : json_null());
    spl_profile_finish(&profile);
    set(json, "levels", count(info->levels));
    set(json, "tiles", info->tiles ? count(info->tiles) : json_null());
    set(json, "leaf_splats", count(info->leaf_splats));
    set(json, "pruned", describe_pruned(entry->dataset));
    set(json, "page_bytes", count(info->page_bytes));
    set(json, "splat_radius", json_real(info->splat_radius));
    set(json, "layers", describe_layers());
    set(json, "methods", describe_methods(info));
    set(json, "attributes", describe_attributes(info));
    set(json, "soft", describe_soft(info));
    set(json, "color", describe_color(entry->dataset));
    set(json, "textures", info->atoms ? describe_textures(info) : json_null());
    set(json, "maps", info->maps ? describe_maps(entry) : json_null());
    set(json, "stations", describe_stations(entry));
    set(json, "primitives", info->panels || info->meshes || info->pieces ? describe_primitives(info) : json_null());
    json_t *formats = json_array();
    for (int i = 0; i < SPL_FORMAT_COUNT; i++)
        if (spl_format_is_built((enum spl_format)i))
            json_array_append_new(formats, json_string(spl_format_name((enum spl_format)i)));
    set(json, "formats", formats);
    set(json, "default_view",
        json_pack("{s:o, s:o, s:o, s:f, s:o}", "eye", vector(info->default_eye), "target",
                  vector(info->default_target), "up", vector(info->default_up), "fov", info->default_fov, "fit",
                  info->default_fit[0] > 0 ? json_pack("[f, f]", info->default_fit[0], info->default_fit[1])
                                           : json_null()));
    set(json, "description", info->description ? json_string(info->description) : json_null());
    set(json, "views", spl_saved_describe(entry->saved));
    return json;
}
