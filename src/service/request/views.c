/* A batch: many views in one JSON body. What stands beside "views" goes for each of them where it says nothing else.
 *
 * Errors name the view: views[3].fov. Invariant: no reference to the document outlives the call. Pure functions, any
 * thread. */
#include "service/request/request.h"

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "render/view.h"
#include "service/request/body.h"
#include "service/request/values.h"

static int resolve_view(const struct values *common, json_t *json, const struct spl_camera_defaults *defaults,
                        const struct spl_camera_limits *limits, struct spl_view_request *out, struct spl_error *err)
{
    struct values own = {0};
    if (!json_is_object(json))
        return spl_fail(err, SPL_E_INPUT, "a view must be an object, not %s", spl_json_type_name(json));
    int rc = spl_values_from_object(&own, json, SPL_BODY, err);
    if (!own.v[PARAM_color_by].given)
        own.color = common->color;
    spl_values_inherit_terms(&own, common);
    for (int i = 0; i < PARAM_COUNT; i++)
        if (!own.v[i].given)
            own.v[i] = common->v[i];
    if (rc || (rc = spl_values_resolve(&own, defaults, limits, out, err)))
        return rc;
    if (out->container)
        return spl_fail_field(err, SPL_E_INPUT, "layers",
                              "a view of a batch has one layer; list the view once a layer");
    return 0;
}

/* Whether no view before it has its lens: each is traced once, on the loop, for up to two milliseconds. */
static bool has_own_lens(const struct spl_views_request *views, const struct spl_view *view)
{
    for (size_t i = 0; i < views->count; i++)
        if (spl_view_shares_lens(view, &views->views[i].view))
            return false;
    return true;
}

static int resolve_all(const struct values *common, json_t *list, const struct spl_camera_defaults *defaults,
                       const struct spl_camera_limits *limits, struct spl_views_request *out, struct spl_error *err)
{
    uint64_t pixels = 0, samples = 0;
    unsigned lenses = 0;
    if (!(out->views = spl_alloc(json_array_size(list), sizeof *out->views, err)))
        return SPL_E_NOMEM;
    for (; out->count < json_array_size(list); out->count++) {
        struct spl_view_request *view = &out->views[out->count];
        struct spl_error why = {0};
        char field[sizeof why.field + 24];
        json_t *json = json_array_get(list, out->count);
        int rc = resolve_view(common, json, defaults, limits, view, &why);
        spl_camera_locate(json, &why);
        snprintf(field, sizeof field, "views[%zu]%s%s", out->count, why.field[0] ? "." : "", why.field);
        if (rc)
            return spl_fail_field(err, rc, field, "view %zu: %s", out->count, why.message);
        lenses += spl_camera_is_bent(&view->view.camera) && has_own_lens(out, &view->view);
        if (lenses > SPL_VIEW_LENSES_KEPT)
            return spl_fail_field(
                err, SPL_E_INPUT, "views",
                "views[%zu] is beyond the %d lenses and panoramas of a batch that differ in more than "
                "their pose; ask for them in several batches",
                out->count, SPL_VIEW_LENSES_KEPT);
        pixels += (uint64_t)view->view.camera.width * view->view.camera.height;
        samples += spl_view_get_samples(&view->view);
    }
    if (pixels > limits->pixels)
        return spl_fail_field(err, SPL_E_INPUT, "views", "%zu views have %llu pixels in all; the limit is %llu",
                              out->count, (unsigned long long)pixels, (unsigned long long)limits->pixels);
    if (limits->samples && samples > limits->samples)
        return spl_fail_field(err, SPL_E_INPUT, "views", "%zu views have %llu samples in all; the limit is %llu",
                              out->count, (unsigned long long)samples, (unsigned long long)limits->samples);
    return 0;
}

/* Takes "views" out of the document, so that what is left are parameters. */
static int read_document(json_t *document, struct values *common, json_t **list, struct spl_error *err)
{
    if (!json_is_object(document))
        return spl_fail_field(err, SPL_E_INPUT, "body", "the body must be a JSON object, not %s",
                              spl_json_type_name(document));
    char shape[40];
    *list = json_incref(json_object_get(document, "views"));
    if (!json_is_array(*list) || !json_array_size(*list) || json_array_size(*list) > SPL_VIEWS_MAX)
        return spl_fail_field(err, SPL_E_INPUT, "views", "views must be an array of 1 to %d; it is %s", SPL_VIEWS_MAX,
                              spl_json_show_shape(*list, shape));
    json_object_del(document, "views");
    return spl_values_from_object(common, document, SPL_BODY, err);
}

int spl_views_request_from_json(const char *body, size_t length, const struct spl_camera_defaults *defaults,
                                const struct spl_camera_limits *limits, struct spl_views_request *out,
                                struct spl_error *err)
{
    struct values common = {0};
    json_t *list = NULL, *document = spl_body_parse(body, length, SPL_BODY_VALUES, SPL_BODY_TEXT, err);
    *out = (struct spl_views_request){0};
    int rc = document ? read_document(document, &common, &list, err) : SPL_E_INPUT;
    struct spl_value *container = &common.v[PARAM_container];
    out->container = container->given ? (enum spl_container)container->n[0] : SPL_CONTAINER_MULTIPART;
    *container = (struct spl_value){0}; // of the batch, not of its views
    if (!rc)
        rc = resolve_all(&common, list, defaults, limits, out, err);
    json_decref(list);
    json_decref(document);
    if (rc)
        spl_views_request_finish(out);
    return rc;
}

void spl_views_request_finish(struct spl_views_request *request)
{
    free(request->views);
    *request = (struct spl_views_request){0};
}
