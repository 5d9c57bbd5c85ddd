/* A remote file by blocks of 1 MiB: what is asked for small, as tables are, comes as the blocks that it lies in, and
 * what is asked for large, as pages are, as one range of all its blocks that are missing. Blocks that somebody is
 * fetching are waited for, not fetched again. Some stay in memory (remote_blocks.h), and all go to the page cache, if
 * there is one.
 *
 * Invariant: who has the claim of some blocks fetches them before it waits for those of others, so nobody waits in a
 * circle. */
#include "dataset/remote.h"

#include <inttypes.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/condition.h"
#include "base/memory.h"
#include "base/work.h"
#include "dataset/remote_blocks.h"
#include "dataset/remote_counts.h"
#include "dataset/remote_run.h"

enum { BLOCK = SPL_REMOTE_BLOCK_BYTES, window = 24 /* blocks of a request */, forgotten_most = 1 << 16 /* on disk */ };
enum { beginning_most = 4096 }; /* what is asked for of a file whose blocks the page cache may have */
static const uint64_t state_block = (1ull << 40) - 1; /* the number that a state is kept by, beyond all blocks */

struct spl_remote_counts spl_remote_counts;

struct remote {
    struct spl_remote_origin origin;
    struct spl_page_cache *cache; // may be NULL
    struct spl_page_key key;
    struct spl_remote_blocks blocks;
    bool by_version, remembered; /* its blocks are kept by its version; its state was, and nobody has asked for it */
    uint64_t expected, expected_end; // guarded by: blocks.mutex; bytes that are wanted soon
    size_t beginning_bytes;          // guarded by: blocks.mutex; what of `beginning` is there
    char beginning[beginning_most];
};

/* What one read has of blocks, from index `first` on. */
struct claim {
    uint64_t first;
    unsigned count;
    struct spl_remote_block *blocks[window];
    bool mine[window]; /* it is this read that fetches it */
};

static size_t bytes_of(const struct remote *remote, uint64_t index)
{
    uint64_t left = remote->origin.state.size - index * BLOCK;
    return left < BLOCK ? (size_t)left : BLOCK;
}

static int add_to_claim(struct remote *remote, struct claim *claim, uint64_t index, struct spl_error *err)
{
    bool *mine = &claim->mine[claim->count];
    struct spl_remote_block *block = spl_remote_blocks_hold(&remote->blocks, index, bytes_of(remote, index), mine, err);
    if (!block)
        return SPL_E_NOMEM;
    spl_remote_count(joined, !*mine && block->state == SPL_REMOTE_WANTED);
    claim->blocks[claim->count++] = block;
    return SPL_OK;
}

/* The blocks of a read, and where something of it is missing those behind it that are expected too. The mutex is
 * held. */
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
                                i * BLOCK < remote->expected_end && !spl_remote_blocks_find(&remote->blocks, i); i++)
        if (add_to_claim(remote, claim, i, NULL))
            break; // it was a hint
    return SPL_OK;
}

static void end_block(struct remote *remote, struct spl_remote_block *block, const struct spl_error *why)
{
    pthread_mutex_lock(&remote->blocks.mutex);
    spl_remote_blocks_end(&remote->blocks, block, why);
    pthread_mutex_unlock(&remote->blocks.mutex);
}

/* A run of a claim that is being fetched. */
struct arriving {
    struct remote *remote;
    struct spl_remote_block **blocks;
    unsigned count, at;
    size_t filled; /* of blocks[at] */
};

static void put(void *context, const void *data, size_t bytes)
{
    struct arriving *a = context;
    for (const char *from = data; bytes;) {
        struct spl_remote_block *block = a->blocks[a->at];
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

static void fetch_run(struct remote *remote, struct spl_remote_block **blocks, unsigned count)
{
    struct arriving a = {.remote = remote, .blocks = blocks, .count = count};
    struct spl_remote_run run = {.first = blocks[0]->index * BLOCK, .put = put, .context = &a};
    struct spl_error why = {0};
    for (unsigned i = 0; i < count; i++)
        run.bytes += blocks[i]->bytes;
    if (spl_remote_run(&remote->origin, &run, &why) && remote->remembered && atomic_load(&remote->origin.changed))
        spl_page_cache_drop(remote->cache, remote->key, state_block);
    for (unsigned i = a.at; i < count; i++)
        end_block(remote, blocks[i], &why);
    for (unsigned i = 0; i < a.at; i++)
        spl_page_cache_write(remote->cache, remote->key, blocks[i]->index, blocks[i]->data, blocks[i]->bytes);
}

/* Ends all blocks that the claim has to: from the page cache, or fetched, neighbours together. */
static void fetch_own(struct remote *remote, struct claim *claim)
{
    for (unsigned i = 0; i < claim->count; i++) {
        struct spl_remote_block *block = claim->blocks[i];
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
static int wait_for(struct remote *remote, struct spl_remote_block *block, uint64_t deadline_ns, struct spl_error *err)
{
    while (block->state == SPL_REMOTE_WANTED) {
        if (spl_is_cancelled(remote->origin.cancelled))
            return spl_fail(err, SPL_E_CANCELLED, "%s: nobody waits for it any more", remote->origin.name);
        if (!spl_remaining_ns(deadline_ns))
            return spl_fail(err, SPL_E_TIMEOUT, "cannot read %s: nothing came in time", remote->origin.name);
        spl_condition_wait(&remote->blocks.ended, &remote->blocks.mutex, spl_now_ns() + 100 * SPL_NS_PER_MS);
    }
    return block->state == SPL_REMOTE_FAILED ? spl_fail(err, block->err.code, "%s", block->err.message) : SPL_OK;
}

/* At most a window's worth, of which `out` gets bytes [offset, offset + bytes). */
static int fetch_window(struct remote *remote, uint64_t offset, char *out, size_t bytes, struct spl_error *err)
{
    struct claim claim = {.first = offset / BLOCK};
    const uint64_t last = (offset + bytes - 1) / BLOCK;
    const uint64_t deadline_ns =
        spl_now_ns() + 2 * spl_remote_get_patience_ns(&remote->origin, (uint64_t)window * BLOCK);
    pthread_mutex_lock(&remote->blocks.mutex);
    int rc = make_claim(remote, &claim, last, err);
    pthread_mutex_unlock(&remote->blocks.mutex);
    if (!rc)
        fetch_own(remote, &claim);
    pthread_mutex_lock(&remote->blocks.mutex);
    for (unsigned i = 0; i < claim.count; i++) {
        struct spl_remote_block *block = claim.blocks[i];
        if (rc && claim.mine[i] && block->state == SPL_REMOTE_WANTED) { // no memory for the rest of the claim
            struct spl_error why = {0};
            spl_fail(&why, rc, "out of memory for a block of %s", remote->origin.name);
            spl_remote_blocks_end(&remote->blocks, block, &why);
        }
        if (!rc && claim.first + i <= last)
            rc = wait_for(remote, block, deadline_ns, err);
        if (rc || claim.first + i > last)
            continue;
        const uint64_t begin = block->index * BLOCK, from = offset > begin ? offset - begin : 0;
        const uint64_t to = offset + bytes < begin + block->bytes ? offset + bytes - begin : block->bytes;
        pthread_mutex_unlock(&remote->blocks.mutex); // it stays as it is while it has a user
        memcpy(out + (begin + from - offset), block->data + from, to - from);
        pthread_mutex_lock(&remote->blocks.mutex);
    }
    for (unsigned i = 0; i < claim.count; i++)
        spl_remote_blocks_let_go(claim.blocks[i]);
    pthread_mutex_unlock(&remote->blocks.mutex);
    spl_remote_blocks_trim(&remote->blocks);
    return rc;
}

static atomic_uint fetching; /* reads under way in this process */

void spl_remote_begin(void)
{
    atomic_fetch_add(&fetching, 1);
}

void spl_remote_end(void)
{
    atomic_fetch_sub(&fetching, 1);
}

bool spl_remote_wait_idle(uint64_t deadline_ns)
{
    while (atomic_load(&fetching) && spl_remaining_ns(deadline_ns))
        nanosleep(&(struct timespec){.tv_nsec = 5 * SPL_NS_PER_MS}, NULL);
    return !atomic_load(&fetching);
}

/* What came with the file's state. */
static bool take_beginning(struct remote *remote, uint64_t offset, void *out, size_t bytes)
{
    pthread_mutex_lock(&remote->blocks.mutex);
    const bool here = offset < remote->beginning_bytes && bytes <= remote->beginning_bytes - offset;
    if (here)
        memcpy(out, remote->beginning + offset, bytes);
    pthread_mutex_unlock(&remote->blocks.mutex);
    return here;
}

static int fetch(void *context, uint64_t offset, void *out, size_t bytes, struct spl_error *err)
{
    struct remote *remote = context;
    int rc = SPL_OK;
    if (take_beginning(remote, offset, out, bytes))
        return SPL_OK;
    spl_remote_begin();
    for (char *to = out; bytes && !rc;) {
        uint64_t end = (offset / BLOCK + window) * BLOCK;
        size_t some = end - offset < bytes ? (size_t)(end - offset) : bytes;
        rc = fetch_window(remote, offset, to, some, err);
        to += some;
        offset += some;
        bytes -= some;
    }
    spl_remote_end();
    return rc;
}

static void expect(void *context, uint64_t offset, uint64_t bytes)
{
    struct remote *remote = context;
    pthread_mutex_lock(&remote->blocks.mutex);
    remote->expected = offset;
    remote->expected_end = offset + bytes;
    pthread_mutex_unlock(&remote->blocks.mutex);
}

static void forget(void *context, uint64_t offset, uint64_t bytes)
{
    struct remote *remote = context;
    if (!bytes)
        return;
    const uint64_t first = offset / BLOCK, last = (offset + bytes - 1) / BLOCK; // a server may say any length
    pthread_mutex_lock(&remote->blocks.mutex);
    if (!first)
        remote->beginning_bytes = 0;
    pthread_mutex_unlock(&remote->blocks.mutex);
    spl_remote_blocks_forget(&remote->blocks, first, last);
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

static void remember(void *context, bool good)
{
    struct remote *remote = context;
    if (good && remote->by_version && !remote->remembered)
        spl_page_cache_write(remote->cache, remote->key, state_block, &remote->origin.state,
                             sizeof remote->origin.state);
    else if (!good && remote->by_version)
        spl_page_cache_drop(remote->cache, remote->key, state_block);
}

static bool was_remembered(void *context)
{
    return ((struct remote *)context)->remembered;
}

static void get_landed(void *context, char out[SPL_SOURCE_ORIGIN_MAX])
{
    const struct spl_remote_link *link = &((struct remote *)context)->origin.link;
    _Static_assert((int)SPL_SOURCE_ORIGIN_MAX == (int)SPL_REMOTE_ORIGIN_MAX, "the same");
    *out = '\0';
    if (link->get_landed)
        link->get_landed(link->context, out);
}

static const struct spl_source_far far = {.fetch = fetch,
                                          .expect = expect,
                                          .forget = forget,
                                          .get_moved_ns = get_moved_ns,
                                          .has_changed = has_changed,
                                          .remember = remember,
                                          .was_remembered = was_remembered,
                                          .get_landed = get_landed};

/* The state that the page cache has by the file's version. */
static bool recall(struct remote *remote)
{
    struct spl_remote_state *state = &remote->origin.state;
    if (!remote->by_version ||
        !spl_page_cache_read(remote->cache, remote->key, state_block, state, sizeof *state) || !state->size) {
        *state = (struct spl_remote_state){0};
        return false;
    }
    state->etag[sizeof state->etag - 1] = state->modified[sizeof state->modified - 1] = '\0';
    return remote->remembered = true;
}

/* All but its link. */
static void release(struct remote *remote)
{
    spl_remote_blocks_finish(&remote->blocks);
    spl_page_cache_let_go(remote->cache);
    free(remote->origin.shown);
    free(remote->origin.name);
    free(remote);
}

static void close_remote(void *context)
{
    struct remote *remote = context;
    remote->origin.link.close(remote->origin.link.context);
    release(remote);
}

static void put_beginning(void *context, const void *data, size_t bytes)
{
    struct remote *remote = context;
    memcpy(remote->beginning + remote->beginning_bytes, data, bytes);
    remote->beginning_bytes += bytes;
}

static void put_first(void *context, const void *data, size_t bytes)
{
    struct spl_remote_block *block = context;
    memcpy(block->data + block->bytes, data, bytes);
    block->bytes += bytes;
}

/* The first block, with which comes what the file is held to. Where the page cache may have it, the beginning does; of
 * what is kept by its version it has nothing where it has no state. */
static int read_first(struct remote *remote, bool kept, struct spl_error *err)
{
    bool mine;
    if (kept) {
        struct spl_remote_run some = {.bytes = beginning_most, .put = put_beginning, .context = remote};
        return spl_remote_run(&remote->origin, &some, err);
    }
    pthread_mutex_lock(&remote->blocks.mutex);
    struct spl_remote_block *block = spl_remote_blocks_hold(&remote->blocks, 0, BLOCK, &mine, err);
    pthread_mutex_unlock(&remote->blocks.mutex);
    if (!block)
        return SPL_E_NOMEM;
    block->bytes = 0; // so far
    struct spl_remote_run run = {.bytes = BLOCK, .put = put_first, .context = block};
    int rc = spl_remote_run(&remote->origin, &run, err);
    if (!rc && remote->by_version)
        spl_page_cache_write(remote->cache, remote->key, 0, block->data, block->bytes);
    pthread_mutex_lock(&remote->blocks.mutex);
    block = spl_remote_blocks_shrink(&remote->blocks, block);
    spl_remote_blocks_end(&remote->blocks, block, rc ? &(struct spl_error){.code = rc} : NULL);
    spl_remote_blocks_let_go(block);
    pthread_mutex_unlock(&remote->blocks.mutex);
    return rc;
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
    spl_remote_blocks_init(&remote->blocks);
    origin->link = *link;
    origin->shown = strdup(shown);
    origin->name = strndup(stem, length);
    origin->deadline_ms = how->deadline_ms ? how->deadline_ms : SPL_REMOTE_DEADLINE_MS;
    origin->cancelled = how->cancelled;
    origin->also_moved_ns = how->moved_ns;
    remote->by_version = how->version && how->cache;
    if (remote->by_version) {
        char version[40];
        snprintf(version, sizeof version, "version %016" PRIx64, *how->version);
        remote->cache = spl_page_cache_hold(how->cache);
        remote->key = spl_page_key_of(shown, version, 0);
    }
    int rc = !origin->shown || !origin->name ? spl_fail(err, SPL_E_NOMEM, "out of memory for a URL")
             : recall(remote)                ? SPL_OK
                                             : read_first(remote, how->cache && !remote->by_version, err);
    if (rc) {
        release(remote);
        return rc;
    }
    const struct spl_remote_state *state = &origin->state;
    if (!remote->by_version && (*state->etag || *state->modified)) { // else nobody knows of what state blocks are
        remote->cache = spl_page_cache_hold(how->cache);
        remote->key = spl_page_key_of(shown, *state->etag ? state->etag : state->modified, state->size);
    }
    origin->opened = true;
    spl_remote_blocks_trim(&remote->blocks);
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
    if (!(rc = spl_remote_link_open(&parsed, &account, how->landed, &link, err)) &&
        (rc = spl_remote_open_link(&link, parsed.shown, how, out, err)))
        link.close(link.context);
    spl_remote_url_finish(&parsed);
    return rc;
}
