/* A frame from its first tile to its last, one tile a step, or a piece of one that is too much work for a step.
 *
 * Invariant: between steps a frame holds nothing on the device and nothing of the scratch: its images, the places of
 * the next tile and of the pieces of this one, what is walked of a piece that gave way (soft/pause.h), and the fill
 * plan, which is the whole image's, are all on the host. So frames may take turns, and a tile is the same whatever was
 * drawn before it, and in one or in pieces. Images are made when there is a tile to put into them: one that waits for
 * its first pages has none. A camera that is no one pinhole is drawn face by face, each as a frame of its own, and
 * looked up in them at the end (around.h). Belongs to the renderer's thread. */
#include "render/steps.h"

#include <stdlib.h>
#include <string.h>

#include "image/resample.h"
#include "render/borrowed.h"
#include "render/slot.h"
#include "render/turns.h"

/* A step: 10 ms of a core or two. */
enum { resampled_pixels = 1 << 20, looked_up_pixels = 1 << 17, bent_back_pixels = 1 << 14 };

static uint64_t count_resampled_left(const struct spl_frame_steps *steps)
{
    const struct spl_camera *wanted = &steps->wanted.camera;
    return spl_steps_are_resampled(steps) ? (uint64_t)wanted->width * (wanted->height - steps->row) : 0;
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
    if (!steps->prepared && (rc = spl_steps_prepare(steps, err)))
        return rc;
    if (steps->y < steps->view.camera.height) {
        rc = spl_steps_draw_tile(steps, err);
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
    struct spl_frame *made = spl_steps_get_made(steps);
    spl_frame_give_images_back(steps->spread ? &steps->frame : made, steps->borrowed);
    if (steps->spread) {
        spl_spread_leave(steps->spread, steps->number, steps->frame.stats.total_ms);
        if (frame && steps->drew_last)
            spl_spread_hand_out(steps->spread, frame);
        if (frame && steps->drew_last && spl_steps_are_resampled(steps)) {
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
