/* The grid of a dataset's map tiles: squares of a square, 2^z a side, as XYZ has them (x from the west, y from the
 * north). Where PROJ knows the dataset's coordinate system the square is Web Mercator's world (EPSG:3857), else that of
 * the dataset's own plane which holds its bounds. The loop's thread. */
#ifndef SPL_SERVICE_TILES_GRID_H
#define SPL_SERVICE_TILES_GRID_H

#include <stdbool.h>
#include <stdint.h>

#include "base/error.h"
#include "service/request/request.h"

enum { SPL_TILE_LEVELS = 31, SPL_TILE_SIDE = 256, SPL_WEB_MERCATOR = 3857 };

struct spl_catalog_entry;

struct spl_tile_grid {
    bool mercator;
    double corner[2], side;  /* north-west one of the square, and how long it is, in the grid's unit */
    double low[2], high[2];  /* of the dataset */
    double world_units;      /* of the dataset's plane to one of the grid, about: for the level of most detail */
};

/* SPL_E_BUSY, field "crs", while the coordinate system is being looked up (place/wait.h). */
int spl_tile_grid_find(const struct spl_catalog_entry *entry, struct spl_tile_grid *grid, struct spl_error *err);

/* "z/x/y.png", "z/x/y@2x.webp" */
struct spl_tile_name {
    uint32_t z, x, y, scale;
    enum spl_format format;
};
/* SPL_E_NOT_FOUND of what is no tile. */
int spl_tile_name_parse(const char *text, struct spl_tile_name *name, struct spl_error *err);

/* What the tile shows of the dataset: from above, its middle where the tile's is, turned and scaled as the grid is
 * there (to 0.02 pixels where a tile is 2.4 km wide, and less the smaller it is). */
int spl_tile_grid_look(const struct spl_tile_grid *grid, const struct spl_catalog_entry *entry,
                       const struct spl_tile_name *name, struct spl_tile_view *view, struct spl_error *err);

/* Levels from that on which the dataset fills a quarter of a tile's side, to that on which a pixel is less than a
 * splat. */
void spl_tile_grid_get_levels(const struct spl_tile_grid *grid, const struct spl_dataset_info *info, int *least,
                              int *most);

/* Longitude and latitude of a point of Web Mercator, degrees. */
void spl_tile_to_degrees(const double mercator[2], double out[2]);

#endif
