/* Panels: up to 16 x 16 cells on a plane, a mask of those that are there and their colours. A chunk of kind
 * SPL_CHUNK_PANELS holds up to SPL_PANELS_MAX of them, of one plane; api/format.md and shaders/shared.h have their
 * layout, shaders/common/panel.glsl reads the same. A cell stands for a disc there of radius SPL_RADIUS_SPACING x cell.
 * One of kind SPL_CHUNK_MESHES holds panels with relief (relief.h), and what is said of panels here is true of them,
 * with the mesh of their heights in place of the plane.
 *
 * The plane's frame: u and v as spl_tangent_frame() has them of the normal as it decodes; cell (x, y) of the chunk is
 * the square from origin + cell (x u + y v) on, and panel (column, row) has the cells from 16 (column, row) on. Pure
 * functions; any thread. */
#ifndef SPL_DATASET_PANELS_H
#define SPL_DATASET_PANELS_H

#include "dataset/chunk.h"
#include "dataset/relief.h"

struct spl_panel {
    uint8_t column, row;
    uint16_t cells[SPL_PANEL_SIDE];                   /* bit x of cells[y]: cell (x, y) is there; at least one is */
    uint8_t color[SPL_PANEL_SIDE][SPL_PANEL_SIDE][3]; /* [y][x], sRGB; of a cell that is not there it means nothing */
};

/* Is cell (x, y) of the panel there? */
static inline bool spl_panel_has(const struct spl_panel *panel, unsigned x, unsigned y)
{
    return panel->cells[y] >> x & 1;
}

/* The plane that a chunk's panels lie on. */
struct spl_panel_plane {
    double origin[3]; /* of cell (0, 0), relative to the node's origin */
    float normal[3];  /* unit, away from the surface */
    float cell;       /* side of a cell, metres, > 0 */
    float error_mean; /* distance of the points to the plane, of meshes to the mesh along the plane's normal, metres,
                         >= 0: root of the mean square, and the most */
    float error_most;
    uint32_t points; /* that the panels stand for */
};

/* What a chunk's plane is, as it decodes. */
struct spl_panel_frame {
    float origin[3]; /* of cell (0, 0), relative to the node's origin */
    float u[3], v[3], normal[3];
    float cell;
};

/* Begins a chunk on `plane`: its header but for what follows from panels. Afterwards spl_panels_get_frame() says where
 * cells lie. */
void spl_panels_begin(const struct spl_panel_plane *plane, struct spl_chunk *chunk);
void spl_panels_get_frame(const struct spl_chunk *chunk, struct spl_panel_frame *frame);

/* What the packer keeps colours to. */
#define SPL_PANEL_COLOR_ERROR 3.0

/* Writes `count` panels (1..SPL_PANELS_MAX) behind a header that was begun, and completes it but for geometry_word and
 * first_id. `words` has room for SPL_PANEL_CHUNK_WORDS_MAX; returns how many were written. Colours are kept coarser
 * than cells, panel by panel, where the root of the mean squared difference over the cells and channels of each block
 * of 4 x 4 cells stays within `color_error` (levels of 255, >= 0). */
uint32_t spl_panels_encode(const struct spl_panel *panels, uint32_t count, double color_error, struct spl_chunk *chunk,
                           uint32_t *words);

/* The same with relief, as a chunk of meshes: reliefs[i] is panels[i]'s, all of one level, with heights in codes of
 * `step`, see spl_relief_choose_step(). `words` has room for SPL_MESH_CHUNK_WORDS_MAX. */
uint32_t spl_meshes_encode(const struct spl_panel *panels, const struct spl_relief *reliefs, uint32_t count,
                           unsigned step, double color_error, struct spl_chunk *chunk, uint32_t *words);

/* How many cells the chunk's panels have; and how many discs that is worth, at least 1: the packer makes cells of
 * leaves half as large as what a disc stands for. */
uint32_t spl_panels_count_cells(const struct spl_chunk *chunk, const uint32_t *page);
uint32_t spl_panels_count_discs(const struct spl_chunk *chunk, const uint32_t *page);

/* Says how many points, at least 1, the panels stand for. */
void spl_panels_set_points(struct spl_chunk *chunk, uint32_t points);

/* The same chunk with other colours, of its cells panel by panel and row by row, as coarse as SPL_PANEL_COLOR_ERROR
 * says; like spl_chunk_recolor(). */
uint32_t spl_panels_recolor(const struct spl_chunk *chunk, const uint32_t *page, const uint8_t (*color)[3],
                            struct spl_chunk *out, uint32_t *words);

/* Panel i < chunk->count; `page` as of spl_chunk_decode(). What a forged page says beyond the chunk's words is as if
 * its last word repeated. Its relief is flat, of level 0, where the chunk is not of meshes. */
void spl_panels_decode(const struct spl_chunk *chunk, const uint32_t *page, uint32_t i, struct spl_panel *panel);
void spl_panels_get_relief(const struct spl_chunk *chunk, const uint32_t *page, uint32_t i, struct spl_relief *relief);

/* Where (x, y), in cells of the panel, lies on its surface, relative to the node's origin, and the normal there, unit.
 */
void spl_panels_place(const struct spl_panel_frame *frame, const struct spl_panel *panel,
                      const struct spl_relief *relief, float x, float y, float position[3], float normal[3]);

/* What a header says: points that its panels stand for; their distance to the plane, metres, as of struct
 * spl_panel_plane; columns and rows of panels that hold all of them; the level of its lattices and what a code of
 * heights is worth, metres, both 0 where it is not of meshes; how far off the plane their surface may lie, either way.
 */
uint32_t spl_panels_get_points(const struct spl_chunk *chunk);
float spl_panels_get_error_mean(const struct spl_chunk *chunk);
float spl_panels_get_error_most(const struct spl_chunk *chunk);
void spl_panels_get_extent(const struct spl_chunk *chunk, uint32_t *columns, uint32_t *rows);
unsigned spl_panels_get_level(const struct spl_chunk *chunk);
float spl_panels_get_worth(const struct spl_chunk *chunk);
float spl_panels_get_reach(const struct spl_chunk *chunk);

#endif
