/* What making maps takes, so that the time left can be told: seconds of two cores, by what the stages do. The caller's
 * thread. */
#include "pack/maps/pass.h"

static const double judged = 0.25e-6, gathered = 0.6e-6, chosen = 6e-9; /* a splat and station */
static const double trimmed = 0.8e-6, own = 0.5e-6;                      /* a splat */
static const double ranged = 0.1;                                        /* a station */
static const double checked = 0.2e-6, drawn = 0.25e-6;                   /* a pixel of pictures */

void spl_maps_plan(struct spl_stage *stage, const struct spl_view_list *views, uint32_t scanned, uint64_t points)
{
    double pixels = 0, pictures = 0, splats = (double)points;
    for (size_t v = 0; v < views->count; v++) {
        const struct spl_named_view *view = &views->views[v];
        if (v && spl_map_is_same_picture(view - 1, view))
            continue;
        bool panorama = view->inner && view->inner->is_panorama;
        pictures++;
        pixels += !view->photograph ? 0
                  : panorama        ? (double)view->inner->panorama.width * view->inner->panorama.height
                                    : (double)view->camera.width * view->camera.height;
    }
    double stations = scanned ? scanned : pictures, pairs = scanned ? 0 : stations * splats;
    spl_stage_plan(stage, "stations", judged * pairs, 0);
    spl_stage_plan(stage, "ranges of stations", gathered * pairs + ranged * stations + (scanned ? own * splats : 0), 0);
    spl_stage_plan(stage, "stations of chunks", trimmed * splats + chosen * stations * splats, 0);
    spl_stage_plan(stage, "checking maps", checked * pixels, 0);
    spl_stage_plan(stage, "maps", drawn * pixels + ranged * stations + own * splats, 0);
}

size_t spl_map_count_placed(const struct spl_map_pass *p)
{
    size_t count = 0;
    for (size_t v = 0; v < p->views->count; v++)
        count += p->stations.of_view[v] != UINT32_MAX && p->views->views[v].photograph;
    return count;
}
