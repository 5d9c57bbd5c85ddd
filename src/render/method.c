/* The table of methods and of their parameters. Immutable; any thread. */
#include "render/method.h"

#include <stdio.h>
#include <string.h>

#include <splatd/render.h>

#include "base/error.h"
#include "shared.h"

_Static_assert(SPL_TEXTURE_ATOMS == 8 && SPL_FILL_LEVELS_MAX == 8, "the most atoms and levels, as the table says");

#define ROW(NAME, name) extern const struct spl_method_row spl_method_##name;
SPL_METHODS(ROW)
#undef ROW

static const struct spl_method_row *const rows[SPL_METHOD_COUNT] = {
#define ROW(NAME, name) &spl_method_##name,
    SPL_METHODS(ROW)
#undef ROW
};

static int find_name(const char *const *names, int count, const char *name)
{
    for (int i = 0; name && i < count; i++)
        if (!strcmp(name, names[i]))
            return i;
    return -1;
}

static const char *const visibility_names[SPL_VISIBILITY_COUNT] = {
    [SPL_VISIBILITY_ADAPTIVE] = "adaptive",
    [SPL_VISIBILITY_CONSTANT] = "constant",
    [SPL_VISIBILITY_NONE] = "none",
};

const char *spl_visibility_name(enum spl_visibility visibility)
{
    return (unsigned)visibility < SPL_VISIBILITY_COUNT ? visibility_names[visibility] : "unknown";
}

int spl_visibility_from_name(const char *name)
{
    return find_name(visibility_names, SPL_VISIBILITY_COUNT, name);
}

static const char *const maps_names[SPL_MAPS_COUNT] = {
    [SPL_MAPS_ON] = "on",
    [SPL_MAPS_OFF] = "off",
};

const char *spl_maps_name(enum spl_maps maps)
{
    return (unsigned)maps < SPL_MAPS_COUNT ? maps_names[maps] : "unknown";
}

int spl_maps_from_name(const char *name)
{
    return find_name(maps_names, SPL_MAPS_COUNT, name);
}

static const char *const shapes_names[SPL_SHAPES_COUNT] = {
    [SPL_SHAPES_OFF] = "off",
    [SPL_SHAPES_LINES] = "lines",
    [SPL_SHAPES_PANELS] = "panels",
    [SPL_SHAPES_ALL] = "all",
};

const char *spl_shapes_name(enum spl_shapes shapes)
{
    return (unsigned)shapes < SPL_SHAPES_COUNT ? shapes_names[shapes] : "unknown";
}

int spl_shapes_from_name(const char *name)
{
    return find_name(shapes_names, SPL_SHAPES_COUNT, name);
}

/* spl_PREFIX_name() of an int, for each choice. */
#define NOTHING(...)
#define CHOICE_NAME(name, field, prefix, ...)                                                                          \
    static const char *choice_##name(int choice)                                                                       \
    {                                                                                                                  \
        return spl_##prefix##_name((enum spl_##prefix)choice);                                                         \
    }
SPL_METHOD_PARAMS(NOTHING, NOTHING, CHOICE_NAME)

#define CHOICE_MOST_visibility (SPL_VISIBILITY_COUNT - 1)
#define CHOICE_MOST_maps (SPL_MAPS_COUNT - 1)
#define CHOICE_MOST_shapes (SPL_SHAPES_COUNT - 1)
#define CHOICE_MOST_ramp (SPL_RAMP_COUNT - 1)
#define CHOICE_MOST_soft_model (SPL_SOFT_MODEL_COUNT - 1)
#define CHOICE_MOST_soft_of (SPL_SOFT_OF_COUNT - 1)
static const struct spl_method_param_info params[SPL_PARAM_COUNT] = {
#define REAL(id, field, low, high, value, change, text)                                                                \
    {.name = #id,                                                                                                      \
     .help = text,                                                                                                     \
     .kind = SPL_PARAM_REAL,                                                                                           \
     .least = low,                                                                                                     \
     .most = high,                                                                                                     \
     .otherwise = value,                                                                                               \
     .changes = change},
#define COUNT(id, field, low, high, value, change, text)                                                               \
    {.name = #id,                                                                                                      \
     .help = text,                                                                                                     \
     .kind = SPL_PARAM_WHOLE,                                                                                          \
     .least = low,                                                                                                     \
     .most = high,                                                                                                     \
     .otherwise = value,                                                                                               \
     .changes = change},
#define CHOICE(id, field, prefix, value, change, text)                                                                 \
    {.name = #id,                                                                                                      \
     .help = text,                                                                                                     \
     .kind = SPL_PARAM_CHOICE,                                                                                         \
     .most = CHOICE_MOST_##prefix,                                                                                     \
     .otherwise = value,                                                                                               \
     .changes = change,                                                                                                \
     .choice_name = choice_##id,                                                                                       \
     .choice_from_name = spl_##prefix##_from_name},
    SPL_METHOD_PARAMS(REAL, COUNT, CHOICE)};

const struct spl_method_param_info *spl_method_param_get(enum spl_method_param param)
{
    return (unsigned)param < SPL_PARAM_COUNT ? &params[param] : NULL;
}

int spl_method_param_from_name(const char *name)
{
    for (int i = 0; name && i < SPL_PARAM_COUNT; i++)
        if (!strcmp(params[i].name, name))
            return i;
    return -1;
}

int spl_method_param_check(const struct spl_method_param_info *param, double value, struct spl_error *err)
{
    if (value == param->otherwise || (value >= param->least && value <= param->most))
        return SPL_OK;
    if (param->kind == SPL_PARAM_CHOICE)
        return spl_fail_field(err, SPL_E_USAGE, param->name, "%s %g does not exist", param->name, value);
    if (param->otherwise < param->least)
        return spl_fail_field(err, SPL_E_USAGE, param->name, "%s %g is neither %g nor within %g and %g", param->name,
                              value, param->otherwise, param->least, param->most);
    return spl_fail_field(err, SPL_E_USAGE, param->name, "%s %g is not within %g and %g", param->name, value,
                          param->least, param->most);
}

bool spl_method_param_counts(const struct spl_method_param_info *param, const struct spl_dataset_info *dataset)
{
    return param->changes == SPL_CHANGES_TEXTURES     ? dataset->atoms > 0
           : param->changes == SPL_CHANGES_MAPS       ? dataset->maps > 0
           : param->changes == SPL_CHANGES_PRIMITIVES ? dataset->panels || dataset->meshes || dataset->pieces
                                                      : true;
}

double spl_view_get_param(const struct spl_view *view, enum spl_method_param param)
{
    switch (param) {
#define GET(name, field, ...)                                                                                          \
    case SPL_PARAM_##name:                                                                                             \
        return (double)view->field;
        SPL_METHOD_PARAMS(GET, GET, GET)
    case SPL_PARAM_COUNT:
        break;
    }
    return 0;
}

void spl_view_set_param(struct spl_view *view, enum spl_method_param param, double value)
{
    double whole = value >= 0 ? value <= UINT32_MAX ? value : UINT32_MAX : UINT32_MAX; // NaN too: the check refuses it
    switch (param) {
#define SET_REAL(name, field, ...)                                                                                     \
    case SPL_PARAM_##name:                                                                                             \
        view->field = value;                                                                                           \
        return;
#define SET_WHOLE(name, field, ...)                                                                                    \
    case SPL_PARAM_##name:                                                                                             \
        view->field = (uint32_t)whole;                                                                                 \
        return;
        SPL_METHOD_PARAMS(SET_REAL, SET_WHOLE, SET_WHOLE)
    case SPL_PARAM_COUNT:
        break;
    }
}

static bool exists(enum spl_method method)
{
    return (unsigned)method < SPL_METHOD_COUNT;
}

const struct spl_method_row *spl_method_row(enum spl_method method)
{
    return rows[method];
}

const struct spl_method_info *spl_method_get(enum spl_method method)
{
    return exists(method) ? &rows[method]->info : NULL;
}

const char *spl_method_name(enum spl_method method)
{
    return exists(method) ? rows[method]->info.name : "unknown";
}

int spl_method_from_name(const char *name)
{
    for (int i = 0; name && i < SPL_METHOD_COUNT; i++)
        if (!strcmp(name, rows[i]->info.name))
            return i;
    return -1;
}

const char *spl_method_names(void)
{
#define NAME(NAME, name) ", " #name
    return &(SPL_METHODS(NAME))[2];
#undef NAME
}

bool spl_method_has_textures(enum spl_method method)
{
    return exists(method) && rows[method]->info.textures;
}

enum spl_method spl_method_for(enum spl_method method, const struct spl_dataset_info *dataset)
{
    const struct spl_method_info *info = spl_method_get(method);
    return info && info->needs_surface && !dataset->has_surface ? info->stand_in : method;
}

bool spl_method_has_normals(enum spl_method method, const struct spl_dataset_info *dataset)
{
    return exists(method) && (dataset->has_surface || rows[spl_method_for(method, dataset)]->info.finds_normals);
}

uint32_t spl_method_get_params(enum spl_method method)
{
    const struct spl_method_info *info = spl_method_get(method);
    if (!info)
        return 0;
    return info->params | (info->needs_surface ? rows[info->stand_in]->info.params : 0);
}
