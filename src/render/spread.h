/* A frame that several renderers draw together, each on a thread and a device of its own: pieces of whole tiles, which
 * each takes as it has drawn its last, and puts into images that all share. Tiles are those that one renderer alone
 * would draw, and a piece has the weight of its tile, so the bytes are the same.
 *
 * Each has a stretch of the image first, the same in every frame of as many, so that it needs the pages of that stretch
 * alone; who is done takes from the end of the longest that is left. A piece that was not drawn to its end is there for
 * the others again. All functions but create() and destroy() are any thread's. */
#ifndef SPL_RENDER_SPREAD_H
#define SPL_RENDER_SPREAD_H

#include <splatd/render.h>

#include "base/error.h"
#include "render/pieces.h"
#include "render/residency.h"
#include "render/tiling.h"

enum { SPL_SPREAD_MAX = 16 }; /* renderers */

/* What is known of a tile of which pieces are drawn. */
struct spl_frame_whole {
    uint64_t pixels;     /* 0 = nothing is known: what is drawn is a tile itself */
    uint64_t work;       /* of work.c */
    uint32_t weight_max; /* of its sums */
    bool complete;       /* its draw list was */
};

struct spl_spread;

/* Can pieces of the view be drawn apart? Those of one pinhole or plan can. */
bool spl_spread_can(const struct spl_view *view);

/* For as many renderers, 1 to SPL_SPREAD_MAX. Destroyed once no steps of it are left; NULL-safe. */
int spl_spread_create(const struct spl_view *view, unsigned renderers, struct spl_spread **out, struct spl_error *err);
void spl_spread_destroy(struct spl_spread *spread);

/* Begins steps that draw what is to be had of the frame, as renderer `number`; as spl_frame_begin(), with the view that
 * the spread was made of. Their end puts back what is not drawn; it hands out the frame to who drew the last piece, and
 * an empty one to others, whose steps end when there is nothing left to take. */
int spl_frame_begin_spread(struct spl_renderer *renderer, const struct spl_dataset *dataset,
                           const struct spl_view *view, struct spl_spread *spread, unsigned number,
                           struct spl_frame_steps **out, struct spl_error *err);

/* To be asked before the end: was the last piece of the frame drawn by these? */
bool spl_frame_drew_last(const struct spl_frame_steps *steps);

/* For who draws: a piece, and its tile, by its index in the image. */
struct spl_spread_piece {
    struct spl_piece piece, tile; /* width 0: there is none left */
    uint32_t index;
    struct spl_frame_whole whole; /* of the tile, where it is known */
};

/* The next piece for renderer `number`, which has none; tiles are `tiling`'s, that of all. SPL_E_NOMEM. */
int spl_spread_take(struct spl_spread *spread, unsigned number, const struct spl_tiling *tiling,
                    struct spl_spread_piece *out, struct spl_error *err);

/* What is known of a tile from now on; who says it first counts what it draws. */
void spl_spread_tell(struct spl_spread *spread, uint32_t index, const struct spl_frame_whole *whole,
                     const struct spl_frame_stats *drawn);

/* A piece of the tile was drawn, of what `walk` asked for and had. SPL_E_NOMEM. */
int spl_spread_note_had(struct spl_spread *spread, uint32_t index, const struct spl_resident_dataset *resident,
                        uint64_t walk, struct spl_error *err);
/* Once all is drawn, of an incomplete frame: the next tile from *index on that was told, and by slot what any piece of
 * it had. What it was told to draw is of all its pages: who asks is to tell anew. False: there is none. */
bool spl_spread_find_short(struct spl_spread *spread, uint32_t *index, struct spl_piece *tile, const bool **had);
void spl_spread_tell_anew(struct spl_spread *spread, uint32_t index, const struct spl_frame_stats *drawn);

/* The piece that it has is drawn; moves what was counted into the frame's, all but total_ms. True: it was the last. */
bool spl_spread_done(struct spl_spread *spread, unsigned number, struct spl_frame_stats *counted);

/* The steps of `number` end, after so long: a piece that it has is to be taken by others. */
void spl_spread_leave(struct spl_spread *spread, unsigned number, double total_ms);

/* Has `make` fill in images that are not there, one caller at a time, and borrows them. */
int spl_spread_get_images(struct spl_spread *spread,
                          int (*make)(struct spl_frame *frame, const struct spl_view *view, struct spl_error *err),
                          struct spl_image images[SPL_LAYER_COUNT], struct spl_error *err);

/* The frame; once, after the last piece. Or its images first, once, and the rest then. */
void spl_spread_hand_out(struct spl_spread *spread, struct spl_frame *frame);
void spl_spread_hand_out_images(struct spl_spread *spread, struct spl_image images[SPL_LAYER_COUNT]);

/* Samples that nobody has taken, a renderer's share of them; 0 = none at all. */
uint64_t spl_spread_get_left(struct spl_spread *spread);

#endif
