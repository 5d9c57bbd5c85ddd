/* What a frame waits with: the slots that its walk asked for, some of them still on their way. They do not give way to
 * pages of other frames until it has gone on, so each frame that waits ends its wait.
 *
 * A walk whose slots have no room beside those that others hold takes none and waits until they are let go of; the
 * first of these goes first, so that it is not passed over for ever. The renderer's thread. */
#ifndef SPL_RENDER_HOLD_H
#define SPL_RENDER_HOLD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/queue.h>

#include "base/error.h"
#include "render/residency.h"

struct spl_hold {
    LIST_ENTRY(spl_hold) link;              // spl_residency.holds, from its first wait on
    struct spl_residency *residency;        /* NULL = it never waited, or the renderer has gone */
    bool waits;
    const struct spl_dataset *dataset;
    struct spl_resident_page *pages;        /* the dataset's */
    uint32_t *slots;                        /* `count` of them, held; in the order that they were asked for */
    size_t count, begun, come;              /* those whose reads have begun; that have come, without a gap */
    uint64_t releases;                      /* of residency, when there was no room */
    uint64_t since_ns;                      /* when it began to wait */
    size_t hanging;                         /* disks, when there was no room */
    bool crowded;                           /* no slots: it waits for room */
    bool stalled;                           /* the same, until its own disk answers */
    size_t ready;                           /* of slots before the first that was missed: the most of any walk, + 1 */
    uint32_t fruitless;                     /* waits behind which there were no more */
    bool alone;                             /* the caller makes no step of another frame meanwhile: holds give way */
};

/* Ends the walk that `hold` asked: 0 = its frame goes on, or SPL_SLOT_PENDING: it has something to wait for, *awaited
 * (to be added to) slots of them on their way. SPL_E_NOMEM. */
int spl_hold_end_walk(struct spl_residency *residency, struct spl_resident_dataset *resident, struct spl_hold *hold,
                      uint64_t *awaited, struct spl_error *err);

/* Has waiting got it nowhere? Every wait ends with all that was held in its place, so that the walk behind gets
 * further; but where others drive that out without end (who renders to the end meanwhile, a device that is out of
 * memory below its limit), a frame takes what is there for this tile. */
bool spl_hold_gives_up(const struct spl_hold *hold);

/* SPL_SLOT_PENDING as long as there is nothing to do for its frame; 0: it is to let go and to walk (again). Why a slot
 * cannot be read; SPL_E_TIMEOUT when its disk has not answered for 10 s. */
int spl_hold_poll(struct spl_hold *hold, struct spl_error *err);

/* Lets go: for another walk. */
void spl_hold_release(struct spl_hold *hold);

/* The same, for good: reads that nobody else waits for are dropped. Also after the renderer has gone. */
void spl_hold_finish(struct spl_hold *hold);

/* The dataset is about to go, or all: it waits for nothing any more. */
void spl_hold_let_go_dataset(struct spl_residency *residency, const struct spl_resident_dataset *resident);
void spl_hold_let_go_all(struct spl_residency *residency);

#endif
