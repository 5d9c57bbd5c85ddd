/* A frame in the making, shared by steps.h (the whole) and frame.c (one tile). Everything belongs to the renderer's
 * thread. */
#ifndef SPL_RENDER_FRAME_H
#define SPL_RENDER_FRAME_H

#include "base/clock.h"
#include "base/work.h"
#include "render/hold.h"
#include "render/renderer.h"
#include "render/soft/pause.h"
#include "render/spread.h"
#include "render/tiling.h"

struct spl_frame_job {
    struct spl_renderer *renderer;
    struct spl_resident_dataset *resident; /* valid until a dataset is added or removed: looked up for each tile */
    const struct spl_view *view;           /* at least one sample a pixel */
    struct spl_frame *frame;
    struct spl_tiling tiling;
    struct spl_marks marks;                /* what is soft; count 0 = nothing */
    struct spl_marks clip;                 /* what is drawn; count 0 = all */
    struct spl_paint paint;                /* what its colours show; kind 0 = the splats' own */
    const atomic_bool *cancelled;  // may be NULL
    struct spl_error page_error;   /* why a page could not be loaded, unless it was only the limit */
    struct spl_hold hold;          /* what the frame waits with, between its steps */
    struct spl_frame_whole whole;  /* of a tile that is cut */
    bool hurries;                  /* tiles that are not there are not waited for any more */
    bool counts;                   /* nothing is drawn of what is walked: pages count as if they were there, */
    const bool *had;               // these alone, by slot; may be NULL: all
    struct spl_soft_pause pause;   /* what of the piece is walked */
    double advance; /* of spl_camera_advance(): what depths of the view are more by than those that are drawn */
};

/* What `camera` sees of the job's dataset, by the view's method and level. Borrows both. */
struct spl_select_params spl_frame_selection(struct spl_frame_job *job, const struct spl_camera *camera);

/* spl_select_spacing() of what `camera` sees. SPL_SLOT_PENDING where it has pages to wait for: it is to be called
 * again. */
int spl_frame_find_spacing(struct spl_frame_job *job, const struct spl_camera *camera, double *spacing,
                           struct spl_error *err);

/* Makes the images of the view's layers, but for those that are there: the caller's, or from a tile before.
 * SPL_E_NOMEM. */
int spl_frame_make_images(struct spl_frame *frame, const struct spl_view *view, struct spl_error *err);

/* Renders `tile` into the job's images, which it makes, and adds to its stats. Blocks until it is done;
 * SPL_SLOT_PENDING where it has pages to wait for, and nothing was drawn; SPL_FRAME_TOO_MUCH where it is too much work
 * for a step and may be cut, and nothing of it is in the images: job->whole is set, and its pieces are to be drawn.
 * SPL_FRAME_PAUSED where it gave way in the middle: it is to be drawn again, and goes on where job->pause has what was
 * walked; else it is to be cut.
 * SPL_E_TIMEOUT where the view's deadline had passed before. */
enum { SPL_FRAME_TOO_MUCH = SPL_SLOT_PENDING + 1, SPL_FRAME_PAUSED };
int spl_frame_render_tile(struct spl_frame_job *job, struct spl_tile *tile, struct spl_error *err);

/* Finds what is to be known of `tile` for its pieces, as it is with all its pages, or those of job->had: job->whole; no
 * page is asked for, but tables are. *drawn: what it draws. SPL_SLOT_PENDING where it has these to wait for;
 * SPL_E_LIMIT as of rendering. */
int spl_frame_know_tile(struct spl_frame_job *job, struct spl_tile *tile, struct spl_frame_stats *drawn,
                        struct spl_error *err);

/* What a view is told whose deadline has passed while it was drawn. */
#define SPL_FRAME_LATE                                                                                                 \
    "the deadline passed before the frame was rendered: a smaller view, less supersample, a larger lod or a budget "   \
    "take less"

/* Milliseconds since *from, which becomes now. */
static inline double spl_since_ms(uint64_t *from)
{
    uint64_t now = spl_now_ns();
    double ms = (double)(now - *from) * 1e-6;
    *from = now;
    return ms;
}

#endif
