/* Map tiles of a dataset, and TileJSON that says where they are. A tile is a view: it has a view's ETag, cache, queue and
 * limits; one where nothing is is as transparent as it is drawn. Owned by the loop's thread. */
#include <string.h>

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
            : spl_tile_request_from_query(request->query, strlen(request->query), &look, &entry->defaults, &limits, view,
                                          err);
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

void spl_show_tiles(struct request *request, const struct spl_call *call)
{
    const struct spl_catalog_entry *entry = call->entry;
    struct spl_tile_grid grid;
    struct spl_error err = {0};
    if (spl_tile_grid_find(entry, &grid, &err)) {
        if (!spl_place_wait(request, call, spl_show_tiles, &err))
            spl_reply_error(request, &err);
        return;
    }
    int least, most;
    spl_tile_grid_get_levels(&grid, entry->info, &least, &most);
    json_t *json = json_pack("{s:s, s:s, s:s, s:[o], s:i, s:i}", "tilejson", "3.0.0", "name", entry->info->id, "scheme", "xyz",
                             "tiles",
                             json_sprintf("%s/tiles/{z}/{x}/{y}.png?v=%016llx", entry->uri,
                                          (unsigned long long)entry->info->version),
                             "minzoom", least, "maxzoom", most);
    json_t *own = json_pack("{s:s, s:s, s:[f, f], s:f, s:i}", "scheme", grid.mercator ? "mercator" : "plane", "unit",
                            grid.mercator ? "m" : spl_unit_word(entry->info), "corner", grid.corner[0], grid.corner[1],
                            "side", grid.side, "tile_size", SPL_TILE_SIDE);
    if (grid.mercator) { /* else there are no degrees */
        double low[2], high[2], middle[2] = {(grid.low[0] + grid.high[0]) / 2, (grid.low[1] + grid.high[1]) / 2}, center[2];
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
