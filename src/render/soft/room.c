/* Room for the soft stage; see pass.h. Slots for all of a list's soft splats, which an invocation each walks, and as
 * many items and entries of lists as there may be and as fit: memory for them is taken at its first use, at most an
 * eighth of what the device may give, and kept for the frames after. What does not fit at once is drawn in windows of
 * depth, so only what every window needs is refused. Belongs to the renderer's thread. */
#include "render/soft/pass.h"

#include <inttypes.h>

#include "render/soft/gather.h"
#include "render/soft/of.h"

enum {
    items_at_least = 1 << 14,
    entries_of_item = 4, // room for lists
    entries_of_window = 1 << 24,
    memory_share = 8
};

uint32_t spl_soft_slots_of(const struct spl_draw_list *list, size_t chunk)
{
    const uint32_t count = list->chunks[chunk].count & ((1u << SPL_COUNT_BITS) - 1);
    if (spl_kind_has_panels(list->key_of_chunk[chunk].kind))
        return count * (SPL_PANEL_SIDE * SPL_PANEL_SIDE / SPL_SOFT_SLOT_CELLS);
    return (count + SPL_RUN_SPLATS - 1) / SPL_RUN_SPLATS * SPL_LANES;
}

/* Tells the soft chunks, which lie by rising ids, their first slots; returns how many there are. */
static uint64_t lay_out_slots(struct spl_draw_list *list)
{
    uint64_t slots = 0;
    for (size_t i = list->first_soft_chunk; i < list->first_mark_chunk; i++) {
        list->chunks[i].texture = (uint32_t)slots;
        slots += spl_soft_slots_of(list, i);
    }
    return slots;
}

static int make_buffer(void *context, enum spl_gpu_buffer_kind kind, uint64_t bytes, struct spl_gpu_buffer **out,
                       struct spl_error *err)
{
    return spl_residency_make_buffer(context, kind, bytes, out, err);
}

static uint32_t larger(uint32_t a, uint32_t b)
{
    return a > b ? a : b;
}

/* So that views that grow little by little do not take memory anew each time. */
static uint32_t rounded_up(uint64_t slots, uint64_t most)
{
    uint64_t power = 1 << 12;
    while (power < slots)
        power *= 2;
    return (uint32_t)(power < most ? power : slots);
}

/* Items, and lists for them, as many as there may be and as fit in `bytes` and in a binding. */
static void choose_items(struct spl_soft_sizes *sizes, uint64_t wanted, uint64_t bytes, uint64_t binding, bool software)
{
    uint64_t items = items_at_least;
    while (items < wanted)
        items *= 2;
    for (;; items /= 2) {
        sizes->items = (uint32_t)items;
        sizes->entries = (uint32_t)(items * entries_of_item);
        uint64_t largest = items * (SPL_SOFT_ITEM_WORDS + 1 + SPL_SOFT_DETAIL_WORDS) * sizeof(uint32_t);
        if (items <= items_at_least || (largest <= binding && spl_soft_memory_bytes(sizes, software) <= bytes))
            return;
    }
}

/* Models whose windows overlap get longer lists where there is room: near spheres are in many tiles. */
static void choose_entries(struct spl_soft_sizes *sizes, uint64_t bytes, uint64_t binding, bool software)
{
    while (sizes->entries < entries_of_window) {
        struct spl_soft_sizes more = *sizes;
        more.entries *= 2;
        if (2 * (uint64_t)more.entries * sizeof(uint32_t) > binding || spl_soft_memory_bytes(&more, software) > bytes)
            return;
        *sizes = more;
    }
}

int spl_soft_prepare(struct spl_renderer *renderer, const struct spl_camera *camera, const struct spl_view *view,
                     struct spl_error *err)
{
    struct spl_scratch *scratch = &renderer->scratch;
    struct spl_soft_memory *memory = &scratch->soft;
    struct spl_draw_list *list = &renderer->list;
    const struct spl_gpu_limits *limits = spl_gpu_get_limits(renderer->gpu);
    const bool software = spl_gpu_get_device(renderer->gpu)->software;
    const uint64_t slots = lay_out_slots(list), columns = SPL_SOFT_TILE, rows = SPL_SOFT_TILE_ROWS;
    if (list->first_soft_chunk == list->first_mark_chunk)
        return SPL_OK;
    if (slots * SPL_SOFT_SLOT_WORDS * sizeof(uint32_t) > limits->binding_bytes)
        return spl_fail_field(err, SPL_E_LIMIT, "lod", "this view has more soft splats than it can sort; raise lod");
    const struct spl_soft_sizes *have = &memory->sizes;
    const uint64_t slots_most = limits->binding_bytes / (SPL_SOFT_SLOT_WORDS * sizeof(uint32_t));
    struct spl_soft_sizes sizes = {.slots = larger(rounded_up(slots, slots_most), have->slots),
                                   .tiles = (uint32_t)((camera->width + columns - 1) / columns *
                                                       ((camera->height + rows - 1) / rows)),
                                   .samples = (uint64_t)camera->width * camera->height};
    sizes.tiles = larger(sizes.tiles, have->tiles);
    sizes.walks = view->soft.model != SPL_SOFT_MODEL_EXPRESS || have->walks;
    sizes.samples = sizes.samples > have->samples ? sizes.samples : have->samples;
    sizes.found = spl_soft_is_found(view) || have->found ? sizes.samples : 0;
    uint64_t own = scratch->soft_bytes, kept = scratch->taken_bytes - own;
    kept += spl_residency_get_reserve(&renderer->residency);
    const uint64_t left = limits->memory_bytes > kept ? limits->memory_bytes - kept : 0;
    uint64_t share = limits->memory_bytes / memory_share;
    share = share < left ? share : left;
    if (renderer->soft_items_most) {
        sizes.items = larger(renderer->soft_items_most, SPL_SOFT_SLOT_CELLS);
        sizes.entries =
            larger(sizes.items * entries_of_item, SPL_SOFT_SLOT_CELLS * SPL_SOFT_SPAN_MAX * SPL_SOFT_SPAN_MAX);
    } else {
        choose_items(&sizes, slots * SPL_SOFT_SLOT_SPLATS, share, limits->binding_bytes, software);
        if (view->soft.model != SPL_SOFT_MODEL_EXPRESS || !software) // a window costs a GPU more than memory does
            choose_entries(&sizes, share, limits->binding_bytes, software);
    }
    const bool exact = renderer->soft_items_most > 0;
    const bool enough = exact ? sizes.items == have->items && sizes.entries == have->entries
                              : sizes.items <= have->items && sizes.entries <= have->entries;
    if (enough && sizes.slots == have->slots && sizes.tiles == have->tiles && sizes.samples == have->samples &&
        sizes.walks == have->walks && sizes.found == have->found)
        return SPL_OK;
    const uint64_t bytes = spl_soft_memory_bytes(&sizes, software);
    if (bytes > left) /* nothing that the view says alone: no field */
        return spl_fail(err, SPL_E_LIMIT,
                        "soft spheres take at least %" PRIu64
                        " bytes of working memory in this view; of memory-limit, %" PRIu64 ", %" PRIu64
                        " are left beside the rest and the largest dataset's first page; a smaller "
                        "image or a higher lod takes less, or the service needs a memory-limit of %" PRIu64,
                        bytes, limits->memory_bytes, left, limits->memory_bytes + (bytes - left));
    spl_soft_memory_finish(memory, renderer->gpu);
    scratch->taken_bytes -= own;
    scratch->soft_bytes = 0;
    int rc = spl_soft_memory_init(memory, &sizes, software, make_buffer, &renderer->residency, renderer->gpu, err);
    if (rc)
        return rc;
    scratch->soft_bytes = bytes;
    scratch->taken_bytes += bytes;
    return SPL_OK;
}
