/* Which cells of a level are lines, by the spread of the points in a cell and its 26 neighbours (dimensionality after
 * the principal components): long in one direction alone, and as thin as the finest level's cells. Each cell is judged
 * by itself, in parallel; a line's middle and direction are those of the same points. */
#include <math.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "geom/eigen.h"
#include "pack/linear_level.h"

enum { points_min = 4, grain = 4096 };
static const float thin = 0.04f;        /* second invariant of the spread over the first's square: sigma 1 : 6 */
static const float own_surface = 0.21f; /* the same within a cell, of which a square has 0.25 */
static const float along_min = 0.2f;    /* variance along a line, squared cells; 0.75 where it crosses all three */

static void invariants(const float m[6], float *first, float *second)
{
    *first = m[0] + m[3] + m[5];
    *second = m[0] * m[3] + m[0] * m[5] + m[3] * m[5] - m[1] * m[1] - m[2] * m[2] - m[4] * m[4];
}

static bool judge(const struct spl_linear_level *l, uint32_t cell)
{
    const struct spl_cell_sums *own = &l->cells.cells[cell].sums;
    float m[6], first, second;
    if (own->count == 0)
        return false;
    if (own->count >= 8) {
        spl_cells_covariance(own, m);
        invariants(m, &first, &second);
        if (second > own_surface * first * first)
            return false;
    }
    struct spl_cell_sums around = spl_cells_around(&l->cells, cell);
    if (around.count < points_min)
        return false;
    spl_cells_covariance(&around, m);
    invariants(m, &first, &second);
    return first >= along_min && second <= thin * first * first &&
           second <= 2 * first * (float)(l->across_max * l->across_max);
}

static void judge_cells(void *context, size_t begin, size_t end, unsigned worker)
{
    struct spl_linear_level *l = context;
    (void)worker;
    for (size_t k = begin; k < end && !spl_stage_is_cancelled(l->stage); k++)
        l->is_line[k] = judge(l, (uint32_t)k);
}

static void fit_lines(void *context, size_t begin, size_t end, unsigned worker)
{
    struct spl_linear_level *l = context;
    (void)worker;
    for (size_t i = begin; i < end && !spl_stage_is_cancelled(l->stage); i++) {
        struct spl_line *line = &l->lines[i];
        struct spl_cell_sums around = spl_cells_around(&l->cells, line->cell);
        float m[6];
        double wide[6], values[3], least[3], most[3];
        spl_cells_covariance(&around, m);
        for (int e = 0; e < 6; e++)
            wide[e] = m[e];
        spl_eigen_symmetric(wide, values, least, most);
        for (int c = 0; c < 3; c++) {
            line->middle[c] = around.sum[c] / around.count;
            line->direction[c] = (float)most[c];
        }
        line->across = (float)sqrt(fmax(0, values[0]) + fmax(0, values[1]));
        line->spacing = (float)(sqrt(12 * values[2])) / around.count;
    }
}

int spl_linear_find_lines(struct spl_linear_level *l, struct spl_error *err)
{
    uint32_t count = 0;
    unsigned threads = l->stage->threads;
    l->is_line = spl_spill_alloc(l->cells.spill, l->cells.count, 1, err);
    if (!l->is_line)
        return SPL_E_NOMEM;
    spl_parallel_for(threads, l->cells.count, grain, judge_cells, l);
    for (uint32_t k = 0; k < l->cells.count; k++)
        count += l->is_line[k];
    l->lines = spl_spill_alloc(l->cells.spill, count, sizeof *l->lines, err);
    l->bucket = spl_spill_alloc(l->cells.spill, (size_t)count + 1, sizeof *l->bucket, err);
    if (!l->lines || !l->bucket)
        return SPL_E_NOMEM;
    for (uint32_t k = 0; k < l->cells.count; k++)
        if (l->is_line[k])
            l->lines[l->line_count++] = (struct spl_line){.cell = k};
    for (uint32_t i = 0; i < count; i++)
        if (i == 0 || l->cells.cells[l->lines[i].cell].key >> SPL_LINE_BUCKET_BITS !=
                          l->cells.cells[l->lines[i - 1].cell].key >> SPL_LINE_BUCKET_BITS)
            l->bucket[l->bucket_count++] = i;
    l->bucket[l->bucket_count] = count;
    spl_parallel_for(threads, count, grain, fit_lines, l);
    return 0;
}
