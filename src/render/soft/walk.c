/* Recording of models base, concentric and layer; see order.h and shaders/soft_base.comp. An invocation walks the whole
 * list of its tile, again and again; one that takes more rounds than a kernel may goes on in the next run, where it
 * was. Tiles are laid out in groups, a dispatch each, with a word that says whether any was left and what each
 * invocation keeps. A run is bounded however long lists are, and between runs the host asks whether anybody still
 * waits. */
#include "render/soft/order.h"

#include "render/soft/models.h"

enum {
    samples = SPL_SOFT_TILE * SPL_SOFT_TILE_ROWS,
    tile_words = 3,
    kept_words = samples * SPL_SOFT_KEPT_WORDS,
    groups_max = 256,      // of a batch
    group_work = 1 << 25,  // samples that are looked at in a dispatch
    round_work = 4         // of a round, in such samples
};

struct group {
    uint32_t first, count; // tiles of the lists
    uint32_t progress;     // word of the counters
    uint64_t work;         // of a run at most
    bool done;
};

struct batch {
    uint32_t count, words; // groups; counters
    struct group groups[groups_max];
};

/* A walk is an event, of which every sphere has two. */
static uint64_t work_of(const struct spl_soft_blend *blend, uint64_t length)
{
    uint64_t rounds = blend->model == SPL_SOFT_MODEL_LAYER ? length + 1 : 2 * (length + 1) * length;
    return (rounds < SPL_SOFT_ROUNDS ? rounds : SPL_SOFT_ROUNDS) * samples * round_work;
}

/* The last of layer: what was seen of tiles that have nothing more is shown, too. */
static bool shows_all(const struct spl_soft_blend *blend)
{
    return blend->model == SPL_SOFT_MODEL_LAYER && blend->ends;
}

/* Lists tiles from `tile` on; returns the first that did not fit. */
static uint32_t lay_out(const struct spl_soft_order *order, const struct spl_soft_blend *blend, uint32_t tile,
                        struct batch *batch)
{
    const struct spl_soft_memory *memory = order->memory;
    const uint32_t tiles = order->columns * order->rows;
    const uint32_t most = spl_gpu_get_limits(order->gpu)->workgroups / (samples / SPL_WORKGROUP + 1);
    const uint32_t *starts = order->starts;
    uint32_t *lists = spl_gpu_buffer_map(memory->buffers[SPL_SOFT_LISTS]), listed = 0;
    struct group *group = NULL;
    batch->count = batch->words = 0;
    for (; tile < tiles; tile++) {
        const uint32_t first = order->entries ? starts[tile] : 0;
        const uint32_t end = order->entries && tile + 1 < tiles ? starts[tile + 1] : order->entries;
        const uint64_t work = work_of(blend, end - first);
        if (end == first && !shows_all(blend))
            continue;
        if (batch->words + 1 + kept_words > memory->counters)
            break;
        if (!group || group->work + work > group_work || group->count == most) {
            if (batch->count == groups_max)
                break;
            group = &batch->groups[batch->count++];
            *group = (struct group){.first = listed, .progress = batch->words++};
        }
        lists[tile_words * listed] = tile % order->columns | tile / order->columns << 16;
        lists[tile_words * listed + 1] = first;
        lists[tile_words * listed + 2] = end;
        listed++;
        group->count++;
        group->work += work;
        batch->words += kept_words;
    }
    return tile;
}

static int dispatch(struct spl_soft_order *order, const struct spl_soft_blend *blend, const struct group *group,
                    struct spl_error *err)
{
    static const uint32_t models[SPL_SOFT_MODEL_COUNT] = {[SPL_SOFT_MODEL_BASE] = SPL_SOFT_BASE,
                                                          [SPL_SOFT_MODEL_CONCENTRIC] = SPL_SOFT_CONCENTRIC,
                                                          [SPL_SOFT_MODEL_LAYER] = SPL_SOFT_LAYER};
    const enum spl_soft_buffer lists = spl_soft_other(order->sorted);
    const struct spl_soft_dispatch what = {
        .key = {"soft_base", order->wide, {models[blend->model], blend->border, blend->thin}},
        .step = {.count = group->count,
                 .first = tile_words * group->first,
                 .progress = group->progress,
                 .depth = (float)spl_soft_depth(blend->opacity),
                 .reach = blend->reach,
                 .thin = (float)spl_soft_thin(blend->opacity),
                 .until = blend->until,
                 .ends = blend->ends},
        .from = lists,
        .to = order->sorted,
        .totals = SPL_SOFT_TOTALS,
        .workgroups = (uint32_t)(((uint64_t)group->count * samples + SPL_WORKGROUP - 1) / SPL_WORKGROUP)};
    int rc = spl_soft_add_work(order, group->work, err);
    return rc ? rc : spl_soft_dispatch(order, &what, err);
}

/* Runs the groups that are not done, once. */
static int run(struct spl_soft_order *order, const struct spl_soft_blend *blend, struct batch *batch,
               struct spl_error *err)
{
    struct spl_gpu_buffer *const *buffers = order->memory->buffers;
    const uint64_t word = sizeof(uint32_t);
    int rc = SPL_OK;
    spl_gpu_barrier(order->gpu);
    for (uint32_t i = 0; i < batch->count && !rc; i++)
        if (!batch->groups[i].done)
            rc = dispatch(order, blend, &batch->groups[i], err);
    spl_gpu_barrier(order->gpu);
    for (uint32_t i = 0; i < batch->count && !rc; i++)
        spl_gpu_copy(order->gpu, buffers[SPL_SOFT_COUNTS], word * batch->groups[i].progress, buffers[SPL_SOFT_TOTALS],
                     word * i, word);
    rc = rc ? rc : spl_soft_run(order, err);
    if (rc)
        return rc;
    const uint32_t *left = spl_gpu_buffer_map(buffers[SPL_SOFT_TOTALS]);
    for (uint32_t i = 0; i < batch->count; i++)
        batch->groups[i].done = !left[i];
    return SPL_OK;
}

int spl_soft_walk(struct spl_soft_order *order, const struct spl_soft_blend *blend, struct spl_error *err)
{
    const uint32_t tiles = order->columns * order->rows;
    struct spl_gpu_buffer *counts = order->memory->buffers[SPL_SOFT_COUNTS];
    struct batch batch;
    int rc = SPL_OK;
    for (uint32_t tile = 0; tile < tiles && (order->entries || shows_all(blend)) && !rc;) {
        tile = lay_out(order, blend, tile, &batch);
        if (!batch.count)
            break;
        spl_gpu_fill(order->gpu, counts, 0, batch.words * sizeof(uint32_t), 0);
        for (bool left = true; left && !rc;) {
            rc = run(order, blend, &batch, err);
            left = false;
            for (uint32_t i = 0; i < batch.count && !rc; i++) {
                if (!batch.groups[i].done)
                    spl_gpu_fill(order->gpu, counts, batch.groups[i].progress * sizeof(uint32_t), sizeof(uint32_t), 0);
                left |= !batch.groups[i].done;
            }
        }
    }
    return rc;
}
