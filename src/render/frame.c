/* One tile of a frame: it selects, uploads, records, waits, and is copied into the images. Nothing of it is left on the
 * device but pages, so that tiles of other frames may come between. */
#include "base/clock.h"
#include "base/memory.h"
#include "render/frame_parts.h"
#include "render/method.h"
#include "render/occupancy.h"
#include "render/readback.h"
#include "render/soft/pass.h"

#define FRAME_DEADLINE_NS (10 * SPL_NS_PER_S)

/* A piece has the weight of its tile, so that bytes are the same as of the tile in one, where both saw all that there
 * is to draw; where something stood in, the piece may have more on a sample than was counted of the tile. */
static uint32_t choose_weight(const struct spl_frame_job *job, const struct spl_draw_list *list)
{
    const uint32_t own = spl_occupancy_weight(list->sample_splats, list->sample_panels), tile = job->whole.weight_max;
    if (!job->whole.pixels)
        return own;
    return (job->whole.complete && list->complete) || tile < own ? tile : own;
}

static int select_tile(struct spl_frame_job *job, struct spl_tile *tile, struct spl_error *err)
{
    struct spl_renderer *r = job->renderer;
    const struct spl_method_row *method = spl_method_row(job->view->method);
    struct spl_select_params params = spl_frame_selection(job, &tile->camera);
    params.corner[0] = tile->params.tile_x;
    params.corner[1] = tile->params.tile_y;
    spl_residency_begin_walk(&r->residency, &job->hold);
    struct spl_error why = {0}; // a page that cannot be loaded looks like a limit to the selection
    int rc = spl_select(&params, &r->list, &why), waits = spl_frame_end_walk(job, err);
    if (waits)
        return waits;
    if (rc)
        return spl_fail_field(err, rc, why.field, "%s", why.message);
    tile->params.weight_max = choose_weight(job, &r->list);
    if (!tile->params.weight_max && method->sums)
        return spl_fail_field(err, SPL_E_LIMIT, "lod",
                              "at lod %g up to %llu splats would blend in one pixel; raise lod", job->view->lod,
                              (unsigned long long)(r->list.sample_splats + r->list.sample_panels));
    return SPL_OK;
}

static void count_drawn(const struct spl_draw_list *list, struct spl_frame_stats *stats)
{
    stats->splats_drawn += list->drawn[SPL_CHUNK_DISCS];
    stats->lines_drawn += list->drawn[SPL_CHUNK_LINES];
    stats->panels_drawn += list->drawn[SPL_CHUNK_PANELS];
    stats->meshes_drawn += list->drawn[SPL_CHUNK_MESHES];
    stats->chunks_drawn += list->chunk_count;
    stats->nodes_drawn += list->nodes;
}

/* The tile is known for its pieces. */
static void know_whole(struct spl_frame_job *job, const struct spl_tile *tile, uint64_t work,
                       struct spl_frame_stats *drawn)
{
    if (job->whole.pixels)
        return;
    job->whole = (struct spl_frame_whole){.pixels = (uint64_t)tile->width * tile->height,
                                          .work = work,
                                          .weight_max = tile->params.weight_max,
                                          .complete = job->renderer->list.complete};
    count_drawn(&job->renderer->list, drawn);
}

int spl_frame_know_tile(struct spl_frame_job *job, struct spl_tile *tile, struct spl_frame_stats *drawn,
                        struct spl_error *err)
{
    uint64_t clock = spl_now_ns();
    job->counts = true;
    int rc = select_tile(job, tile, err);
    job->counts = false;
    job->frame->stats.select_ms += spl_since_ms(&clock);
    if (!rc)
        know_whole(job, tile, spl_frame_count_work(tile), drawn);
    return rc;
}

/* Selects; anew where others had memory that this tile lacks. */
static int select_with_room(struct spl_frame_job *job, struct spl_tile *tile, struct spl_error *err)
{
    struct spl_error why = {0};
    int rc = select_tile(job, tile, &why);
    if ((!rc || rc == SPL_E_LIMIT) && spl_frame_give_back(job, &job->renderer->list)) {
        why = (struct spl_error){0};
        rc = select_tile(job, tile, &why);
    }
    return rc < 0 ? spl_fail_field(err, rc, why.field, "%s", why.message) : rc;
}

/* All that the tile takes beside pages. */
static int take_room(struct spl_renderer *r, const struct spl_frame_job *job, const struct spl_tile *tile,
                     struct spl_error *err)
{
    const uint64_t shaded = spl_tile_get_shades(tile) ? tile->samples : 0;
    int rc = spl_soft_prepare(r, &tile->camera, job->view, err);
    rc = rc ? rc : spl_scratch_upload(&r->scratch, &r->residency, &r->list, err);
    return rc ? rc : spl_scratch_make_shades(&r->scratch, &r->residency, shaded, err);
}

/* Selects and uploads. Pages are taken while selecting; where they leave the draw list no room, it takes that of some,
 * and the tile is selected anew from those that then fit. */
static int list_tile(struct spl_frame_job *job, struct spl_tile *tile, struct spl_error *err)
{
    struct spl_renderer *r = job->renderer;
    struct spl_frame_stats *stats = &job->frame->stats;
    for (int attempt = 0;; attempt++) {
        uint64_t clock = spl_now_ns();
        int rc = attempt ? select_tile(job, tile, err) : select_with_room(job, tile, err);
        stats->select_ms += spl_since_ms(&clock);
        if (rc)
            return rc;
        if (spl_frame_is_too_much(job, tile)) {
            know_whole(job, tile, spl_frame_count_work(tile), stats);
            return SPL_FRAME_TOO_MUCH;
        }
        struct spl_error why = {0};
        rc = take_room(r, job, tile, &why);
        bool again = !attempt && (rc == SPL_E_LIMIT || rc == SPL_E_NOMEM);
        if (again) {
            why = (struct spl_error){0};
            spl_scratch_give_back(&r->scratch, &r->residency, &(struct spl_scratch_needs){.list = &r->list}, 0);
            spl_residency_begin_walk(&r->residency, &job->hold); // what this frame asked for may go, too
            rc = take_room(r, job, tile, &why);
        }
        stats->upload_ms += spl_since_ms(&clock);
        if (rc || !again)
            return rc ? spl_fail_field(err, rc, why.field, "%s", why.message) : SPL_OK;
    }
}

int spl_frame_make_images(struct spl_frame *frame, const struct spl_view *view, struct spl_error *err)
{
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
        struct spl_image *image = &frame->images[layer];
        if (!(view->layers >> layer & 1) || image->pixels)
            continue;
        *image = (struct spl_image){.layer = layer,
                                    .type = spl_readback_type(layer),
                                    .width = view->camera.width,
                                    .height = view->camera.height};
        image->pixels = spl_alloc_raw((size_t)image->width * image->height, spl_pixel_bytes(image->type), err);
        if (!image->pixels)
            return SPL_E_NOMEM;
    }
    return SPL_OK;
}

/* Records every group and layer of the view into the list that was begun; the n-th requested layer starts at word n *
 * pixels. */
static int record(struct spl_tile *tile, struct spl_error *err)
{
    struct spl_renderer *r = tile->renderer;
    uint32_t pixels = tile->width * tile->height, wanted = tile->view->layers;
    bool first = true, soft = true;
    spl_tile_stamp(tile, SPL_STAGE_BEGIN);
    int rc = spl_tile_take_rounds(tile, err);
    rc = rc ? rc : spl_tile_dispatch_marks(tile, err);
    for (uint32_t group = 0; group < SPL_SUMS_COUNT && !rc; group++) {
        uint32_t layers = 0;
        for (uint32_t layer = 0; layer < SPL_LAYER_COUNT; layer++)
            if (spl_layer_sums(layer) == group)
                layers |= 1u << layer & wanted;
        if (!layers)
            continue;
        if (group == SPL_SUMS_COLOR)
            rc = spl_tile_light(tile, &first, err);
        rc = rc ? rc : spl_method_row(tile->view->method)->record(tile, group, first, err);
        if (!rc && group == SPL_SUMS_COLOR)
            rc = spl_tile_deepen(tile, err);
        if (!rc && soft && spl_soft_is_drawn(tile))
            rc = spl_soft_record(tile, group, err);
        first = soft = false;
        for (uint32_t layer = 0; layer < SPL_LAYER_COUNT && !rc; layer++)
            if (layers >> layer & 1)
                rc = spl_tile_dispatch_resolve(tile, layer, pixels * spl_readback_rank(wanted, layer), err);
        spl_gpu_barrier(r->gpu);
        spl_tile_end_group(tile);
        spl_tile_stamp(tile, SPL_STAGE_RESOLVE);
    }
    if (!rc && r->scratch.output) {
        spl_gpu_copy(r->gpu, r->scratch.output, 0, r->scratch.readback, 0,
                     (uint64_t)pixels * 4 * (uint32_t)__builtin_popcount(wanted));
        spl_gpu_barrier(r->gpu);
    }
    return rc;
}

static void add_times(const struct spl_tile *tile, struct spl_frame_stats *stats)
{
    double *const stage_ms[] = {
        [SPL_STAGE_CLEAR] = &stats->clear_ms,
        [SPL_STAGE_DEPTH] = &stats->depth_ms,
        [SPL_STAGE_SHADE] = &stats->shade_ms,
        [SPL_STAGE_SOFT] = &stats->soft_ms,
        [SPL_STAGE_RESOLVE] = &stats->resolve_ms,
    };
    for (uint32_t i = 1; i < tile->stamps; i++) {
        uint64_t from = spl_gpu_get_timestamp_ns(tile->renderer->gpu, i - 1);
        uint64_t to = spl_gpu_get_timestamp_ns(tile->renderer->gpu, i);
        if (from && to > from)
            *stage_ms[tile->stamp_stage[i]] += (double)(to - from) * 1e-6;
    }
}

/* Has the device draw the tile. What is left of a list that could not be recorded to its end is run all the same, for
 * nothing: parameters and half its work are the device's by then. */
static int draw_tile(struct spl_tile *tile, struct spl_error *err)
{
    struct spl_gpu *gpu = tile->renderer->gpu;
    uint64_t ticket;
    spl_kernels_begin(&tile->renderer->kernels, gpu, tile->camera.projection == SPL_ORTHOGRAPHIC);
    int rc = spl_gpu_begin(gpu, err);
    if (rc)
        return rc;
    if (tile->paint)
        spl_paint_see(tile->paint, &tile->camera, spl_gpu_buffer_map(tile->renderer->scratch.palette));
    rc = record(tile, err);
    struct spl_error why = {0};
    int ended = spl_gpu_submit(gpu, &ticket, &why);
    /* The device is given its own full deadline: a request that is merely late must not mark it lost. */
    if (!ended)
        ended = spl_gpu_wait(gpu, ticket, spl_now_ns() + FRAME_DEADLINE_NS, &why);
    if (!ended)
        return rc;
    if (err)
        *err = (struct spl_error){0}; // whatever else: whoever renders is to know at once
    return spl_fail(err, SPL_E_DEVICE_LOST, "%s", why.message);
}

int spl_frame_render_tile(struct spl_frame_job *job, struct spl_tile *tile, struct spl_error *err)
{
    struct spl_renderer *r = job->renderer;
    struct spl_frame_stats *stats = &job->frame->stats;
    uint64_t clock;
    if (spl_now_ns() >= job->view->deadline_ns)
        return spl_fail(err, SPL_E_TIMEOUT, SPL_FRAME_LATE);
    int rc = list_tile(job, tile, err);
    if (!rc)
        rc = spl_frame_make_images(job->frame, job->view, err);
    if (!rc) {
        clock = spl_now_ns();
        rc = draw_tile(tile, err);
        spl_frame_learn_pace(job, tile, rc, spl_now_ns() - clock);
    }
    if (rc == SPL_FRAME_TOO_MUCH || (rc == SPL_FRAME_PAUSED && !job->pause.words))
        know_whole(job, tile, spl_frame_count_work(tile), stats);
    if (rc == SPL_FRAME_PAUSED)
        add_times(tile, stats);
    if (rc)
        return rc;
    clock = spl_now_ns();
    spl_readback_tile(tile, spl_gpu_buffer_map(r->scratch.readback), job->frame->images);
    stats->readback_ms += spl_since_ms(&clock);
    add_times(tile, stats);
    stats->soft_drawn += tile->soft_drawn;
    if (!job->whole.pixels) // a tile is counted as a whole
        count_drawn(&r->list, stats);
    stats->complete &= r->list.complete;
    stats->pending |= r->residency.later;
    return SPL_OK;
}
