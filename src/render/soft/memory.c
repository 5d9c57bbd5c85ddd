/* Device memory of soft transparency; see order.h. Sizes follow from how many items and entries are held at once; the
 * counters are as many as keep every invocation a table of its own. Belongs to the renderer's thread. */
#include "render/soft/order.h"
#include "render/soft/plan.h"

/* Invocations that walk blocks: a software driver has few cores, and each has a counter for every tile. */
enum { threads = 128, kept = 1024, tables_at_least = 16 };
enum { digits_max = 2048, sort_threads = 1024 };

static uint64_t counters_of(const struct spl_soft_sizes *sizes, bool software)
{
    const uint64_t sort = (uint64_t)digits_max * sort_threads, few = (uint64_t)tables_at_least * sizes->tiles;
    const uint64_t sorted = sizes->items > sizes->entries ? sizes->items : sizes->entries;
    const uint64_t many = software ? 0 : (sorted / SPL_SOFT_MANY_BLOCK + 1) << SPL_SOFT_MANY_BITS;
    uint64_t all = (uint64_t)threads * sizes->tiles;
    const uint64_t most = few > 4 * sort ? few : 4 * sort;
    all = all < most ? all : most;
    all = (all > sort ? all : sort) + 2 * (uint64_t)kept;
    return all > many ? all : many;
}

static void sizes_of(const struct spl_soft_sizes *sizes, bool software, uint64_t bytes[SPL_SOFT_BUFFERS])
{
    const uint64_t word = sizeof(uint32_t);
    const uint64_t pairs = 2 * (uint64_t)sizes->items, list = pairs > sizes->entries ? pairs : sizes->entries;
    const uint64_t item = SPL_SOFT_ITEM_WORDS + 1 + (sizes->found ? SPL_SOFT_DETAIL_WORDS : 0);
    bytes[SPL_SOFT_ITEMS] = word * item * sizes->items;
    bytes[SPL_SOFT_PAIRS] = bytes[SPL_SOFT_OTHERS] = word * list;
    bytes[SPL_SOFT_TILED] = bytes[SPL_SOFT_UNTILED] = software ? 0 : 2 * word * sizes->entries;
    bytes[SPL_SOFT_COUNTS] = word * counters_of(sizes, software);
    const uint64_t slots = sizes->slots, buckets = 2 * (uint64_t)SPL_SOFT_BUCKETS;
    bytes[SPL_SOFT_SLOTS] = word * (SPL_SOFT_SLOT_WORDS * slots > buckets ? SPL_SOFT_SLOT_WORDS * slots : buckets);
    bytes[SPL_SOFT_TOLD] = software ? 0 : bytes[SPL_SOFT_SLOTS];
    bytes[SPL_SOFT_FIRSTS] = word * (slots ? slots : 1);
    bytes[SPL_SOFT_DIGITS] = word * digits_max;
    bytes[SPL_SOFT_TOTALS] = bytes[SPL_SOFT_STARTS] = word * sizes->tiles;
    bytes[SPL_SOFT_LISTS] = 3 * word * sizes->tiles;
    bytes[SPL_SOFT_STEPS_OF] = (uint64_t)SPL_SOFT_STEP_STRIDE * SPL_SOFT_STEPS;
    bytes[SPL_SOFT_STATE] = SPL_SOFT_STATE_WORDS * word * sizes->samples;
    bytes[SPL_SOFT_WALKS] = sizes->walks ? SPL_SOFT_WALK_WORDS * word * sizes->samples : word;
    bytes[SPL_SOFT_FOUND] = SPL_SOFT_FOUND_WORDS * word * sizes->found;
}

uint64_t spl_soft_memory_bytes(const struct spl_soft_sizes *sizes, bool software)
{
    uint64_t bytes[SPL_SOFT_BUFFERS], sum = 0;
    sizes_of(sizes, software, bytes);
    for (int i = 0; i < SPL_SOFT_BUFFERS; i++)
        sum += (bytes[i] + 15) / 16 * 16;
    return sum;
}

int spl_soft_memory_init(struct spl_soft_memory *memory, const struct spl_soft_sizes *sizes, bool software,
                         spl_soft_make *make, void *context, struct spl_gpu *gpu, struct spl_error *err)
{
    static const enum spl_gpu_buffer_kind kinds[SPL_SOFT_BUFFERS] = {
        [SPL_SOFT_SLOTS] = SPL_GPU_READBACK,
        [SPL_SOFT_FIRSTS] = SPL_GPU_UPLOAD,
        [SPL_SOFT_TOTALS] = SPL_GPU_READBACK,
        [SPL_SOFT_STARTS] = SPL_GPU_UPLOAD,
        [SPL_SOFT_LISTS] = SPL_GPU_UPLOAD,
        [SPL_SOFT_STEPS_OF] = SPL_GPU_UPLOAD,
    };
    uint64_t bytes[SPL_SOFT_BUFFERS];
    sizes_of(sizes, software, bytes);
    *memory = (struct spl_soft_memory){.sizes = *sizes,
                                       .many = !software,
                                       .counters = (uint32_t)counters_of(sizes, software),
                                       .threads = threads};
    for (int i = 0; i < SPL_SOFT_BUFFERS; i++) {
        int rc = !bytes[i] ? SPL_OK : make(context, kinds[i], bytes[i], &memory->buffers[i], err);
        if (rc) {
            memory->buffers[i] = NULL;
            spl_soft_memory_finish(memory, gpu);
            return rc;
        }
    }
    return SPL_OK;
}

void spl_soft_memory_finish(struct spl_soft_memory *memory, struct spl_gpu *gpu)
{
    for (int i = 0; i < SPL_SOFT_BUFFERS; i++)
        spl_gpu_buffer_destroy(gpu, memory->buffers[i]);
    *memory = (struct spl_soft_memory){0};
}
