/* What the files of a frame's tile share: frame.c, which draws it, frame_walk.c and frame_pace.c. */
#ifndef SPL_RENDER_FRAME_PARTS_H
#define SPL_RENDER_FRAME_PARTS_H

#include "render/frame.h"

/* frame_walk.c. Ends a walk: 0, SPL_SLOT_PENDING where it is to be made again once what it asked for has come, or an
 * error, that of a page among them. */
int spl_frame_end_walk(struct spl_frame_job *job, struct spl_error *err);

/* Gives back what others needed where a walk has left out what then has room, so that what is left out follows from
 * the view alone: it is to be made anew. Soft views keep what the stage had of the one before: it is an eighth of all
 * memory, and pages in its place would have to be read and driven out with each. */
bool spl_frame_give_back(struct spl_frame_job *job, const struct spl_draw_list *list);

/* frame_pace.c. The work of a tile that was selected, for all layers of its view: units of spl_tile_count_work(). */
uint64_t spl_frame_count_work(const struct spl_tile *tile);

/* Is it too much for a step, and may be cut? What has more than a step of unknown work is given up where it takes
 * several times as long as it was to: tile->until_ns. */
bool spl_frame_is_too_much(const struct spl_frame_job *job, struct spl_tile *tile);

/* What a unit of work takes, a mean of the last few tiles: this one was drawn (0), given up (SPL_FRAME_TOO_MUCH:
 * nothing is known again) or failed. Small tiles tell little. */
void spl_frame_learn_pace(const struct spl_frame_job *job, const struct spl_tile *tile, int drawn, uint64_t took_ns);

/* Which run of the shade pass each layer needs; coverage reads the depth only and goes with whatever runs. */
static inline uint32_t spl_layer_sums(uint32_t layer)
{
    static const uint8_t sums[SPL_LAYER_COUNT] = {
        [SPL_LAYER_COLOR] = SPL_SUMS_COLOR,   [SPL_LAYER_DEPTH] = SPL_SUMS_DEPTH, [SPL_LAYER_RANGE] = SPL_SUMS_DEPTH,
        [SPL_LAYER_NORMAL] = SPL_SUMS_NORMAL, [SPL_LAYER_ID] = SPL_SUMS_ID,       [SPL_LAYER_COVERAGE] = SPL_SUMS_COLOR,
        [SPL_LAYER_PRIMITIVE] = SPL_SUMS_PRIMITIVE,
    };
    return sums[layer];
}

#endif
