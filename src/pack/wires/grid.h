/* Items by the cells of a grid that they lie in. Grids of the room wires; owned by the thread that joins. */
#ifndef SPL_PACK_WIRES_GRID_H
#define SPL_PACK_WIRES_GRID_H

#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

struct spl_wires_cell {
    uint64_t key;
    uint32_t item;
};

struct spl_wires_grid { // zeroed before first use
    struct spl_wires_cell *cells;
    size_t count, capacity;
    double low[3], edge; // the caller's to set: least corner, side of a cell
};

/* The key of the cell that is `shift` cells off that of `position` in a grid of cells of side `edge` from `low` on: 21
 * bits an axis; what is wider wraps, which makes no difference but work. */
uint64_t spl_wires_key(const double low[3], double edge, const double position[3], const int shift[3]);

/* Room for `count` items in all, so that adding them takes no more; SPL_E_NOMEM. */
int spl_wires_grid_reserve(struct spl_wires_grid *grid, size_t count, struct spl_error *err);

/* Adds an item; SPL_E_NOMEM. */
int spl_wires_grid_add(struct spl_wires_grid *grid, const double position[3], uint32_t item, struct spl_error *err);

/* Then: sorts them, and each once. */
void spl_wires_grid_sort(struct spl_wires_grid *grid);

/* The cells [*first, the result) of what lies in the cell that is `shift` cells off that of `position`. Those of
 * another cell may be among them where a scan is wider than 2^21 cells. */
size_t spl_wires_grid_find(const struct spl_wires_grid *grid, const double position[3], const int shift[3],
                           size_t *first);

void spl_wires_grid_finish(struct spl_wires_grid *grid);

#endif
