/* Counting sort of a node's points by plane: planes are many, but few of them are in one node. One worker's. */
#include "pack/panels/groups.h"

#include <math.h>
#include <stdlib.h>

#include "base/array.h"
#include "base/memory.h"

static int compare_runs(const void *a, const void *b)
{
    const struct spl_panel_run *x = a, *y = b;
    return (x->plane > y->plane) - (x->plane < y->plane);
}

bool spl_panel_groups_find(struct spl_panel_groups *g, const struct spl_panel_maker *maker, size_t begin, size_t end)
{
    const uint32_t *plane = maker->points->plane;
    size_t count = 0, at = 0;
    g->run_count = 0;
    if (!g->counts && !(g->counts = spl_alloc(maker->planes->count, sizeof *g->counts, NULL)))
        return false;
    if (end - begin > g->member_capacity) {
        g->spill = maker->points->spill;
        spl_spill_free(g->spill, g->members);
        spl_spill_free(g->spill, g->level_members);
        g->member_capacity = 0;
        g->members = spl_spill_alloc_raw(g->spill, end - begin, sizeof *g->members, NULL);
        g->level_members = spl_spill_alloc_raw(g->spill, end - begin, sizeof *g->level_members, NULL);
        if (!g->members || !g->level_members)
            return false;
        g->member_capacity = end - begin;
    }
    for (size_t i = begin; i < end; i++)
        if (maker->level[i] && !g->counts[plane[i]]++) {
            if (spl_array_reserve(g->runs, g->run_capacity, g->run_count + 1, NULL))
                return false;
            g->runs[g->run_count++] = (struct spl_panel_run){.plane = plane[i]};
        }
    if (g->run_count)
        qsort(g->runs, g->run_count, sizeof *g->runs, compare_runs);
    for (size_t r = 0; r < g->run_count; r++) {
        g->runs[r].begin = at;
        g->runs[r].count = g->counts[g->runs[r].plane];
        g->counts[g->runs[r].plane] = (uint32_t)at;
        at += g->runs[r].count;
    }
    for (size_t i = begin; i < end; i++)
        if (maker->level[i]) {
            g->members[g->counts[plane[i]]++] = (uint32_t)(i - begin);
            count++;
        }
    spl_assert(count == at);
    for (size_t r = 0; r < g->run_count; r++)
        g->counts[g->runs[r].plane] = 0;
    return true;
}

size_t spl_panel_groups_select(struct spl_panel_groups *g, const struct spl_panel_maker *maker, size_t first,
                               const struct spl_panel_run *run, uint8_t level)
{
    size_t count = 0;
    for (size_t m = run->begin; m < run->begin + run->count; m++)
        if (maker->level[first + g->members[m]] == level)
            g->level_members[count++] = g->members[m];
    return count;
}

void spl_panel_groups_finish(struct spl_panel_groups *g)
{
    spl_spill_free(g->spill, g->members);
    spl_spill_free(g->spill, g->level_members);
    free(g->runs);
    free(g->counts);
    *g = (struct spl_panel_groups){0};
}

double spl_panel_cell(const struct spl_panel_maker *maker, uint32_t plane, uint8_t level)
{
    return (double)maker->base[plane] * exp2(0.5 * (level - SPL_PANEL_LEVEL_BASE));
}

uint8_t spl_panel_level(const struct spl_panel_maker *maker, uint32_t plane, double cell)
{
    double level = floor(SPL_PANEL_LEVEL_BASE + 2 * log2(cell / (double)maker->base[plane]) + 0.5);
    return (uint8_t)fmin(fmax(level, 1), UINT8_MAX);
}
