/* The default view of a collection. Roots say where there is something, and nothing of where most of it is: their
 * splats lie as far apart in the bushes behind a street as on the street. So it is found as a pack finds it, from an
 * even part of all points, which the leaves have: tiles are opened once more, and of each the heads of its pages are
 * read and the chunks that have one of these points. The caller's thread but for what the view itself does. */
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "geom/unit.h"
#include "pack/collect/collect.h"
#include "pack/view.h"

enum { sample_max = 200000 }; /* as many as a view is found from (pack/view/sample.c) */

/* Which station saw a point, as far as it is known: what the view is found by. */
static int know_stations(struct spl_points *p, struct spl_error *err)
{
    const struct spl_scalar_values *scan = &p->scalar[SPL_SCALAR_SCAN];
    if (!p->station_count || (p->station_count > 1 && !scan->values))
        return SPL_OK;
    if (!(p->station = spl_alloc_raw(p->count ? p->count : 1, sizeof *p->station, err)))
        return SPL_E_NOMEM;
    for (size_t i = 0; i < p->count; i++) {
        uint32_t station = p->station_count > 1 ? spl_scalar_number(scan, i) : 0;
        p->station[i] = station < p->station_count ? (uint16_t)station : SPL_NO_STATION;
    }
    return SPL_OK;
}

static int read_leaves(struct spl_collect *c, const struct spl_collect_tile *tile, uint64_t step, uint64_t *next,
                       struct spl_error *err)
{
    const struct spl_dataset_opening how = {.tables_bytes = 1, .cancelled = c->stage->cancelled};
    struct spl_dataset *dataset = NULL;
    struct spl_error why = {0};
    int rc = spl_dataset_open_as(tile->path, &how, &dataset, &why);
    if (rc)
        return spl_fail_field(err, rc, why.field, "%s", why.message);
    rc = spl_dataset_get_info(dataset)->version == tile->version
             ? spl_collect_take_leaves(c, tile, dataset, step, next, err)
             : spl_fail_field(err, SPL_E_INPUT, "inputs", "%.200s: it has become another one meanwhile", tile->path);
    spl_dataset_close(dataset);
    return rc;
}

int spl_collect_find_view(const struct spl_collect *c, struct spl_default_view *view, struct spl_error *err)
{
    struct spl_collect sight = *c; /* with points of its own */
    uint64_t leaf_splats = 0, next = 0;
    double unit_m = 0;
    int rc = SPL_OK;
    sight.points = (struct spl_points){.stations = c->points.stations,
                                       .station_count = c->points.station_count,
                                       .keep = &c->keep,
                                       .no_surface = c->points.no_surface};
    memcpy(sight.points.up, c->points.up, sizeof sight.points.up);
    memcpy(sight.points.scalar, c->points.scalar, sizeof sight.points.scalar);
    for (int i = 0; i < SPL_POINT_SCALARS; i++)
        sight.points.scalar[i].values = NULL;
    sight.wires = (struct spl_wires){0};
    spl_unit_parse(c->unit, &unit_m);
    for (size_t i = 0; i < c->count; i++)
        leaf_splats += c->tiles[i].leaf_splats;
    const uint64_t step = leaf_splats > sample_max ? leaf_splats / sample_max : 1;
    spl_stage_begin(c->stage, "choosing the view", "tiles", c->count);
    for (size_t i = 0; i < c->count && !rc; i++) {
        rc = read_leaves(&sight, &c->tiles[i], step, &next, err);
        spl_stage_add(c->stage, 1, 0);
        if (!rc)
            rc = spl_stage_check(c->stage, err);
    }
    if (!rc)
        rc = know_stations(&sight.points, err);
    if (!rc) /* of panels with few cells none may be met */
        rc = spl_default_view_find(sight.points.count ? &sight.points : &c->points, unit_m, c->has_sides,
                                   c->stage->threads, view, err);
    spl_stage_end(c->stage);
    sight.points.stations = NULL;
    spl_points_finish(&sight.points);
    return rc;
}
