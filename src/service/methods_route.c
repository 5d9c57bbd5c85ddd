/* /v1/methods: the table of methods and of their parameters as JSON (splatd/method.h), from which the page builds its
 * controls. It speaks of the program, not of datasets, so nobody needs a token for it. Owned by the loop's thread. */
#include <splatd/method.h>

#include "service/pages.h"
#include "service/reply.h"

/* A member that memory was refused for is left out. */
static void set(json_t *object, const char *name, json_t *value)
{
    json_object_set_new(object, name, value);
}

static json_t *list_params(uint32_t params)
{
    json_t *list = json_array();
    for (int i = 0; i < SPL_PARAM_COUNT; i++)
        if (params >> i & 1)
            json_array_append_new(list, json_string(spl_method_param_get((enum spl_method_param)i)->name));
    return list;
}

static json_t *describe_method(const struct spl_method_info *method)
{
    json_t *json =
        json_pack("{s:s, s:s, s:b, s:b}", "name", method->name, "description", method->help, "textures",
                             method->textures, "normals", method->finds_normals);
    set(json, "stand_in", method->needs_surface ? json_string(spl_method_name(method->stand_in)) : json_null());
    set(json, "parameters", list_params(method->params));
    return json;
}

static json_t *describe_number(const struct spl_method_param_info *param, double value)
{
    return param->kind == SPL_PARAM_WHOLE ? json_integer((json_int_t)value) : json_real(value);
}

/* In the words of JSON Schema, as openapi.yaml has them. */
static json_t *describe_param(const struct spl_method_param_info *param)
{
    static const char *const types[] = {
        [SPL_PARAM_REAL] = "number", [SPL_PARAM_WHOLE] = "integer", [SPL_PARAM_CHOICE] = "string"};
    json_t *json =
        json_pack("{s:s, s:s, s:s}", "name", param->name, "description", param->help, "type", types[param->kind]);
    if (param->kind == SPL_PARAM_CHOICE) {
        json_t *names = json_array();
        for (int i = 0; i <= (int)param->most; i++)
            json_array_append_new(names, json_string(param->choice_name(i)));
        set(json, "enum", names);
        set(json, "default", json_string(param->choice_name((int)param->otherwise)));
    } else {
        set(json, "minimum", describe_number(param, param->least));
        set(json, "maximum", describe_number(param, param->most));
        set(json, "default", describe_number(param, param->otherwise));
    }
    set(json, "textures", json_boolean(param->changes == SPL_CHANGES_TEXTURES));
    set(json, "maps", json_boolean(param->changes == SPL_CHANGES_MAPS));
    set(json, "primitives", json_boolean(param->changes == SPL_CHANGES_PRIMITIVES));
    set(json, "colors", json_boolean(param->changes == SPL_CHANGES_SHADE || param->changes == SPL_CHANGES_COLORS));
    set(json, "soft", json_boolean(param->changes == SPL_CHANGES_SOFT));
    return json;
}

void spl_show_methods(struct request *request, const struct spl_call *call)
{
    (void)call;
    json_t *methods = json_array(), *params = json_array();
    for (int i = 0; i < SPL_METHOD_COUNT; i++)
        json_array_append_new(methods, describe_method(spl_method_get((enum spl_method)i)));
    for (int i = 0; i < SPL_PARAM_COUNT; i++)
        json_array_append_new(params, describe_param(spl_method_param_get((enum spl_method_param)i)));
    spl_reply_json(request, json_pack("{s:s, s:o, s:o}", "default", spl_method_name(SPL_METHOD_DEFAULT), "methods",
                                      methods, "parameters", params));
}
