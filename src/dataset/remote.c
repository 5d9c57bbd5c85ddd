/* A remote file by blocks of 1 MiB: what is asked for small, as tables are, comes as the blocks that it lies in, and what
 * is asked for large, as pages are, as one range of all its blocks that are missing. Blocks that somebody is fetching are
 * waited for, not fetched again. Some of the last used stay in memory, of a file and of all together, and all go to the page
 * cache, if there is one.
 *
 * Invariant: a block in the list is WANTED, and then one thread is about to end that, or READY and never written again.
 * One that fails leaves the list before its users hear of it, so whoever comes later fetches it anew. Who has the claim
 * of some blocks fetches them before it waits for those of others, so nobody waits in a circle. */
#include "dataset/remote.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/queue.h>
#include <time.h>

#include "base/condition.h"
#include "base/memory.h"
#include "base/work.h"
#include "dataset/remote_counts.h"
#include "dataset/remote_run.h"

enum { BLOCK = SPL_REMOTE_BLOCK_BYTES, window = 24 /* blocks of one request */, kept = 8 /* in memory, unused */, kept_of_all = 64,
       forgotten_most = 1 << 16 /* on disk */ };

struct spl_remote_counts spl_remote_counts;

struct block {
    TAILQ_ENTRY(block) link; // guarded by: mutex, as all but `data` of who fetches it
    uint64_t index;
    enum { WANTED, READY, FAILED } state;
    unsigned users;
    bool listed;
    size_t bytes;
    struct spl_error err;
    char data[];
};

TAILQ_HEAD(block_list, block);

struct remote {
    TAILQ_ENTRY(remote) link; // guarded by: all.mutex
    struct spl_remote_origin origin;
    struct spl_page_cache *cache; // may be NULL
    struct spl_page_key key;
    pthread_mutex_t mutex;
    pthread_cond_t ended;
    struct block_list blocks; // guarded by: mutex, as all below; the last used last
    unsigned listed;
    uint64_t expected, expected_end; /* bytes that are wanted soon */
};

/* Open ones, those that were read last behind the others. Its mutex is taken before one of theirs. */
static struct {
    pthread_mutex_t mutex;
    TAILQ_HEAD(, remote) remotes; // guarded by: mutex
    _Atomic uint64_t blocks; /* listed */
} all = {.mutex = PTHREAD_MUTEX_INITIALIZER, .remotes = TAILQ_HEAD_INITIALIZER(all.remotes)};

/* What one read has of blocks, from index `first` on. */
struct claim {
    uint64_t first;
    unsigned count;
    struct block *blocks[window];
    bool mine[window]; /* it is this read that fetches it */
};

static size_t bytes_of(const struct remote *remote, uint64_t index)
{
    uint64_t left = remote->origin.state.size - index * BLOCK;
    return left < BLOCK ? (size_t)left : BLOCK;
}

static struct block *find(struct remote *remote, uint64_t index)
{
    struct block *block;
    TAILQ_FOREACH(block, &remote->blocks, link)
    if (block->index == index)
        return block;
    return NULL;
}

static void unlist(struct remote *remote, struct block *block)
{
    if (block->listed)
        TAILQ_REMOVE(&remote->blocks, block, link);
    remote->listed -= block->listed;
    atomic_fetch_sub(&all.blocks, block->listed);
    block->listed = false;
    if (!block->users)
        free(block);
}

/* Forgets what was not used for longest. The mutex is held. */
static void trim(struct remote *remote, unsigned most)
{
    struct block *block, *next;
    for (block = TAILQ_FIRST(&remote->blocks); block && remote->listed > most; block = next) {
        next = TAILQ_NEXT(block, link);
        if (!block->users)
            unlist(remote, block);
    }
}

/* `remote` was read just now: what others keep goes first, of those whose last read is longest ago. */
static void trim_all(struct remote *remote)
{
    pthread_mutex_lock(&all.mutex);
    TAILQ_REMOVE(&all.remotes, remote, link);
    TAILQ_INSERT_TAIL(&all.remotes, remote, link);
    struct remote *other;
    TAILQ_FOREACH(other, &all.remotes, link)
    {
        if (other == remote || atomic_load(&all.blocks) <= kept_of_all)
            break;
        pthread_mutex_lock(&other->mutex);
        trim(other, 0);
        pthread_mutex_unlock(&other->mutex);
    }
    pthread_mutex_unlock(&all.mutex);
}

static struct block *add(struct remote *remote, uint64_t index, struct spl_error *err)
{
    size_t bytes = bytes_of(remote, index);
    struct block *block = spl_alloc_raw(sizeof *block + bytes, 1, err);
    if (!block)
        return NULL;
    *block = (struct block){.index = index, .state = WANTED, .listed = true, .bytes = bytes};
    TAILQ_INSERT_TAIL(&remote->blocks, block, link);
    remote->listed++;
    atomic_fetch_add(&all.blocks, 1);
    return block;
}

static int add_to_claim(struct remote *remote, struct claim *claim, uint64_t index, struct spl_error *err)
{
    struct block *block = find(remote, index);
    claim->mine[claim->count] = !block;
    if (block) {
        TAILQ_REMOVE(&remote->blocks, block, link);
        TAILQ_INSERT_TAIL(&remote->blocks, block, link);
        spl_remote_count(joined, block->state == WANTED);
    } else if (!(block = add(remote, index, err))) {
        return SPL_E_NOMEM;
    }
    block->users++;
    claim->blocks[claim->count++] = block;
    return SPL_OK;
}

/* The blocks of a read, and where something of it is missing those behind it that are expected too. The mutex is held. */
static int make_claim(struct remote *remote, struct claim *claim, uint64_t last, struct spl_error *err)
{
    bool missing = false;
    for (uint64_t i = claim->first; i <= last; i++) {
        int rc = add_to_claim(remote, claim, i, err);
        if (rc)
            return rc;
        missing |= claim->mine[claim->count - 1];
    }
    for (uint64_t i = last + 1; missing && claim->count < window && i * BLOCK >= remote->expected &&
                                i * BLOCK < remote->expected_end && !find(remote, i); i++)
        if (add_to_claim(remote, claim, i, NULL))
            break; // it was a hint
    return SPL_OK;
}

static void end_block(struct remote *remote, struct block *block, const struct spl_error *why)
{
    pthread_mutex_lock(&remote->mutex);
    block->state = why ? FAILED : READY;
    if (why) {
        block->err = *why;
        unlist(remote, block);
    }
    pthread_cond_broadcast(&remote->ended);
    pthread_mutex_unlock(&remote->mutex);
}

/* A run of a claim that is being fetched. */
struct arriving {
    struct remote *remote;
    struct block **blocks;
    unsigned count, at;
    size_t filled; /* of blocks[at] */
};

static void put(void *context, const void *data, size_t bytes)
{
    struct arriving *a = context;
    for (const char *from = data; bytes;) {
        struct block *block = a->blocks[a->at];
        size_t room = block->bytes - a->filled, some = bytes < room ? bytes : room;
        memcpy(block->data + a->filled, from, some);
        a->filled += some;
        from += some;
        bytes -= some;
        if (a->filled == block->bytes) {
            end_block(a->remote, block, NULL);
            a->at++;
            a->filled = 0;
        }
    }
}

static void fetch_run(struct remote *remote, struct block **blocks, unsigned count)
{
    struct arriving a = {.remote = remote, .blocks = blocks, .count = count};
    struct spl_remote_run run = {.first = blocks[0]->index * BLOCK, .put = put, .context = &a};
    struct spl_error why = {0};
    for (unsigned i = 0; i < count; i++)
        run.bytes += blocks[i]->bytes;
    spl_remote_run(&remote->origin, &run, &why);
    for (unsigned i = a.at; i < count; i++)
        end_block(remote, blocks[i], &why);
    for (unsigned i = 0; i < a.at; i++)
        spl_page_cache_write(remote->cache, remote->key, blocks[i]->index, blocks[i]->data, blocks[i]->bytes);
}

/* Ends all blocks that the claim has to: from the page cache, or fetched, neighbours together. */
static void fetch_own(struct remote *remote, struct claim *claim)
{
    for (unsigned i = 0; i < claim->count; i++) {
        struct block *block = claim->blocks[i];
        if (!claim->mine[i])
            continue;
        if (spl_page_cache_read(remote->cache, remote->key, block->index, block->data, block->bytes)) {
            spl_remote_count(cache_hits, 1);
            claim->mine[i] = false;
            end_block(remote, block, NULL);
        } else {
            spl_remote_count(cache_misses, remote->cache != NULL);
        }
    }
    for (unsigned i = 0, n; i < claim->count; i += n) {
        for (n = 0; i + n < claim->count && claim->mine[i + n]; n++)
            continue;
        if (n)
            fetch_run(remote, &claim->blocks[i], n);
        n += !n;
    }
}

/* Waits for a block that another read fetches, which ends by itself. The mutex is held. */
static int wait_for(struct remote *remote, struct block *block, uint64_t deadline_ns, struct spl_error *err)
{
    while (block->state == WANTED) {
        if (spl_is_cancelled(remote->origin.cancelled))
            return spl_fail(err, SPL_E_CANCELLED, "%s: nobody waits for it any more", remote->origin.name);
        if (!spl_remaining_ns(deadline_ns))
            return spl_fail(err, SPL_E_TIMEOUT, "cannot read %s: nothing came in time", remote->origin.name);
        spl_condition_wait(&remote->ended, &remote->mutex, spl_now_ns() + 100 * SPL_NS_PER_MS);
    }
    return block->state == FAILED ? spl_fail(err, block->err.code, "%s", block->err.message) : SPL_OK;
}

/* At most a window's worth, of which `out` gets bytes [offset, offset + bytes). */
static int fetch_window(struct remote *remote, uint64_t offset, char *out, size_t bytes, struct spl_error *err)
{
    struct claim claim = {.first = offset / BLOCK};
    const uint64_t last = (offset + bytes - 1) / BLOCK;
    const uint64_t deadline_ns = spl_now_ns() + 2 * spl_remote_get_patience_ns(&remote->origin, (uint64_t)window * BLOCK);
    pthread_mutex_lock(&remote->mutex);
    int rc = make_claim(remote, &claim, last, err);
    pthread_mutex_unlock(&remote->mutex);
    if (!rc)
        fetch_own(remote, &claim);
    pthread_mutex_lock(&remote->mutex);
    for (unsigned i = 0; i < claim.count; i++) {
        struct block *block = claim.blocks[i];
        if (rc && claim.mine[i] && block->state == WANTED) { // no memory for the rest of the claim
            block->state = FAILED;
            spl_fail(&block->err, rc, "out of memory for a block of %s", remote->origin.name);
            pthread_cond_broadcast(&remote->ended);
            unlist(remote, block);
        }
        if (!rc && claim.first + i <= last)
            rc = wait_for(remote, block, deadline_ns, err);
        if (rc || claim.first + i > last)
            continue;
        const uint64_t begin = block->index * BLOCK, from = offset > begin ? offset - begin : 0;
        const uint64_t to = offset + bytes < begin + block->bytes ? offset + bytes - begin : block->bytes;
        pthread_mutex_unlock(&remote->mutex); // it stays as it is while it has a user
        memcpy(out + (begin + from - offset), block->data + from, to - from);
        pthread_mutex_lock(&remote->mutex);
    }
    for (unsigned i = 0; i < claim.count; i++)
        if (!--claim.blocks[i]->users && !claim.blocks[i]->listed)
            free(claim.blocks[i]);
    trim(remote, kept);
    pthread_mutex_unlock(&remote->mutex);
    trim_all(remote);
    return rc;
}

static atomic_uint fetching; /* reads under way in this process */

bool spl_remote_wait_idle(uint64_t deadline_ns)
{
    while (atomic_load(&fetching) && spl_remaining_ns(deadline_ns))
        nanosleep(&(struct timespec){.tv_nsec = 5 * SPL_NS_PER_MS}, NULL);
    return !atomic_load(&fetching);
}

static int fetch(void *context, uint64_t offset, void *out, size_t bytes, struct spl_error *err)
{
    struct remote *remote = context;
    int rc = SPL_OK;
    atomic_fetch_add(&fetching, 1);
    for (char *to = out; bytes && !rc;) {
        uint64_t end = (offset / BLOCK + window) * BLOCK;
        size_t some = end - offset < bytes ? (size_t)(end - offset) : bytes;
        rc = fetch_window(remote, offset, to, some, err);
        to += some;
        offset += some;
        bytes -= some;
    }
    atomic_fetch_sub(&fetching, 1);
    return rc;
}

static void expect(void *context, uint64_t offset, uint64_t bytes)
{
    struct remote *remote = context;
    pthread_mutex_lock(&remote->mutex);
    remote->expected = offset;
    remote->expected_end = offset + bytes;
    pthread_mutex_unlock(&remote->mutex);
}

static void forget(void *context, uint64_t offset, uint64_t bytes)
{
    struct remote *remote = context;
    if (!bytes)
        return;
    const uint64_t first = offset / BLOCK, last = (offset + bytes - 1) / BLOCK; // a server may say any length
    struct block *block, *next;
    pthread_mutex_lock(&remote->mutex);
    for (block = TAILQ_FIRST(&remote->blocks); block; block = next) {
        next = TAILQ_NEXT(block, link);
        if (block->state == READY && block->index >= first && block->index <= last)
            unlist(remote, block);
    }
    pthread_mutex_unlock(&remote->mutex);
    for (uint64_t i = first; remote->cache && i <= last && i - first < forgotten_most; i++)
        spl_page_cache_drop(remote->cache, remote->key, i);
}

static uint64_t get_moved_ns(void *context)
{
    return atomic_load(&((struct remote *)context)->origin.moved_ns);
}

static bool has_changed(void *context)
{
    return atomic_load(&((struct remote *)context)->origin.changed);
}

static const struct spl_source_far far = {
    .fetch = fetch, .expect = expect, .forget = forget, .get_moved_ns = get_moved_ns, .has_changed = has_changed};

/* All but its link. */
static void release(struct remote *remote)
{
    struct block *block;
    while ((block = TAILQ_FIRST(&remote->blocks))) {
        block->users = 0;
        unlist(remote, block);
    }
    spl_page_cache_let_go(remote->cache);
    pthread_cond_destroy(&remote->ended);
    pthread_mutex_destroy(&remote->mutex);
    free(remote->origin.shown);
    free(remote->origin.name);
    free(remote);
}

static void close_remote(void *context)
{
    struct remote *remote = context;
    pthread_mutex_lock(&all.mutex);
    TAILQ_REMOVE(&all.remotes, remote, link);
    pthread_mutex_unlock(&all.mutex);
    remote->origin.link.close(remote->origin.link.context);
    release(remote);
}

static void put_first(void *context, const void *data, size_t bytes)
{
    struct block *block = context;
    memcpy(block->data + block->bytes, data, bytes);
    block->bytes += bytes;
}

/* The first block, with which comes what the file is held to. */
static int read_first(struct remote *remote, struct spl_error *err)
{
    struct block *block = spl_alloc_raw(sizeof *block + BLOCK, 1, err);
    if (!block)
        return SPL_E_NOMEM;
    *block = (struct block){.state = READY, .listed = true};
    struct spl_remote_run run = {.bytes = BLOCK, .put = put_first, .context = block};
    int rc = spl_remote_run(&remote->origin, &run, err);
    if (rc) {
        free(block);
        return rc;
    }
    TAILQ_INSERT_TAIL(&remote->blocks, block, link);
    remote->listed = 1;
    atomic_fetch_add(&all.blocks, 1);
    return SPL_OK;
}

int spl_remote_open_link(const struct spl_remote_link *link, const char *shown, const struct spl_remote_how *how,
                         struct spl_dataset_source *out, struct spl_error *err)
{
    size_t length;
    const char *stem = spl_remote_get_stem(shown, &length);
    struct remote *remote = spl_alloc(1, sizeof *remote, err);
    *out = (struct spl_dataset_source){0};
    if (!remote)
        return SPL_E_NOMEM;
    struct spl_remote_origin *origin = &remote->origin;
    pthread_mutex_init(&remote->mutex, NULL);
    spl_condition_init(&remote->ended);
    TAILQ_INIT(&remote->blocks);
    origin->link = *link;
    origin->shown = strdup(shown);
    origin->name = strndup(stem, length);
    origin->deadline_ms = how->deadline_ms ? how->deadline_ms : SPL_REMOTE_DEADLINE_MS;
    origin->cancelled = how->cancelled;
    int rc = origin->shown && origin->name ? read_first(remote, err)
                                           : spl_fail(err, SPL_E_NOMEM, "out of memory for a URL");
    if (rc) {
        release(remote);
        return rc;
    }
    const struct spl_remote_state *state = &origin->state;
    if (*state->etag || *state->modified) { // else nobody knows of what state blocks are
        remote->cache = spl_page_cache_hold(how->cache);
        remote->key = spl_page_key_of(shown, *state->etag ? state->etag : state->modified, state->size);
    }
    origin->opened = true;
    pthread_mutex_lock(&all.mutex);
    TAILQ_INSERT_TAIL(&all.remotes, remote, link);
    pthread_mutex_unlock(&all.mutex);
    trim_all(remote);
    *out = (struct spl_dataset_source){
        .size = state->size, .close = close_remote, .context = remote, .far = &far, .owned = true};
    return SPL_OK;
}

int spl_remote_open(const char *url, const struct spl_remote_how *how, struct spl_dataset_source *out,
                    struct spl_error *err)
{
    const struct spl_s3_account account = spl_s3_account_of_environment();
    struct spl_remote_url parsed;
    struct spl_remote_link link;
    *out = (struct spl_dataset_source){0};
    int rc = spl_remote_url_parse(url, &account, &parsed, err);
    if (rc)
        return rc;
    if (!(rc = spl_remote_link_open(&parsed, &account, &link, err)) &&
        (rc = spl_remote_open_link(&link, parsed.shown, how, out, err)))
        link.close(link.context);
    spl_remote_url_finish(&parsed);
    return rc;
}
