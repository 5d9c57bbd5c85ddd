/* The soft stage of a tile; see pass.h. More spheres than fit (room.c) are drawn a window of depth after the other,
 * which changes no byte; of models that cut spheres, windows overlap. Where too many overlap even so, the tile is to be
 * cut. The host waits for counts and for the lengths of lists; in between it asks whether anybody still waits for the
 * frame, and while models that cut spheres are walked whether others wait longer than they should (pause.h). Belongs to
 * the renderer's thread. */
#include "render/soft/pass.h"

#include <inttypes.h>
#include <string.h>

#include "base/float.h"
#include "base/memory.h"
#include "base/work.h"
#include "render/frame.h"
#include "render/method.h"
#include "render/soft/gather.h"
#include "render/soft/of.h"
#include "render/soft/pause.h"
#include "render/soft/thick.h"

enum {
    cut_share = 8,     // of the largest radius is how thin windows may be where tiles can be cut instead,
    least_share = 1024 // and where not
};

struct pass {
    struct spl_tile *tile;
    struct spl_soft_order order;
    struct spl_soft_gathering gathering;
    bool blends, finds;
    uint32_t found_to; // depth up to which spheres were looked for
    bool begun;        // something was blended
    bool walks;        // spheres are cut just now
    float from;        // the window of depth that is drawn: walks before it are done
    struct spl_soft_walked of;
};

bool spl_soft_is_drawn(const struct spl_tile *tile)
{
    const struct spl_draw_list *list = &tile->renderer->list;
    return list->first_soft_chunk < list->first_mark_chunk;
}

/* The device ran. SPL_FRAME_PAUSED: others shall have it now, and what was walked is kept, unless it is to be cut. */
static int give_way(struct pass *pass, struct spl_error *err)
{
    struct spl_soft_pause *pause = pass->tile->pause;
    if (!pass->walks || !spl_soft_pause_is_due(pause, pass->tile))
        return SPL_OK;
    pass->walks = false;
    int rc = spl_soft_pause_keep(pause, pass->tile, &pass->of, pass->from, err);
    return rc ? rc : SPL_FRAME_PAUSED;
}

static int tile_work(void *context, uint64_t work, struct spl_error *err)
{
    struct pass *pass = context;
    const uint64_t before = pass->tile->work;
    int rc = spl_tile_add_work(pass->tile, work, err);
    return rc || pass->tile->work == before + work ? rc : give_way(pass, err);
}

static int tile_run(void *context, struct spl_error *err)
{
    struct pass *pass = context;
    int rc = spl_tile_run(pass->tile, err);
    return rc ? rc : give_way(pass, err);
}

static bool is_walked(const struct pass *pass)
{
    const enum spl_soft_model model = pass->tile->view->soft.model;
    return pass->blends && (model == SPL_SOFT_MODEL_BASE || model == SPL_SOFT_MODEL_CONCENTRIC);
}

/* Draws a window that was counted; models but express what of it lies before `until`. */
static int draw(struct pass *pass, const struct spl_soft_range *window, const struct spl_soft_counted *sum, float until,
                struct spl_error *err)
{
    const struct spl_soft_params *soft = &pass->tile->view->soft;
    const uint32_t items = (uint32_t)sum->items;
    int rc = spl_soft_gather(&pass->gathering, window, err);
    rc = rc ? rc : spl_soft_sort(&pass->order, items, sum->low, sum->high, err);
    rc = rc ? rc : spl_soft_list(&pass->order, items, sum->entries, sum->most, err);
    spl_assert(rc != SPL_SOFT_CROWDED);
    pass->walks = !rc && is_walked(pass);
    if (pass->walks)
        spl_soft_pause_walk(pass->tile->pause);
    if (!rc && pass->blends)
        rc = spl_soft_blend(&pass->order, &(struct spl_soft_blend){.model = soft->model,
                                                                   .opacity = soft->opacity,
                                                                   .reach = sum->reach,
                                                                   .until = until,
                                                                   .border = soft->blend > 0,
                                                                   .thin = sum->thin,
                                                                   .first = !pass->begun}, err);
    pass->walks = false;
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
    struct spl_soft_plan *plan = spl_alloc(1, sizeof *plan, err);
    if (!plan)
        return SPL_E_NOMEM;
    plan->room = (struct spl_soft_sum){sizes->items, sizes->entries};
    plan->measure = spl_soft_measure;
    plan->context = &pass->gathering;
    int rc = spl_soft_plan_begin(plan, all, err);
    while (!rc && (rc = spl_soft_plan_next(plan, &window, &planned, err)) == 1) {
        struct spl_soft_counted sum;
        rc = spl_soft_count(&pass->gathering, &window, &sum, err);
        rc = rc ? rc : draw(pass, &window, &sum, SPL_SOFT_NO_END, err);
    }
    free(plan);
    return rc;
}

static int refuse(const struct pass *pass, float depth, float reach, struct spl_error *err)
{
    const struct spl_soft_sizes *sizes = &pass->order.memory->sizes;
    return spl_fail_field(err, SPL_E_LIMIT, "soft_model",
                          "soft_model %s has to hold all soft spheres that overlap one another: behind one pixel, at "
                          "depth %g and up to %g around it, there are more than %" PRIu32 ", which is what fits in an "
                          "eighth of memory-limit; use soft_model express, raise lod, or raise memory-limit",
                          spl_soft_model_name(pass->tile->view->soft.model), (double)depth, (double)reach,
                          sizes->items);
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
    plan->measure = spl_soft_measure;
    plan->context = &pass->gathering;
    plan->from = pass->from;
    while (!rc && (more = spl_soft_thick_next(plan, &window, err)) == 1) {
        struct spl_soft_counted sum;
        rc = spl_soft_count(&pass->gathering, &window.held, &sum, err);
        rc = rc ? rc : draw(pass, &window.held, &sum, window.until, err);
        pass->from = window.until;
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

/* Gives walks back that were kept. What they are of follows from what is to be drawn: where pages have come or gone
 * since, it is drawn anew. */
static int go_on(struct pass *pass, const struct spl_soft_counted *sum, struct spl_error *err)
{
    struct spl_tile *tile = pass->tile;
    const struct spl_draw_list *list = &tile->renderer->list;
    bool kept = false;
    pass->of = (struct spl_soft_walked){.place = {(uint64_t)tile->x << 32 | tile->y,
                                                  (uint64_t)tile->width << 32 | tile->height},
                                        .items = sum->items,
                                        .entries = sum->entries,
                                        .chunks = list->chunk_count,
                                        .splats = list->drawn[SPL_CHUNK_DISCS],
                                        .low = sum->low,
                                        .high = sum->high,
                                        .most = sum->most,
                                        .reach = spl_float_to_bits(sum->reach)};
    if (!is_walked(pass))
        return SPL_OK;
    const float from = tile->pause->from;
    int rc = spl_soft_pause_give_back(tile->pause, tile, &pass->of, &kept, err);
    if (kept && !pass->finds) /* what is found is not kept */
        pass->from = from;
    /* the parameters may have lain where the walks came by */
    memcpy((char *)spl_gpu_buffer_map(pass->order.frame.buffer) + pass->order.frame.offset, &tile->params,
           sizeof tile->params);
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
                        .blends = group == SPL_SUMS_COLOR,
                        .finds = spl_soft_is_found(tile->view)};
    const uint32_t low = spl_float_to_bits(tile->params.near), high = spl_float_to_bits(tile->params.far);
    const struct spl_soft_range all = {(uint64_t)low << 32, (uint64_t)(high + 1) << 32};
    struct spl_soft_counted sum;
    pass.order.context = &pass;
    pass.gathering = (struct spl_soft_gathering){.tile = tile,
                                            .order = &pass.order,
                                            .slots = list->chunks[last].texture + spl_soft_slots_of(list, last),
                                            .details = pass.finds};
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
    rc = rc ? rc : spl_soft_count(&pass.gathering, &all, &sum, err);
    rc = rc ? rc : go_on(&pass, &sum, err);
    if (!rc && sum.items <= sizes->items && sum.entries <= sizes->entries)
        rc = draw(&pass, &all, &sum, SPL_SOFT_NO_END, err);
    else if (!rc && is_walked(&pass))
        rc = draw_thick(&pass, &all, sum.reach, err);
    else if (!rc)
        rc = draw_windows(&pass, &all, err);
    rc = rc ? rc : end(&pass, err);
    tile->soft_drawn += rc ? 0 : sum.items;
    spl_tile_stamp(tile, SPL_STAGE_SOFT);
    return rc;
}
