/* A frame in steps, from the inside: what its files share. steps_begin.c begins one, steps_tiles.c draws its tiles or
 * their pieces, steps.c has them wait, step and end. Everything belongs to the renderer's thread. */
#ifndef SPL_RENDER_STEPS_H
#define SPL_RENDER_STEPS_H

#include "render/around.h"
#include "render/frame.h"
#include "render/view.h"

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
static inline bool spl_steps_are_resampled(const struct spl_frame_steps *steps)
{
    return spl_view_is_resampled(&steps->wanted) || steps->around;
}

/* The frame that is handed out at the end. */
static inline struct spl_frame *spl_steps_get_made(struct spl_frame_steps *steps)
{
    return spl_steps_are_resampled(steps) ? &steps->resampled : &steps->frame;
}

/* Begins one; what can be refused is, before the device or a page is touched. `options` NULL: a frame in steps, of
 * which all layers are handed out; `handed_out`: those that have no image of the caller's are. `spread` NULL: alone. */
int spl_steps_begin(struct spl_renderer *renderer, const struct spl_dataset *dataset, const struct spl_view *view,
                    const struct spl_render_options *options, bool handed_out, struct spl_spread *spread,
                    unsigned number, struct spl_frame_steps **out, struct spl_error *err);

/* Makes the plan. SPL_SLOT_PENDING where it has pages to wait for; then it is to be called again. */
int spl_steps_prepare(struct spl_frame_steps *steps, struct spl_error *err);

/* Looks up the dataset, as others may have been added or removed. */
int spl_steps_find_resident(struct spl_frame_steps *steps, struct spl_error *err);

/* Draws the next tile, or a piece of it; or one of what the spread has left. SPL_SLOT_PENDING: it has pages to wait
 * for. */
int spl_steps_draw_tile(struct spl_frame_steps *steps, struct spl_error *err);

#endif
