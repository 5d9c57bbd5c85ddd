/* Lists of tiles; see order.h. An entry for each tile of each item, tile by tile, and within a tile as the items lie,
 * which are sorted by depth. The host waits once a window, for where they start. Software drivers count by tile, an
 * invocation for many items; where thousands run at once entries are written out, each behind the other, and sorted
 * by tile as items are by depth. Both are stable, so lists are the same. Belongs to the renderer's thread. */
#include "render/soft/order.h"

enum {
    list_block = 64,
    list_blocks_least = 32 // that all cores have some
};

static uint32_t blocks_of(uint64_t items, uint32_t block)
{
    return (uint32_t)((items + block - 1) / block);
}

/* Where lists start; the sum of all. */
static uint64_t lay_out(const uint32_t *totals, uint32_t *starts, uint32_t tiles)
{
    uint64_t sum = 0;
    for (uint32_t i = 0; i < tiles; i++) {
        starts[i] = (uint32_t)sum;
        sum += totals[i];
    }
    return sum;
}

/* Walks all blocks to their ends, as many dispatches as the one with most entries may need. */
static int walk(struct spl_soft_order *order, struct spl_soft_dispatch *what, uint32_t most, struct spl_error *err)
{
    const uint64_t rounds = (uint64_t)what->step.block * most;
    const uint64_t kept = (uint64_t)what->step.progress * sizeof(uint32_t);
    int rc = SPL_OK;
    what->key.name = "soft_list";
    spl_gpu_fill(order->gpu, order->memory->buffers[SPL_SOFT_COUNTS], kept, 2ull * what->step.blocks * sizeof(uint32_t),
                 0);
    spl_gpu_barrier(order->gpu);
    for (uint64_t done = 0; done < rounds && !rc; done += SPL_SOFT_ROUNDS) {
        rc = spl_soft_add_work(order, (uint64_t)what->step.blocks * SPL_SOFT_ROUNDS, err);
        rc = rc ? rc : spl_soft_dispatch(order, what, err);
        spl_gpu_barrier(order->gpu);
    }
    return rc;
}

/* Lists by a counting sort, whose counters are tiles: an invocation a block walks its items' tiles. */
static int list_by_counting(struct spl_soft_order *order, uint32_t items, uint32_t most, struct spl_error *err)
{
    const struct spl_soft_memory *memory = order->memory;
    const uint32_t tiles = order->columns * order->rows, room = memory->counters - 2 * memory->threads;
    uint32_t threads = items / tiles > list_blocks_least ? items / tiles : list_blocks_least;
    threads = threads < memory->threads ? threads : memory->threads;
    threads = threads < room / tiles ? threads : room / tiles;
    uint32_t block = blocks_of(items, threads);
    block = block > list_block ? block : list_block;
    struct spl_soft_dispatch what = {.step = {.count = items,
                                              .block = block,
                                              .blocks = blocks_of(items, block),
                                              .digits = tiles,
                                              .columns = order->columns,
                                              .rects = memory->sizes.items * SPL_SOFT_ITEM_WORDS,
                                              .progress = room},
                                     .from = order->sorted,
                                     .to = spl_soft_other(order->sorted),
                                     .totals = SPL_SOFT_STARTS};
    what.workgroups = spl_soft_groups(order, what.step.blocks);
    spl_gpu_fill(order->gpu, memory->buffers[SPL_SOFT_COUNTS], 0,
                 (uint64_t)what.step.blocks * tiles * sizeof(uint32_t), 0);
    int rc = walk(order, &what, most, err);
    struct spl_soft_dispatch sums = what;
    sums.totals = SPL_SOFT_TOTALS;
    rc = rc ? rc : spl_soft_scan(order, sums, false, err);
    rc = rc ? rc : spl_soft_run(order, err);
    if (rc)
        return rc;
    uint32_t *starts = spl_gpu_buffer_map(memory->buffers[SPL_SOFT_STARTS]);
    uint64_t entries = lay_out(spl_gpu_buffer_map(memory->buffers[SPL_SOFT_TOTALS]), starts, tiles);
    order->starts = starts;
    if (entries > memory->sizes.entries)
        return SPL_SOFT_CROWDED;
    order->entries = (uint32_t)entries;
    what.key.constants[0] = 1;
    return walk(order, &what, most, err);
}

/* Lists by the sort that items took: entries are pairs of tile and item. */
static int list_by_sorting(struct spl_soft_order *order, uint32_t items, uint64_t entries, struct spl_error *err)
{
    const struct spl_soft_memory *memory = order->memory;
    const uint32_t tiles = order->columns * order->rows;
    if (entries > memory->sizes.entries)
        return SPL_SOFT_CROWDED;
    struct spl_soft_dispatch what = {.key = {.name = "soft_entries"},
                                     .step = {.count = items,
                                              .block = SPL_SOFT_MANY_BLOCK,
                                              .blocks = blocks_of(items, SPL_SOFT_MANY_BLOCK),
                                              .digits = 1,
                                              .columns = order->columns,
                                              .rects = memory->sizes.items * SPL_SOFT_ITEM_WORDS,
                                              .entries = (uint32_t)entries},
                                     .from = order->sorted,
                                     .to = SPL_SOFT_TILED,
                                     .totals = SPL_SOFT_DIGITS};
    what.workgroups = spl_soft_groups(order, what.step.blocks);
    int rc = spl_soft_add_work(order, items + entries, err);
    rc = rc ? rc : spl_soft_dispatch(order, &what, err);
    spl_gpu_barrier(order->gpu);
    rc = rc ? rc : spl_soft_scan(order, what, false, err);
    what.key.constants[0] = 1;
    rc = rc ? rc : spl_soft_dispatch(order, &what, err);
    spl_gpu_barrier(order->gpu);
    enum spl_soft_buffer tiled = SPL_SOFT_TILED;
    rc = rc ? rc : spl_soft_sort_pairs(order, &tiled, (uint32_t)entries, 0, tiles - 1, err);
    const uint64_t lanes = entries > tiles ? entries : tiles;
    const struct spl_soft_dispatch ends = {.key = {.name = "soft_tiles"},
                                           .step = {.count = (uint32_t)entries, .digits = tiles},
                                           .from = tiled,
                                           .to = spl_soft_other(order->sorted),
                                           .totals = SPL_SOFT_TOTALS,
                                           .workgroups = spl_soft_groups(order, lanes)};
    rc = rc ? rc : spl_soft_dispatch(order, &ends, err);
    spl_gpu_barrier(order->gpu);
    rc = rc ? rc : spl_soft_run(order, err);
    if (rc)
        return rc;
    order->starts = spl_gpu_buffer_map(memory->buffers[SPL_SOFT_TOTALS]); /* cached, which those of UPLOAD are not */
    order->entries = (uint32_t)entries;
    return SPL_OK;
}

int spl_soft_list(struct spl_soft_order *order, uint32_t items, uint64_t entries, uint32_t most, struct spl_error *err)
{
    order->entries = 0;
    if (!items || !entries)
        return SPL_OK;
    return order->memory->many ? list_by_sorting(order, items, entries, err)
                               : list_by_counting(order, items, most, err);
}
