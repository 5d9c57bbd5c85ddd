/* The stations whose maps a tile takes colours from, and where: cells of SPL_MAP_CELL samples a side of the image, not
 * of the tile, that chunks reach which a station sees. So a sample takes the same however the image is cut. What can be
 * had is asked once a walk, in its order. The renderer's thread. */
#ifndef SPL_RENDER_MAP_CELLS_H
#define SPL_RENDER_MAP_CELLS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/error.h"
#include "dataset/map.h"
#include "render/draw_list.h"
#include "render/frustum.h"

/* How far outside of a tile chunks are selected, so that all that reach its cells are, samples. */
#define SPL_MAP_CELLS_PAD (SPL_MAP_CELL + 4)

struct spl_select_params;

struct spl_map_cells {
    const struct spl_select_params *params;
    uint32_t count;             /* of the dataset; 0 = its maps are not drawn */
    uint32_t first[2], size[2]; /* cells of the tile */
    uint8_t *answers;           /* by station: SPL_SELECT_* + 1; 0 = not asked */
    uint64_t **cells;           /* by station: bit a cell; NULL = none */
};

/* For a walk by `params`, which is borrowed. SPL_E_NOMEM. */
int spl_map_cells_init(struct spl_map_cells *cells, const struct spl_select_params *params, struct spl_error *err);
void spl_map_cells_finish(struct spl_map_cells *cells);

/* A chunk that is drawn, whose discs lie in `box`: notes the cells that it reaches, and returns the station whose map
 * trims it, plus 1; 0 = none. Where one cannot be had the list is not complete. A negative code: SPL_E_NOMEM. */
int spl_map_cells_add(struct spl_map_cells *cells, const struct spl_chunk_stations *seen,
                      const struct spl_view_box *box, struct spl_draw_list *list, struct spl_error *err);

/* Lists the cells behind the list's entries. SPL_E_NOMEM, SPL_E_LIMIT. */
int spl_map_cells_lay_out(const struct spl_map_cells *cells, struct spl_draw_list *list, struct spl_error *err);

#endif
