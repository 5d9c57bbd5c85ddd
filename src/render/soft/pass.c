/* The soft stage of a tile; see pass.h. Memory for it is taken at its first use, at most an eighth of what the device may
 * give: more spheres than fit are drawn a window of depth after the other, which changes no byte; of models that cut
 * spheres, windows overlap. Where too many overlap even so, the tile is to be cut. The host waits for counts and for the lengths of lists; in between it asks whether anybody still waits for the frame. */
#include "render/soft/pass.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/work.h"
#include "render/frame.h"
#include "render/method.h"
#include "render/soft/of.h"
#include "render/soft/thick.h"

enum {
    items_at_least = 1 << 14,
    entries_of_item = 4, // room for lists
    entries_of_window = 1 << 24,
    memory_share = 8,
    cut_share = 8,       // of the largest radius is how thin windows may be where tiles can be cut instead,
    least_share = 1024,  // and where not
    gather_work = 8      // of a splat, in samples that are looked at
};

struct pass {
    struct spl_tile *tile;
    struct spl_soft_order order;
    uint32_t slots;
    struct spl_soft_plan *plan; // NULL until spheres are more than fit
    bool blends, finds;
    uint32_t found_to;          // depth up to which spheres were looked for
    bool begun;                 // something was blended
};

static uint32_t slots_of(const struct spl_draw_list *list, size_t chunk)
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
        slots += slots_of(list, i);
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
        if ((uint64_t)more.entries * sizeof(uint32_t) > binding || spl_soft_memory_bytes(&more, software) > bytes)
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
    struct spl_soft_sizes sizes = {.slots = larger((uint32_t)slots, have->slots),
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
        sizes.entries = larger(sizes.items * entries_of_item, SPL_SOFT_SLOT_CELLS * SPL_SOFT_SPAN_MAX * SPL_SOFT_SPAN_MAX);
    } else {
        choose_items(&sizes, slots * SPL_SOFT_SLOT_SPLATS, share, limits->binding_bytes, software);
        if (view->soft.model != SPL_SOFT_MODEL_EXPRESS)
            choose_entries(&sizes, share, limits->binding_bytes, software);
    }
    const bool exact = renderer->soft_items_most > 0;
    const bool enough = exact ? sizes.items == have->items && sizes.entries == have->entries
                              : sizes.items <= have->items && sizes.entries <= have->entries;
    if (enough && sizes.slots == have->slots && sizes.tiles == have->tiles && sizes.samples == have->samples &&
        sizes.walks == have->walks && sizes.found == have->found)
        return SPL_OK;
    const uint64_t bytes = spl_soft_memory_bytes(&sizes, software);
    if (bytes > left)
        return spl_fail_field(err, SPL_E_LIMIT, "memory-limit",
                              "soft spheres take %" PRIu64 " bytes of working memory, which memory-limit, %" PRIu64
                              ", has not beside the rest and the largest dataset's first page; raise it, or ask for a "
                              "smaller image",
                              bytes, limits->memory_bytes);
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

bool spl_soft_is_drawn(const struct spl_tile *tile)
{
    const struct spl_draw_list *list = &tile->renderer->list;
    return list->first_soft_chunk < list->first_mark_chunk;
}

static int tile_work(void *context, uint64_t work, struct spl_error *err)
{
    return spl_tile_add_work(((struct pass *)context)->tile, work, err);
}

static int tile_run(void *context, struct spl_error *err)
{
    return spl_tile_run(((struct pass *)context)->tile, err);
}

enum phase { COUNT_SLOTS, COUNT_BUCKETS, GATHER };

/* Records the gathering kernel in one of its phases. */
static int gather(struct pass *pass, enum phase phase, const struct spl_soft_step *step, struct spl_error *err)
{
    static const struct {
        enum spl_chunk_kind kind;
        const char *name;
        uint32_t lanes;
    } kinds[] = {{SPL_CHUNK_DISCS, "soft_gather", SPL_LANES},
                 {SPL_CHUNK_PANELS, "soft_gather_cells", SPL_CELL_DISC_LANES},
                 {SPL_CHUNK_MESHES, "soft_gather_mesh_cells", SPL_CELL_DISC_LANES}};
    struct spl_soft_order *order = &pass->order;
    struct spl_gpu_buffer *const *buffers = order->memory->buffers;
    struct spl_gpu_binding with[SPL_RESOURCE_COUNT] = {
        [SPL_RESOURCE_SLOTS] = {.buffer = buffers[SPL_SOFT_SLOTS]},
        [SPL_RESOURCE_STARTS] = {.buffer = buffers[SPL_SOFT_FIRSTS]},
        [SPL_RESOURCE_ITEMS] = {.buffer = buffers[SPL_SOFT_ITEMS]},
        [SPL_RESOURCE_SORT_TO] = {.buffer = buffers[SPL_SOFT_PAIRS]},
    };
    const bool surface = spl_dataset_get_info(pass->tile->resident->dataset)->has_surface;
    const uint32_t details = phase == GATHER && pass->finds ? surface ? 1 : 2 : 0;
    int rc = spl_soft_put_step(order, step, &with[SPL_RESOURCE_STEP], err);
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds && !rc; i++) {
        struct spl_disc_kernels kernels;
        const struct spl_dispatch what = {.phases = SPL_PHASE_BOTH,
                                          .kind = kinds[i].kind,
                                          .lanes = kinds[i].lanes,
                                          .role = SPL_ROLE_SOFT,
                                          .with = with};
        const struct spl_kernel_key key = {kinds[i].name, false, {phase, details}};
        rc = spl_tile_get_plain_kernels(pass->tile, key, &what, &kernels, err);
        rc = rc ? rc : spl_tile_dispatch_splats(pass->tile, &kernels, &what, err);
    }
    spl_gpu_barrier(order->gpu);
    return rc;
}

/* What the slots have, and where the first items of each go. */
struct counted {
    uint64_t items, entries;
    uint32_t most, low, high;
    float reach; // largest radius
    bool thin;   // some are narrower than a sample
};

static struct counted sum_slots(struct pass *pass)
{
    struct spl_gpu_buffer *const *buffers = pass->order.memory->buffers;
    const uint32_t *words = spl_gpu_buffer_map(buffers[SPL_SOFT_SLOTS]);
    uint32_t *firsts = spl_gpu_buffer_map(buffers[SPL_SOFT_FIRSTS]);
    struct counted sum = {.low = UINT32_MAX};
    uint32_t reach = 0;
    for (uint32_t i = 0; i < pass->slots; i++, words += SPL_SOFT_SLOT_WORDS) {
        const uint32_t most = words[0] >> 4 & 0x7ff;
        firsts[i] = (uint32_t)sum.items;
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

static struct spl_soft_step window_step(const struct pass *pass, const struct spl_soft_range *window)
{
    return (struct spl_soft_step){.low = (uint32_t)(window->first >> 32),
                                  .low_slot = (uint32_t)window->first,
                                  .high = (uint32_t)(window->end >> 32),
                                  .high_slot = (uint32_t)window->end,
                                  .columns = pass->order.columns,
                                  .rects = pass->order.memory->sizes.items * SPL_SOFT_ITEM_WORDS,
                                  .details = pass->order.memory->sizes.items * (SPL_SOFT_ITEM_WORDS + 1)};
}

static int count(struct pass *pass, const struct spl_soft_range *window, struct counted *sum, struct spl_error *err)
{
    const struct spl_soft_step step = window_step(pass, window);
    int rc = gather(pass, COUNT_SLOTS, &step, err);
    rc = rc ? rc : spl_soft_run(&pass->order, err);
    if (!rc)
        *sum = sum_slots(pass);
    return rc;
}

static int measure(void *context, const struct spl_soft_range *range, uint32_t shift, struct spl_soft_sum *sums,
                   struct spl_error *err)
{
    struct pass *pass = context;
    struct spl_gpu_buffer *buffer = pass->order.memory->buffers[SPL_SOFT_SLOTS];
    struct spl_soft_step step = window_step(pass, range);
    step.digits = shift < 32;
    step.shift = shift < 32 ? shift : shift - 32;
    spl_gpu_fill(pass->order.gpu, buffer, 0, SPL_SOFT_BUCKETS * sizeof *sums, 0);
    spl_gpu_barrier(pass->order.gpu);
    int rc = gather(pass, COUNT_BUCKETS, &step, err);
    rc = rc ? rc : spl_soft_run(&pass->order, err);
    if (!rc)
        memcpy(sums, spl_gpu_buffer_map(buffer), SPL_SOFT_BUCKETS * sizeof *sums);
    return rc;
}

/* Draws a window that was counted; models but express what of it lies before `until`. */
static int draw(struct pass *pass, const struct spl_soft_range *window, const struct counted *sum, float until,
                struct spl_error *err)
{
    const struct spl_soft_params *soft = &pass->tile->view->soft;
    const struct spl_soft_step step = window_step(pass, window);
    const uint32_t items = (uint32_t)sum->items;
    int rc = gather(pass, GATHER, &step, err);
    rc = rc ? rc : spl_soft_sort(&pass->order, items, sum->low, sum->high, err);
    rc = rc ? rc : spl_soft_list(&pass->order, items, sum->most, err);
    spl_assert(rc != SPL_SOFT_CROWDED);
    if (!rc && pass->blends)
        rc = spl_soft_blend(&pass->order, &(struct spl_soft_blend){.model = soft->model,
                                                                   .opacity = soft->opacity,
                                                                   .reach = sum->reach,
                                                                   .until = until,
                                                                   .border = soft->blend > 0,
                                                                   .thin = sum->thin,
                                                                   .first = !pass->begun}, err);
    if (!rc && pass->finds)
        rc = spl_soft_find(&pass->order, soft, pass->found_to, sum->thin, err);
    pass->found_to = (uint32_t)(window->end >> 32);
    pass->begun = true;
    return rc;
}

/* Layer shows what it saw once it has seen all. */
static int end(struct pass *pass, struct spl_error *err)
{
    const struct spl_soft_params *soft = &pass->tile->view->soft;
    if (soft->model != SPL_SOFT_MODEL_LAYER || !pass->blends)
        return SPL_OK;
    pass->order.entries = 0;
    return spl_soft_blend(&pass->order, &(struct spl_soft_blend){.model = soft->model,
                                                                 .opacity = soft->opacity,
                                                                 .until = SPL_SOFT_NO_END,
                                                                 .ends = true}, err);
}

/* A window after the other. */
static int draw_windows(struct pass *pass, const struct spl_soft_range *all, struct spl_error *err)
{
    const struct spl_soft_sizes *sizes = &pass->order.memory->sizes;
    struct spl_soft_range window;
    struct spl_soft_sum planned;
    pass->plan = spl_alloc(1, sizeof *pass->plan, err);
    if (!pass->plan)
        return SPL_E_NOMEM;
    pass->plan->room = (struct spl_soft_sum){sizes->items, sizes->entries};
    pass->plan->measure = measure;
    pass->plan->context = pass;
    int rc = spl_soft_plan_begin(pass->plan, all, err);
    while (!rc && (rc = spl_soft_plan_next(pass->plan, &window, &planned, err)) == 1) {
        struct counted sum;
        rc = count(pass, &window, &sum, err);
        rc = rc ? rc : draw(pass, &window, &sum, SPL_SOFT_NO_END, err);
    }
    free(pass->plan);
    return rc;
}

static int refuse(const struct pass *pass, float depth, float reach, struct spl_error *err)
{
    const struct spl_soft_sizes *sizes = &pass->order.memory->sizes;
    return spl_fail_field(err, SPL_E_LIMIT, "soft_model",
                          "soft_model %s has to hold all soft spheres that overlap one another: behind one pixel, at depth "
                          "%g and up to %g around it, there are more than %" PRIu32 ", which is what fits in an eighth "
                          "of memory-limit; use soft_model express, raise lod, or raise memory-limit",
                          spl_soft_model_name(pass->tile->view->soft.model), (double)depth, (double)reach, sizes->items);
}

/* Windows that overlap, since a sphere reaches from one into the next. Tiles that can be cut are, before windows become
 * much thinner than what they hold. */
static int draw_thick(struct pass *pass, const struct spl_soft_range *all, float reach, struct spl_error *err)
{
    const struct spl_soft_sizes *sizes = &pass->order.memory->sizes;
    const bool can_cut = (uint64_t)pass->tile->width * pass->tile->height > 1;
    struct spl_soft_thick *plan = spl_alloc(1, sizeof *plan, err);
    struct spl_soft_window window;
    int rc = SPL_OK, more = 1;
    if (!plan)
        return SPL_E_NOMEM;
    plan->room = (struct spl_soft_sum){sizes->items, sizes->entries};
    plan->all = *all;
    plan->reach = reach;
    plan->least = reach / (can_cut ? cut_share : least_share);
    plan->measure = measure;
    plan->context = pass;
    while (!rc && (more = spl_soft_thick_next(plan, &window, err)) == 1) {
        struct counted sum;
        rc = count(pass, &window.held, &sum, err);
        rc = rc ? rc : draw(pass, &window.held, &sum, window.until, err);
    }
    if (!rc && more == SPL_SOFT_TOO_THICK && !can_cut)
        rc = refuse(pass, plan->from, reach, err);
    else if (!rc && more == SPL_SOFT_TOO_THICK)
        rc = SPL_FRAME_TOO_MUCH;
    else if (!rc)
        rc = more;
    free(plan);
    return rc;
}

/* Drops chunks that the solid hides. Where its memory is taken, as of methods that keep ids, all are drawn. */
static int occlude(struct spl_tile *tile, bool wide, struct spl_error *err)
{
    const struct spl_draw_list *list = &tile->renderer->list;
    if (!spl_tile_may_begin(tile, SPL_AREA_OCCLUDERS))
        return SPL_OK;
    return spl_tile_dispatch_occlusion(tile, list->first_soft_chunk, list->first_mark_chunk, wide, err);
}

int spl_soft_record(struct spl_tile *tile, uint32_t group, struct spl_error *err)
{
    struct spl_renderer *r = tile->renderer;
    const struct spl_soft_sizes *sizes = &r->scratch.soft.sizes;
    const struct spl_draw_list *list = &r->list;
    const uint32_t columns = SPL_SOFT_TILE, rows = SPL_SOFT_TILE_ROWS;
    const size_t last = list->first_mark_chunk - 1;
    const enum spl_soft_model model = tile->view->soft.model;
    const bool wide = !spl_method_row(tile->view->method)->sums && spl_gpu_get_limits(r->gpu)->atomics_64;
    struct pass pass = {.tile = tile,
                        .order = {.gpu = r->gpu,
                                  .kernels = &r->kernels,
                                  .memory = &r->scratch.soft,
                                  .depth = r->scratch.depth,
                                  .wide = wide,
                                  .columns = (tile->camera.width + columns - 1) / columns,
                                  .rows = (tile->camera.height + rows - 1) / rows,
                                  .add_work = tile_work,
                                  .run = tile_run},
                        .slots = list->chunks[last].texture + slots_of(list, last),
                        .blends = group == SPL_SUMS_COLOR,
                        .finds = spl_soft_is_found(tile->view)};
    const float near = tile->params.near, far = tile->params.far;
    uint32_t low, high;
    memcpy(&low, &near, sizeof low);
    memcpy(&high, &far, sizeof high);
    const struct spl_soft_range all = {(uint64_t)low << 32, (uint64_t)(high + 1) << 32};
    struct counted sum;
    pass.order.context = &pass;
    if (!pass.blends && !pass.finds)
        return SPL_OK;
    if (pass.finds)
        spl_gpu_fill(r->gpu, pass.order.memory->buffers[SPL_SOFT_FOUND], 0,
                     tile->samples * SPL_SOFT_FOUND_WORDS * sizeof(uint32_t), SPL_NOTHING);
    spl_gpu_fill(r->gpu, pass.order.memory->buffers[SPL_SOFT_STATE], 0,
                 tile->samples * SPL_SOFT_STATE_WORDS * sizeof(uint32_t), 0);
    if (model != SPL_SOFT_MODEL_EXPRESS)
        spl_gpu_fill(r->gpu, pass.order.memory->buffers[SPL_SOFT_WALKS], 0,
                     tile->samples * SPL_SOFT_WALK_WORDS * sizeof(uint32_t), 0);
    int rc = spl_tile_put_params(tile, &tile->params, &pass.order.frame, err);
    rc = rc ? rc : occlude(tile, wide, err);
    rc = rc ? rc : count(&pass, &all, &sum, err);
    if (!rc && sum.items <= sizes->items && sum.entries <= sizes->entries)
        rc = draw(&pass, &all, &sum, SPL_SOFT_NO_END, err);
    else if (!rc && pass.blends && (model == SPL_SOFT_MODEL_BASE || model == SPL_SOFT_MODEL_CONCENTRIC))
        rc = draw_thick(&pass, &all, sum.reach, err);
    else if (!rc)
        rc = draw_windows(&pass, &all, err);
    rc = rc ? rc : end(&pass, err);
    tile->soft_drawn += rc ? 0 : sum.items;
    spl_tile_stamp(tile, SPL_STAGE_SOFT);
    return rc;
}
