/* Where a plane ends beside another: clip lines of its points, which its cells keep to. */
#ifndef SPL_PACK_PANELS_BORDERS_H
#define SPL_PACK_PANELS_BORDERS_H

#include "pack/clip.h"
#include "pack/panels/groups.h"

/* The room of a worker. Zeroed before first use. */
struct spl_panel_borders {
    struct spl_panel_box *boxes; /* of the runs */
    size_t box_capacity;
    uint32_t *others; /* runs that lie beside the one at work */
    size_t other_capacity;
    struct spl_nearest near;
};

/* Writes points->clip of those points of a leaf that lie beside a plane of another of its runs. False: no memory. */
bool spl_panel_borders_find(struct spl_panel_borders *borders, const struct spl_panel_groups *groups,
                            const struct spl_panel_maker *maker, size_t first);

void spl_panel_borders_finish(struct spl_panel_borders *borders);

#endif
