/* A dataset, and single points, in other coordinate systems. Owned by the loop's thread. */
#include <string.h>

#include "service/datasets/library.h"
#include "service/exchange.h"
#include "service/place/wait.h"
#include "service/reply.h"
#include "service/request/values.h"

static json_t *vector(const double v[3])
{
    return json_pack("[f, f, f]", v[0], v[1], v[2]);
}

/* The query; *crs is 0 where none is given. */
static int read_query(const struct request *request, struct values *values, uint32_t *crs, struct spl_error *err)
{
    *values = (struct values){0};
    int rc = spl_values_from_query(values, request->query, strlen(request->query), SPL_PLACE, err);
    *crs = (uint32_t)values->v[PARAM_crs].n[0];
    return rc;
}

/* Bounds and the default view as EPSG:`crs` has them. */
static int translate(json_t *json, const struct spl_catalog_entry *entry, uint32_t crs, struct spl_error *err)
{
    const struct spl_dataset_info *info = entry->info;
    double world[2][3], box[2][3], eye[3], target[3];
    memcpy(world[0], info->bounds_min, sizeof world[0]);
    memcpy(world[1], info->bounds_max, sizeof world[1]);
    int rc;
    if ((rc = spl_places_bounds(entry->places, crs, world, box, err)) ||
        (rc = spl_places_from_world(entry->places, crs, false, info->default_eye, eye, err)) ||
        (rc = spl_places_from_world(entry->places, crs, false, info->default_target, target, err)))
        return rc;
    json_t *view = json_object_get(json, "default_view");
    json_object_set_new(json, "bounds", json_pack("{s:o, s:o}", "min", vector(box[0]), "max", vector(box[1])));
    json_object_set_new(json, "bounds_crs", json_sprintf("EPSG:%u", crs));
    json_object_set_new(view, "eye", vector(eye));
    json_object_set_new(view, "target", vector(target));
    json_object_set_new(view, "crs", json_sprintf("EPSG:%u", crs));
    return 0;
}

void spl_show_dataset(struct request *request, const struct spl_call *call)
{
    struct spl_error err = {0};
    struct values values;
    uint32_t crs;
    json_t *json = NULL;
    int rc = read_query(request, &values, &crs, &err);
    for (enum param param = PARAM_position; !rc && param <= PARAM_world; param++)
        if (values.v[param].given)
            rc = spl_fail_field(&err, SPL_E_INPUT, spl_params[param].name, "'%s' belongs to %s/place",
                                spl_params[param].name, call->entry->uri);
    if (!rc)
        json = spl_describe_dataset(call->entry, true);
    if (!rc && crs)
        rc = translate(json, call->entry, crs, &err);
    if (!rc) {
        spl_reply_json(request, json);
        return;
    }
    json_decref(json);
    if (!spl_place_wait(request, call, spl_show_dataset, &err))
        spl_reply_error(request, &err);
}

/* One of `position` and `world` is given; the other one follows. */
static int find(struct spl_catalog_entry *entry, const struct values *values, uint32_t crs, double position[3],
                double world[3], struct spl_error *err)
{
    const struct spl_value *given = &values->v[PARAM_position], *other = &values->v[PARAM_world];
    const struct spl_camera_places *places = &entry->at_once.hook;
    if (!crs)
        return spl_fail_field(err, SPL_E_INPUT, "crs", "'crs' is missing: EPSG:N, as EPSG:4326");
    if (given->given == other->given)
        return spl_fail_field(err, SPL_E_INPUT, "position", "give 'position', in crs, or 'world', and not both");
    if (other->given) {
        memcpy(world, other->n, 3 * sizeof *world);
        return spl_places_from_world(entry->places, crs, false, world, position, err);
    }
    memcpy(position, given->n, 3 * sizeof *position);
    return places->to_world(places, crs, "position", position, world, err);
}

void spl_show_place(struct request *request, const struct spl_call *call)
{
    struct spl_catalog_entry *entry = call->entry;
    struct spl_error err = {0};
    struct values values;
    double position[3], world[3];
    uint32_t crs;
    if (read_query(request, &values, &crs, &err) || find(entry, &values, crs, position, world, &err)) {
        if (!spl_place_wait(request, call, spl_show_place, &err))
            spl_reply_error(request, &err);
        return;
    }
    double accuracy_m = spl_places_get_accuracy(entry->places, crs);
    spl_reply_json(request, json_pack("{s:o, s:o, s:o, s:s, s:o}", "crs", json_sprintf("EPSG:%u", crs), "position",
                                      vector(position), "world", vector(world), "unit", spl_unit_word(entry->info),
                                      "accuracy_m", accuracy_m < 0 ? json_null() : json_real(accuracy_m)));
}
