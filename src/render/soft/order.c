/* Recording of sort, lists and blending; see order.h. The host waits once a window, for how long the tiles' lists are:
 * it lays them out, and knows then how much work each is, so that none is more than a device's patience or a software
 * driver's rounds. */
#include "render/soft/order.h"

#include <string.h>

#include "render/soft/models.h"

enum {
    sort_block = 2048,    // pairs that an invocation sorts at least
    sort_bits = 9,        // of a digit at most
    sort_blocks_max = 1024,
    digits_max = 2048,
    list_block = 64,
    list_blocks_least = 32, // that all cores have some
    blend_work = 1 << 25, // samples that are looked at in a dispatch
    walked_samples = 1    // that moving an item is worth
};

int spl_soft_add_work(struct spl_soft_order *order, uint64_t work, struct spl_error *err)
{
    return order->add_work ? order->add_work(order->context, work, err) : SPL_OK;
}

int spl_soft_run(struct spl_soft_order *order, struct spl_error *err)
{
    int rc = order->run ? order->run(order->context, err) : spl_gpu_run(order->gpu, err);
    order->steps = 0;
    return rc;
}

int spl_soft_put_step(struct spl_soft_order *order, const struct spl_soft_step *step, struct spl_gpu_binding *binding,
                      struct spl_error *err)
{
    struct spl_gpu_buffer *buffer = order->memory->buffers[SPL_SOFT_STEPS_OF];
    int rc = order->steps == SPL_SOFT_STEPS ? spl_soft_run(order, err) : SPL_OK;
    if (rc)
        return rc;
    *binding = (struct spl_gpu_binding){buffer, (uint64_t)order->steps++ * SPL_SOFT_STEP_STRIDE, SPL_SOFT_STEP_STRIDE};
    memcpy((char *)spl_gpu_buffer_map(buffer) + binding->offset, step, sizeof *step);
    return SPL_OK;
}

int spl_soft_dispatch(struct spl_soft_order *order, const struct spl_soft_dispatch *what, struct spl_error *err)
{
    struct spl_gpu_buffer *const *buffers = order->memory->buffers;
    struct spl_gpu_kernel *kernel;
    struct spl_gpu_binding step;
    int rc = spl_kernels_get(order->kernels, order->gpu, &what->key, &kernel, err);
    rc = rc ? rc : spl_soft_put_step(order, &what->step, &step, err);
    if (rc)
        return rc;
    struct spl_gpu_binding bindings[SPL_RESOURCE_COUNT] = {
        [SPL_RESOURCE_FRAME] = order->frame,
        [SPL_RESOURCE_DEPTH] = {.buffer = order->depth},
        [SPL_RESOURCE_STEP] = step,
        [SPL_RESOURCE_ITEMS] = {.buffer = buffers[SPL_SOFT_ITEMS]},
        [SPL_RESOURCE_SORT_FROM] = {.buffer = buffers[what->from]},
        [SPL_RESOURCE_SORT_TO] = {.buffer = buffers[what->to]},
        [SPL_RESOURCE_COUNTS] = {.buffer = buffers[SPL_SOFT_COUNTS]},
        [SPL_RESOURCE_TOTALS] = {.buffer = buffers[what->totals]},
        [SPL_RESOURCE_LISTS] = {.buffer = buffers[SPL_SOFT_LISTS]},
        [SPL_RESOURCE_SOFT] = {.buffer = buffers[SPL_SOFT_STATE]},
        [SPL_RESOURCE_WALKS] = {.buffer = buffers[SPL_SOFT_WALKS]},
        [SPL_RESOURCE_FOUND] = {.buffer = buffers[SPL_SOFT_FOUND]},
    };
    spl_gpu_dispatch(order->gpu, kernel, bindings, what->workgroups);
    return SPL_OK;
}

static uint32_t groups(uint64_t invocations, uint32_t size)
{
    return (uint32_t)((invocations + size - 1) / size);
}

static enum spl_soft_buffer other(enum spl_soft_buffer buffer)
{
    return buffer == SPL_SOFT_PAIRS ? SPL_SOFT_OTHERS : SPL_SOFT_PAIRS;
}

/* Counts are cleared, counted, and summed up by block. */
static int count(struct spl_soft_order *order, struct spl_soft_dispatch what, const char *name, struct spl_error *err)
{
    spl_gpu_fill(order->gpu, order->memory->buffers[SPL_SOFT_COUNTS], 0,
                 (uint64_t)what.step.blocks * what.step.digits * sizeof(uint32_t), 0);
    spl_gpu_barrier(order->gpu);
    what.key.name = name;
    int rc = spl_soft_dispatch(order, &what, err);
    spl_gpu_barrier(order->gpu);
    return rc;
}

static int scan(struct spl_soft_order *order, struct spl_soft_dispatch what, bool starts, struct spl_error *err)
{
    what.key = (struct spl_kernel_key){.name = "sort_scan"};
    what.workgroups = groups(what.step.digits, SPL_LANES);
    int rc = spl_soft_dispatch(order, &what, err);
    spl_gpu_barrier(order->gpu);
    if (rc || !starts)
        return rc;
    what.key.constants[0] = 1;
    what.workgroups = 1;
    rc = spl_soft_dispatch(order, &what, err);
    spl_gpu_barrier(order->gpu);
    return rc;
}

int spl_soft_sort(struct spl_soft_order *order, uint32_t items, uint32_t low, uint32_t high, struct spl_error *err)
{
    const uint32_t bits = high > low ? 32u - (uint32_t)__builtin_clz(high - low) : 0;
    const uint32_t passes = (bits + sort_bits - 1) / sort_bits;
    uint32_t block = groups(items, sort_blocks_max);
    block = block > sort_block ? block : sort_block;
    int rc = SPL_OK;
    order->sorted = SPL_SOFT_PAIRS;
    for (uint32_t pass = 0; pass < passes && !rc && items; pass++) {
        const uint32_t first = bits * pass / passes, end = bits * (pass + 1) / passes;
        struct spl_soft_dispatch what = {.key = {.name = "sort_move"},
                                         .step = {.count = items,
                                                  .block = block,
                                                  .blocks = groups(items, block),
                                                  .digits = 1u << (end - first),
                                                  .low = low,
                                                  .shift = first},
                                         .from = order->sorted,
                                         .to = other(order->sorted),
                                         .totals = SPL_SOFT_DIGITS};
        what.workgroups = groups(what.step.blocks, SPL_LANES);
        rc = spl_soft_add_work(order, (uint64_t)walked_samples * items, err);
        rc = rc ? rc : count(order, what, "sort_count", err);
        rc = rc ? rc : scan(order, what, true, err);
        rc = rc ? rc : spl_soft_dispatch(order, &what, err);
        spl_gpu_barrier(order->gpu);
        order->sorted = what.to;
    }
    return rc;
}

/* Where lists start; the sum of all, UINT64_MAX where it does not fit. */
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

int spl_soft_list(struct spl_soft_order *order, uint32_t items, uint32_t most, struct spl_error *err)
{
    const struct spl_soft_memory *memory = order->memory;
    const uint32_t tiles = order->columns * order->rows, room = memory->counters - 2 * memory->threads;
    order->entries = 0;
    if (!items)
        return SPL_OK;
    uint32_t threads = items / tiles > list_blocks_least ? items / tiles : list_blocks_least;
    threads = threads < memory->threads ? threads : memory->threads;
    threads = threads < room / tiles ? threads : room / tiles;
    uint32_t block = groups(items, threads);
    block = block > list_block ? block : list_block;
    struct spl_soft_dispatch what = {.step = {.count = items,
                                              .block = block,
                                              .blocks = groups(items, block),
                                              .digits = tiles,
                                              .columns = order->columns,
                                              .rects = memory->sizes.items * SPL_SOFT_ITEM_WORDS,
                                              .progress = room},
                                     .from = order->sorted,
                                     .to = other(order->sorted),
                                     .totals = SPL_SOFT_STARTS};
    what.workgroups = groups(what.step.blocks, SPL_LANES);
    spl_gpu_fill(order->gpu, memory->buffers[SPL_SOFT_COUNTS], 0,
                 (uint64_t)what.step.blocks * tiles * sizeof(uint32_t), 0);
    int rc = walk(order, &what, most, err);
    struct spl_soft_dispatch sums = what;
    sums.totals = SPL_SOFT_TOTALS;
    rc = rc ? rc : scan(order, sums, false, err);
    rc = rc ? rc : spl_soft_run(order, err);
    if (rc)
        return rc;
    uint64_t entries = lay_out(spl_gpu_buffer_map(memory->buffers[SPL_SOFT_TOTALS]),
                               spl_gpu_buffer_map(memory->buffers[SPL_SOFT_STARTS]), tiles);
    if (entries > memory->sizes.entries)
        return SPL_SOFT_CROWDED;
    order->entries = (uint32_t)entries;
    what.key.constants[0] = 1;
    return walk(order, &what, most, err);
}

int spl_soft_blend(struct spl_soft_order *order, const struct spl_soft_blend *blend, struct spl_error *err)
{
    enum { samples = SPL_SOFT_TILE * SPL_SOFT_TILE_ROWS, lanes = samples / SPL_SOFT_SAMPLES, tile_words = 3 };
    const struct spl_soft_memory *memory = order->memory;
    const uint32_t tiles = order->columns * order->rows;
    if (blend->model != SPL_SOFT_MODEL_EXPRESS)
        return spl_soft_walk(order, blend, err);
    const uint32_t *starts = spl_gpu_buffer_map(memory->buffers[SPL_SOFT_STARTS]);
    uint32_t *lists = spl_gpu_buffer_map(memory->buffers[SPL_SOFT_LISTS]);
    const uint32_t most = spl_gpu_get_limits(order->gpu)->workgroups * (SPL_WORKGROUP / lanes);
    const float scale = 65536;
    float fall[SPL_SOFT_FALLOFF];
    spl_soft_falloff(blend->opacity, fall);
    bool first = blend->first, left = order->entries > 0;
    int rc = SPL_OK;
    for (uint32_t round = 0; left && !rc; round++, first = false) {
        uint64_t skipped = (uint64_t)round * SPL_SOFT_ROUNDS;
        uint32_t listed = 0, begun = 0;
        uint64_t work = 0;
        left = false;
        if (round) /* the lists of the round before are being read */
            rc = spl_soft_run(order, err);
        for (uint32_t tile = 0; tile < tiles && !rc; tile++) {
            uint32_t end = tile + 1 < tiles ? starts[tile + 1] : order->entries, own = end - starts[tile];
            bool here = own > skipped;
            if (here) {
                uint32_t length = own - (uint32_t)skipped;
                left |= length > SPL_SOFT_ROUNDS;
                length = length < SPL_SOFT_ROUNDS ? length : SPL_SOFT_ROUNDS;
                lists[tile_words * listed] = tile % order->columns | tile / order->columns << 16;
                lists[tile_words * listed + 1] = starts[tile] + (uint32_t)skipped;
                lists[tile_words * listed + 2] = starts[tile] + (uint32_t)skipped + length;
                listed++;
                work += (uint64_t)length * samples;
            }
            if (listed == begun || (tile + 1 < tiles && work < blend_work && listed - begun < most))
                continue;
            struct spl_soft_dispatch what = {.key = {"soft_blend", order->wide, {blend->border, first, blend->thin}},
                                             .step = {.count = listed - begun,
                                                      .first = tile_words * begun,
                                                      .fall_0 = fall[0] * scale,
                                                      .fall_1 = fall[1] * scale,
                                                      .fall_2 = fall[2] * scale,
                                                      .fall_3 = fall[3] * scale,
                                                      .fall_4 = fall[4] * scale},
                                             .from = other(order->sorted),
                                             .workgroups = groups((uint64_t)(listed - begun) * lanes, SPL_WORKGROUP)};
            rc = spl_soft_add_work(order, work, err);
            rc = rc ? rc : spl_soft_dispatch(order, &what, err);
            begun = listed;
            work = 0;
        }
        spl_gpu_barrier(order->gpu);
    }
    return rc;
}
