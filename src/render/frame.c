/* One tile of a frame: it selects, uploads, records, waits, and is copied into the images. Nothing of it is left on the
 * device but pages, so that tiles of other frames may come between. */
#include "render/frame.h"

#include "base/clock.h"
#include "base/memory.h"
#include "render/map_cells.h"
#include "render/method.h"
#include "render/occupancy.h"
#include "render/readback.h"
#include "render/slot.h"
#include "render/soft/pass.h"
#include "render/soft_params.h"

/* Which run of the shade pass each layer needs; coverage reads the depth only and goes with whatever runs. */
static const uint8_t group_of_layer[SPL_LAYER_COUNT] = {
    [SPL_LAYER_COLOR] = SPL_SUMS_COLOR,   [SPL_LAYER_DEPTH] = SPL_SUMS_DEPTH, [SPL_LAYER_RANGE] = SPL_SUMS_DEPTH,
    [SPL_LAYER_NORMAL] = SPL_SUMS_NORMAL, [SPL_LAYER_ID] = SPL_SUMS_ID,       [SPL_LAYER_COVERAGE] = SPL_SUMS_COLOR,
    [SPL_LAYER_PRIMITIVE] = SPL_SUMS_PRIMITIVE,
};

/* A frame that waits is selected as if what is on its way were there: the walk that draws it then gets the same
 * answers. One that does not takes what is there, but for the first page. Of a tile of a collection that cannot be read
 * nothing is there, and its leaf stands in; so it does for one whose server does not answer where the view does
 * without: such views do not wait for it until something of it has come. */
static enum spl_select_answer ask_slot(struct spl_frame_job *job, uint32_t slot)
{
    const uint32_t part = spl_slot_get_part(job->resident->dataset, slot);
    const bool late = spl_dataset_is_late(job->resident->dataset, part);
    const bool spares = part && (job->view->partial || job->view->without_late_tiles);
    struct spl_error why = {0};
    if (spl_dataset_is_without(job->resident->dataset, part) && (spares || !late))
        return SPL_SELECT_NO;
    if (job->counts && slot < spl_slot_of_tables(job->resident->dataset, 0))
        return !job->had || job->had[slot] ? SPL_SELECT_YES : SPL_SELECT_NO;
    bool awaited = (!job->view->partial && !spl_hold_gives_up(&job->hold) && !(spares && (late || job->hurries))) ||
                   slot == SPL_FIRST_SLOT;
    int rc = spl_is_cancelled(job->cancelled)
                 ? spl_fail(&why, SPL_E_CANCELLED, "the frame was cancelled")
                 : spl_residency_ask(&job->renderer->residency, job->resident, slot, awaited, &why);
    /* for which a coarser one stands in */
    bool no_room = rc == SPL_E_LIMIT || (rc == SPL_E_NOMEM && slot != SPL_FIRST_SLOT);
    if (rc < 0 && !no_room && !spl_slot_may_miss(job->resident->dataset, slot, rc) && !(spares && rc == SPL_E_TIMEOUT))
        spl_fail(&job->page_error, rc, "%s", why.message);
    if (rc == SPL_SLOT_PENDING && !awaited) {
        if (job->hurries && spares && spl_io_part_hangs(job->renderer->residency.io, job->resident->dataset, part))
            spl_dataset_find_late(job->resident->dataset, part);
        return SPL_SELECT_LATER;
    }
    return rc == SPL_SLOT_READY || rc == SPL_SLOT_PENDING ? SPL_SELECT_YES : SPL_SELECT_NO;
}

static enum spl_select_answer ask_page(void *context, uint32_t page)
{
    return ask_slot(context, page);
}

static enum spl_select_answer ask_textures(void *context, uint32_t page)
{
    struct spl_frame_job *job = context;
    enum spl_select_answer dictionary = ask_slot(job, spl_dictionary_slot(job->resident));
    if (dictionary == SPL_SELECT_NO)
        return SPL_SELECT_NO;
    enum spl_select_answer textures = ask_slot(job, spl_textures_slot(job->resident, page));
    return dictionary == SPL_SELECT_YES ? textures : dictionary;
}

static enum spl_select_answer ask_map(void *context, uint32_t station)
{
    struct spl_frame_job *job = context;
    return ask_slot(job, spl_slot_of_map(job->resident->dataset, station));
}

/* The same of tables, which a walk cannot do without: what is on its way is not there. */
static enum spl_select_answer ask_tables(void *context, uint32_t page, const struct spl_tables **tables)
{
    struct spl_frame_job *job = context;
    uint32_t slot = spl_slot_of_tables(job->resident->dataset, page);
    enum spl_select_answer answer = ask_slot(job, slot);
    *tables = job->resident->pages[slot].tables;
    return answer == SPL_SELECT_YES && !*tables ? SPL_SELECT_LATER : answer;
}

/* 0, SPL_SLOT_PENDING where the walk is to be made again once what it asked for has come, or an error, that of a page
 * among them. */
static int end_walk(struct spl_frame_job *job, struct spl_error *err)
{
    int rc =
        spl_hold_end_walk(&job->renderer->residency, job->resident, &job->hold, &job->frame->stats.pages_loaded, err);
    if (job->page_error.code)
        return spl_fail(err, job->page_error.code, "%s", job->page_error.message);
    return rc;
}

struct spl_select_params spl_frame_selection(struct spl_frame_job *job, const struct spl_camera *camera)
{
    const struct spl_method_row *method = spl_method_row(job->view->method);
    uint32_t maps = spl_dataset_get_info(job->resident->dataset)->maps ? spl_view_get_maps(job->view) : 0;
    const bool painted = job->paint.kind && job->view->layers >> SPL_LAYER_COLOR & 1;
    bool textured = spl_view_is_textured(job->view) && !maps && !painted;
    maps &= ~(painted ? SPL_MAP_COLORS : 0u);
    const bool lines = method->lines || spl_view_draws_lines(job->view);
    return (struct spl_select_params){
        .dataset = job->resident->dataset,
        .camera = camera,
        .lod = job->view->lod,
        .low_pass = SPL_LOW_PASS + (maps & SPL_MAP_COLORS ? SPL_MAP_CELLS_PAD : 0),
        .discs = method->discs,
        .panels = spl_view_draws_panels(job->view),
        .meshes = spl_view_draws_meshes(job->view),
        .lines = lines && !(painted && job->paint.stream >= 0), // they have no attributes, the splats they stand for do
        .paint = painted ? &job->paint : NULL,
        .tables = ask_tables,
        .resident = ask_page,
        .atoms = textured ? job->view->disc.atoms : 0,
        .textured = ask_textures,
        .maps = maps,
        .mapped = ask_map,
        .marks = job->marks.count ? &job->marks : NULL,
        .draws_soft = job->view->soft.opacity > 0,
        .clip = job->clip.count ? &job->clip : NULL,
        .context = job,
    };
}

/* Gives back what others needed where the walk has left out what then has room, so that what is left out follows from
 * the view alone: it is to be made anew. Soft views keep what the stage had of the one before: it is an eighth of all
 * memory, and pages in its place would have to be read and driven out with each. */
static bool give_back(struct spl_frame_job *job, const struct spl_draw_list *list)
{
    struct spl_renderer *r = job->renderer;
    const struct spl_scratch_needs needs = {
        .soft = job->marks.count && job->view->soft.opacity > 0,
        .shades = spl_shade_get_kinds(job->view, spl_dataset_get_info(job->resident->dataset)),
        .list = list,
    };
    const uint64_t lacking = r->residency.lacking;
    return lacking && spl_scratch_give_back(&r->scratch, &r->residency, &needs, lacking);
}

int spl_frame_find_spacing(struct spl_frame_job *job, const struct spl_camera *camera, double *spacing,
                           struct spl_error *err)
{
    struct spl_select_params params = spl_frame_selection(job, camera);
    struct spl_error why = {0}; // a page that cannot be loaded looks like a limit to the selection
    uint64_t clock = spl_now_ns();
    bool complete;
    int rc, waits;
    do {
        complete = true;
        spl_residency_begin_walk(&job->renderer->residency, &job->hold);
        rc = spl_select_spacing(&params, spacing, &complete, &why);
        waits = end_walk(job, err);
    } while (!rc && !waits && give_back(job, NULL));
    job->frame->stats.select_ms += spl_since_ms(&clock);
    if (waits)
        return waits;
    job->frame->stats.complete &= complete;
    job->frame->stats.pending |= job->renderer->residency.later;
    return rc ? spl_fail_field(err, rc, why.field, "%s", why.message) : SPL_OK;
}

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
    int rc = spl_select(&params, &r->list, &why), waits = end_walk(job, err);
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

/* As long as most of what is drawn is the tile's own, and not what lies around it; not into crumbs, since each piece
 * selects anew and lists all chunks that may touch it, whose splats are then looked at however few fall on it; and as
 * long as pieces have shared the work, not each done all of it, as where most of it falls on a few pixels. */
static bool may_cut(const struct spl_frame_job *job, const struct spl_tile *tile, uint64_t work)
{
    const struct spl_frame_whole *whole = &job->whole;
    uint64_t side = (uint64_t)tile->view->supersample, pixels = (uint64_t)tile->width * tile->height;
    return pixels > 1 && pixels * side * side >= 2 * job->renderer->least_piece &&
           2 * pixels * side * side >= tile->samples &&
           (!whole->pixels || (double)work * (double)whole->pixels <= 2 * (double)whole->work * (double)pixels);
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

static uint64_t count_work(const struct spl_tile *tile)
{
    uint32_t groups = 0;
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++)
        groups |= tile->view->layers >> layer & 1 ? 1u << group_of_layer[layer] : 0;
    const bool lit = spl_tile_get_shades(tile) & (SPL_SHADE_HEADLIGHT | SPL_SHADE_SUN);
    return spl_tile_count_work(tile, (uint32_t)__builtin_popcount(groups) + lit);
}

/* What a step has. Each piece selects anew, and draws what reaches into others: a frame in twenty takes a fifth longer.
 * So it has as much as takes step_ns by what such work took of late, and all where nobody can come between. Soft
 * spheres are another sort of work. */
static uint64_t get_step_work(const struct spl_frame_job *job)
{
    const struct spl_renderer *r = job->renderer;
    const double each = r->work_ns[job->view->method], paced = each > 0 ? (double)r->step_ns / each : 0;
    if (!r->step_ns || spl_view_shows_soft(job->view) || r->work_a_step >= SPL_STEP_WORK_MOST)
        return r->work_a_step;
    if (job->hold.alone || paced >= (double)SPL_STEP_WORK_MOST)
        return SPL_STEP_WORK_MOST;
    return paced > (double)r->work_a_step ? (uint64_t)paced : r->work_a_step;
}

/* Too much for a step. What has more than a step of unknown work is given up where it takes several times as long as it
 * was to. */
static bool is_too_much(struct spl_frame_job *job, struct spl_tile *tile)
{
    enum { patience = 4 };
    const struct spl_renderer *r = job->renderer;
    const uint64_t work = count_work(tile);
    tile->until_ns = SPL_NEVER;
    if (work <= r->work_a_step || !may_cut(job, tile, work))
        return false;
    if (work <= get_step_work(job)) {
        if (!job->hold.alone)
            tile->until_ns = spl_now_ns() + patience * r->step_ns;
        return false;
    }
    know_whole(job, tile, work, &job->frame->stats);
    return true;
}

/* A mean of the last few: what took much longer than that was given up, and nothing is known again. Small tiles tell
 * little. */
static void learn_pace(struct spl_frame_job *job, const struct spl_tile *tile, int drawn, uint64_t took_ns)
{
    struct spl_renderer *r = job->renderer;
    const uint64_t work = count_work(tile);
    double *known = &r->work_ns[job->view->method], each = (double)took_ns / (double)work;
    if (drawn == SPL_FRAME_TOO_MUCH)
        *known = 0;
    else if (!drawn && work >= r->work_a_step / 8)
        *known = *known > 0 ? *known + (each - *known) / 4 : each;
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
        know_whole(job, tile, count_work(tile), drawn);
    return rc;
}

/* Selects; anew where others had memory that this tile lacks. */
static int select_with_room(struct spl_frame_job *job, struct spl_tile *tile, struct spl_error *err)
{
    struct spl_error why = {0};
    int rc = select_tile(job, tile, &why);
    if ((!rc || rc == SPL_E_LIMIT) && give_back(job, &job->renderer->list)) {
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
        if (is_too_much(job, tile))
            return SPL_FRAME_TOO_MUCH;
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
            if (group_of_layer[layer] == group)
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
        ended = spl_gpu_wait(gpu, ticket, spl_now_ns() + spl_gpu_patience_ns(gpu), &why);
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
        learn_pace(job, tile, rc, spl_now_ns() - clock);
    }
    if (rc == SPL_FRAME_TOO_MUCH || (rc == SPL_FRAME_PAUSED && !job->pause.words))
        know_whole(job, tile, count_work(tile), stats);
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
