/* What --points-only packs instead of a surface: points that are as large as they are apart.
 *
 * The distance of neighbours follows from how many points lie in the 27 cells around a cell, as if they lay on a plane
 * through it: n of them are 3 edges / sqrt(n) apart. One look-up a cell instead of a search a point. Equation 20's
 * radius of a square grid of that spacing keeps what chooses levels of detail as it is. */
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

struct bare {
    struct spl_points *points;
    const struct spl_cells *cells;
};

static void size_cells(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct bare *b = context;
    struct spl_points *p = b->points;
    (void)worker;
    for (size_t k = begin; k < end; k++) {
        double count = spl_cells_around(b->cells, (uint32_t)k).count;
        double radius = SPL_RADIUS_SPACING * 3 * b->cells->edge / sqrt(fmax(count, 1));
        for (size_t i = b->cells->cells[k].begin; i < b->cells->cells[k + 1].begin; i++)
            p->radius[i] = (float)fmax(radius, 1e-9);
    }
}

int spl_bare_points(struct spl_points *points, struct spl_stage *stage, struct spl_error *err)
{
    struct spl_cells cells = {0};
    struct bare b = {points, &cells};
    spl_stage_begin(stage, "spacing", points->count);
    free(points->normal);
    points->normal = spl_alloc(points->count + SPL_POINTS_PAD, sizeof *points->normal, err);
    points->radius = spl_alloc_raw(points->count, sizeof *points->radius, err);
    points->uncertainty = spl_alloc(points->count, sizeof *points->uncertainty, err);
    int rc = points->normal && points->radius && points->uncertainty ? 0 : SPL_E_NOMEM;
    if (!rc)
        rc = spl_cells_init(&cells, points, cell_points, stage->threads, err);
    if (!rc) {
        spl_parallel_for(stage->threads, cells.count, grain, size_cells, &b);
        for (size_t i = 0; i < points->count; i++)
            points->normal[i][2] = 1;
        points->no_surface = true;
        spl_stage_finish(stage);
    }
    spl_cells_finish(&cells);
    return rc;
}
