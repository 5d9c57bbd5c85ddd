/* Occupied cells of a grid, level by level: points in Morton order make each cell a run of them, and each cell of the
 * level above a run of cells. A level's cells are found by a hash table of their keys. Sums are floats about each
 * cell's own middle, so coordinates of any size cost no precision. Cells are summed in parallel, each by one worker in
 * the order of its points: results do not depend on the number of threads. */
#include "pack/cells.h"

#include <math.h>
#include <stdlib.h>

#include "base/hash.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "geom/morton.h"
#include "pack/order.h"

enum { grain = 1 << 14, around_grain = 32 };
static const int row[6] = {0, 0, 0, 1, 1, 2}, column[6] = {0, 1, 2, 1, 2, 2};

struct build {
    const struct spl_points *points;
    const struct spl_cells *below;
    struct spl_cells *cells;
    uint64_t *key; /* of each point */
};

void spl_cells_place(const struct spl_cells *cells, uint32_t cell, int64_t at[3])
{
    for (int c = 0; c < 3; c++)
        at[c] = spl_morton_compact(cells->cells[cell].key >> c);
}

static uint32_t slot_of(const struct spl_cells *cells, uint64_t key)
{
    return (uint32_t)spl_hash_slot(key, cells->table_mask);
}

uint64_t spl_cells_key(int64_t x, int64_t y, int64_t z)
{
    return spl_morton_encode((uint32_t)x, (uint32_t)y, (uint32_t)z);
}

uint32_t spl_cells_find(const struct spl_cells *cells, int64_t x, int64_t y, int64_t z)
{
    int64_t end = (int64_t)1 << (SPL_MORTON_BITS - cells->shift);
    if (x < 0 || y < 0 || z < 0 || x >= end || y >= end || z >= end)
        return UINT32_MAX;
    uint64_t key = spl_cells_key(x, y, z);
    for (uint32_t slot = slot_of(cells, key); cells->table[slot]; slot = (slot + 1) & cells->table_mask)
        if (cells->cells[cells->table[slot] - 1].key == key)
            return cells->table[slot] - 1;
    return UINT32_MAX;
}

/* Adds sums whose middle lies at `shift` from that of `to`. */
static void add_sums(struct spl_cell_sums *to, const struct spl_cell_sums *from, const float shift[3])
{
    for (int e = 0; e < 6; e++)
        to->square[e] += from->square[e] + shift[row[e]] * from->sum[column[e]] + shift[column[e]] * from->sum[row[e]] +
                         from->count * shift[row[e]] * shift[column[e]];
    for (int c = 0; c < 3; c++)
        to->sum[c] += from->sum[c] + from->count * shift[c];
    to->count += from->count;
}

struct spl_cell_sums spl_cells_around(const struct spl_cells *cells, uint32_t cell)
{
    struct spl_cell_sums all = {0};
    int64_t at[3];
    if (cell % around_grain == 0)
        spl_spill_keep_bound(cells->spill);
    spl_cells_place(cells, cell, at);
    for (int z = -1; z <= 1; z++)
        for (int y = -1; y <= 1; y++)
            for (int x = -1; x <= 1; x++) {
                uint32_t other = spl_cells_find(cells, at[0] + x, at[1] + y, at[2] + z);
                if (other != UINT32_MAX)
                    add_sums(&all, &cells->cells[other].sums, (const float[3]){(float)x, (float)y, (float)z});
            }
    return all;
}

void spl_cells_covariance(const struct spl_cell_sums *sums, float m[6])
{
    float inverse = 1 / sums->count;
    for (int e = 0; e < 6; e++)
        m[e] = sums->square[e] * inverse - sums->sum[row[e]] * sums->sum[column[e]] * inverse * inverse;
}

static void key_points(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct build *b = context;
    (void)worker;
    spl_spill_keep_bound(b->points->spill);
    for (size_t i = begin; i < end; i++)
        b->key[i] = spl_points_key(b->points, i, b->points->cube_min, b->points->cube_size);
}

static void sum_points(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct build *b = context;
    const struct spl_points *p = b->points;
    (void)worker;
    spl_spill_keep_bound(p->spill);
    for (size_t k = begin; k < end; k++) {
        struct spl_cell *cell = &b->cells->cells[k];
        int64_t at[3];
        double middle[3], inverse = 1 / b->cells->edge;
        spl_cells_place(b->cells, (uint32_t)k, at);
        for (int c = 0; c < 3; c++)
            middle[c] = p->cube_min[c] + ((double)at[c] + 0.5) * b->cells->edge;
        for (size_t i = cell->begin; i < cell[1].begin; i++) {
            float d[3];
            for (int c = 0; c < 3; c++)
                d[c] = (float)((spl_points_at(p, c, i) - middle[c]) * inverse);
            for (int e = 0; e < 6; e++)
                cell->sums.square[e] += d[row[e]] * d[column[e]];
            for (int c = 0; c < 3; c++)
                cell->sums.sum[c] += d[c];
        }
        cell->sums.count = (float)(cell[1].begin - cell->begin);
    }
}

static void sum_cells(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct build *b = context;
    const struct spl_cells *below = b->below;
    (void)worker;
    for (size_t k = begin; k < end; k++) {
        struct spl_cell *cell = &b->cells->cells[k];
        uint32_t from = cell->begin, to = cell[1].begin; /* cells of the level below until they become points */
        struct spl_cell_sums all = {0};
        for (uint32_t i = from; i < to; i++) {
            float shift[3];
            for (int c = 0; c < 3; c++)
                shift[c] = below->cells[i].key >> c & 1 ? 0.5f : -0.5f;
            add_sums(&all, &below->cells[i].sums, shift);
        }
        for (int c = 0; c < 3; c++)
            all.sum[c] *= 0.5f;
        for (int e = 0; e < 6; e++)
            all.square[e] *= 0.25f;
        cell->sums = all;
    }
}

static int make_table(struct spl_cells *cells, struct spl_error *err)
{
    size_t size = 16;
    while (size < 2 * (size_t)cells->count)
        size *= 2;
    cells->table = spl_spill_alloc(cells->spill, size, sizeof *cells->table, err);
    if (!cells->table)
        return SPL_E_NOMEM;
    cells->table_mask = (uint32_t)(size - 1);
    for (uint32_t k = 0; k < cells->count; k++) {
        uint32_t slot = slot_of(cells, cells->cells[k].key);
        while (cells->table[slot])
            slot = (slot + 1) & cells->table_mask;
        cells->table[slot] = k + 1;
    }
    return 0;
}

/* The least shift with `wanted` points a cell: two points in a row share a cell from the shift on at which their keys'
 * last differing triple is gone. */
static unsigned shift_for(const uint64_t *key, size_t count, double wanted, uint32_t *cells)
{
    size_t apart[SPL_MORTON_BITS + 1] = {0};
    for (size_t i = 1; i < count; i++)
        if (key[i] != key[i - 1])
            apart[(63 - __builtin_clzll(key[i] ^ key[i - 1])) / 3]++;
    size_t above = 1;
    unsigned shift = SPL_MORTON_BITS;
    while (shift > 0 && (double)count >= wanted * (double)(above + apart[shift - 1]))
        above += apart[--shift];
    *cells = (uint32_t)above;
    return shift;
}

/* Cells that there are at a shift. */
static uint32_t count_cells(const uint64_t *key, size_t count, unsigned shift)
{
    uint32_t cells = count > 0;
    for (size_t i = 1; i < count; i++)
        cells += key[i] >> 3 * shift != key[i - 1] >> 3 * shift;
    return cells;
}

/* Of `wanted` points a cell or, where that is 0, of `edge`. */
static int init(struct spl_cells *cells, const struct spl_points *points, double wanted, double edge, unsigned threads,
                struct spl_error *err)
{
    struct build b = {.points = points, .cells = cells};
    *cells = (struct spl_cells){.spill = points->spill};
    b.key = spl_spill_alloc_raw(points->spill, points->count, sizeof *b.key, err);
    if (!b.key)
        return SPL_E_NOMEM;
    spl_parallel_for(threads, points->count, grain, key_points, &b);
    if (wanted > 0) {
        cells->shift = shift_for(b.key, points->count, wanted, &cells->count);
    } else {
        int shift = SPL_MORTON_BITS - ilogb(points->cube_size / edge);
        cells->shift = shift < 0 ? 0 : shift > SPL_MORTON_BITS ? SPL_MORTON_BITS : (unsigned)shift;
        cells->count = count_cells(b.key, points->count, cells->shift);
    }
    cells->edge = ldexp(points->cube_size, (int)cells->shift - SPL_MORTON_BITS);
    cells->cells = spl_spill_alloc(cells->spill, (size_t)cells->count + 1, sizeof *cells->cells, err);
    if (!cells->cells) {
        spl_spill_free(points->spill, b.key);
        return SPL_E_NOMEM;
    }
    uint32_t k = 0;
    for (size_t i = 0; i < points->count; i++) {
        uint64_t key = b.key[i] >> 3 * cells->shift;
        if (i == 0 || key != cells->cells[k - 1].key)
            cells->cells[k++] = (struct spl_cell){.key = key, .begin = (uint32_t)i};
    }
    spl_assert(k == cells->count);
    cells->cells[k].begin = (uint32_t)points->count;
    spl_spill_free(points->spill, b.key);
    spl_parallel_for(threads, cells->count, grain, sum_points, &b);
    return make_table(cells, err);
}

int spl_cells_init(struct spl_cells *cells, const struct spl_points *points, double wanted, unsigned threads,
                   struct spl_error *err)
{
    return init(cells, points, wanted, 0, threads, err);
}

int spl_cells_init_at(struct spl_cells *cells, const struct spl_points *points, double edge, unsigned threads,
                      struct spl_error *err)
{
    return init(cells, points, 0, edge, threads, err);
}

int spl_cells_init_above(struct spl_cells *cells, const struct spl_cells *below, unsigned threads,
                         struct spl_error *err)
{
    struct build b = {.below = below, .cells = cells};
    uint32_t count = 0;
    for (uint32_t k = 0; k < below->count; k++)
        count += k == 0 || below->cells[k].key >> 3 != below->cells[k - 1].key >> 3;
    *cells =
        (struct spl_cells){.spill = below->spill, .count = count, .shift = below->shift + 1, .edge = 2 * below->edge};
    cells->cells = spl_spill_alloc(cells->spill, (size_t)count + 1, sizeof *cells->cells, err);
    if (!cells->cells)
        return SPL_E_NOMEM;
    for (uint32_t k = 0, n = 0; k < below->count; k++)
        if (k == 0 || below->cells[k].key >> 3 != below->cells[k - 1].key >> 3)
            cells->cells[n++] = (struct spl_cell){.key = below->cells[k].key >> 3, .begin = k};
    cells->cells[count].begin = below->count;
    spl_parallel_for(threads, count, grain, sum_cells, &b);
    for (uint32_t k = 0; k <= count; k++)
        cells->cells[k].begin = below->cells[cells->cells[k].begin].begin;
    return make_table(cells, err);
}

void spl_cells_finish(struct spl_cells *cells)
{
    spl_spill_free(cells->spill, cells->cells);
    spl_spill_free(cells->spill, cells->table);
    *cells = (struct spl_cells){0};
}
