/* The blocks of a remote file that are in memory. Some of the last used stay, of a file and of all open ones together.
 *
 * A block in the list is WANTED, and then one thread is about to end that, or READY and never written again. One that
 * fails leaves the list before its users hear of it, so whoever comes later fetches it anew. */
#ifndef SPL_DATASET_REMOTE_BLOCKS_H
#define SPL_DATASET_REMOTE_BLOCKS_H

#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>
#include <sys/queue.h>

#include "base/error.h"

struct spl_remote_block {
    TAILQ_ENTRY(spl_remote_block) link; // guarded by: mutex, as all but `data` of who fetches it
    uint64_t index;
    enum { SPL_REMOTE_WANTED, SPL_REMOTE_READY, SPL_REMOTE_FAILED } state;
    unsigned users;
    bool listed;
    size_t bytes, counted; /* of memory, once it is there */
    struct spl_error err; /* why it failed */
    char data[];
};

struct spl_remote_blocks {
    TAILQ_ENTRY(spl_remote_blocks) link; // guarded by: a mutex of all files, which is taken before this one
    pthread_mutex_t mutex;
    pthread_cond_t ended;                // a block is no longer wanted
    TAILQ_HEAD(, spl_remote_block) list; // guarded by: mutex, as below; the last used last
    unsigned listed;
};

void spl_remote_blocks_init(struct spl_remote_blocks *blocks);

/* Nobody uses any more. */
void spl_remote_blocks_finish(struct spl_remote_blocks *blocks);

/* Of [first, last] what is ready leaves the list. */
void spl_remote_blocks_forget(struct spl_remote_blocks *blocks, uint64_t first, uint64_t last);

/* They were read just now: what is too much for one file goes of them, what is too much for all of others first. */
void spl_remote_blocks_trim(struct spl_remote_blocks *blocks);

/* With the mutex held: */

/* NULL: not listed. */
struct spl_remote_block *spl_remote_blocks_find(struct spl_remote_blocks *blocks, uint64_t index);

/* The same for a user of it; new, of so many bytes, where it is *mine: then the caller fetches and ends it. NULL: no
 * memory. */
struct spl_remote_block *spl_remote_blocks_hold(struct spl_remote_blocks *blocks, uint64_t index, size_t bytes,
                                                bool *mine, struct spl_error *err);
void spl_remote_blocks_let_go(struct spl_remote_block *block);

/* A block whose bytes have become fewer, in less memory; of its one user, before it is there. */
struct spl_remote_block *spl_remote_blocks_shrink(struct spl_remote_blocks *blocks, struct spl_remote_block *block);

/* It is there, or, with `why`, failed. */
void spl_remote_blocks_end(struct spl_remote_blocks *blocks, struct spl_remote_block *block,
                           const struct spl_error *why);

#endif
