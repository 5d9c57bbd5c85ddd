/* A renderer without a device, linked in place of the real one where tests are about the service: frames of a flat
 * colour that take as long as FAKE_FRAME_MS says and, by setting and size, FAKE_MPX_MS and FAKE_SOFT_MS (see
 * frame_ns()), in steps of a tile like the real one's, which those of soft models base and concentric end early where
 * that is asked for; losses on demand, failures to open after FAKE_OPEN_LIMIT times, FAKE_OPEN_MS to open, no room for
 * frames of more than FAKE_ROOM_PX samples, FAKE_PAGES_MS that a frame waits for its pages, FAKE_UPLOADS that it takes
 * to put them on the device, and FAKE_HANG_MS that the first frame ignores its deadline for, as a hanging driver does;
 * FAKE_LOSE_LOADING pages of one dataset in which the device is lost; FAKE_LOSE_FRAME, while which every frame loses
 * it; FAKE_REFUSE datasets that have no room; the device "other" is of another kind. What a test holds up until it
 * has seen what it came for it names by a file: while that of FAKE_STEPS is there, only as many steps end as the
 * number in it says; while those of FAKE_OPENING, FAKE_PAGES and FAKE_HANG are there, no device is opened, no page
 * has come, and the first frame hangs. Tests in the same process hold frames without files (fake_renderer.h). TSan sees
 * it all, which it cannot with a driver that compiles its own code. */
#include "fake_renderer.h"

#include <splatd/render.h>

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/error.h"
#include "base/memory.h"
#include "render/fault.h"
#include "render/spread.h"
#include "render/turns.h"

struct spl_renderer {
    struct spl_device_info device;
    bool lose_next, lost, hung;
    const struct spl_dataset *lost_by;
    long uploads;
};

struct fake_frames fake_frames;

static pthread_mutex_t environment = PTHREAD_MUTEX_INITIALIZER;

void fake_setenv(const char *name, const char *value)
{
    pthread_mutex_lock(&environment);
    setenv(name, value, 1);
    pthread_mutex_unlock(&environment);
}

void fake_unsetenv(const char *name)
{
    pthread_mutex_lock(&environment);
    unsetenv(name);
    pthread_mutex_unlock(&environment);
}

/* The text stays as it is; another may come in its place. */
static const char *get_text(const char *name)
{
    pthread_mutex_lock(&environment);
    const char *text = getenv(name);
    pthread_mutex_unlock(&environment);
    return text;
}

static long setting(const char *name, long otherwise)
{
    const char *text = get_text(name);
    return text ? strtol(text, NULL, 10) : otherwise;
}

static bool is_held(const char *name)
{
    const char *path = get_text(name);
    return path && !access(path, F_OK);
}

static void wait_while_held(const char *name)
{
    while (is_held(name))
        usleep(1000);
}

/* Whether one more step may end; it is counted then. */
static bool may_end(void)
{
    static _Atomic long ended; /* since the file is there */
    const char *path = get_text("FAKE_STEPS");
    FILE *file = path ? fopen(path, "r") : NULL;
    long allowed = 0;
    if (!file) {
        ended = 0;
        return true;
    }
    if (fscanf(file, "%ld", &allowed) != 1)
        allowed = 0;
    fclose(file);
    if (ended++ < allowed)
        return true;
    ended--;
    return false;
}

int spl_renderer_create(const struct spl_renderer_options *options, struct spl_renderer **out, struct spl_error *err)
{
    static _Atomic long opened;
    if (options->require_gpu || opened++ >= setting("FAKE_OPEN_LIMIT", 1000))
        return spl_fail(err, SPL_E_NO_DEVICE, "no usable device: the fake one is software");
    usleep((useconds_t)setting("FAKE_OPEN_MS", 0) * 1000);
    while (atomic_load(&fake_frames.closed))
        usleep(500);
    wait_while_held("FAKE_OPENING");
    if (!(*out = spl_alloc(1, sizeof **out, err)))
        return SPL_E_NOMEM;
    (*out)->device =
        (struct spl_device_info){.backend = "fake", .name = "flat colour", .driver = "tests", .software = true};
    if (options->device && !strcmp(options->device, "other"))
        strcpy((*out)->device.name, "another colour");
    return 0;
}

void spl_renderer_destroy(struct spl_renderer *renderer)
{
    free(renderer);
}

const struct spl_device_info *spl_renderer_get_device(const struct spl_renderer *renderer)
{
    return &renderer->device;
}

int spl_renderer_add(struct spl_renderer *renderer, const struct spl_dataset *dataset, struct spl_error *err)
{
    static _Atomic long refused;
    (void)renderer;
    (void)dataset;
    if (refused < setting("FAKE_REFUSE", 0)) {
        refused++;
        return spl_fail(err, SPL_E_LIMIT, "the fake device has no room");
    }
    return 0;
}

void spl_renderer_remove(struct spl_renderer *renderer, const struct spl_dataset *dataset)
{
    (void)renderer;
    (void)dataset;
}

int spl_renderer_upload(struct spl_renderer *renderer, struct spl_error *err)
{
    (void)err;
    renderer->uploads++;
    return 0;
}

bool spl_renderer_wait(struct spl_renderer *renderer, uint64_t deadline_ns)
{
    if (renderer->uploads < setting("FAKE_UPLOADS", 0))
        return true;
    if (spl_remaining_ns(deadline_ns))
        usleep(1000);
    return false;
}

int spl_renderer_preload_page(struct spl_renderer *renderer, const struct spl_dataset *dataset, uint32_t *page,
                              bool *more, struct spl_error *err)
{
    static _Atomic long late, losses;
    static const struct spl_dataset *_Atomic loser; /* the first that is loaded once it is set */
    *more = false;
    if (losses < setting("FAKE_LOSE_LOADING", 0) && (!loser || loser == dataset)) {
        losses++;
        loser = dataset;
        renderer->lost = true;
        renderer->lost_by = dataset;
        return spl_fail(err, SPL_E_DEVICE_LOST, "the fake device was lost in a page");
    }
    if (late++ < setting("FAKE_LOAD_LATE", 0))
        return spl_fail(err, SPL_E_TIMEOUT, "no page has come for 10 s");
    *page = 1;
    return spl_renderer_add(renderer, dataset, err);
}

int spl_renderer_preload(struct spl_renderer *renderer, const struct spl_dataset *dataset, struct spl_error *err)
{
    return spl_renderer_add(renderer, dataset, err);
}

void spl_renderer_get_residency(struct spl_renderer *renderer, const struct spl_dataset *dataset,
                                struct spl_residency_info *info)
{
    (void)renderer;
    *info = (struct spl_residency_info){
        .bytes = dataset ? 1 << 16 : 0, .limit_bytes = 1 << 30, .taken_bytes = spl_renderer_get_memory(renderer)};
}

static int fill(struct spl_image *image, enum spl_layer layer, const struct spl_view *view, struct spl_error *err)
{
    static const enum spl_pixel_type types[SPL_LAYER_COUNT] = {SPL_PIXEL_RGBA8, SPL_PIXEL_F32, SPL_PIXEL_F32,
                                                               SPL_PIXEL_F32X3, SPL_PIXEL_U32, SPL_PIXEL_F32,
                                                               SPL_PIXEL_U32};
    const struct spl_camera *camera = &view->camera;
    size_t pixels = (size_t)camera->width * camera->height;
    *image = (struct spl_image){layer, types[layer], camera->width, camera->height, NULL};
    uint32_t words = spl_pixel_bytes(image->type) / 4;
    uint32_t *out = image->pixels = spl_alloc_raw(pixels * words, 4, err);
    if (!out)
        return SPL_E_NOMEM;
    float depth = (float)camera->eye[2] + 100; // beyond 65.535 m where a test wants saturation
    uint32_t word;
    memcpy(&word, &depth, 4);
    if (image->type == SPL_PIXEL_RGBA8)
        memcpy(&word, view->background, 4);
    if (layer == SPL_LAYER_PRIMITIVE)
        word = SPL_SHAPE_SPLAT;
    for (size_t i = 0; i < pixels * words; i++)
        out[i] = word;
    return 0;
}

static double samples_of(const struct spl_view *view)
{
    return 1e-6 * view->camera.width * view->camera.height * view->supersample * view->supersample;
}

/* FAKE_SOFT_MS a megapixel of what is soft, at lod=1, whatever the method. */
static double soft_ms(const struct spl_view *view)
{
    bool soft = view->soft.what.count && view->soft.opacity > 0;
    return soft ? (double)setting("FAKE_SOFT_MS", 0) * samples_of(view) / (view->lod > 1 ? view->lod : 1) : 0;
}

/* FAKE_FRAME_MS and, a megapixel of splats at lod=1, FAKE_MPX_MS: proportional to samples, a quarter of it for points,
 * less where the level is coarser. */
static uint64_t frame_ns(const struct spl_view *view)
{
    double share = (view->method == SPL_METHOD_POINTS ? 0.25 : 1) / (view->lod > 1 ? view->lod : 1);
    double ms = (double)setting("FAKE_FRAME_MS", 1) + (double)setting("FAKE_MPX_MS", 0) * samples_of(view) * share;
    return (uint64_t)((ms + soft_ms(view)) * SPL_NS_PER_MS);
}

struct spl_frame_steps {
    struct spl_renderer *renderer;
    struct spl_view view;
    struct spl_frame frame;
    const struct spl_cancel *cancel; // may be NULL
    uint64_t left;     /* samples */
    uint64_t there_ns; /* when its pages are */
    uint64_t drawn_ns; /* of the tile, before it gave way */
    struct spl_spread *spread; // may be NULL
    unsigned number;
    struct spl_spread_piece taken; /* of it; width 0: none */
    bool drew_last;
    bool paused;
    spl_frame_gives_way *asked; // may be NULL
    void *context;
};

int spl_frame_begin(struct spl_renderer *renderer, const struct spl_dataset *dataset, const struct spl_view *view,
                    struct spl_frame_steps **out, struct spl_error *err)
{
    (void)dataset;
    if (spl_view_get_samples(view) > (uint64_t)setting("FAKE_ROOM_PX", 1 << 30))
        return spl_fail(err, SPL_E_LIMIT, "a draw list of 9 bytes has no room on the fake device");
    struct spl_frame_steps *steps = *out = spl_alloc(1, sizeof *steps, err);
    if (!steps)
        return SPL_E_NOMEM;
    *steps = (struct spl_frame_steps){.renderer = renderer,
                                      .view = *view,
                                      .left = spl_view_get_samples(view),
                                      .there_ns = spl_now_ns() + (uint64_t)setting("FAKE_PAGES_MS", 0) * SPL_NS_PER_MS};
    return 0;
}

int spl_frame_begin_spread(struct spl_renderer *renderer, const struct spl_dataset *dataset,
                           const struct spl_view *view, struct spl_spread *spread, unsigned number,
                           struct spl_frame_steps **out, struct spl_error *err)
{
    int rc = spl_frame_begin(renderer, dataset, view, out, err);
    if (rc)
        return rc;
    (*out)->spread = spread;
    (*out)->number = number;
    return 0;
}

bool spl_frame_drew_last(const struct spl_frame_steps *steps)
{
    return steps->drew_last;
}

void spl_frame_set_cancel(struct spl_frame_steps *steps, const struct spl_cancel *cancel)
{
    steps->cancel = cancel;
}

void spl_frame_set_gives_way(struct spl_frame_steps *steps, spl_frame_gives_way *asked, void *context)
{
    steps->asked = asked;
    steps->context = context;
}

bool spl_frame_is_paused(const struct spl_frame_steps *steps)
{
    return steps->paused;
}

static bool gives_way(const struct spl_frame_steps *steps, uint64_t began)
{
    const struct spl_soft_params *soft = &steps->view.soft;
    bool walks = soft->what.count && (soft->model == SPL_SOFT_MODEL_BASE || soft->model == SPL_SOFT_MODEL_CONCENTRIC);
    return walks && steps->asked && steps->asked(steps->context, spl_now_ns() - began, 0);
}

static int fill_all(struct spl_frame *frame, const struct spl_view *view, struct spl_error *err)
{
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++)
        if (view->layers >> layer & 1 && !frame->images[layer].pixels &&
            fill(&frame->images[layer], (enum spl_layer)layer, view, err))
            return SPL_E_NOMEM;
    return 0;
}

/* Samples of the tile or piece that is next; 0: there is no piece left. */
static uint64_t find_next(struct spl_frame_steps *steps)
{
    const struct spl_tiling tiling = {.width = steps->view.camera.width, .height = steps->view.camera.height};
    if (!steps->spread)
        return steps->left < SPL_TILE_SAMPLES ? steps->left : SPL_TILE_SAMPLES;
    if (!steps->taken.piece.width)
        spl_spread_take(steps->spread, steps->number, &tiling, &steps->taken, NULL);
    double pixels = (double)steps->taken.piece.width * steps->taken.piece.height;
    return (uint64_t)(pixels * steps->view.supersample * steps->view.supersample);
}

/* The piece is drawn. */
static int finish_piece(struct spl_frame_steps *steps, struct spl_error *err)
{
    struct spl_frame_stats stats = {.complete = true};
    struct spl_image images[SPL_LAYER_COUNT];
    int rc = spl_spread_get_images(steps->spread, fill_all, images, err);
    steps->taken = (struct spl_spread_piece){0};
    steps->drew_last = !rc && spl_spread_done(steps->spread, steps->number, &stats);
    return rc;
}

static int make_images(struct spl_frame_steps *steps, struct spl_error *err)
{
    if (fill_all(&steps->frame, &steps->view, err))
        return SPL_E_NOMEM;
    steps->frame.stats.soft_ms = soft_ms(&steps->view);
    steps->frame.stats.complete = !spl_remaining_ns(steps->there_ns) && !is_held("FAKE_PAGES");
    steps->frame.stats.pending = !steps->frame.stats.complete;
    return 0;
}

bool spl_frame_is_waiting(struct spl_frame_steps *steps)
{
    return !steps->view.partial &&
           (spl_remaining_ns(steps->there_ns) || is_held("FAKE_PAGES") ||
            steps->renderer->uploads < setting("FAKE_UPLOADS", 0));
}

uint32_t spl_frame_stop_waiting(struct spl_frame_steps *steps)
{
    (void)steps;
    return 0; // its datasets have no tiles
}

static int lose(struct spl_renderer *renderer, struct spl_error *err)
{
    renderer->lost = true;
    return spl_fail(err, SPL_E_DEVICE_LOST, "the fake device was told to be lost");
}

/* Until `until_ns`, and as long as frames are held. The step ends before where it gives way: then it is paused. */
static int take_time(struct spl_frame_steps *steps, uint64_t began_ns, uint64_t until_ns, uint64_t deadline_ns,
                     struct spl_error *err)
{
    int rc = 0;
    steps->paused = false;
    atomic_fetch_add(&fake_frames.drawing, 1);
    while (!rc && !steps->paused && (atomic_load(&fake_frames.held) || spl_remaining_ns(until_ns) || !may_end())) {
        if ((steps->paused = gives_way(steps, began_ns)))
            steps->drawn_ns += spl_now_ns() - began_ns;
        else if (!spl_remaining_ns(deadline_ns))
            rc = spl_fail(err, SPL_E_TIMEOUT, "the deadline passed before the frame was rendered");
        else if (spl_cancel_is_set(steps->cancel))
            rc = spl_fail(err, SPL_E_CANCELLED, "the frame was cancelled");
        else
            usleep(500);
    }
    atomic_fetch_sub(&fake_frames.drawing, 1);
    return rc;
}

static bool is_endless(const struct spl_frame_steps *steps)
{
    const uint64_t endless_px = atomic_load(&fake_frames.endless_px);
    return endless_px && spl_view_get_samples(&steps->view) >= endless_px;
}

int spl_frame_step(struct spl_frame_steps *steps, uint64_t deadline_ns, bool *more, struct spl_error *err)
{
    struct spl_renderer *renderer = steps->renderer;
    uint64_t tile = find_next(steps);
    double share = (double)tile / (double)spl_view_get_samples(&steps->view);
    *more = false;
    if (renderer->lose_next || renderer->lost || setting("FAKE_LOSE_FRAME", 0))
        return lose(renderer, err);
    if (spl_frame_is_waiting(steps)) {
        *more = true;
        return spl_remaining_ns(deadline_ns) ? 0 : spl_fail(err, SPL_E_TIMEOUT, "the deadline passed");
    }
    if (!renderer->hung) {
        renderer->hung = true;
        usleep((useconds_t)setting("FAKE_HANG_MS", 0) * 1000);
        wait_while_held("FAKE_HANG");
        usleep((useconds_t)setting("FAKE_KERNELS_MS", 0) * 1000);
        steps->frame.stats.kernels_ms = (double)setting("FAKE_KERNELS_MS", 0);
        atomic_fetch_add(&fake_frames.hanging, 1);
        while (atomic_load(&fake_frames.hang))
            usleep(500);
        atomic_fetch_sub(&fake_frames.hanging, 1);
        if (setting("FAKE_LOSE_FRAME", 0))
            return lose(renderer, err);
    }
    const uint64_t began = spl_now_ns(), whole = (uint64_t)((double)frame_ns(&steps->view) * share);
    const uint64_t until = began + (whole > steps->drawn_ns ? whole - steps->drawn_ns : 0);
    int rc = take_time(steps, began, until, deadline_ns, err);
    if (rc)
        return rc;
    if (steps->paused || is_endless(steps)) {
        *more = true;
        return 0;
    }
    /* what others kept it from the processor for is told as what is no property of the view */
    steps->frame.stats.kernels_ms += (double)(spl_now_ns() - until) / SPL_NS_PER_MS;
    steps->drawn_ns = 0;
    if (steps->spread) {
        rc = tile ? finish_piece(steps, err) : 0;
        *more = !rc && spl_spread_get_left(steps->spread);
        return rc;
    }
    steps->left -= tile;
    *more = steps->left;
    return *more ? 0 : make_images(steps, err);
}

uint64_t spl_frame_get_samples_left(const struct spl_frame_steps *steps)
{
    return steps->spread ? spl_spread_get_left(steps->spread) : steps->left;
}

void spl_frame_end(struct spl_frame_steps *steps, struct spl_frame *frame)
{
    if (steps && steps->spread)
        spl_spread_leave(steps->spread, steps->number, 0);
    if (frame && steps->drew_last) {
        spl_spread_hand_out(steps->spread, frame);
    } else if (frame) {
        *frame = steps->frame;
        steps->frame = (struct spl_frame){0};
    }
    if (steps)
        spl_frame_finish(&steps->frame);
    free(steps);
}

uint64_t spl_renderer_get_memory(const struct spl_renderer *renderer)
{
    (void)renderer;
    return 1 << 20;
}

const struct spl_dataset *spl_renderer_get_lost_dataset(const struct spl_renderer *renderer)
{
    return renderer->lost_by;
}

void spl_renderer_inject_loss(struct spl_renderer *renderer)
{
    renderer->lose_next = true;
}
