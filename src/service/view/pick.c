/* One rendered pixel to JSON; what it means is in render/pick.c. Members that nothing has a value for are null. */
#include "service/view/pick.h"

#include <jansson.h>
#include <math.h>
#include <string.h>

#include <splatd/dataset.h>

#include "base/error.h"
#include "dataset/dataset.h"
#include "geom/json.h"
#include "render/pick.h"

static const double most_whole = 0x1p53; /* that doubles count to */

static json_t *vector(const double v[3])
{
    return json_pack("[f, f, f]", v[0], v[1], v[2]);
}

static json_t *normal(const double n[3])
{
    return n[0] == 0 && n[1] == 0 && n[2] == 0 ? json_null() : vector(n);
}

/* Could its dataset's server be read? What could not is no value, and is not said to be missing. */
static bool was_read(const struct spl_pick *p, const struct spl_dataset *dataset)
{
    const struct spl_dataset_info *info = dataset ? spl_dataset_get_info(dataset) : NULL;
    double value;
    if (!info || !spl_dataset_is_remote(dataset) || p->splat < 0 || (uint64_t)p->splat >= info->ids)
        return true;
    bool good = p->primitive != SPL_SHAPE_NONE; // read with the tables
    for (uint32_t s = 0; s < info->stream_count && good && p->primitive != SPL_SHAPE_LINE; s++)
        good = spl_dataset_find_stream(dataset, info->streams[s].name) < 0 ||
               spl_dataset_find_value(dataset, (int)s, (uint64_t)p->splat, &value);
    return good;
}

/* What the splat has by name; null where it is none, or has nothing: on wires. */
static json_t *attributes(const struct spl_dataset *dataset, int64_t splat)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    json_t *all = json_object();
    double value;
    for (uint32_t s = 0; s < info->stream_count && splat >= 0; s++)
        if (spl_dataset_find_value(dataset, (int)s, (uint64_t)splat, &value))
            json_object_set_new(all, info->streams[s].name,
                                isnan(value)                                        ? json_null()
                                : value == rint(value) && fabs(value) <= most_whole ? json_integer((json_int_t)value)
                                                                                    : json_real(value));
    if (json_object_size(all) > 0)
        return all;
    json_decref(all);
    return json_null();
}

static json_t *plane(const struct spl_pick *p)
{
    const struct spl_pick_plane *plane = &p->plane;
    if (p->primitive != SPL_SHAPE_PANEL)
        return json_null();
    return json_pack("{s:o, s:o, s:f, s:f, s:I}", "point", vector(plane->point), "normal", vector(plane->normal),
                     "error_mean", plane->error_mean, "error_most", plane->error_most, "points",
                     (json_int_t)plane->points);
}

static void fill(json_t *json, const struct spl_pick *p, const struct spl_dataset *dataset)
{
    bool hit = p->hit;
    json_object_set_new(json, "position", hit ? vector(p->position) : json_null());
    json_object_set_new(json, "normal", hit ? normal(p->normal) : json_null());
    json_object_set_new(json, "color",
                        hit ? json_pack("[i, i, i]", p->color[0], p->color[1], p->color[2]) : json_null());
    json_object_set_new(json, "class", hit && p->classification >= 0 ? json_integer(p->classification) : json_null());
    json_object_set_new(json, "attributes", hit && dataset ? attributes(dataset, p->splat) : json_null());
    json_object_set_new(json, "depth", hit ? json_real(p->depth) : json_null());
    json_object_set_new(json, "distance", hit && isfinite(p->distance) ? json_real(p->distance) : json_null());
    json_object_set_new(json, "splat", hit && p->splat >= 0 ? json_integer(p->splat) : json_null());
    if (dataset && spl_dataset_get_info(dataset)->tiles) {
        const char *tile = hit && p->splat >= 0 ? spl_dataset_find_tile(dataset, (uint64_t)p->splat) : NULL;
        json_object_set_new(json, "tile", tile ? json_string(tile) : json_null());
    }
    json_object_set_new(json, "primitive",
                        p->primitive == SPL_SHAPE_NONE ? json_null() : json_string(spl_shape_name(p->primitive)));
    json_object_set_new(json, "plane", plane(p));
}

/* The position in EPSG:`crs`; where it is in the world is said as well. */
static int place(json_t *json, uint32_t crs, const struct spl_pick *pick, struct spl_places *places,
                 struct spl_error *err)
{
    double position[3];
    int rc = pick->hit ? spl_places_from_world(places, crs, true, pick->position, position, err) : 0;
    json_object_set_new(json, "crs", json_sprintf("EPSG:%u", crs));
    json_object_set(json, "world", json_object_get(json, "position"));
    if (!rc && pick->hit)
        json_object_set_new(json, "position", vector(position));
    return rc;
}

int spl_pick_encode(const struct spl_view_request *request, const struct spl_frame *frame,
                    const struct spl_dataset *dataset, struct spl_places *places, struct spl_encoded *out,
                    struct spl_error *err)
{
    double x = request->pick.x, y = request->pick.y;
    struct spl_pick pick;
    *out = (struct spl_encoded){.media_type = "application/json"};
    spl_pick_read(&request->pick.camera, x, y, frame, dataset, &pick);
    if (!was_read(&pick, dataset))
        return spl_fail(err, SPL_E_TIMEOUT, "what lies there of %s could not be read from its server; come back later",
                        spl_dataset_get_info(dataset)->id);
    json_t *json = json_pack("{s:f, s:f, s:s}", "x", x, "y", y, "unit", request->encode.unit);
    if (json)
        fill(json, &pick, dataset);
    int rc = json && request->pick.crs ? place(json, request->pick.crs, &pick, places, err) : 0;
    if (rc) {
        json_decref(json);
        return rc;
    }
    char *text = spl_json_print(json);
    if (!text)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for what was picked");
    out->bytes = (uint8_t *)text;
    out->length = strlen(text);
    return 0;
}
