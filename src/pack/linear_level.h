/* One level of the search for wires, poles and cables: its cells, the lines among them, the pieces that these make. The
 * room of linear*.c; see linear.c for the whole. */
#ifndef SPL_PACK_LINEAR_LEVEL_H
#define SPL_PACK_LINEAR_LEVEL_H

#include "pack/cells.h"
#include "pack/stage.h"

enum spl_line_state { SPL_LINE_ALIVE, SPL_LINE_INNER, SPL_LINE_BORDER, SPL_LINE_EDGE };
enum { SPL_LINE_BUCKET_BITS = 12 };
#define SPL_LINE_BESIDE 1.2 /* cells off a line from which on something is not it itself */

struct spl_line {
    uint32_t cell;
    float middle[3];           /* of the points around, cells from the cell's middle */
    float direction[3];        /* unit */
    float across;              /* sigma, cells */
    float spacing;             /* of points along it, cells */
    uint8_t state, next_state; /* enum spl_line_state */
    bool beside_surface;       /* a surface's line runs beside it: it may be that surface's last */
    uint32_t parent;           /* of a union-find forest; root: itself */
    double low[3], high[3];
};

struct spl_linear_level {
    const struct spl_stage *stage; /* cancelled: what is not done yet is left, and of no use */
    struct spl_cells cells;
    uint8_t *is_line; /* of each cell */
    struct spl_line *lines;
    uint32_t line_count;
    uint32_t *bucket, bucket_count; /* first line of each run with equal key >> SPL_LINE_BUCKET_BITS, and the end */
    uint32_t *owner;                /* of each cell: line + 1 that it belongs to, or 0 */
    double across_max, length_min;  /* cells */
    bool border;                    /* the second round of lateral checks */
};

/* Fills is_line, lines and bucket: the cells that are long and thin with what lies around them. Parallel. What it
 * allocates is the level's on success and on failure. SPL_E_NOMEM. */
int spl_linear_find_lines(struct spl_linear_level *l, struct spl_error *err);

/* Sets the states of lines: which ones are edges of other things, or scan lines of a surface. Parallel. */
void spl_linear_drop_surfaces(struct spl_linear_level *l);

/* Joins lines to pieces; `owner` holds zeros. */
void spl_linear_connect(const struct spl_points *p, struct spl_linear_level *l);

/* Marks the points of the pieces that are long enough, and takes marks back from those of lines that were dropped.
 * Returns how many it marked, those that were before included. */
uint64_t spl_linear_mark(struct spl_points *p, struct spl_linear_level *l);

#endif
