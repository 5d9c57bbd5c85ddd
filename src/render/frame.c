/* A frame: the image is cut into tiles; each tile selects, uploads, records, waits, and is copied into the images. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "image/enlarge.h"
#include "render/occupancy.h"
#include "render/readback.h"
#include "render/renderer.h"
#include "render/tiling.h"
#include "render/wires.h"

#define FRAME_DEADLINE_NS (10 * SPL_NS_PER_S)
/* 25 x 25 at 1248 x 768 is 0.7e9 looks and 0.8 s of two cores. */
static const double constant_looks = 65000, constant_work = 3e9;

static const struct spl_method_ops *const methods[SPL_METHOD_COUNT] = {
    [SPL_METHOD_SPLAT] = &spl_method_splat,
    [SPL_METHOD_POINTS] = &spl_method_points,
    [SPL_METHOD_FILL] = &spl_method_fill,
};

/* Which run of the shade pass each layer needs; coverage reads the depth only and goes with whatever runs. */
static const uint8_t group_of_layer[SPL_LAYER_COUNT] = {
    [SPL_LAYER_COLOR] = SPL_SUMS_COLOR,   [SPL_LAYER_DEPTH] = SPL_SUMS_DEPTH, [SPL_LAYER_RANGE] = SPL_SUMS_DEPTH,
    [SPL_LAYER_NORMAL] = SPL_SUMS_NORMAL, [SPL_LAYER_ID] = SPL_SUMS_ID,       [SPL_LAYER_COVERAGE] = SPL_SUMS_COLOR,
};

struct frame_job {
    struct spl_renderer *renderer;
    struct spl_resident_dataset *resident;
    const struct spl_view *view;
    struct spl_frame *frame;
    struct spl_tiling tiling;
    const struct spl_wires *wires; /* method fill */
    struct spl_error page_error;   /* why a page could not be loaded, unless it was only the limit */
};

static bool ask_slot(struct frame_job *job, uint32_t slot)
{
    struct spl_error why = {0};
    int rc = spl_residency_ask(&job->renderer->residency, job->resident, slot, &why);
    if (rc && rc != SPL_E_LIMIT && rc != SPL_E_NOMEM)
        spl_fail(&job->page_error, rc, "%s", why.message);
    return rc == SPL_OK;
}

static bool ask_page(void *context, uint32_t page)
{
    return ask_slot(context, page);
}

static bool ask_textures(void *context, uint32_t page)
{
    struct frame_job *job = context;
    return ask_slot(job, spl_dictionary_slot(job->resident)) && ask_slot(job, spl_textures_slot(job->resident, page));
}

static struct spl_select_params selection(struct frame_job *job, const struct spl_camera *camera)
{
    return (struct spl_select_params){
        .dataset = job->resident->dataset,
        .camera = camera,
        .lod = job->view->lod,
        .low_pass = SPL_LOW_PASS,
        .points = job->view->method != SPL_METHOD_SPLAT,
        .lines = job->view->method == SPL_METHOD_FILL,
        .resident = ask_page,
        .atoms = spl_view_is_textured(job->view) ? job->view->atoms : 0,
        .textured = ask_textures,
        .context = job,
    };
}

static int select_tile(struct frame_job *job, struct spl_tile *tile, struct spl_error *err)
{
    struct spl_renderer *r = job->renderer;
    struct spl_select_params params = selection(job, &tile->camera);
    spl_residency_begin_frame(&r->residency);
    struct spl_error why = {0}; // a page that cannot be loaded looks like a limit to the selection
    int rc = spl_select(&params, &r->list, &why);
    if (job->page_error.code)
        return spl_fail(err, job->page_error.code, "%s", job->page_error.message);
    if (rc)
        return spl_fail_field(err, rc, why.field, "%s", why.message);
    if (job->view->method == SPL_METHOD_FILL && (rc = spl_wires_draw(job->wires, &tile->camera, &r->list, err)))
        return rc;
    tile->params.weight_max = spl_occupancy_weight(r->list.sample_splats);
    if (!tile->params.weight_max && job->view->method == SPL_METHOD_SPLAT)
        return spl_fail_field(err, SPL_E_LIMIT, "lod",
                              "at lod %g up to %llu splats would blend in one pixel; raise lod", job->view->lod,
                              (unsigned long long)r->list.sample_splats);
    return SPL_OK;
}

/* Records every group and layer of the view; the n-th requested layer starts at word n * pixels. */
static int record(struct spl_tile *tile, struct spl_error *err)
{
    struct spl_renderer *r = tile->renderer;
    uint32_t pixels = tile->width * tile->height, wanted = tile->view->layers;
    bool first = true;
    int rc = spl_gpu_begin(r->gpu, err);
    if (rc)
        return rc;
    spl_tile_stamp(tile, SPL_STAGE_BEGIN);
    rc = spl_tile_take_slots(tile, err);
    for (uint32_t group = 0; group < SPL_SUMS_COUNT && !rc; group++) {
        uint32_t layers = 0;
        for (uint32_t layer = 0; layer < SPL_LAYER_COUNT; layer++)
            if (group_of_layer[layer] == group)
                layers |= 1u << layer & wanted;
        if (!layers)
            continue;
        rc = methods[tile->view->method]->record(tile, group, first, err);
        first = false;
        for (uint32_t layer = 0; layer < SPL_LAYER_COUNT && !rc; layer++)
            if (layers >> layer & 1)
                rc = spl_tile_dispatch_resolve(tile, layer, pixels * spl_readback_rank(wanted, layer), err);
        spl_gpu_barrier(r->gpu);
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
        [SPL_STAGE_RESOLVE] = &stats->resolve_ms,
    };
    for (uint32_t i = 1; i < tile->stamps; i++) {
        uint64_t from = spl_gpu_get_timestamp_ns(tile->renderer->gpu, i - 1);
        uint64_t to = spl_gpu_get_timestamp_ns(tile->renderer->gpu, i);
        if (from && to > from)
            *stage_ms[tile->stamp_stage[i]] += (double)(to - from) * 1e-6;
    }
}

static double since_ms(uint64_t *from)
{
    uint64_t now = spl_now_ns();
    double ms = (double)(now - *from) * 1e-6;
    *from = now;
    return ms;
}

static int render_tile(struct frame_job *job, struct spl_tile *tile, struct spl_error *err)
{
    struct spl_renderer *r = job->renderer;
    struct spl_frame_stats *stats = &job->frame->stats;
    uint64_t ticket, clock = spl_now_ns();
    if (clock >= job->view->deadline_ns)
        return spl_fail(err, SPL_E_TIMEOUT, "the deadline passed before the frame was rendered");
    int rc = select_tile(job, tile, err);
    stats->select_ms += since_ms(&clock);
    if (!rc)
        rc = spl_scratch_upload(&r->scratch, &r->residency, &r->list, err);
    stats->upload_ms += since_ms(&clock);
    if (!rc)
        rc = record(tile, err);
    if (!rc)
        rc = spl_gpu_submit(r->gpu, &ticket, err);
    /* The device is given its own full deadline: a request that is merely late must not mark it lost. */
    if (!rc)
        rc = spl_gpu_wait(r->gpu, ticket, spl_now_ns() + FRAME_DEADLINE_NS, err);
    if (rc)
        return rc;
    clock = spl_now_ns();
    spl_readback_tile(tile, spl_gpu_buffer_map(r->scratch.readback), job->frame->images);
    stats->readback_ms += since_ms(&clock);
    add_times(tile, stats);
    stats->splats_drawn += r->list.splats;
    stats->chunks_drawn += r->list.chunk_count;
    stats->nodes_drawn += r->list.nodes;
    stats->complete &= r->list.complete;
    stats->tiles++;
    return SPL_OK;
}

static int make_images(struct spl_frame *frame, const struct spl_view *view, struct spl_error *err)
{
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
        if (!(view->layers >> layer & 1))
            continue;
        struct spl_image *image = &frame->images[layer];
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

/* The constant operator looks at every sample of the kernel: what a software driver cannot do before the device's
 * deadline, or in the rounds that it allows an invocation, is refused before it costs the device. */
static int check_work(const struct frame_job *job, const struct spl_camera *camera, struct spl_error *err)
{
    const struct spl_fill_plan *plan = &job->tiling.fill;
    double side = 2 * floor(plan->kernel) + 1;
    double samples = ((double)camera->width + 2 * plan->guard) * ((double)camera->height + 2 * plan->guard);
    samples = fmin(samples, (double)job->renderer->scratch.samples);
    if (job->view->visibility != SPL_VISIBILITY_CONSTANT)
        return SPL_OK;
    if (side * side > constant_looks ||
        (spl_gpu_get_device(job->renderer->gpu)->software && side * side * samples > constant_work))
        return spl_fail_field(
            err, SPL_E_LIMIT, "kernel",
            "visibility constant with a kernel of %g x %g samples takes too long in this image; ask for a "
            "smaller kernel, or for visibility adaptive",
            side, side);
    return SPL_OK;
}

/* The plan is the whole image's, or tiles would show where they meet. */
static int plan_fill(struct frame_job *job, struct spl_error *err)
{
    struct spl_camera camera;
    double spacing = 1;
    spl_tiling_get_camera(job->view, &camera);
    struct spl_select_params params = selection(job, &camera);
    uint64_t clock = spl_now_ns();
    spl_residency_begin_frame(&job->renderer->residency);
    int rc = job->view->kernel > 0 ? SPL_OK : spl_select_spacing(&params, &spacing, &job->frame->stats.complete, err);
    job->frame->stats.select_ms += since_ms(&clock);
    if (job->page_error.code)
        return spl_fail(err, job->page_error.code, "%s", job->page_error.message);
    spl_fill_plan_init(&job->tiling.fill, job->view, spacing);
    return rc ? rc : check_work(job, &camera, err);
}

/* A view with at least one sample a pixel. */
static int render_view(struct spl_renderer *renderer, const struct spl_dataset *dataset, const struct spl_view *view,
                       struct spl_frame *frame, struct spl_error *err)
{
    uint64_t start = spl_now_ns(), loaded = renderer->residency.pages_loaded;
    struct frame_job job = {.renderer = renderer, .view = view, .frame = frame};
    int rc = 0;
    job.resident = spl_residency_get(&renderer->residency, dataset);
    if (!job.resident)
        return spl_fail(err, SPL_E_NOT_FOUND, "the dataset was not added to this renderer");
    frame->stats.complete = true;
    if (view->method == SPL_METHOD_FILL)
        rc = plan_fill(&job, err);
    if (!rc && view->method == SPL_METHOD_FILL)
        rc = spl_dataset_get_wires(dataset, &job.wires, err);
    if (!rc)
        rc = spl_tiling_init(&job.tiling, view, renderer->scratch.samples, err);
    if (!rc)
        rc = make_images(frame, view, err);
    for (uint32_t y = 0; y < view->camera.height && !rc; y += job.tiling.height)
        for (uint32_t x = 0; x < view->camera.width && !rc; x += job.tiling.width) {
            struct spl_tile tile = {.renderer = renderer, .resident = job.resident, .view = view};
            spl_tiling_place(&job.tiling, x, y, &tile);
            rc = render_tile(&job, &tile, err);
        }
    frame->stats.pages_loaded = renderer->residency.pages_loaded - loaded;
    frame->stats.total_ms = since_ms(&start);
    if (rc)
        spl_frame_finish(frame);
    return rc;
}

/* Renders a share of the size and enlarges it; a pixel's centre stays where it is in the world. */
static int render_small(struct spl_renderer *renderer, const struct spl_dataset *dataset, const struct spl_view *view,
                        struct spl_frame *frame, struct spl_error *err)
{
    double scale = view->supersample;
    struct spl_view small = *view;
    struct spl_frame coarse = {0};
    uint64_t clock = spl_now_ns();
    small.supersample = 1;
    small.kernel = view->kernel > 0 ? fmax(view->kernel * scale, 3) : view->kernel;
    small.camera.width = (uint32_t)ceil(view->camera.width * scale);
    small.camera.height = (uint32_t)ceil(view->camera.height * scale);
    small.camera.fx *= scale;
    small.camera.fy *= scale;
    small.camera.cx *= scale;
    small.camera.cy *= scale;
    int rc = render_view(renderer, dataset, &small, &coarse, err);
    if (!rc)
        rc = make_images(frame, view, err);
    frame->stats = coarse.stats;
    double rendered_ms = since_ms(&clock);
    for (int layer = 0; layer < SPL_LAYER_COUNT && !rc; layer++)
        if (coarse.images[layer].pixels)
            spl_image_enlarge(&coarse.images[layer], scale, &frame->images[layer]);
    double enlarged_ms = since_ms(&clock);
    frame->stats.readback_ms += enlarged_ms;
    frame->stats.total_ms = rendered_ms + enlarged_ms;
    spl_frame_finish(&coarse);
    if (rc)
        spl_frame_finish(frame);
    return rc;
}

int spl_renderer_render(struct spl_renderer *renderer, const struct spl_dataset *dataset, const struct spl_view *view,
                        struct spl_frame *frame, struct spl_error *err)
{
    memset(frame, 0, sizeof *frame);
    int rc = spl_view_check(view, err);
    if (rc)
        return rc;
    struct spl_view bare = *view;
    if (!spl_dataset_get_info(dataset)->has_surface) {
        if (view->layers >> SPL_LAYER_NORMAL & 1 && view->method == SPL_METHOD_POINTS)
            return spl_fail_field(err, SPL_E_INPUT, "layer",
                                  "dataset '%s' has no normals, as it was packed with --points-only: ask for method "
                                  "fill, which takes them from depth, or pack it without",
                                  spl_dataset_get_info(dataset)->id);
        bare.method = view->method == SPL_METHOD_SPLAT ? SPL_METHOD_FILL : view->method;
        view = &bare;
    }
    return view->supersample < 1 ? render_small(renderer, dataset, view, frame, err)
                                 : render_view(renderer, dataset, view, frame, err);
}
