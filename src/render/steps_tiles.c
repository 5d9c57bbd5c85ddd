/* The tiles of a frame in steps, or pieces of one that is too much work for a step: the frame's own, one after the
 * other, or what of a spread is left to take. Belongs to the renderer's thread. */
#include "render/steps.h"

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
    int rc = spl_steps_find_resident(steps, err);
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
    if (steps->drew_last && spl_steps_are_resampled(steps)) { // by these alone
        spl_spread_hand_out_images(steps->spread, steps->frame.images);
        steps->borrowed = 0;
        steps->y = steps->view.camera.height;
    }
    return SPL_OK;
}

/* The next of the frame's own. */
static int make_tile(struct spl_frame_steps *steps, struct spl_error *err)
{
    const struct spl_camera *camera = &steps->view.camera;
    struct spl_frame_job *job = &steps->job;
    int rc = spl_steps_find_resident(steps, err); // others may have been added or removed
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

int spl_steps_draw_tile(struct spl_frame_steps *steps, struct spl_error *err)
{
    return steps->spread ? make_piece(steps, err) : make_tile(steps, err);
}
