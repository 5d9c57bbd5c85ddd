/* Memory that a read gave back, kept for the reads to come: to have it anew, page by page from the kernel, costs as
 * much as the read. Guarded by its owner's lock. */
#ifndef SPL_RENDER_SPARES_H
#define SPL_RENDER_SPARES_H

#include <stddef.h>
#include <stdint.h>

enum { SPL_SPARES = 4 };

/* Zeroed = empty. */
struct spl_spares {
    struct {
        void *data; // owned; NULL = none
        size_t room;
    } at[SPL_SPARES];
};

void spl_spares_drop(struct spl_spares *spares);

/* Memory of at least `bytes`, and not much more, for the caller to free or keep, *room of it. NULL where there is none,
 * *room = bytes: what is there then is no longer counted on, and freed. */
void *spl_spares_take(struct spl_spares *spares, size_t bytes, size_t *room);

/* Takes `data`, and frees it where all places are taken or more than `most` bytes would be kept. */
void spl_spares_keep(struct spl_spares *spares, void *data, size_t room, uint64_t most);

#endif
