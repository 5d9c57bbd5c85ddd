/* A method's row: all that it decides. Its file in methods/ has it, include/splatd/method.h names it, method.c finds
 * it. What methods share stands in renderer.h. Everything belongs to the renderer's thread. */
#ifndef SPL_RENDER_METHOD_H
#define SPL_RENDER_METHOD_H

#include <splatd/method.h>

#include "base/error.h"

struct spl_frame_job;
struct spl_tile;

/* What a setting costs and gives where no profile says: milliseconds of a software driver on two slow cores, decibels
 * as no more than an order ("Without a profile" in tests/bench/RESULTS.md). */
struct spl_method_guess {
    double lod, supersample, fixed_ms, ms_per_mpx, psnr;
};
enum { SPL_METHOD_GUESSES_MAX = 8 };

struct spl_method_row {
    struct spl_method_info info;

    /* How it selects. */
    bool discs;     /* splats have their radius; else each falls on one sample */
    bool lines;     /* wires are drawn as lines, and linear splats are marked, by methods without discs */
    bool sums;      /* adds up fragments: the weight is chosen so that no sum can wrap; else the nearest wins */
    uint32_t apron; /* samples around a tile that act on those in it; prepare() may set more */

    /* Once a view, after its tiling was zeroed and `apron` set; may be NULL. SPL_SLOT_PENDING where it has pages to
     * wait for (frame.h): it is called again, then. */
    int (*prepare)(struct spl_frame_job *job, struct spl_error *err);
    /* Fills in its own parameters of a tile; may be NULL. */
    void (*place)(struct spl_tile *tile);
    /* What a tile is beside its draw list, in the units of draw_list.h; may be NULL. */
    uint64_t (*count_work)(const struct spl_tile *tile);
    /* Records everything from the scratch to what resolve reads, once for each group of layers that the view has: those
     * with the same SPL_SUMS_*. `first` is true for the tile's first group. */
    int (*record)(struct spl_tile *tile, uint32_t group, bool first, struct spl_error *err);

    uint32_t resolve;                                        /* SPL_RESOLVED_*: what resolve.comp reads */
    struct spl_method_guess guesses[SPL_METHOD_GUESSES_MAX]; /* up to the first with lod 0 */
};

const struct spl_method_row *spl_method_row(enum spl_method method);

/* Can the parameter change anything that is drawn of the dataset? */
bool spl_method_param_counts(const struct spl_method_param_info *param, const struct spl_dataset_info *dataset);

#endif
