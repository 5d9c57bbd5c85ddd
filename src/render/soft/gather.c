/* Gathering of soft spheres; see gather.h and shaders/soft_gather.comp. Slots tell the host how many they have, and the
 * host tells each where its own go, in the order of ids: so that order is the same however many walk at once. Belongs
 * to the renderer's thread. */
#include "render/soft/gather.h"

#include <string.h>

#include "render/frame.h"

enum phase { COUNT_SLOTS, COUNT_BUCKETS, GATHER };

static struct spl_soft_step window_step(const struct spl_soft_gathering *from, const struct spl_soft_range *window)
{
    return (struct spl_soft_step){.low = (uint32_t)(window->first >> 32),
                                  .low_slot = (uint32_t)window->first,
                                  .high = (uint32_t)(window->end >> 32),
                                  .high_slot = (uint32_t)window->end,
                                  .columns = from->order->columns,
                                  .rects = from->order->memory->sizes.items * SPL_SOFT_ITEM_WORDS,
                                  .details = from->order->memory->sizes.items * (SPL_SOFT_ITEM_WORDS + 1)};
}

/* Records the gathering kernel in one of its phases. */
static int gather(const struct spl_soft_gathering *from, enum phase phase, const struct spl_soft_step *step,
                  struct spl_error *err)
{
    static const struct {
        enum spl_chunk_kind kind;
        const char *name;
        uint32_t lanes;
    } kinds[] = {{SPL_CHUNK_DISCS, "soft_gather", SPL_LANES},
                 {SPL_CHUNK_PANELS, "soft_gather_cells", SPL_CELL_DISC_LANES},
                 {SPL_CHUNK_MESHES, "soft_gather_mesh_cells", SPL_CELL_DISC_LANES}};
    struct spl_soft_order *order = from->order;
    struct spl_gpu_buffer *const *buffers = order->memory->buffers;
    struct spl_gpu_binding with[SPL_RESOURCE_COUNT] = {
        [SPL_RESOURCE_SLOTS] = {.buffer = buffers[order->memory->many ? SPL_SOFT_TOLD : SPL_SOFT_SLOTS]},
        [SPL_RESOURCE_STARTS] = {.buffer = buffers[SPL_SOFT_FIRSTS]},
        [SPL_RESOURCE_ITEMS] = {.buffer = buffers[SPL_SOFT_ITEMS]},
        [SPL_RESOURCE_SORT_TO] = {.buffer = buffers[SPL_SOFT_PAIRS]},
    };
    const bool surface = spl_dataset_get_info(from->tile->resident->dataset)->has_surface;
    const uint32_t details = phase == GATHER && from->details ? surface ? 1 : 2 : 0;
    const uint32_t paint = spl_tile_get_paint(from->tile, SPL_SUMS_COLOR);
    int rc = spl_soft_put_step(order, step, &with[SPL_RESOURCE_STEP], err);
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds && !rc; i++) {
        struct spl_disc_kernels kernels;
        const struct spl_dispatch what = {.phases = SPL_PHASE_BOTH,
                                          .kind = kinds[i].kind,
                                          .lanes = kinds[i].lanes,
                                          .role = SPL_ROLE_SOFT,
                                          .with = with};
        const struct spl_kernel_key key = {
            kinds[i].name, false, {phase, details, [SPL_CONSTANT_PAINT] = phase == GATHER ? paint : SPL_PAINT_NONE}};
        rc = spl_tile_get_plain_kernels(from->tile, key, &what, &kernels, err);
        rc = rc ? rc : spl_tile_dispatch_splats(from->tile, &kernels, &what, err);
    }
    spl_gpu_barrier(order->gpu);
    return rc;
}

/* Counts into zeroes, and lets the host have them: the first `bytes`. */
static int count(const struct spl_soft_gathering *from, enum phase phase, const struct spl_soft_step *step,
                 uint64_t bytes, struct spl_error *err)
{
    struct spl_soft_order *order = from->order;
    struct spl_gpu_buffer *const *buffers = order->memory->buffers;
    const bool many = order->memory->many;
    spl_gpu_fill(order->gpu, buffers[many ? SPL_SOFT_TOLD : SPL_SOFT_SLOTS], 0, bytes, 0);
    spl_gpu_barrier(order->gpu);
    int rc = gather(from, phase, step, err);
    if (!rc && many)
        spl_gpu_copy(order->gpu, buffers[SPL_SOFT_TOLD], 0, buffers[SPL_SOFT_SLOTS], 0, bytes);
    return rc ? rc : spl_soft_run(order, err);
}

static uint32_t larger(uint32_t a, uint32_t b)
{
    return a > b ? a : b;
}

/* What the slots have; says where the first items of each go. */
static struct spl_soft_counted sum_slots(const struct spl_soft_gathering *from)
{
    struct spl_gpu_buffer *const *buffers = from->order->memory->buffers;
    const uint32_t *words = spl_gpu_buffer_map(buffers[SPL_SOFT_SLOTS]);
    uint32_t *firsts = spl_gpu_buffer_map(buffers[SPL_SOFT_FIRSTS]);
    struct spl_soft_counted sum = {.low = UINT32_MAX};
    uint32_t reach = 0;
    for (uint32_t i = 0; i < from->slots; i++, words += SPL_SOFT_SLOT_WORDS) {
        const uint32_t most = words[0] >> 4 & 0x7ff;
        firsts[i] = (uint32_t)sum.items;
        if (!words[0])
            continue;
        sum.items += words[0] & 15;
        sum.entries += words[0] >> 16;
        sum.most = larger(sum.most, most);
        sum.low = words[1] < sum.low ? words[1] : sum.low;
        sum.high = larger(sum.high, words[2]);
        reach = larger(reach, words[3]);
        sum.thin |= (words[0] & SPL_SOFT_SLOT_THIN) != 0;
    }
    memcpy(&sum.reach, &reach, sizeof reach);
    return sum;
}

int spl_soft_count(const struct spl_soft_gathering *from, const struct spl_soft_range *window,
                   struct spl_soft_counted *sum, struct spl_error *err)
{
    const struct spl_soft_step step = window_step(from, window);
    /* of chunks that are hidden nothing is counted: what another tile left there would be drawn */
    int rc = count(from, COUNT_SLOTS, &step, (uint64_t)from->slots * SPL_SOFT_SLOT_WORDS * sizeof(uint32_t), err);
    if (!rc)
        *sum = sum_slots(from);
    return rc;
}

int spl_soft_measure(void *context, const struct spl_soft_range *range, uint32_t shift, struct spl_soft_sum *sums,
                     struct spl_error *err)
{
    const struct spl_soft_gathering *from = context;
    struct spl_gpu_buffer *buffer = from->order->memory->buffers[SPL_SOFT_SLOTS];
    struct spl_soft_step step = window_step(from, range);
    step.digits = shift < 32;
    step.shift = shift < 32 ? shift : shift - 32;
    int rc = count(from, COUNT_BUCKETS, &step, SPL_SOFT_BUCKETS * sizeof *sums, err);
    if (!rc)
        memcpy(sums, spl_gpu_buffer_map(buffer), SPL_SOFT_BUCKETS * sizeof *sums);
    return rc;
}

int spl_soft_gather(const struct spl_soft_gathering *from, const struct spl_soft_range *window, struct spl_error *err)
{
    const struct spl_soft_step step = window_step(from, window);
    return gather(from, GATHER, &step, err);
}
