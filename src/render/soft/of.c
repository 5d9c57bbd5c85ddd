/* Recording of what is found of soft spheres; see of.h and shaders/soft_of.comp. Lists are walked as they are blended:
 * at most so much of each in a dispatch as a software driver's loop has rounds for, then on from there; what was hidden
 * so far stays with the sample. */
#include "render/soft/of.h"

#include "render/soft/models.h"

enum {
    samples = SPL_SOFT_TILE * SPL_SOFT_TILE_ROWS,
    tile_words = 3,
    find_work = 1 << 25, // samples that are looked at in a dispatch
    dense_work = 4       // of a sphere with a density, in such samples
};

_Static_assert(SPL_SOFT_FIND_SHELLS >= 3 * SPL_SOFT_SHELLS_MAX + 1, "three integrals of an item, and the item");

bool spl_soft_is_found(const struct spl_view *view)
{
    const uint32_t blended = 1u << SPL_LAYER_COLOR | 1u << SPL_LAYER_COVERAGE;
    return view->soft.of != SPL_SOFT_OF_SOLID && view->soft.what.count && view->soft.opacity > 0 &&
           view->layers & ~blended;
}

static uint32_t kernel_of(const struct spl_soft_params *soft)
{
    static const uint32_t dense[SPL_SOFT_MODEL_COUNT] = {[SPL_SOFT_MODEL_BASE] = SPL_SOFT_BASE,
                                                         [SPL_SOFT_MODEL_CONCENTRIC] = SPL_SOFT_CONCENTRIC,
                                                         [SPL_SOFT_MODEL_LAYER] = SPL_SOFT_LAYER};
    if (soft->of == SPL_SOFT_OF_FIRST && soft->model != SPL_SOFT_MODEL_LAYER)
        return SPL_SOFT_FIND_FIRST;
    return soft->model == SPL_SOFT_MODEL_EXPRESS ? SPL_SOFT_FIND_MEDIAN : SPL_SOFT_FIND_DENSE + dense[soft->model];
}

/* What is looked for, and the depth that it is looked for from. */
struct look {
    const struct spl_soft_params *soft;
    uint32_t from, kernel;
    bool thin;
};

/* Tiles [first, end) of the lists. */
static int dispatch(struct spl_soft_order *order, const struct look *look, uint32_t first, uint32_t end,
                    struct spl_error *err)
{
    const struct spl_soft_params *soft = look->soft;
    const float scale = 65536;
    float fall[SPL_SOFT_FALLOFF];
    spl_soft_falloff(soft->opacity, fall);
    return spl_soft_dispatch(
        order,
        &(struct spl_soft_dispatch){
            .key = {"soft_of", order->wide, {look->kernel, soft->blend > 0, look->thin}},
            .step = {.count = end - first,
                     .first = tile_words * first,
                     .details = order->memory->sizes.items * (SPL_SOFT_ITEM_WORDS + 1),
                     .low = soft->of == SPL_SOFT_OF_FIRST ? SPL_SOFT_DEPTH_SEEN : SPL_SOFT_DEPTH_HALF,
                     .high = look->from,
                     .depth = (float)spl_soft_depth(soft->opacity),
                     .thin = (float)spl_soft_thin(soft->opacity),
                     .fall_0 = fall[0] * scale,
                     .fall_1 = fall[1] * scale,
                     .fall_2 = fall[2] * scale,
                     .fall_3 = fall[3] * scale,
                     .fall_4 = fall[4] * scale},
            .from = spl_soft_other(order->sorted),
            .to = order->sorted,
            .totals = SPL_SOFT_TOTALS,
            .workgroups = (uint32_t)(((uint64_t)(end - first) * samples + SPL_WORKGROUP - 1) / SPL_WORKGROUP)},
        err);
}

/* Walks `rounds` of each list from `skipped` on; *left: some are longer. */
static int walk(struct spl_soft_order *order, const struct look *look, uint64_t skipped, uint32_t rounds, bool *left,
                struct spl_error *err)
{
    const uint32_t tiles = order->columns * order->rows;
    const uint32_t work_of_item = look->kernel < SPL_SOFT_FIND_DENSE ? 1 : dense_work;
    const uint32_t most = spl_gpu_get_limits(order->gpu)->workgroups * (SPL_WORKGROUP / samples);
    const uint32_t *starts = order->starts;
    uint32_t *lists = spl_gpu_buffer_map(order->memory->buffers[SPL_SOFT_LISTS]), listed = 0, begun = 0;
    uint64_t work = 0;
    int rc = SPL_OK;
    *left = false;
    for (uint32_t tile = 0; tile < tiles && !rc; tile++) {
        const uint32_t end = tile + 1 < tiles ? starts[tile + 1] : order->entries;
        if (end - starts[tile] > skipped) {
            const uint32_t from = starts[tile] + (uint32_t)skipped, length = end - from;
            const uint32_t own = length < rounds ? length : rounds;
            *left |= length > rounds;
            lists[tile_words * listed] = tile % order->columns | tile / order->columns << 16;
            lists[tile_words * listed + 1] = from;
            lists[tile_words * listed + 2] = from + own;
            listed++;
            work += (uint64_t)own * samples * work_of_item;
        }
        if (listed == begun || (tile + 1 < tiles && work < find_work && listed - begun < most))
            continue;
        rc = spl_soft_add_work(order, work, err);
        rc = rc ? rc : dispatch(order, look, begun, listed, err);
        begun = listed;
        work = 0;
    }
    spl_gpu_barrier(order->gpu);
    return rc;
}

int spl_soft_find(struct spl_soft_order *order, const struct spl_soft_params *soft, uint32_t from,
                  bool thin, struct spl_error *err)
{
    const struct look look = {soft, from, kernel_of(soft), thin};
    const bool shells = look.kernel == SPL_SOFT_FIND_DENSE + SPL_SOFT_CONCENTRIC;
    const uint32_t rounds = SPL_SOFT_ROUNDS / (shells ? SPL_SOFT_FIND_SHELLS : 1);
    bool left = order->entries > 0;
    int rc = SPL_OK;
    for (uint64_t skipped = 0; left && !rc; skipped += rounds) {
        rc = spl_soft_run(order, err); /* what was recorded reads the lists that lie there */
        rc = rc ? rc : walk(order, &look, skipped, rounds, &left, err);
    }
    return rc ? rc : spl_soft_run(order, err); /* the lists may be laid out anew */
}
