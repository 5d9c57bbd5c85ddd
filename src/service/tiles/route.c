/* Map tiles of a dataset, and TileJSON that says where they are. A tile is a view: it has a view's ETag, cache, queue
 * and limits; one where nothing is is as transparent as it is drawn. Owned by the loop's thread. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "service/datasets/library.h"
#include "service/exchange.h"
#include "service/place/wait.h"
#include "service/reply.h"
#include "service/tiles/grid.h"
#include "service/tiles/tiles.h"
#include "service/view/views.h"

static int find_view(struct request *request, const struct spl_call *call, struct spl_view_request *view,
                     struct spl_error *err)
{
    const struct spl_catalog_entry *entry = call->entry;
    const struct spl_camera_limits limits = spl_view_get_limits(request->service);
    struct spl_tile_name name;
    struct spl_tile_grid grid;
    struct spl_tile_view look;
    int rc = spl_tile_name_parse(call->name, &name, err);
    if (rc)
        return rc;
    rc = spl_tile_grid_find(entry, &grid, err);
    rc = rc ? rc : spl_tile_grid_look(&grid, entry, &name, &look, err);
    rc = rc ? rc
            : spl_tile_request_from_query(request->query, strlen(request->query), &look, &entry->defaults, &limits,
                                          view, err);
    return rc ? spl_view_blame(err) : SPL_OK;
}

void spl_make_tile(struct request *request, const struct spl_call *call)
{
    struct spl_view_request view;
    struct spl_error err = {0};
    if (find_view(request, call, &view, &err) && spl_place_wait(request, call, spl_make_tile, &err))
        return;
    spl_view_answer(request, call, &view, &err);
}

/* The grid, and whether tiles can be drawn as the query says; *versioned: whether that names the version. */
static int find_tiles(struct request *request, const struct spl_call *call, struct spl_tile_grid *grid, bool *versioned,
                      struct spl_error *err)
{
    const struct spl_catalog_entry *entry = call->entry;
    const struct spl_camera_limits limits = spl_view_get_limits(request->service);
    const struct spl_tile_name top = {.scale = 1, .format = SPL_FORMAT_PNG};
    struct spl_tile_view look;
    struct spl_view_request view;
    int rc = spl_tile_grid_find(entry, grid, err);
    rc = rc ? rc : spl_tile_grid_look(grid, entry, &top, &look, err);
    if (rc)
        return rc;
    rc = spl_tile_request_from_query(request->query, strlen(request->query), &look, &entry->defaults, &limits, &view,
                                     err);
    rc = rc ? rc : spl_view_check_dataset(&view, entry->info, err);
    *versioned = !rc && view.versioned;
    return rc ? spl_view_blame(err) : SPL_OK;
}

/* The template of the tiles' URLs, with the query and the signature that tiles.json was asked with, as they stand; what
 * JSON or a template could not carry is written %7B. What is signed is not changed: it names a version or none. */
static json_t *make_template(const struct request *request, const struct spl_catalog_entry *entry, bool versioned)
{
    char *query = spl_alloc(3 * strlen(request->query) + 1, 1, NULL), *to = query, version[24] = "";
    for (const char *from = request->query; query && *from; from++) {
        unsigned char c = (unsigned char)*from;
        to += strchr("{}\"<>\\", c) || c < 0x21 || c > 0x7e ? sprintf(to, "%%%02X", c) : sprintf(to, "%c", c);
    }
    if (!versioned && !*request->grant)
        snprintf(version, sizeof version, "v=%016llx", (unsigned long long)entry->info->version);
    json_t *text = NULL;
    if (query) {
        const char *const parts[] = {query, version, request->grant};
        char joint = '?';
        text = json_sprintf("%s/tiles/{z}/{x}/{y}.png", entry->uri);
        for (size_t i = 0; text && i < sizeof parts / sizeof *parts; i++) {
            if (!*parts[i])
                continue;
            json_t *longer = json_sprintf("%s%c%s", json_string_value(text), joint, parts[i]);
            json_decref(text);
            text = longer;
            joint = '&';
        }
    }
    free(query);
    return text;
}

void spl_show_tiles(struct request *request, const struct spl_call *call)
{
    const struct spl_catalog_entry *entry = call->entry;
    struct spl_tile_grid grid;
    struct spl_error err = {0};
    bool versioned;
    if (find_tiles(request, call, &grid, &versioned, &err)) {
        if (!spl_place_wait(request, call, spl_show_tiles, &err))
            spl_reply_error(request, &err);
        return;
    }
    int least, most;
    spl_tile_grid_get_levels(&grid, entry->info, &least, &most);
    json_t *json =
        json_pack("{s:s, s:s, s:s, s:[o], s:i, s:i}", "tilejson", "3.0.0", "name", entry->info->id, "scheme", "xyz",
                  "tiles", make_template(request, entry, versioned), "minzoom", least, "maxzoom", most);
    json_t *own = json_pack("{s:s, s:s, s:[f, f], s:f, s:i}", "scheme", grid.mercator ? "mercator" : "plane", "unit",
                            grid.mercator ? "m" : spl_unit_word(entry->info), "corner", grid.corner[0], grid.corner[1],
                            "side", grid.side, "tile_size", SPL_TILE_SIDE);
    if (grid.mercator) { /* else there are no degrees */
        double low[2], high[2], middle[2] = {(grid.low[0] + grid.high[0]) / 2, (grid.low[1] + grid.high[1]) / 2},
                                center[2];
        spl_tile_to_degrees(grid.low, low);
        spl_tile_to_degrees(grid.high, high);
        spl_tile_to_degrees(middle, center);
        json_object_set_new(json, "bounds", json_pack("[f, f, f, f]", low[0], low[1], high[0], high[1]));
        json_object_set_new(json, "center", json_pack("[f, f, i]", center[0], center[1], (least + most) / 2));
    }
    json_object_set_new(own, "bounds", json_pack("[f, f, f, f]", grid.low[0], grid.low[1], grid.high[0], grid.high[1]));
    json_object_set_new(json, "splatd", own);
    spl_reply_json(request, json);
}
