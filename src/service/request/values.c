/* The table of parameters, and the syntax of single values that queries and JSON share beyond those of cameras. Pure
 * functions, any thread. */
#include "service/request/values.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/decimal.h"
#include "base/near_name.h"
#include "dataset/saved_views.h"
#include "image/color.h"

#define LAYER_NAMES "color, depth, range, normal, id, coverage, primitive"

const struct param_info spl_params[PARAM_COUNT] = {
#define PARAM(name, alias, kind, places, help) {#name, alias, SPL_KIND_##kind, places},
#include "service/request/view_params.def"
#undef PARAM
};

/* What a place takes, for those that are no view's; NULL for a view's. */
static const char *say_taken(enum spl_value_place place)
{
    return place & (SPL_PICK | SPL_PICK_BODY) ? "a pick takes x, y, a camera, method, its settings and v"
           : place == SPL_TILE ? "a tile's path says where it lies; it takes what is drawn (clip, class, soft), how "
                                 "(method, lod, color_by, shade, supersample, …), background, quality, wait and v"
           : place == SPL_THUMBNAIL ? "a thumbnail takes width, background, clip, class and v"
           : place == SPL_SAVED
               ? "a saved view keeps what is drawn (clip, class, soft), colours, shading and background"
           : place == SPL_PLACE    ? "a dataset takes crs, a place crs and position or world"
           : place == SPL_STATIONS ? "a list of stations takes crs, first and count"
                                   : NULL;
}

/* Of enum spl_value_place; a pick takes a view's camera. */
static unsigned get_places(enum param param)
{
    unsigned places = spl_params[param].places;
    if ((int)param < (int)SPL_CAMERA_PARAMS)
        return places | (places & SPL_QUERY ? SPL_PICK : 0) | (places & SPL_BODY ? SPL_PICK_BODY : 0);
    return places | (places & SPL_PICK ? SPL_PICK_BODY : 0);
}

enum param spl_param_find(const char *name, enum spl_value_place place, struct spl_error *err)
{
    const char *taken = say_taken(place), *ours = place & (SPL_QUERY | SPL_CAMERA) ? spl_camera_find_ours(name) : NULL;
    struct spl_near_name near = spl_near_name_of(name);
    for (int i = 0; i < PARAM_COUNT; i++) {
        const struct param_info *info = &spl_params[i];
        bool alias = place & (SPL_QUERY | SPL_PICK) && info->alias[0] && !strcasecmp(name, info->alias);
        bool taken_here = get_places((enum param)i) & place;
        if (strcmp(name, info->name) && !alias) {
            if (taken_here)
                spl_near_name_offer(&near, info->name);
            continue;
        }
        if (taken_here)
            return (enum param)i;
        if (ours)
            break;
        spl_fail_field(err, SPL_E_INPUT, name, "'%s' does not belong here; %s", name,
                       place == SPL_PICK_BODY && info->places & SPL_CAMERA ? "give it in the \"camera\" object"
                       : taken                              ? taken
                       : info->places == SPL_STATIONS       ? "it is a parameter of a list of stations"
                       : info->places == SPL_PLACE          ? "it is a parameter of a place"
                       : info->places == SPL_PICK           ? "it is a parameter of a pick"
                       : info->places == SPL_LIST           ? "it is a parameter of rays"
                       : info->places & SPL_CAMERA          ? "give it in the \"camera\" object of a POST"
                                                            : "give it beside \"camera\"");
        return PARAM_COUNT;
    }
    char meant[SPL_NEAR_NAME_TEXT_MAX];
    if (ours)
        spl_fail_field(err, SPL_E_INPUT, name, "unknown parameter '%s': it is called '%s'", name, ours);
    else
        spl_fail_field(err, SPL_E_INPUT, name, "unknown parameter '%s'; %s%s", name, spl_near_name_say(&near, meant),
                       taken ? taken : "/v1/openapi.json lists those of a view");
    return PARAM_COUNT;
}

static int parse_color(struct spl_value *value, const char *name, const char *text, struct spl_error *err)
{
    uint8_t rgba[4];
    if (!spl_color_from_text(text, rgba))
        return spl_fail_field(err, SPL_E_INPUT, name, "%s '%.32s' is no colour; write " SPL_COLOR_FORMS "%s", name,
                              text, *text ? "" : "; '#' is written %23 in a URL, or left out");
    for (int i = 0; i < 4; i++)
        value->n[i] = rgba[i];
    return 0;
}

/* "50ms", "0.05s", "50". */
static int parse_duration(struct spl_value *value, const char *name, const char *text, struct spl_error *err)
{
    size_t digits = strspn(text, "0123456789.");
    const char *unit = text + digits;
    double scale = !*unit || !strcmp(unit, "ms") ? 1 : !strcmp(unit, "s") ? 1000 : 0, count = 0;
    if (spl_decimal_parse(text, &count) != unit || scale == 0)
        return spl_fail_field(err, SPL_E_INPUT, name, "%s '%.32s' is no time; write 50ms, 0.05s or 50", name, text);
    value->n[0] = scale * count;
    return 0;
}

static int parse_name(struct spl_value *value, const char *name, const char *text, struct spl_error *err)
{
    if (!spl_view_name_is_valid(text))
        return spl_fail_field(err, SPL_E_INPUT, name, "%s '%.64s' is no name of a view: " SPL_VIEW_NAME_FORMS, name,
                              text);
    snprintf(value->word, sizeof value->word, "%s", text);
    return 0;
}

static int parse_version(struct spl_value *value, const char *name, const char *text, struct spl_error *err)
{
    size_t length = strspn(text, "0123456789abcdef");
    if (length != 16 || text[length])
        return spl_fail_field(err, SPL_E_INPUT, name, "%s '%.32s' is no version; write the dataset's 16 hex digits",
                              name, text);
    uint64_t version = strtoull(text, NULL, 16);
    value->n[0] = (double)(version >> 32);
    value->n[1] = (double)(version & UINT32_MAX);
    return 0;
}

static int parse_shade(struct spl_value *value, const char *text, struct spl_error *err)
{
    struct spl_shade_params shade = {0};
    int rc = spl_shade_parse(text, &shade, err);
    value->n[0] = shade.kinds;
    value->n[1] = shade.sun[0];
    value->n[2] = shade.sun[1];
    return rc;
}

static int parse_range(struct spl_value *value, const char *text, struct spl_error *err)
{
    struct spl_color_params color = {0};
    int rc = spl_color_parse_range(text, &color, err);
    value->n[0] = color.range[0];
    value->n[1] = color.range[1];
    value->n[2] = (int)color.shares[0] | (int)color.shares[1] << 1;
    return rc;
}

int spl_values_set_color(struct values *values, const char *text, struct spl_error *err)
{
    int rc = spl_value_claim(&values->v[PARAM_color_by], "color_by", err);
    return rc ? rc : spl_color_parse(text, &values->color, err);
}

/* Of a method's parameter. */
static int parse_choice(struct spl_value *value, const char *name, const char *text, struct spl_error *err)
{
    const struct spl_method_param_info *param = spl_method_param_get(spl_method_param_from_name(name));
    int choice = param->choice_from_name(text);
    if (choice < 0) {
        char known[256] = "";
        for (int i = 0, used = 0; i <= (int)param->most && used < (int)sizeof known; i++)
            used += snprintf(known + used, sizeof known - (size_t)used, "%s%s", i ? ", " : "", param->choice_name(i));
        return spl_fail_field(err, SPL_E_INPUT, name, "%s '%.32s' is unknown; known are %s", name, text, known);
    }
    value->n[0] = choice;
    return 0;
}

int spl_value_add_layer(struct spl_value *value, const char *name, const char *text, struct spl_error *err)
{
    int layer = spl_layer_from_name(text);
    if (layer < 0)
        return spl_fail_field(err, SPL_E_INPUT, name, "%s: '%.32s' is unknown; known are " LAYER_NAMES, name, text);
    unsigned set = (unsigned)value->n[0];
    if (set >> layer & 1)
        return spl_fail_field(err, SPL_E_INPUT, name, "%s has '%s' twice", name, text);
    value->n[0] = set | 1u << layer;
    return 0;
}

static int parse_layers(struct spl_value *value, const char *name, const char *text, struct spl_error *err)
{
    char word[32];
    for (const char *p = text;; p++) {
        size_t length = strcspn(p, ",");
        snprintf(word, sizeof word, "%.*s", (int)(length < sizeof word ? length : sizeof word - 1), p);
        int rc = spl_value_add_layer(value, name, word, err);
        if (rc)
            return rc;
        p += length;
        if (!*p)
            return 0;
    }
}

static int container_from_name(const char *name)
{
    return !strcmp(name, "multipart") ? SPL_CONTAINER_MULTIPART : !strcmp(name, "zip") ? SPL_CONTAINER_ZIP : -1;
}

static int built_format_from_name(const char *name)
{
    if (!strcmp(name, "json"))
        return SPL_FORMAT_LISTED; // spl_values_resolve_encoding() asks of what
    int format = spl_format_from_name(name);
    return format >= 0 && spl_format_is_built((enum spl_format)format) ? format : -1;
}

/* The names of the formats that are built in. */
static const char *format_names(void)
{
    static const char *const names[] = {"jpeg, png, npy, raw", "jpeg, png, npy, raw, webp", "jpeg, png, npy, raw, tiff",
                                        "jpeg, png, npy, raw, webp, tiff"};
    return names[spl_format_is_built(SPL_FORMAT_WEBP) + 2 * spl_format_is_built(SPL_FORMAT_TIFF)];
}

static int flag_from_name(const char *name)
{
    if (!strcmp(name, "1") || !strcasecmp(name, "true"))
        return 1;
    return !strcmp(name, "0") || !strcasecmp(name, "false") ? 0 : -1;
}

int spl_value_from_text(struct spl_value *value, int kind, const char *name, const char *text, struct spl_error *err)
{
    const struct {
        int (*lookup)(const char *name);
        const char *choices;
    } table[] = {
        [SPL_KIND_FLAG] = {flag_from_name, "true, false, 1, 0"},
        [SPL_KIND_METHOD] = {spl_method_from_name, spl_method_names()},
        [SPL_KIND_LAYER] = {spl_layer_from_name, LAYER_NAMES},
        [SPL_KIND_FORMAT] = {built_format_from_name, format_names()},
        [SPL_KIND_CONTAINER] = {container_from_name, "multipart, zip"},
        [SPL_KIND_FRAME] = {spl_ray_frame_from_name, "camera, sensor, world"},
    };
    if (kind == SPL_KIND_COLOR)
        return parse_color(value, name, text, err);
    if (kind == SPL_KIND_DURATION)
        return parse_duration(value, name, text, err);
    if (kind == SPL_KIND_LAYERS)
        return parse_layers(value, name, text, err);
    if (kind == SPL_KIND_CHOICE)
        return parse_choice(value, name, text, err);
    if (kind == SPL_KIND_NAME)
        return parse_name(value, name, text, err);
    if (kind == SPL_KIND_RANGE)
        return parse_range(value, text, err);
    if (kind == SPL_KIND_SHADE)
        return parse_shade(value, text, err);
    if (kind == SPL_KIND_VERSION)
        return parse_version(value, name, text, err);
    if (kind < SPL_KIND_END)
        return spl_value_from_choice(value, (enum spl_value_kind)kind, name, text, err);
    int choice = table[kind].lookup(text);
    if (choice < 0)
        return spl_fail_field(err, SPL_E_INPUT, name, "%s '%.32s' is unknown; known are %s", name, text,
                              table[kind].choices);
    value->n[0] = choice;
    return 0;
}
