/* Recording of sort and blending; see order.h, and list.c for the lists between them, of which the host knows how much
 * work each is, so that none is more than a device's patience or a software driver's rounds. */
#include "render/soft/order.h"

#include <string.h>

#include "render/soft/models.h"

enum {
    sort_block = 2048,    // pairs that an invocation sorts at least
    sort_bits = 9,        // of a digit at most
    sort_blocks_max = 1024,
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

enum spl_soft_buffer spl_soft_other(enum spl_soft_buffer buffer)
{
    static const enum spl_soft_buffer others[SPL_SOFT_BUFFERS] = {
        [SPL_SOFT_PAIRS] = SPL_SOFT_OTHERS,
        [SPL_SOFT_OTHERS] = SPL_SOFT_PAIRS,
        [SPL_SOFT_TILED] = SPL_SOFT_UNTILED,
        [SPL_SOFT_UNTILED] = SPL_SOFT_TILED,
    };
    return others[buffer];
}

uint32_t spl_soft_groups(const struct spl_soft_order *order, uint64_t invocations)
{
    return groups(invocations, order->memory->many ? SPL_WORKGROUP : SPL_LANES);
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

int spl_soft_scan(struct spl_soft_order *order, struct spl_soft_dispatch what, bool starts, struct spl_error *err)
{
    const bool many = order->memory->many;
    what.key = (struct spl_kernel_key){.name = many ? "sort_scan_many" : "sort_scan"};
    what.workgroups = many ? what.step.digits : groups(what.step.digits, SPL_LANES);
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

int spl_soft_sort_pairs(struct spl_soft_order *order, enum spl_soft_buffer *pairs, uint32_t count_of, uint32_t low,
                        uint32_t high, struct spl_error *err)
{
    const bool many = order->memory->many;
    const uint32_t digit = many ? SPL_SOFT_MANY_BITS : sort_bits;
    const uint32_t bits = high > low ? 32u - (uint32_t)__builtin_clz(high - low) : 0;
    const uint32_t passes = (bits + digit - 1) / digit;
    uint32_t block = groups(count_of, sort_blocks_max);
    block = many ? SPL_SOFT_MANY_BLOCK : block > sort_block ? block : sort_block;
    int rc = SPL_OK;
    for (uint32_t pass = 0; pass < passes && !rc && count_of; pass++) {
        const uint32_t first = bits * pass / passes, end = bits * (pass + 1) / passes;
        struct spl_soft_dispatch what = {.key = {.name = many ? "sort_move_many" : "sort_move"},
                                         .step = {.count = count_of,
                                                  .block = block,
                                                  .blocks = groups(count_of, block),
                                                  .digits = 1u << (end - first),
                                                  .low = low,
                                                  .shift = first},
                                         .from = *pairs,
                                         .to = spl_soft_other(*pairs),
                                         .totals = SPL_SOFT_DIGITS};
        what.workgroups = spl_soft_groups(order, what.step.blocks);
        rc = spl_soft_add_work(order, (uint64_t)walked_samples * count_of, err);
        rc = rc ? rc : count(order, what, many ? "sort_count_many" : "sort_count", err);
        rc = rc ? rc : spl_soft_scan(order, what, true, err);
        rc = rc ? rc : spl_soft_dispatch(order, &what, err);
        spl_gpu_barrier(order->gpu);
        *pairs = what.to;
    }
    return rc;
}

int spl_soft_sort(struct spl_soft_order *order, uint32_t items, uint32_t low, uint32_t high, struct spl_error *err)
{
    order->sorted = SPL_SOFT_PAIRS;
    return spl_soft_sort_pairs(order, &order->sorted, items, low, high, err);
}

int spl_soft_blend(struct spl_soft_order *order, const struct spl_soft_blend *blend, struct spl_error *err)
{
    enum { samples = SPL_SOFT_TILE * SPL_SOFT_TILE_ROWS, lanes = samples / SPL_SOFT_SAMPLES, tile_words = 3 };
    const struct spl_soft_memory *memory = order->memory;
    const uint32_t tiles = order->columns * order->rows;
    if (blend->model != SPL_SOFT_MODEL_EXPRESS)
        return spl_soft_walk(order, blend, err);
    const uint32_t *starts = order->starts;
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
                                             .from = spl_soft_other(order->sorted),
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
