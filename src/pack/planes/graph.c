/* Pairs of patches that have points in the same cell of some level, or in cells that touch. Blocks of cells list them
 * in parallel, each leaving out those that it met just before; blocks in their order make the graph, so it does not
 * depend on the number of threads. A pair may come from several blocks and levels: who walks the graph marks where he
 * was. Of the finest level, which has most of the cells, those that share a face are asked, not those that meet at an
 * edge or a corner: the next level has these in one cell or in two that touch. */
#include <stdlib.h>

#include "base/array.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "pack/planes/planes.h"
#include "pack/planes/regions.h"

enum { block_cells = 4096, remembered = 256, around = 14 };

struct pair {
    uint32_t a, b;
};

struct block {
    struct pair *pairs;
    size_t count, capacity;
};

struct search {
    const struct spl_cells *cells;
    const struct spl_plane_list *lists;
    const struct spl_stage *stage;
    bool finest;
    struct block *blocks;
    atomic_bool failed;
};

static int add(struct block *b, struct pair *last, uint32_t x, uint32_t y)
{
    struct pair pair = {x < y ? x : y, x < y ? y : x};
    uint64_t hash = ((uint64_t)pair.a << 32 | pair.b) * 0x9e3779b97f4a7c15ull;
    struct pair *slot = &last[hash >> 56];
    if (slot->a == pair.a && slot->b == pair.b)
        return 0;
    *slot = pair;
    if (spl_array_reserve(b->pairs, b->capacity, b->count + 1, NULL))
        return SPL_E_NOMEM;
    b->pairs[b->count++] = pair;
    return 0;
}

/* All pairs of labels of two cells. */
static int add_cells(struct block *b, struct pair *last, const struct spl_plane_list *one,
                     const struct spl_plane_list *other)
{
    for (int s = 0; s < SPL_PLANE_LIST && one->label[s] != SPL_NO_PLANE; s++)
        for (int t = 0; t < SPL_PLANE_LIST && other->label[t] != SPL_NO_PLANE; t++)
            if (one->label[s] != other->label[t] && add(b, last, one->label[s], other->label[t]))
                return SPL_E_NOMEM;
    return 0;
}

static void search_blocks(void *context, size_t begin, size_t end, unsigned worker)
{
    struct search *s = context;
    (void)worker;
    for (size_t k = begin; k < end && !spl_stage_is_cancelled(s->stage); k++) {
        struct pair last[remembered];
        for (int i = 0; i < remembered; i++)
            last[i] = (struct pair){SPL_NO_PLANE, SPL_NO_PLANE};
        uint32_t from = (uint32_t)k * block_cells, to = from + block_cells;
        for (uint32_t cell = from; cell < to && cell < s->cells->count; cell++) {
            int64_t at[3];
            if (s->lists[cell].label[0] == SPL_NO_PLANE)
                continue;
            spl_cells_place(s->cells, cell, at);
            for (int n = 0; n < around; n++) { /* the cell itself, and half of its neighbours: the others see it */
                int m = 26 - n;
                bool shares_face = m == 14 || m == 16 || m == 22;
                if (s->finest && n != around - 1 && !shares_face)
                    continue;
                uint32_t other = n == around - 1 ? cell
                                                 : spl_cells_find(s->cells, at[0] + m % 3 - 1, at[1] + m / 3 % 3 - 1,
                                                                  at[2] + m / 9 - 1);
                if (other != UINT32_MAX && add_cells(&s->blocks[k], last, &s->lists[cell], &s->lists[other]))
                    atomic_store(&s->failed, true);
            }
        }
    }
}

/* Both directions of all pairs. */
static int connect(struct spl_patch_graph *graph, uint32_t patches, const struct block *blocks, size_t count,
                   struct spl_error *err)
{
    size_t total = 0;
    graph->first = spl_alloc((size_t)patches + 2, sizeof *graph->first, err);
    if (!graph->first)
        return SPL_E_NOMEM;
    for (size_t k = 0; k < count; k++)
        for (size_t i = 0; i < blocks[k].count; i++, total += 2) {
            graph->first[blocks[k].pairs[i].a + 2]++;
            graph->first[blocks[k].pairs[i].b + 2]++;
        }
    graph->neighbour = spl_alloc_raw(total, sizeof *graph->neighbour, err);
    if (!graph->neighbour)
        return SPL_E_NOMEM;
    for (uint32_t a = 0; a < patches; a++)
        graph->first[a + 2] += graph->first[a + 1];
    for (size_t k = 0; k < count; k++)
        for (size_t i = 0; i < blocks[k].count; i++) {
            struct pair pair = blocks[k].pairs[i];
            graph->neighbour[graph->first[pair.a + 1]++] = pair.b;
            graph->neighbour[graph->first[pair.b + 1]++] = pair.a;
        }
    return 0;
}

int spl_patch_graph_init(struct spl_patch_graph *graph, struct spl_plane_levels *levels, uint32_t patches,
                         const struct spl_points *points, const uint32_t *label, struct spl_stage *stage,
                         struct spl_error *err)
{
    size_t total = 0, done = 0;
    *graph = (struct spl_patch_graph){0};
    for (unsigned k = 0; k < levels->count; k++)
        total += (levels->cells[k].count + block_cells - 1) / block_cells;
    struct block *blocks = spl_alloc(total, sizeof *blocks, err);
    int rc = blocks ? 0 : SPL_E_NOMEM;
    for (unsigned k = 0; !rc && k < levels->count; k++) {
        struct search s = {&levels->cells[k], levels->lists, stage, k == 0, blocks + done, false};
        size_t count = (levels->cells[k].count + block_cells - 1) / block_cells;
        spl_plane_levels_fill(levels, k, points, label, stage->threads);
        spl_parallel_for(stage->threads, count, 1, search_blocks, &s);
        if (atomic_load(&s.failed))
            rc = spl_fail(err, SPL_E_NOMEM, "out of memory for the neighbours of %u flat cells", patches);
        done += count;
    }
    if (!rc)
        rc = connect(graph, patches, blocks, total, err);
    for (size_t k = 0; blocks && k < total; k++)
        free(blocks[k].pairs);
    free(blocks);
    return rc;
}

void spl_patch_graph_finish(struct spl_patch_graph *graph)
{
    free(graph->neighbour);
    free(graph->first);
    *graph = (struct spl_patch_graph){0};
}
