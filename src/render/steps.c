/* A frame from its first tile to its last, one tile a step, or a piece of one that is too much work for a step.
 *
 * Invariant: between steps a frame holds nothing on the device and nothing of the scratch: its images, the places of
 * the next tile and of the pieces of this one, what is walked of a piece that gave way (soft/pause.h), and the fill
 * plan, which is the whole image's, are all on the host. So frames may take turns, and a tile is the same whatever was
 * drawn before it, and in one or in pieces. Images are made when there is a tile to put into them: one that waits for
 * its first pages has none. A camera that is no one pinhole is drawn face by face, each as a frame of its own, and
 * looked up in them at the end (around.h). Belongs to the renderer's thread. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "base/sized.h"
#include "geom/size.h"
#include "image/resample.h"
#include "render/advance.h"
#include "render/around.h"
#include "render/borrowed.h"
#include "render/frame.h"
#include "render/method.h"
#include "render/pick.h"
#include "render/slot.h"
#include "render/turns.h"
#include "render/view.h"

/* A step: 10 ms of a core or two. */
enum { resampled_pixels = 1 << 20, looked_up_pixels = 1 << 17, bent_back_pixels = 1 << 14 };

/* Of a tile where maps are drawn: a software driver takes some microseconds a sample for them, and a tile has 10 s. */
enum { mapped_samples = 1 << 19 };

struct spl_frame_steps {
    const struct spl_dataset *dataset;
    struct spl_view wanted, view; /* as asked for; as rendered, with at least one sample a pixel */
    struct spl_frame frame;       /* of `view` */
    struct spl_frame resampled; /* of `wanted`, where samples a side are no whole number, or it is looked up in faces */
    struct spl_around *around; // may be NULL: `view` is not one of several faces
    struct spl_frame_job job;
    uint32_t x, y;             /* corner of the tile; y = height: all are there */
    struct spl_pieces pieces;  /* of it that are to be drawn; none: it was not begun */
    uint32_t row;              /* of `resampled`, the next */
    uint32_t borrowed;         /* layers of what is handed out whose pixels are the caller's: bit per enum spl_layer */
    struct spl_spread *spread; // may be NULL: these make all of it
    unsigned number;           /* among those that draw the spread */
    struct spl_spread_piece taken; /* of it, where `pieces` has some */
    bool drew_last;                /* of its pieces */
    bool prepared;                 /* its plan is made, for which it may have waited */
    bool slow;   /* a piece of this tile gave way and was too large to be kept: others are cut before they do */
    bool paused; /* the last step gave way in the middle of a piece */
};

/* Are its images made of others, that were drawn? */
static bool is_resampled(const struct spl_frame_steps *steps)
{
    return spl_view_is_resampled(&steps->wanted) || steps->around;
}

static uint64_t count_resampled_left(const struct spl_frame_steps *steps)
{
    const struct spl_camera *wanted = &steps->wanted.camera;
    return is_resampled(steps) ? (uint64_t)wanted->width * (wanted->height - steps->row) : 0;
}

/* The frame that is handed out at the end. */
static struct spl_frame *get_made(struct spl_frame_steps *steps)
{
    return is_resampled(steps) ? &steps->resampled : &steps->frame;
}

static int find_resident(struct spl_frame_steps *steps, struct spl_error *err)
{
    steps->job.resident = spl_residency_get(&steps->job.renderer->residency, steps->dataset);
    return steps->job.resident ? SPL_OK : spl_fail(err, SPL_E_NOT_FOUND, "the dataset was not added to this renderer");
}

/* SPL_SLOT_PENDING where it has pages to wait for; then it is to be called again. */
static int prepare(struct spl_frame_steps *steps, struct spl_error *err)
{
    struct spl_frame_job *job = &steps->job;
    const struct spl_view *view = &steps->view;
    const struct spl_method_row *method = spl_method_row(view->method);
    bool mapped = spl_dataset_get_info(steps->dataset)->maps && spl_view_get_maps(view) & SPL_MAP_COLORS;
    uint64_t samples = job->renderer->scratch.samples;
    uint32_t apron = method->apron + (mapped ? 1 : 0); // normals look so far
    struct spl_reach *reach = &job->tiling.reach;
    *reach = (struct spl_reach){.align = 1, .apron = apron};
    int rc = find_resident(steps, err);
    job->counts = steps->spread; // all of them plan the same
    if (!rc && method->prepare)
        rc = method->prepare(job, err);
    job->counts = false;
    const uint32_t shade = spl_shade_get_reach(view, spl_dataset_get_info(steps->dataset));
    if (view->surrounded)
        reach->guard += (apron + shade + 3) / 4 * 4; // as guards are: whole groups of lanes
    reach->apron += shade + reach->align - 1;
    reach->apron -= reach->apron % reach->align;
    if (!rc)
        rc = spl_tiling_init(&job->tiling, view, mapped && samples > mapped_samples ? mapped_samples : samples, err);
    steps->prepared = !rc;
    return rc;
}

/* What can be refused is, before the device or a page is touched. `options` NULL: a frame in steps, of which all layers
 * are handed out; `handed_out`: those that have no image of the caller's are. */
static int begin(struct spl_renderer *renderer, const struct spl_dataset *dataset, const struct spl_view *view,
                 const struct spl_render_options *options, bool handed_out, struct spl_spread *spread, unsigned number,
                 struct spl_frame_steps **out, struct spl_error *err)
{
    uint64_t clock = spl_now_ns();
    struct spl_view known;
    *out = NULL;
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    int rc = spl_view_read(view, &known, err);
    if (!rc)
        rc = spl_view_check_layers(&known, info, err);
    if (rc)
        return rc;
    view = &known;
    struct spl_frame_steps *steps = spl_alloc(1, sizeof *steps, err);
    if (!steps)
        return SPL_E_NOMEM;
    steps->dataset = dataset;
    steps->spread = spread;
    steps->number = number;
    steps->wanted = *view;
    steps->wanted.method = spl_method_for(view->method, info);
    steps->view = steps->wanted;
    spl_view_resize(&steps->view);
    if (spl_camera_is_bent(&view->camera))
        rc = spl_around_create(&steps->view, &steps->around, err);
    double advance = spl_camera_advance(&steps->view.camera, info);
    steps->job =
        (struct spl_frame_job){.renderer = renderer, .view = &steps->view, .frame = &steps->frame, .advance = advance};
    steps->job.cancelled = options ? spl_cancel_get_flag(options->cancel) : NULL;
    steps->job.hold.alone = options;
    steps->frame.stats.complete = true;
    if (!rc && steps->around && spl_around_is_empty(steps->around))
        steps->y = steps->view.camera.height; // there is nothing to draw
    if (!rc && options)
        rc = spl_frame_borrow_images(get_made(steps), &steps->wanted, options, &steps->borrowed, err);
    if (!rc && !handed_out && steps->borrowed != steps->wanted.layers)
        rc = spl_fail_field(err, SPL_E_USAGE, "images", "layers %#x have neither an image nor a frame",
                            steps->wanted.layers & ~steps->borrowed);
    if (!rc)
        rc = spl_marks_init(&steps->job.marks, &view->soft, dataset, err);
    if (!rc)
        rc = spl_marks_init_clip(&steps->job.clip, &view->clip, dataset, err);
    if (!rc)
        rc = spl_paint_init(&steps->job.paint, &view->color, info, err);
    if (!rc)
        spl_paint_set_stream(&steps->job.paint, spl_dataset_get_streams(dataset, &(uint32_t){0}));
    if (!rc)
        rc = spl_residency_upload(&renderer->residency, err);
    if (rc || (rc = prepare(steps, err)) < 0) {
        spl_frame_end(steps, NULL);
        return rc;
    }
    steps->frame.stats.total_ms = spl_since_ms(&clock);
    *out = steps;
    return SPL_OK;
}

int spl_frame_begin(struct spl_renderer *renderer, const struct spl_dataset *dataset, const struct spl_view *view,
                    struct spl_frame_steps **out, struct spl_error *err)
{
    return begin(renderer, dataset, view, NULL, true, NULL, 0, out, err);
}

int spl_frame_begin_spread(struct spl_renderer *renderer, const struct spl_dataset *dataset,
                           const struct spl_view *view, struct spl_spread *spread, unsigned number,
                           struct spl_frame_steps **out, struct spl_error *err)
{
    return begin(renderer, dataset, view, NULL, true, spread, number, out, err);
}

bool spl_frame_drew_last(const struct spl_frame_steps *steps)
{
    return steps->drew_last;
}

void spl_frame_set_cancel(struct spl_frame_steps *steps, const struct spl_cancel *cancel)
{
    steps->job.cancelled = spl_cancel_get_flag(cancel);
}

void spl_frame_set_gives_way(struct spl_frame_steps *steps, spl_frame_gives_way *asked, void *context)
{
    steps->job.pause.asked = asked;
    steps->job.pause.context = context;
}

bool spl_frame_is_paused(const struct spl_frame_steps *steps)
{
    return steps->paused;
}

/* Until walks of it can be kept, but for what is drawn around it. */
static void cut_slow(struct spl_frame_steps *steps)
{
    const uint64_t side = (uint64_t)steps->view.supersample;
    for (;;) {
        const struct spl_piece *next = &steps->pieces.left[steps->pieces.count - 1];
        if ((uint64_t)next->width * next->height * side * side <= SPL_SOFT_KEPT_SAMPLES / 4 ||
            !spl_pieces_cut(&steps->pieces))
            return;
    }
}

static struct spl_tile place(struct spl_frame_steps *steps, const struct spl_piece *piece)
{
    struct spl_frame_job *job = &steps->job;
    struct spl_tile tile = {.renderer = job->renderer,
                            .resident = job->resident,
                            .view = &steps->view,
                            .paint = job->paint.kind ? &job->paint : NULL,
                            .cancelled = job->cancelled,
                            .pause = &job->pause,
                            .advance = job->advance};
    spl_tiling_place(&job->tiling, piece, &tile);
    return tile;
}

/* Draws the next piece; what is too much is cut until it is not. */
static int draw_piece(struct spl_frame_steps *steps, struct spl_error *err)
{
    struct spl_frame_job *job = &steps->job;
    if (steps->slow)
        cut_slow(steps);
    for (;;) {
        struct spl_tile tile = place(steps, &steps->pieces.left[steps->pieces.count - 1]);
        int rc = spl_frame_render_tile(job, &tile, err);
        steps->paused = rc == SPL_FRAME_PAUSED;
        if (steps->paused && !job->pause.words) {
            steps->slow = true;
            spl_pieces_cut(&steps->pieces);
        }
        if (rc != SPL_FRAME_TOO_MUCH)
            return rc;
        spl_soft_pause_drop(&job->pause);
        bool cut = spl_pieces_cut(&steps->pieces);
        spl_assert(cut); // a pixel is never too much
    }
}

/* Is what it has of the spread a part of its tile? */
static bool is_cut(const struct spl_frame_steps *steps)
{
    const struct spl_spread_piece *taken = &steps->taken;
    return taken->piece.width != taken->tile.width || taken->piece.height != taken->tile.height;
}

/* The next of the spread, if there is one; its tile becomes known where it is cut. */
static int take_piece(struct spl_frame_steps *steps, struct spl_error *err)
{
    struct spl_frame_job *job = &steps->job;
    struct spl_frame_stats drawn = {.complete = true};
    if (!steps->pieces.count) {
        int rc = spl_spread_take(steps->spread, steps->number, &job->tiling, &steps->taken, err);
        if (rc || !steps->taken.piece.width)
            return rc;
        job->whole = steps->taken.whole;
        steps->slow = false;
        spl_pieces_begin(&steps->pieces, &steps->taken.piece);
    }
    if (job->whole.pixels || !is_cut(steps))
        return SPL_OK;
    struct spl_tile tile = place(steps, &steps->taken.tile);
    int rc = spl_frame_know_tile(job, &tile, &drawn, err);
    if (!rc)
        spl_spread_tell(steps->spread, steps->taken.index, &job->whole, &drawn);
    return rc;
}

/* All of the frame is drawn, and not of all pages: what is told of tiles is to be what one would draw of those that
 * there were. Where tables have gone meanwhile, it stays as it is. */
static void count_anew(struct spl_frame_steps *steps)
{
    struct spl_frame_job *job = &steps->job;
    struct spl_piece piece;
    for (uint32_t index = 0; spl_spread_find_short(steps->spread, &index, &piece, &job->had); index++) {
        struct spl_tile tile = place(steps, &piece);
        struct spl_frame_stats drawn = {.complete = true};
        job->whole = (struct spl_frame_whole){0};
        if (spl_frame_know_tile(job, &tile, &drawn, NULL) == SPL_OK)
            spl_spread_tell_anew(steps->spread, index, &drawn);
        spl_hold_release(&job->hold);
    }
    job->had = NULL;
}

/* Draws a piece of what the spread has left, or of the one that it is at. */
static int make_piece(struct spl_frame_steps *steps, struct spl_error *err)
{
    int rc = find_resident(steps, err);
    rc = rc ? rc : take_piece(steps, err);
    if (rc || !steps->pieces.count)
        return rc;
    rc = spl_spread_get_images(steps->spread, spl_frame_make_images, steps->frame.images, err);
    steps->borrowed = steps->wanted.layers;
    if (rc || (rc = draw_piece(steps, err)))
        return steps->paused ? SPL_OK : rc;
    const struct spl_frame_job *job = &steps->job;
    if (is_cut(steps) && (rc = spl_spread_note_had(steps->spread, steps->taken.index, job->resident,
                                                   job->renderer->residency.frame, err)))
        return rc;
    spl_pieces_remove(&steps->pieces);
    if (!steps->pieces.count && (steps->drew_last = spl_spread_done(steps->spread, steps->number, &steps->frame.stats)))
        count_anew(steps);
    if (steps->drew_last && is_resampled(steps)) { // by these alone
        spl_spread_hand_out_images(steps->spread, steps->frame.images);
        steps->borrowed = 0;
        steps->y = steps->view.camera.height;
    }
    return SPL_OK;
}

static int make_tile(struct spl_frame_steps *steps, struct spl_error *err)
{
    const struct spl_camera *camera = &steps->view.camera;
    struct spl_frame_job *job = &steps->job;
    int rc = find_resident(steps, err); // others may have been added or removed
    if (rc)
        return rc;
    const struct spl_piece tile = spl_tiling_get_tile(&job->tiling, camera, steps->x, steps->y);
    if (!steps->pieces.count) {
        job->whole = (struct spl_frame_whole){0};
        steps->slow = false;
        spl_pieces_begin(&steps->pieces, &tile);
    }
    if ((rc = draw_piece(steps, err)))
        return steps->paused ? SPL_OK : rc;
    spl_pieces_remove(&steps->pieces);
    if (steps->pieces.count)
        return SPL_OK;
    steps->frame.stats.tiles++;
    steps->x += tile.width;
    if (steps->x < camera->width)
        return SPL_OK;
    steps->x = 0;
    steps->y += tile.height;
    return SPL_OK;
}

static int resample(struct spl_frame_steps *steps, struct spl_error *err)
{
    const struct spl_camera *camera = &steps->wanted.camera;
    int rc = spl_frame_make_images(&steps->resampled, &steps->wanted, err);
    if (rc)
        return rc;
    const bool tangential = camera->lens.p[0] != 0 || camera->lens.p[1] != 0; // a ray takes rounds
    uint32_t pixels = !steps->around ? resampled_pixels : tangential ? bent_back_pixels : looked_up_pixels;
    uint32_t rows = pixels / camera->width + 1, left = camera->height - steps->row;
    uint32_t end = steps->row + (rows < left ? rows : left);
    if (steps->around)
        spl_around_look_up(steps->around, &steps->wanted, steps->resampled.images, steps->row, end);
    for (int layer = 0; layer < SPL_LAYER_COUNT && !steps->around; layer++)
        if (steps->resampled.images[layer].pixels)
            spl_image_resample(&steps->frame.images[layer], steps->wanted.supersample, spl_view_get_rim(&steps->wanted),
                               &steps->resampled.images[layer], steps->row, end);
    steps->row = end;
    return SPL_OK;
}

/* To the next face. */
static void go_round(struct spl_frame_steps *steps)
{
    if (!spl_around_next(steps->around, steps->frame.images, &steps->view))
        return;
    steps->x = steps->y = 0;
    steps->prepared = false;
}

/* Waits no longer for tiles, which cannot be read or have not come in time. */
static void do_without_tiles(struct spl_frame_job *job)
{
    spl_hold_release(&job->hold);
    job->hurries = true;
}

static bool may_do_without_tiles(const struct spl_frame_steps *steps)
{
    return steps->wanted.without_late_tiles && spl_dataset_get_info(steps->dataset)->tiles && !steps->job.hurries;
}

/* For whoever asks why the view did not come: returns the part that it waits for, one that hangs before one of which
 * something comes; 0: none. */
static uint32_t note_late_tiles(struct spl_frame_steps *steps)
{
    const struct spl_hold *hold = &steps->job.hold;
    uint32_t awaited = 0, hanging = 0;
    for (size_t i = hold->come; hold->waits && i < hold->count; i++) {
        const uint32_t part = spl_slot_get_part(steps->dataset, hold->slots[i]);
        if (!part || hold->pages[hold->slots[i]].filled)
            continue;
        awaited = awaited ? awaited : part;
        if (!spl_io_part_hangs(steps->job.renderer->residency.io, steps->dataset, part))
            continue;
        spl_dataset_find_late(steps->dataset, part);
        hanging = hanging ? hanging : part;
    }
    return hanging ? hanging : awaited;
}

uint32_t spl_frame_stop_waiting(struct spl_frame_steps *steps)
{
    if (may_do_without_tiles(steps))
        do_without_tiles(&steps->job);
    else if (!steps->wanted.without_late_tiles)
        return note_late_tiles(steps);
    return 0;
}

/* SPL_SLOT_PENDING: it waits. */
static int go_on(struct spl_frame_steps *steps, uint64_t deadline_ns, struct spl_error *err)
{
    uint64_t clock = spl_now_ns();
    struct spl_error why = {0};
    if (spl_is_cancelled(steps->job.cancelled))
        return spl_fail(err, SPL_E_CANCELLED, "the frame was cancelled");
    int rc = spl_residency_upload(&steps->job.renderer->residency, err);
    if (!rc)
        rc = spl_hold_poll(&steps->job.hold, &why);
    if (rc == SPL_E_TIMEOUT && why.code && may_do_without_tiles(steps)) {
        do_without_tiles(&steps->job);
        rc = SPL_OK;
    } else if (why.code) {
        char late[sizeof why.message] = "";
        const uint32_t part = note_late_tiles(steps);
        const bool named = strstr(why.message, ": its tile ");
        bool told = rc == SPL_E_TIMEOUT && !named && spl_dataset_tell_late(steps->dataset, part, late, sizeof late);
        spl_fail(err, rc, "%s%s%s", why.message, told ? ": " : "", late);
    }
    if (rc >= 0 && clock >= deadline_ns)
        return spl_fail(err, SPL_E_TIMEOUT, "%s",
                        rc ? "the deadline passed before the frame's pages had come" : SPL_FRAME_LATE);
    if (rc)
        return rc;
    spl_hold_release(&steps->job.hold);
    if (!steps->prepared && (rc = prepare(steps, err)))
        return rc;
    if (steps->y < steps->view.camera.height) {
        rc = steps->spread ? make_piece(steps, err) : make_tile(steps, err);
        if (!rc && steps->y == steps->view.camera.height && steps->around)
            go_round(steps);
        return rc;
    }
    clock = spl_now_ns();
    rc = resample(steps, err);
    steps->frame.stats.readback_ms += spl_since_ms(&clock);
    return rc;
}

int spl_frame_step(struct spl_frame_steps *steps, uint64_t deadline_ns, bool *more, struct spl_error *err)
{
    uint64_t clock = spl_now_ns();
    const double *making_ms = &steps->job.renderer->kernels.making_ms, made_ms = *making_ms;
    steps->view.deadline_ns = deadline_ns;
    steps->paused = false;
    spl_soft_pause_begin(&steps->job.pause);
    int rc = go_on(steps, deadline_ns, err);
    steps->frame.stats.total_ms += spl_since_ms(&clock);
    steps->frame.stats.kernels_ms += *making_ms - made_ms;
    *more = rc >= 0 && spl_frame_get_samples_left(steps);
    return rc < 0 ? rc : SPL_OK;
}

bool spl_frame_is_waiting(struct spl_frame_steps *steps)
{
    return spl_hold_poll(&steps->job.hold, NULL) == SPL_SLOT_PENDING;
}

uint64_t spl_frame_get_samples_left(const struct spl_frame_steps *steps)
{
    const uint64_t of_pixel = (uint64_t)(steps->view.supersample * steps->view.supersample);
    if (steps->spread)
        return spl_spread_get_left(steps->spread) + (steps->pieces.count ? steps->pieces.pixels * of_pixel : 0) +
               (steps->drew_last ? count_resampled_left(steps) : 0);
    const struct spl_camera *camera = &steps->view.camera;
    uint64_t side = (uint64_t)steps->view.supersample, rows = camera->height - steps->y;
    uint64_t drawn = rows < steps->job.tiling.height ? rows : steps->job.tiling.height; /* of those, left of x */
    const struct spl_piece tile = spl_tiling_get_tile(&steps->job.tiling, camera, steps->x, steps->y);
    uint64_t pieces = steps->pieces.count ? (uint64_t)tile.width * tile.height - steps->pieces.pixels : 0; /* drawn */
    uint64_t resampled = count_resampled_left(steps);
    resampled += steps->around ? spl_around_get_samples_left(steps->around) : 0;
    return (camera->width * rows - steps->x * drawn - pieces) * side * side + resampled;
}

void spl_frame_end(struct spl_frame_steps *steps, struct spl_frame *frame)
{
    if (frame)
        *frame = (struct spl_frame){0};
    if (!steps)
        return;
    struct spl_frame *made = get_made(steps);
    spl_frame_give_images_back(steps->spread ? &steps->frame : made, steps->borrowed);
    if (steps->spread) {
        spl_spread_leave(steps->spread, steps->number, steps->frame.stats.total_ms);
        if (frame && steps->drew_last)
            spl_spread_hand_out(steps->spread, frame);
        if (frame && steps->drew_last && is_resampled(steps)) {
            memcpy(frame->images, made->images, sizeof made->images);
            memset(made->images, 0, sizeof made->images);
        }
    } else if (frame && !spl_frame_get_samples_left(steps)) {
        steps->resampled.stats = steps->frame.stats;
        *frame = *made;
        *made = (struct spl_frame){0};
    }
    spl_hold_finish(&steps->job.hold);
    spl_soft_pause_drop(&steps->job.pause);
    spl_frame_finish(&steps->frame);
    spl_frame_finish(&steps->resampled);
    spl_around_destroy(steps->around);
    free(steps);
}

int spl_renderer_render(struct spl_renderer *renderer, const struct spl_dataset *dataset, const struct spl_view *view,
                        struct spl_frame *frame, struct spl_error *err)
{
    const struct spl_render_options none = {.size = sizeof none};
    return spl_renderer_render_with(renderer, dataset, view, &none, frame, err);
}

int spl_renderer_render_with(struct spl_renderer *renderer, const struct spl_dataset *dataset,
                             const struct spl_view *view, const struct spl_render_options *options,
                             struct spl_frame *frame, struct spl_error *err)
{
    struct spl_frame_steps *steps = NULL;
    struct spl_render_options known = {0};
    bool more = true;
    int rc = spl_sized_read(options, &known, sizeof known, "spl_render_options", err);
    if (!rc)
        rc = begin(renderer, dataset, view, &known, frame, NULL, 0, &steps, err);
    while (!rc && more) {
        rc = spl_frame_step(steps, steps->wanted.deadline_ns, &more, err);
        if (!rc && more && spl_frame_is_waiting(steps))
            spl_renderer_wait(renderer, steps->wanted.deadline_ns);
    }
    spl_frame_end(steps, rc ? NULL : frame);
    if (rc && frame)
        memset(frame, 0, sizeof *frame);
    return rc;
}

int spl_renderer_pick(struct spl_renderer *renderer, const struct spl_dataset *dataset, const struct spl_view *view,
                      double x, double y, struct spl_pick *pick, struct spl_error *err)
{
    struct spl_frame frame;
    struct spl_view known, pixel;
    *pick = (struct spl_pick){0};
    int rc = spl_view_read(view, &known, err);
    if (rc)
        return rc;
    view = &known;
    if (!(x >= 0 && x <= view->camera.width))
        return spl_fail_field(err, SPL_E_USAGE, "x", "x %g is outside the image, 0 to %u", x, view->camera.width);
    if (!(y >= 0 && y <= view->camera.height))
        return spl_fail_field(err, SPL_E_USAGE, "y", "y %g is outside the image, 0 to %u", y, view->camera.height);
    if ((rc = spl_pick_view(view, x, y, &pixel, err)))
        return rc;
    if (!spl_method_has_normals(view->method, spl_dataset_get_info(dataset)))
        pixel.layers &= ~(1u << SPL_LAYER_NORMAL);
    rc = spl_renderer_render(renderer, dataset, &pixel, &frame, err);
    if (!rc)
        spl_pick_read(&view->camera, x, y, &frame, dataset, pick);
    spl_frame_finish(&frame);
    return rc;
}
