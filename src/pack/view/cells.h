/* Which cells of the sample's box hold something, and how far a ray goes until it meets one. */
#ifndef SPL_PACK_VIEW_CELLS_H
#define SPL_PACK_VIEW_CELLS_H

#include "pack/view/sample.h"

struct spl_view_cells {
    double low[3], cell;
    int size[3];
    uint8_t *full;
};

/* `across`: cells along the longest side. The caller frees cells->full. SPL_E_NOMEM. */
int spl_view_cells_init(struct spl_view_cells *cells, const struct spl_view_sample *sample, int across,
                        struct spl_error *err);

static inline bool spl_view_cells_has(const struct spl_view_cells *c, int x, int y, int z)
{
    return x >= 0 && x < c->size[0] && y >= 0 && y < c->size[1] && z >= 0 && z < c->size[2] &&
           c->full[((size_t)z * (size_t)c->size[1] + (size_t)y) * (size_t)c->size[0] + (size_t)x];
}

/* How far one sees from `eye` along unit vector `way`, past the cells that touch the eye's; *hit: up to something, else
 * to the end of the box. */
double spl_view_cells_look(const struct spl_view_cells *cells, const double eye[3], const double way[3], bool *hit);

#endif
