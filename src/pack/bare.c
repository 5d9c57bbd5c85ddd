/* What --points-only packs instead of a surface: points that are as large as they are apart.
 *
 * The distance of neighbours follows from how many points lie in the 27 cells around a cell, as if they lay on a plane
 * through it: n of them are 3 edges / sqrt(n) apart. One look-up a cell instead of a search a point. Where these cells
 * hold too few points to say, those of twice the edge are asked, and so on: a scan's far end and the wall right before
 * the scanner lie a hundredfold apart. Equation 20's radius of a square grid of that spacing keeps what chooses levels
 * of detail as it is. */
#include "pack/points.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "dataset/format.h"
#include "pack/cells.h"

enum { grain = 4096 };
static const double cell_points = 5;
static const double enough = 8; /* points in 27 cells; on a plane through cells of `cell_points` there are 45 */

struct bare {
    struct spl_points *points;
    const struct spl_cells *cells;
    double least; /* radius; cells of half the edge had too few points for less */
    bool last;    /* no larger cells are asked */
};

/* Radii of 0 are still to be found. */
static void size_cells(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct bare *b = context;
    struct spl_points *p = b->points;
    (void)worker;
    for (size_t k = begin; k < end; k++) {
        const struct spl_cell *cell = &b->cells->cells[k];
        size_t i = cell->begin;
        while (i < cell[1].begin && p->radius[i] > 0)
            i++;
        if (i == cell[1].begin)
            continue;
        double count = spl_cells_around(b->cells, (uint32_t)k).count;
        double radius = SPL_RADIUS_SPACING * 3 * b->cells->edge / sqrt(fmax(count, 1));
        radius = fmax(radius, b->least);
        for (; i < cell[1].begin && (count >= enough || b->last); i++)
            if (!(p->radius[i] > 0))
                p->radius[i] = (float)fmax(radius, 1e-9);
    }
}

/* Level by level, from the finest with `cell_points` a cell on. */
static int size_points(struct bare *b, unsigned threads, struct spl_error *err)
{
    struct spl_cells level[2] = {0};
    int rc = spl_cells_init(&level[0], b->points, cell_points, threads, err);
    for (int i = 0; !rc; i = !i) {
        b->cells = &level[i];
        b->last = level[i].count <= 1 || level[i].shift >= SPL_CELLS_SHIFT_MAX;
        spl_parallel_for(threads, level[i].count, grain, size_cells, b);
        if (b->last)
            break;
        b->least = SPL_RADIUS_SPACING * 3 * level[i].edge / sqrt(enough);
        spl_cells_finish(&level[!i]);
        rc = spl_cells_init_above(&level[!i], &level[i], threads, err);
    }
    spl_cells_finish(&level[0]);
    spl_cells_finish(&level[1]);
    return rc;
}

int spl_bare_points(struct spl_points *points, struct spl_stage *stage, struct spl_error *err)
{
    struct bare b = {.points = points};
    spl_stage_begin(stage, "spacing", "points", points->count);
    spl_spill_free(points->spill, points->normal);
    points->normal = NULL;
    spl_spill_free(points->spill, points->radius); /* what lines ask for */
    points->radius = spl_spill_alloc(points->spill, points->count, sizeof *points->radius, err);
    int rc = points->radius ? size_points(&b, stage->threads, err) : SPL_E_NOMEM;
    if (rc)
        return rc;
    points->normal = spl_spill_alloc(points->spill, points->count + SPL_POINTS_PAD, sizeof *points->normal, err);
    points->uncertainty = spl_spill_alloc(points->spill, points->count, sizeof *points->uncertainty, err);
    if (!points->normal || !points->uncertainty)
        return SPL_E_NOMEM;
    for (size_t i = 0; i < points->count; i++)
        points->normal[i][2] = 1;
    points->no_surface = true;
    spl_stage_finish(stage);
    return SPL_OK;
}
