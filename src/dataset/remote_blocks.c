/* Blocks of remote files: each file's in a list, the files in one list of the process, so that however many are open,
 * memory for what nobody uses has one bound. What goes first is of those whose last read is longest ago. Any thread. */
#include "dataset/remote_blocks.h"

#include <stdatomic.h>
#include <stdlib.h>

#include "base/condition.h"
#include "base/memory.h"

enum { kept = 8 /* unused, of a file */ };
static const uint64_t kept_of_all = 64 << 20; /* bytes, of blocks that may be small: 1000 tiles of 64 KiB */

/* Open ones, those that were read last behind the others. */
static struct {
    pthread_mutex_t mutex;
    TAILQ_HEAD(, spl_remote_blocks) files; // guarded by: mutex
    _Atomic uint64_t bytes;                /* of blocks that are there and listed */
} all = {.mutex = PTHREAD_MUTEX_INITIALIZER, .files = TAILQ_HEAD_INITIALIZER(all.files)};

struct spl_remote_block *spl_remote_blocks_find(struct spl_remote_blocks *blocks, uint64_t index)
{
    struct spl_remote_block *block;
    TAILQ_FOREACH(block, &blocks->list, link)
    if (block->index == index)
        return block;
    return NULL;
}

struct spl_remote_block *spl_remote_blocks_hold(struct spl_remote_blocks *blocks, uint64_t index, size_t bytes,
                                                bool *mine, struct spl_error *err)
{
    struct spl_remote_block *block = spl_remote_blocks_find(blocks, index);
    *mine = !block;
    if (block) {
        TAILQ_REMOVE(&blocks->list, block, link);
    } else {
        if (!(block = spl_alloc_raw(sizeof *block + bytes, 1, err)))
            return NULL;
        *block = (struct spl_remote_block){.index = index, .state = SPL_REMOTE_WANTED, .listed = true, .bytes = bytes};
        blocks->listed++;
    }
    TAILQ_INSERT_TAIL(&blocks->list, block, link);
    block->users++;
    return block;
}

void spl_remote_blocks_let_go(struct spl_remote_block *block)
{
    if (!--block->users && !block->listed)
        free(block);
}

static void unlist(struct spl_remote_blocks *blocks, struct spl_remote_block *block)
{
    if (block->listed)
        TAILQ_REMOVE(&blocks->list, block, link);
    blocks->listed -= block->listed;
    atomic_fetch_sub(&all.bytes, block->counted);
    block->counted = 0;
    block->listed = false;
    if (!block->users)
        free(block);
}

struct spl_remote_block *spl_remote_blocks_shrink(struct spl_remote_blocks *blocks, struct spl_remote_block *block)
{
    TAILQ_REMOVE(&blocks->list, block, link);
    struct spl_remote_block *smaller = realloc(block, sizeof *block + block->bytes);
    block = smaller ? smaller : block;
    TAILQ_INSERT_TAIL(&blocks->list, block, link);
    return block;
}

void spl_remote_blocks_end(struct spl_remote_blocks *blocks, struct spl_remote_block *block,
                           const struct spl_error *why)
{
    block->state = why ? SPL_REMOTE_FAILED : SPL_REMOTE_READY;
    if (why) {
        block->err = *why;
        unlist(blocks, block);
    } else if (block->listed) {
        block->counted = block->bytes;
        atomic_fetch_add(&all.bytes, block->counted);
    }
    pthread_cond_broadcast(&blocks->ended);
}

void spl_remote_blocks_forget(struct spl_remote_blocks *blocks, uint64_t first, uint64_t last)
{
    struct spl_remote_block *block, *next;
    pthread_mutex_lock(&blocks->mutex);
    for (block = TAILQ_FIRST(&blocks->list); block; block = next) {
        next = TAILQ_NEXT(block, link);
        if (block->state == SPL_REMOTE_READY && block->index >= first && block->index <= last)
            unlist(blocks, block);
    }
    pthread_mutex_unlock(&blocks->mutex);
}

/* What was not used for longest goes, until `most` are left. */
static void trim(struct spl_remote_blocks *blocks, unsigned most)
{
    struct spl_remote_block *block, *next;
    pthread_mutex_lock(&blocks->mutex);
    for (block = TAILQ_FIRST(&blocks->list); block && blocks->listed > most; block = next) {
        next = TAILQ_NEXT(block, link);
        if (!block->users)
            unlist(blocks, block);
    }
    pthread_mutex_unlock(&blocks->mutex);
}

void spl_remote_blocks_trim(struct spl_remote_blocks *blocks)
{
    struct spl_remote_blocks *other;
    trim(blocks, kept);
    pthread_mutex_lock(&all.mutex);
    TAILQ_REMOVE(&all.files, blocks, link);
    TAILQ_INSERT_TAIL(&all.files, blocks, link);
    TAILQ_FOREACH(other, &all.files, link)
    {
        if (other == blocks || atomic_load(&all.bytes) <= kept_of_all)
            break;
        trim(other, 0);
    }
    pthread_mutex_unlock(&all.mutex);
}

void spl_remote_blocks_init(struct spl_remote_blocks *blocks)
{
    pthread_mutex_init(&blocks->mutex, NULL);
    spl_condition_init(&blocks->ended);
    TAILQ_INIT(&blocks->list);
    pthread_mutex_lock(&all.mutex);
    TAILQ_INSERT_TAIL(&all.files, blocks, link);
    pthread_mutex_unlock(&all.mutex);
}

void spl_remote_blocks_finish(struct spl_remote_blocks *blocks)
{
    pthread_mutex_lock(&all.mutex);
    TAILQ_REMOVE(&all.files, blocks, link);
    pthread_mutex_unlock(&all.mutex);
    for (struct spl_remote_block *block; (block = TAILQ_FIRST(&blocks->list));) {
        block->users = 0;
        unlist(blocks, block);
    }
    pthread_cond_destroy(&blocks->ended);
    pthread_mutex_destroy(&blocks->mutex);
}
