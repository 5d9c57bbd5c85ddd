/* Where the points of a plan's scans are. Where scans are many and their headers say it, headers alone are read; then
 * every attribute that a scan may have is kept, since whether all points have the same is not known. Else all points
 * are read once. The caller's thread. */
#include "pack/job/plan_parts.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "pack/job/survey.h"
#include "pack/points.h"

enum { cells_least = 1 << 15, cells_most = 1 << 18, cells_a_part = 1 << 12, scans_a_part = 4, cell_points = 16 };

/* Whether headers say all that there is to be known: LAS is the format whose values are whole numbers, but for fields
 * that are kept by name. How unevenly a scan's points lie in its box they do not say, which in many small boxes evens
 * out. */
static bool headers_tell(const struct spl_planning *p)
{
    bool tell = p->scans.count / scans_a_part >= p->options->parts && !p->keep.count &&
                !p->options->pack.left_out; /* what is broken inside is found by who reads it all */
    uint64_t points = 0;
    for (size_t i = 0; tell && i < p->scans.count; i++)
        points += p->scans.list[i].counted ? p->scans.list[i].points_expected : 0;
    for (size_t i = 0; tell && i < p->scans.count; i++) {
        const struct spl_scan *scan = &p->scans.list[i];
        tell = scan->has_box && !(scan->attributes & SPL_CLOUD_STATION) &&
               (!scan->counted || scan->points_expected <= points / p->options->parts / 2);
        for (int c = 0; c < 3 && tell; c++)
            tell = fabs(scan->box[0][c]) <= SPL_COORDINATE_MAX && fabs(scan->box[1][c]) <= SPL_COORDINATE_MAX;
    }
    return tell;
}

static int take_headers(struct spl_planning *p, struct spl_error *err)
{
    struct spl_part_rules *rules = &p->job->rules;
    uint32_t all = ~0u;
    if (!(p->cells = spl_alloc(p->scans.count, sizeof *p->cells, err)))
        return SPL_E_NOMEM;
    for (size_t i = 0; i < p->scans.count; i++) {
        struct spl_scan *scan = &p->scans.list[i];
        scan->points_inside = scan->counted ? scan->points_expected : 0;
        if (!scan->points_inside)
            continue;
        struct spl_job_cell *cell = &p->cells[p->cell_count++];
        cell->points = (double)scan->points_inside;
        scan->points_from[scan->colors.from] = scan->points_inside;
        for (int c = 0; c < 3; c++) {
            cell->min[c] = scan->min[c] = scan->box[0][c];
            cell->max[c] = scan->max[c] = scan->box[1][c];
        }
        rules->scalars |= scan->scalars;
        all &= scan->scalars;
    }
    for (int s = 0; s < SPL_SCALAR_COUNT; s++) /* one that some scans lack has points without it */
        rules->steps[s] = (struct spl_scalar_steps){all >> s & 1, 0, 1};
    spl_job_find_spacing(p->cells, p->cell_count, &p->spacing);
    return SPL_OK;
}

static int count_points(struct spl_planning *p, struct spl_error *err)
{
    size_t cells = (size_t)p->options->parts * cells_a_part;
    cells = cells < cells_least ? cells_least : cells > cells_most ? cells_most : cells;
    struct spl_job_grid *grid = spl_job_grid_create(cells, err);
    struct spl_job_cell *coarse = NULL;
    size_t count = 0, before = 0;
    int rc = grid ? spl_survey(&p->scans, grid, &p->job->rules, &p->stage, err) : SPL_E_NOMEM;
    if (!rc && !(p->cells = spl_job_grid_get_cells(grid, &p->cell_count, err)))
        rc = SPL_E_NOMEM;
    /* cells with a few points say little of how far these are apart */
    for (count = p->cell_count; !rc && count > 8 && count != before && spl_job_grid_get_usual(grid) < cell_points;) {
        before = count;
        spl_job_grid_coarsen(grid);
        free(coarse);
        if (!(coarse = spl_job_grid_get_cells(grid, &count, err)))
            rc = SPL_E_NOMEM;
    }
    if (!rc)
        spl_job_find_spacing(coarse ? coarse : p->cells, coarse ? count : p->cell_count, &p->spacing);
    free(coarse);
    spl_job_grid_destroy(grid);
    return rc;
}

int spl_plan_find_points(struct spl_planning *p, struct spl_error *err)
{
    return headers_tell(p) ? take_headers(p, err) : count_points(p, err);
}
