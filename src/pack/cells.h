/* A pyramid's level: the occupied cells of a cubic grid over sorted points, with what their points sum up to. */
#ifndef SPL_PACK_CELLS_H
#define SPL_PACK_CELLS_H

#include "pack/points.h"

/* Sums over points, in cell edges, about the cell's middle. */
struct spl_cell_sums {
    float count, sum[3], square[6]; /* xx xy xz yy yz zz */
};

struct spl_cell {
    uint64_t key;   /* Morton key of the cell */
    uint32_t begin; /* first point; the next cell's is its end */
    struct spl_cell_sums sums;
};

struct spl_cells {
    struct spl_spill *spill; /* the points' */
    struct spl_cell *cells; /* in Morton order, and one behind the last whose `begin` is the number of points */
    uint32_t count;
    unsigned shift;  /* edge = 2^shift of the 2^21 cells that keys are counted in */
    double edge;     /* metres */
    uint32_t *table; /* key -> cell + 1 */
    uint32_t table_mask;
};

/* The finest level whose occupied cells hold `wanted` points on the average. The caller finishes it. */
int spl_cells_init(struct spl_cells *cells, const struct spl_points *points, double wanted, unsigned threads,
                   struct spl_error *err);

/* The same with cells of `edge`, a power of two of which cube_size has 2^n, or the next edge that keys can tell. */
int spl_cells_init_at(struct spl_cells *cells, const struct spl_points *points, double edge, unsigned threads,
                      struct spl_error *err);

/* The level above: cells of twice the edge. `below` stays. */
int spl_cells_init_above(struct spl_cells *cells, const struct spl_cells *below, unsigned threads,
                         struct spl_error *err);

enum { SPL_CELLS_SHIFT_MAX = 20 };

uint64_t spl_cells_key(int64_t x, int64_t y, int64_t z);

/* Index of the cell at column, row and layer, or UINT32_MAX when it is empty or outside. */
uint32_t spl_cells_find(const struct spl_cells *cells, int64_t x, int64_t y, int64_t z);

void spl_cells_place(const struct spl_cells *cells, uint32_t cell, int64_t at[3]);

/* Sums over the cell and its 26 neighbours, about its middle. */
struct spl_cell_sums spl_cells_around(const struct spl_cells *cells, uint32_t cell);

/* Spread about their mean, xx xy xz yy yz zz; there is a point. */
void spl_cells_covariance(const struct spl_cell_sums *sums, float m[6]);

void spl_cells_finish(struct spl_cells *cells);

#endif
