/* A hash table of occupied cells, so that a stray point far away is a cell more, and no others are coarser for it.
 * Cells lie at multiples of their edge, a power of two: eight become one where more are occupied than there is room
 * for. What edge there is in the end depends on the points, not on their order, but for the first of them. One thread.
 */
#include "pack/job/count.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/hash.h"
#include "base/memory.h"

static const double edge_least = 0x1p-20; /* where places are whole numbers of 64 bits up to SPL_COORDINATE_MAX */
enum { cells_a_side = 1024, sample_most = 1024 }; /* of the first points */

struct cell {
    int64_t at[3];
    uint64_t points; /* 0: the slot is free */
};

struct spl_job_grid {
    struct cell *slots, *other; /* owned: `room` each, a power of two */
    size_t room, count, most;
    double edge; /* 0: there is no point yet */
};

struct spl_job_grid *spl_job_grid_create(size_t cells_most, struct spl_error *err)
{
    struct spl_job_grid *grid = spl_alloc(1, sizeof *grid, err);
    if (!grid)
        return NULL;
    grid->most = cells_most;
    for (grid->room = 16; grid->room < 2 * cells_most;)
        grid->room *= 2;
    grid->slots = spl_alloc(grid->room, sizeof *grid->slots, err);
    grid->other = spl_alloc(grid->room, sizeof *grid->other, err);
    if (grid->slots && grid->other)
        return grid;
    spl_job_grid_destroy(grid);
    return NULL;
}

void spl_job_grid_destroy(struct spl_job_grid *grid)
{
    if (!grid)
        return;
    free(grid->slots);
    free(grid->other);
    free(grid);
}

static struct cell *find(const struct spl_job_grid *grid, struct cell *slots, const int64_t at[3])
{
    uint64_t key = (uint64_t)at[0] * 0x9e3779b97f4a7c15u ^ (uint64_t)at[1] * 0xc2b2ae3d27d4eb4fu ^
                   (uint64_t)at[2] * 0x165667b19e3779f9u;
    size_t slot = spl_hash_slot(key ^ key >> 29, grid->room - 1);
    while (slots[slot].points && memcmp(slots[slot].at, at, sizeof slots[slot].at) != 0)
        slot = (slot + 1) & (grid->room - 1);
    return &slots[slot];
}

void spl_job_grid_coarsen(struct spl_job_grid *grid)
{
    struct cell *to = grid->other;
    memset(to, 0, grid->room * sizeof *to);
    grid->count = 0;
    for (size_t i = 0; i < grid->room; i++) {
        const struct cell *from = &grid->slots[i];
        int64_t at[3];
        if (!from->points)
            continue;
        for (int c = 0; c < 3; c++)
            at[c] = (from->at[c] - (from->at[c] & 1)) / 2;
        struct cell *cell = find(grid, to, at);
        memcpy(cell->at, at, sizeof cell->at);
        grid->count += !cell->points;
        cell->points += from->points;
    }
    grid->other = grid->slots;
    grid->slots = to;
    grid->edge *= 2;
}

static int compare(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Where most of the first points lie: what is too fine gets coarser, but never the other way round. */
static double first_edge(const double (*points)[3], size_t count)
{
    double size = 0, some[sample_most];
    const size_t sample = count < sample_most ? count : sample_most;
    for (int c = 0; c < 3; c++) {
        for (size_t i = 0; i < sample; i++)
            some[i] = points[i * count / sample][c];
        qsort(some, sample, sizeof *some, compare);
        size = fmax(size, some[sample - 1 - sample / 8] - some[sample / 8]);
    }
    return fmax(edge_least, size > 0 ? ldexp(1, ilogb(size / cells_a_side)) : 0);
}

void spl_job_grid_add(struct spl_job_grid *grid, const double (*points)[3], size_t count)
{
    struct cell *last = NULL; /* the next point mostly lies in the same */
    if (!count)
        return;
    if (grid->edge == 0)
        grid->edge = first_edge(points, count);
    for (size_t i = 0; i < count; i++) {
        int64_t at[3];
        for (int c = 0; c < 3; c++)
            at[c] = (int64_t)floor(points[i][c] / grid->edge);
        if (!last || memcmp(last->at, at, sizeof at) != 0) {
            last = find(grid, grid->slots, at);
            grid->count += !last->points;
            memcpy(last->at, at, sizeof at);
        }
        last->points++;
        if (grid->count > grid->most) {
            while (grid->count > grid->most)
                spl_job_grid_coarsen(grid);
            last = NULL;
        }
    }
}

struct spl_job_cell *spl_job_grid_get_cells(const struct spl_job_grid *grid, size_t *count, struct spl_error *err)
{
    struct spl_job_cell *cells = spl_alloc(grid->count ? grid->count : 1, sizeof *cells, err);
    *count = 0;
    for (size_t i = 0; cells && i < grid->room; i++) {
        const struct cell *from = &grid->slots[i];
        struct spl_job_cell *to = &cells[*count];
        if (!from->points)
            continue;
        for (int c = 0; c < 3; c++) {
            to->min[c] = (double)from->at[c] * grid->edge;
            to->max[c] = (double)(from->at[c] + 1) * grid->edge;
        }
        to->points = (double)from->points;
        ++*count;
    }
    return cells;
}

double spl_job_grid_get_usual(const struct spl_job_grid *grid)
{
    uint64_t all = 0, sum = 0, least = UINT64_MAX, most = 0;
    for (size_t i = 0; i < grid->room; i++) {
        all += grid->slots[i].points;
        most = grid->slots[i].points > most ? grid->slots[i].points : most;
    }
    for (uint64_t low = 0, high = most; low < high;) { /* the largest count of which cells with as many have half */
        uint64_t middle = low + (high - low + 1) / 2;
        sum = 0;
        for (size_t i = 0; i < grid->room; i++)
            sum += grid->slots[i].points >= middle ? grid->slots[i].points : 0;
        if (2 * sum >= all)
            low = middle;
        else
            high = middle - 1;
        least = low;
    }
    return all ? (double)(least == UINT64_MAX ? most : least) : 0;
}
