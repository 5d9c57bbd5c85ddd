/* Points of one plane into cells of one size: the discs that they stand for, rasterised panel by panel. */
#ifndef SPL_PACK_PANELS_RASTER_H
#define SPL_PACK_PANELS_RASTER_H

#include "pack/panels/panels.h"

/* The room of a worker. */
struct spl_panel_raster {
    struct spl_panel_place *places; /* panels that are touched */
    size_t place_count, place_capacity;
    uint32_t *slots; /* hash of places: index + 1 */
    size_t slot_count;
    struct spl_panel_touch *touches, *sorted; /* which point reaches into which panel */
    size_t touch_count, touch_capacity, sorted_capacity;
    struct spl_panel_filled *filled; /* by place */
    size_t filled_capacity;
    uint32_t *order; /* of places, as chunks have them */
    size_t order_capacity;
};

void spl_panel_raster_finish(struct spl_panel_raster *raster);

/* Points that become cells together. */
struct spl_panel_group {
    const struct spl_points *points;
    const struct spl_planes *planes;
    const struct spl_plane *plane;
    const uint32_t *crease; /* by point, as the maker's; may be NULL */
    const double *node_origin;
    const uint32_t *members; /* point = first + member, rising */
    size_t first, count;
    double cell;
    bool leaf; /* cells hold each point's own colour; discs end at their clip lines */
};

/* Most cells that a radius of a member may span: no disc reaches into more than 2 x 2 panels,
 * or 3 x 3 with what lies between it and a crease. */
#define SPL_PANEL_RADIUS_MAX 7.0

/* Appends the group's panels to `out`, as meshes where the plane has heights. A cell is there where its middle lies
 * within a member's disc, or where a member lies, or between a member and the crease at which its plane ends; its
 * colour is mostly that of the points in and beside it. Each member is counted in the chunk that has its cell. SPL_OK,
 * SPL_E_NOMEM, or SPL_E_LIMIT where cells cannot be counted: then nothing is appended. */
int spl_panel_raster_add(struct spl_panel_raster *raster, const struct spl_panel_group *group,
                         struct spl_node_panels *out);

#endif
