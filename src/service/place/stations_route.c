/* GET …/stations: where scanners stood, so many at a time, so that no list holds up the loop, whose thread owns it. */
#include <string.h>

#include "dataset/stations.h"
#include "service/datasets/library.h"
#include "service/exchange.h"
#include "service/place/wait.h"
#include "service/reply.h"
#include "service/request/values.h"

enum { at_once = 256 };

/* NULL and `err` where the coordinate system has no such place. */
static json_t *describe(const struct spl_catalog_entry *entry, uint32_t number, uint32_t crs, struct spl_error *err)
{
    const double *pose = entry->info->stations[number], world[3] = {pose[3], pose[7], pose[11]};
    double position[3];
    if (crs && spl_places_from_world(entry->places, crs, false, world, position, err))
        return NULL;
    json_t *json = spl_station_to_json(entry->info, number);
    if (crs)
        json_object_set_new(json, "position", json_pack("[f, f, f]", position[0], position[1], position[2]));
    return json;
}

static int read_query(const struct request *request, const struct spl_dataset_info *info, uint32_t *crs,
                      uint32_t *first, uint32_t *count, struct spl_error *err)
{
    struct values values = {0};
    int rc = spl_values_from_query(&values, request->query, strlen(request->query), SPL_STATIONS, err);
    const struct spl_value *from = &values.v[PARAM_first], *most = &values.v[PARAM_count];
    if (rc)
        return rc;
    if (most->given && !(most->n[0] >= 1 && most->n[0] <= at_once))
        return spl_fail_field(err, SPL_E_INPUT, "count", "count %.0f is outside 1 to %d", most->n[0], at_once);
    if (from->n[0] > info->station_count)
        return spl_fail_field(err, SPL_E_INPUT, "first", "first %.0f is beyond the %u stations of dataset '%s'",
                              from->n[0], info->station_count, info->id);
    *crs = (uint32_t)values.v[PARAM_crs].n[0];
    *first = (uint32_t)from->n[0];
    *count = most->given ? (uint32_t)most->n[0] : at_once;
    if (*count > info->station_count - *first)
        *count = info->station_count - *first;
    return SPL_OK;
}

void spl_show_stations(struct request *request, const struct spl_call *call)
{
    const struct spl_catalog_entry *entry = call->entry;
    struct spl_error err = {0};
    uint32_t crs, first, count;
    json_t *list = json_array();
    int rc = read_query(request, entry->info, &crs, &first, &count, &err);
    for (uint32_t i = 0; !rc && i < count; i++) {
        json_t *station = describe(entry, first + i, crs, &err);
        rc = err.code;
        json_array_append_new(list, station);
    }
    if (rc) {
        json_decref(list);
        if (!spl_place_wait(request, call, spl_show_stations, &err))
            spl_reply_error(request, &err);
        return;
    }
    json_t *json =
        json_pack("{s:i, s:i, s:o}", "count", (int)entry->info->station_count, "first", (int)first, "stations", list);
    if (crs)
        json_object_set_new(json, "crs", json_sprintf("EPSG:%u", crs));
    spl_reply_json(request, json);
}
