/* The parts of rasterising: where a group's cells lie (grid.c), which panels its discs reach into (places.c), which
 * cells these cover there (fill.c), what panels are then (raster.c, values.c). One worker's. */
#ifndef SPL_PACK_PANELS_RASTER_PARTS_H
#define SPL_PACK_PANELS_RASTER_PARTS_H

#include <math.h>

#include "pack/panels/raster.h"

/* A panel that discs reach into. */
struct spl_panel_place {
    int32_t column, row;
    uint64_t order;
    uint32_t touches; /* how many; of a sorted one where they end */
    uint32_t was;     /* its index before they were sorted */
    uint8_t level;    /* of its mesh; 0 of what is flat */
    float low, high;  /* of its heights; likewise */
};

struct spl_panel_touch {
    uint32_t place : 31;
    uint32_t own : 1; /* the member lies in the place: each does in one */
    uint32_t member;
};

/* The panel of a place. */
struct spl_panel_filled {
    struct spl_panel panel;
    uint16_t covered[SPL_PANEL_SIDE];              /* its cells before slits were closed */
    float claimed[SPL_PANEL_SIDE][SPL_PANEL_SIDE]; /* what points that lie in a cell stand for, in cells */
};

/* Where the group's cells lie. */
struct spl_panel_grid {
    const struct spl_panel_group *group;
    double u[3], v[3], normal[3];
    float normal_f[3];
    double inverse;
    bool round;       /* its discs are: none of them is tilted, or has a line at which it ends */
    int32_t first[2]; /* cell that panel (0, 0) begins with: those of a node begin where its cells do */
};

struct spl_panel_disc {
    double x, y, radius;         /* in cells */
    double clip[2], clip_offset; /* not drawn where clip . d > clip_offset, d from its middle */
    double reach;                /* along clip, how far off the crease is that it goes on to; 0: none */
    double tilt[2];              /* how it rises along u and v; 0 on what is flat */
};

/* floor() and ceil() of what an int32_t can hold: both take a call where a processor's own must not be asked for. */
static inline int32_t spl_panel_floor(double x)
{
    int32_t i = (int32_t)x;
    return i - (x < i);
}

static inline int32_t spl_panel_ceil(double x)
{
    int32_t i = (int32_t)x;
    return i + (x > i);
}

/* The square of how far the place (dx, dy) cells from the disc's middle is from it, along the disc; or, if that is
 * less, from what lies between it and its crease. */
static inline double spl_panel_disc_squared(const struct spl_panel_disc *disc, double dx, double dy)
{
    double along = fmin(fmax(disc->clip[0] * dx + disc->clip[1] * dy, 0), disc->reach);
    dx -= along * disc->clip[0];
    dy -= along * disc->clip[1];
    double up = disc->tilt[0] * dx + disc->tilt[1] * dy;
    return dx * dx + dy * dy + up * up;
}

/* False: its cells cannot be counted. */
bool spl_panel_grid_init(struct spl_panel_grid *grid, const struct spl_panel_group *group);

/* Adds to the disc of point `i` how it is tilted, and where it ends. */
void spl_panel_grid_shape(const struct spl_panel_grid *grid, size_t i, struct spl_panel_disc *disc);

/* Whether it does: its plane has heights, or it ends at a crease or a line. */
static inline bool spl_panel_grid_has_shape(const struct spl_panel_grid *grid, size_t i)
{
    const struct spl_panel_group *group = grid->group;
    const struct spl_point_clip *clip = group->points->clip ? &group->points->clip[i] : NULL;
    return group->plane->heights || (group->leaf && group->crease && group->crease[i] != SPL_NO_PLANE) ||
           (group->leaf && clip && (clip->direction[0] || clip->direction[1] || clip->direction[2]));
}

/* Where the middle of point `i` lies, in cells along u and v. */
static inline void spl_panel_grid_middle(const struct spl_panel_grid *grid, size_t i, double at[2])
{
    double off[3];
    for (int c = 0; c < 3; c++)
        off[c] = spl_points_at(grid->group->points, c, i) - grid->group->plane->origin[c];
    at[0] = (off[0] * grid->u[0] + off[1] * grid->u[1] + off[2] * grid->u[2]) * grid->inverse;
    at[1] = (off[0] * grid->v[0] + off[1] * grid->v[1] + off[2] * grid->v[2]) * grid->inverse;
}

static inline struct spl_panel_disc spl_panel_grid_disc(const struct spl_panel_grid *grid, uint32_t member)
{
    size_t i = grid->group->first + member;
    double at[2];
    spl_panel_grid_middle(grid, i, at);
    struct spl_panel_disc disc = {.x = at[0],
                                  .y = at[1],
                                  .radius = (double)grid->group->points->radius[i] * grid->inverse,
                                  .clip_offset = INFINITY};
    if (!grid->round && spl_panel_grid_has_shape(grid, i))
        spl_panel_grid_shape(grid, i, &disc);
    return disc;
}

/* The cells whose middles a disc, or what lies between it and its crease, can cover, and its own. */
static inline void spl_panel_disc_range(const struct spl_panel_disc *disc, int32_t low[2], int32_t high[2])
{
    const double at[2] = {disc->x, disc->y};
    for (int a = 0; a < 2; a++) {
        int32_t own = spl_panel_floor(at[a]);
        double end = at[a] + (disc->reach > 0 ? disc->reach * disc->clip[a] : 0);
        low[a] = spl_panel_ceil((at[a] < end ? at[a] : end) - disc->radius - 0.5);
        high[a] = spl_panel_floor((at[a] > end ? at[a] : end) + disc->radius - 0.5);
        low[a] = low[a] < own ? low[a] : own;
        high[a] = high[a] > own ? high[a] : own;
    }
}

/* The column, axis 0, or row of the panel that has a cell, counted from the grid's first on. */
static inline int32_t spl_panel_of_cell(const struct spl_panel_grid *grid, int axis, int32_t cell)
{
    return (cell - grid->first[axis]) / SPL_PANEL_SIDE;
}

/* Fills raster->places, in Morton order, and raster->sorted, by place. False: no memory. */
bool spl_panel_places_find(struct spl_panel_raster *raster, const struct spl_panel_grid *grid);

/* Where the touches of a place begin; they end where it says. */
static inline uint32_t spl_panel_first_touch(const struct spl_panel_raster *raster, size_t place)
{
    return place ? raster->places[place - 1].touches : 0;
}

/* Fills the panel of a place, cells and colours, from the discs that reach into it. */
void spl_panel_fill(const struct spl_panel_raster *raster, const struct spl_panel_grid *grid, size_t place,
                    struct spl_panel *panel);

/* The place of a column and row of panels; SIZE_MAX: there is none. */
size_t spl_panel_place_find(const struct spl_panel_raster *raster, int32_t column, int32_t row);

/* Closes slits between scan lines in raster->filled (slits.c). */
void spl_panel_slits_close(struct spl_panel_raster *raster, const struct spl_panel_grid *grid);

/* The mesh of a panel (relief.c). */
struct spl_panel_relief {
    struct spl_relief relief; /* heights over the piece's plane, rounded to steps */
    float low, high;          /* of them */
};

/* The step of heights of a chunk whose heights differ by `range`, metres, at most: as fine as it should be for a group
 * with relief, or coarser where the range asks for it. */
unsigned spl_panel_relief_step(const struct spl_panel_group *group, float range);

/* Makes the mesh, in heights of `step`, of the panel whose cell (0, 0) is the plane's (column, row). */
void spl_panel_relief_make(const struct spl_panel_grid *grid, const struct spl_panel *panel, int32_t column,
                           int32_t row, unsigned step, unsigned level, struct spl_panel_relief *made);

/* The one of the least level that follows the surface wherever a cell is there, or of the greatest. */
void spl_panel_relief_choose(const struct spl_panel_grid *grid, const struct spl_panel *panel, int32_t column,
                             int32_t row, struct spl_panel_relief *made);

/* Appends what the points of a place have beside colour, as its panel's. False: no memory. */
bool spl_panel_values_add(const struct spl_panel_raster *raster, const struct spl_panel_grid *grid, size_t place,
                          struct spl_node_panels *out);

#endif
