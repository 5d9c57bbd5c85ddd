/* Whose turn it is at the device, tile by tile.
 *
 * Views of one tile go first, in the order that they came: they wait in a queue, not here. Of the larger ones the one
 * with the fewest samples left goes next, so that what is nearly done is done, and one of two tiles does not wait for
 * one of sixty. Every SPL_TURNS_EVERY-th turn is a large view's, whatever small ones wait, and every second of these
 * that of the one that came first, so that each gets on and ends. Small views whose work is cut into pieces and takes
 * long stand here, too, and samples that take long count for more (gpu_thread.c); who gave way in the middle of a piece
 * comes behind all others, but for the turns of who came first. Views that wait for pages, small ones
 * too, stand here and have no turn. Pure bookkeeping; owned by the gpu thread. */
#ifndef SPL_SERVICE_TURNS_H
#define SPL_SERVICE_TURNS_H

#include <sys/queue.h>

#include "service/view/pipeline.h"

enum { SPL_TURNS_EVERY = 4 };

struct spl_turns {
    TAILQ_HEAD(, spl_job) jobs; /* large views, and those that have waited for pages, by arrival */
    unsigned count;             /* of turns while there were any */
};

void spl_turns_init(struct spl_turns *turns);

/* The job waits for a turn, by its samples_left, until it is removed. */
void spl_turns_add(struct spl_turns *turns, struct spl_job *job);
void spl_turns_remove(struct spl_turns *turns, struct spl_job *job);

/* The job whose turn it is; it stays. NULL: that of the next small view, or nobody waits for one. */
struct spl_job *spl_turns_next(struct spl_turns *turns, bool small_waits);

#endif
