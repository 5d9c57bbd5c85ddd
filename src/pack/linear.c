/* Wires, poles and cables: what is long and thin beside its own spacing, and no line of a scanned surface.
 *
 * A pyramid of grids gives the adaptive radius: from cells that hold five points on the average, upwards, each cell is
 * judged by the spread of the points in it and its 26 neighbours (dimensionality after the principal components). It is
 * a line when they are long in one direction alone, and as thin as the finest cells. Then
 * - edges and scan lines of surfaces are dropped (linear_sides.c); where a coarser level tells, it takes back what a
 * finer one has found;
 * - lines that connect or go on beyond a gap are a piece (linear_pieces.c), and pieces that do not reach over
 * `length_min` cells are dropped. A level costs a quarter of the one below. */
#include "pack/linear.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "pack/linear_level.h"

enum { levels_max = 6 };
static const double cell_points = 5;        /* of the finest level, on the average */
static const double length_min[2] = {6, 4}; /* cells, of a piece on the finest level, above */
static const double widest = 0.5;           /* sigma across, of the finest cells' edge */

static void finish_level(struct spl_linear_level *l)
{
    struct spl_spill *spill = l->cells.spill;
    spl_cells_finish(&l->cells);
    spl_spill_free(spill, l->is_line);
    spl_spill_free(spill, l->lines);
    spl_spill_free(spill, l->bucket);
    spl_spill_free(spill, l->owner);
    *l = (struct spl_linear_level){0};
}

static int search_level(struct spl_points *points, struct spl_linear_level *l, uint64_t *marked, struct spl_error *err)
{
    int rc = spl_linear_find_lines(l, err);
    if (rc || !l->line_count)
        return rc;
    spl_linear_drop_surfaces(l);
    l->owner = spl_spill_alloc(l->cells.spill, l->cells.count, sizeof *l->owner, err);
    if (!l->owner)
        return SPL_E_NOMEM;
    spl_linear_connect(points, l);
    *marked += spl_linear_mark(points, l);
    return 0;
}

int spl_linear_find(struct spl_points *points, struct spl_stage *stage, struct spl_error *err)
{
    struct spl_linear_level l = {0}, above = {0};
    uint64_t marked = 0;
    double finest = 0;
    spl_stage_begin(stage, "wires, poles and cables", NULL, levels_max);
    points->linear = spl_spill_alloc(points->spill, points->count, 1, err);
    points->radius = spl_spill_alloc(points->spill, points->count, sizeof *points->radius, err);
    int rc = !points->linear || !points->radius ? SPL_E_NOMEM
             : points->cells > 0 ? spl_cells_init_at(&l.cells, points, points->cells, stage->threads, err)
                                 : spl_cells_init(&l.cells, points, cell_points, stage->threads, err);
    for (unsigned k = 0; !rc && k < levels_max; k++) {
        if (k == 0)
            finest = l.cells.edge;
        l.across_max = widest * finest / l.cells.edge;
        l.length_min = length_min[k > 0];
        l.stage = stage;
        rc = search_level(points, &l, &marked, err);
        spl_stage_add(stage, 1, 0);
        if (!rc)
            rc = spl_stage_check(stage, err);
        if (rc || l.cells.count < 8 || l.cells.shift + 1 > SPL_CELLS_SHIFT_MAX || k + 1 == levels_max)
            break;
        rc = spl_cells_init_above(&above.cells, &l.cells, stage->threads, err);
        finish_level(&l);
        l = above;
        above = (struct spl_linear_level){0};
    }
    finish_level(&l);
    if (rc || !marked) {
        spl_spill_free(points->spill, points->linear);
        spl_spill_free(points->spill, points->radius);
        points->linear = NULL;
        points->radius = NULL;
    }
    spl_stage_finish(stage);
    return rc;
}
