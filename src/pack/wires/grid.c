/* Items by the cells of a grid: a sorted list of keys, which are searched by halves. What is asked for in a row mostly
 * lies in one cell, so a scan's points, which are in Morton order, cost little. */
#include "pack/wires/grid.h"

#include <math.h>
#include <stdlib.h>

#include "base/array.h"
#include "base/memory.h"

uint64_t spl_wires_key(const double low[3], double edge, const double position[3], const int shift[3])
{
    uint64_t key = 0;
    for (int c = 0; c < 3; c++) {
        double cell = fmax(fmin(floor((position[c] - low[c]) / edge), 1e15), -1e15) + shift[c] + 1;
        key = key << 21 | ((uint64_t)(int64_t)cell & 0x1fffff);
    }
    return key;
}

int spl_wires_grid_reserve(struct spl_wires_grid *grid, size_t count, struct spl_error *err)
{
    struct spl_wires_cell *cells = spl_realloc(grid->cells, count + 1, sizeof *cells, err);
    if (!cells)
        return SPL_E_NOMEM;
    grid->cells = cells;
    grid->capacity = count + 1;
    return SPL_OK;
}

int spl_wires_grid_add(struct spl_wires_grid *grid, const double position[3], uint32_t item, struct spl_error *err)
{
    if (spl_array_reserve(grid->cells, grid->capacity, grid->count + 1, err))
        return SPL_E_NOMEM;
    uint64_t key = spl_wires_key(grid->low, grid->edge, position, (int[3]){0});
    grid->cells[grid->count++] = (struct spl_wires_cell){key, item};
    return SPL_OK;
}

static int compare(const void *a, const void *b)
{
    const struct spl_wires_cell *p = a, *q = b;
    return p->key != q->key ? (p->key < q->key ? -1 : 1) : (p->item > q->item) - (p->item < q->item);
}

void spl_wires_grid_sort(struct spl_wires_grid *grid)
{
    size_t kept = 0;
    if (grid->count)
        qsort(grid->cells, grid->count, sizeof *grid->cells, compare);
    for (size_t i = 0; i < grid->count; i++)
        if (!i || compare(&grid->cells[i], &grid->cells[i - 1]))
            grid->cells[kept++] = grid->cells[i];
    grid->count = kept;
}

size_t spl_wires_grid_find(const struct spl_wires_grid *grid, const double position[3], const int shift[3],
                           size_t *first)
{
    uint64_t key = spl_wires_key(grid->low, grid->edge, position, shift);
    size_t low = 0, high = grid->count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (grid->cells[middle].key < key)
            low = middle + 1;
        else
            high = middle;
    }
    *first = low;
    while (low < grid->count && grid->cells[low].key == key)
        low++;
    return low;
}

void spl_wires_grid_finish(struct spl_wires_grid *grid)
{
    free(grid->cells);
    *grid = (struct spl_wires_grid){0};
}
