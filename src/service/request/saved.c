/* What a saved view says beside its camera: parameters of place SPL_SAVED, as JSON, which stand for those that a
 * request leaves out.
 *
 * Invariant: what is drawn is taken whole: a request's own clip takes the place of the view's, its class that of the
 * view's. Pure functions, any thread. */
#include <jansson.h>
#include <stdio.h>
#include <string.h>

#include "service/request/request.h"
#include "service/request/values.h"

static int read_settings(struct values *values, const char *settings, struct spl_error *err)
{
    json_t *json = json_loads(settings, JSON_REJECT_DUPLICATES, NULL);
    int rc = json_is_object(json) ? spl_values_from_object(values, json, SPL_SAVED, err)
                                  : spl_fail(err, SPL_E_INPUT, "they are no JSON object");
    json_decref(json);
    return rc;
}

int spl_values_inherit_saved(struct values *values, const char *settings, struct spl_error *err)
{
    struct values saved = {0};
    struct spl_error why = {0};
    if (!settings[0])
        return 0;
    int rc = read_settings(&saved, settings, &why);
    if (rc) // a file may say anything
        return spl_fail_field(err, rc, "view", "the settings of this view are not taken: %s", why.message);
    values->world_soft = !values->v[PARAM_soft].given && saved.v[PARAM_soft].given;
    values->world_clip = !values->v[PARAM_clip].given && saved.v[PARAM_clip].given;
    if (values->v[PARAM_color_by].given) // the view's ramp and range are those of its own
        saved.v[PARAM_range].given = saved.v[PARAM_ramp].given = false;
    else
        values->color = saved.color;
    spl_values_inherit_terms(values, &saved);
    for (int i = 0; i < PARAM_COUNT; i++)
        if (!values->v[i].given)
            values->v[i] = saved.v[i];
    return 0;
}

int spl_view_request_from_saved(const struct spl_saved_view *view, const struct spl_camera_defaults *defaults,
                                const struct spl_camera_limits *limits, struct spl_view_request *out,
                                struct spl_error *err)
{
    struct values values = {0};
    struct spl_error why = {0};
    char field[sizeof why.field + 16];
    int rc = view->settings[0] ? read_settings(&values, view->settings, &why) : 0;
    if (!rc)
        rc = spl_values_resolve(&values, defaults, limits, out, &why);
    snprintf(field, sizeof field, "settings%s%s", why.field[0] ? "." : "", why.field);
    return rc ? spl_fail_field(err, rc, field, "%s", why.message) : 0;
}
