/* What lies in each cell of a pyramid over the points: the labels of its points, patches at first and planes later. By
 * it things find what lies beside them, at the distance that the scan's own density makes. The room of pack/planes/. */
#ifndef SPL_PACK_PLANES_LISTS_H
#define SPL_PACK_PLANES_LISTS_H

#include <stdatomic.h>

#include "pack/cells.h"

enum { SPL_PLANE_LEVELS = 6, SPL_PLANE_LIST = 5 };

struct spl_plane_list {
    uint32_t label[SPL_PLANE_LIST]; /* the first that were met; unused ones SPL_NO_PLANE */
    uint16_t count[SPL_PLANE_LIST]; /* their points, at most UINT16_MAX */
    uint16_t linear;                /* its linear points without a label, at most UINT16_MAX */
    uint32_t open;                  /* points without a label, but linear ones */
};

struct spl_plane_levels {
    struct spl_cells cells[SPL_PLANE_LEVELS]; /* cells[0]: a handful of points each; above twice as wide */
    unsigned count;
    struct spl_plane_list *lists; /* of one level at a time, room for cells[0] */
};

/* Parallel. `levels` is finished by the caller, on failure too. SPL_E_NOMEM. */
int spl_plane_levels_init(struct spl_plane_levels *levels, const struct spl_points *points, unsigned threads,
                          struct spl_error *err);

/* Fills the lists of level `k`. Parallel. */
void spl_plane_levels_fill(struct spl_plane_levels *levels, unsigned k, const struct spl_points *points,
                           const uint32_t *label, unsigned threads);

/* Part of a level: what lies in the cells of `coarse`, this level or one above it, of which where[] says so. */
struct spl_plane_part {
    const struct spl_cells *coarse;
    const atomic_uchar *where;
};

/* Fills the lists of a part of level `k`; those of the others stay. Parallel. */
void spl_plane_levels_fill_part(struct spl_plane_levels *levels, unsigned k, const struct spl_points *points,
                                const uint32_t *label, const struct spl_plane_part *part, unsigned threads);

/* The cell that has a point. */
uint32_t spl_plane_cell_of(const struct spl_cells *cells, size_t point);

void spl_plane_levels_finish(struct spl_plane_levels *levels);

#endif
