/* A remote file over a link that does as the test says: its bytes come whole whatever breaks off, what is wrong at its
 * server is an error that says so, a file that changes is never mixed with what it was, and what several ask for at
 * once is asked once. */
#include <malloc.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>
#include <xxhash.h>

#include "base/clock.h"
#include "dataset/dataset.h"
#include "dataset/format.h"
#include "dataset/remote.h"
#include "dataset/remote_counts.h"
#include "support/folder.h"
#include "support/make_dataset.h"

enum { BLOCK = SPL_REMOTE_BLOCK_BYTES, SIZE = 40 * BLOCK + 12345, SMALL = 12 * BLOCK + 12345, asks_max = 400 };

/* What the server does with its next requests; each counts down to nothing special. */
struct server {
    pthread_mutex_t mutex;
    pthread_cond_t more; // requests at once
    char *bytes; // guarded by: mutex, as all below
    uint64_t size;
    char etag[32], modified[32];
    long status; // of the next `failing` answers; 0 = no answer at all
    int failing, cutting, flipping;
    size_t flipped; /* byte of an answer */
    uint64_t retry_after_s;
    bool lies_about_range, packs, ignores_conditions, ignores_range, trickles;
    uint64_t until_joined; /* it answers once so many blocks were joined in all */
    int until_at_once;     /* and so many requests at once */
    uint64_t asked_ns;     /* the last time */
    int asks, closed, at_once, at_once_most;
    struct {
        uint64_t first;
        size_t bytes;
    } asked[asks_max];
};

static bool refuses(const struct server *s, const struct spl_remote_ask *ask)
{
    return !s->ignores_conditions && ((*ask->if_match && strcmp(ask->if_match, s->etag)) ||
                                      (*ask->if_unmodified && strcmp(ask->if_unmodified, s->modified)));
}

/* How many bytes it sends of the answer, and what they are; the mutex is held. */
static size_t answer(struct server *s, const struct spl_remote_ask *ask, struct spl_remote_reply *reply)
{
    size_t bytes = ask->bytes;
    assert_true(s->asks < asks_max);
    s->asked[s->asks].first = ask->first;
    s->asked[s->asks++].bytes = ask->bytes;
    if (s->failing) {
        s->failing--;
        reply->status = s->status;
        reply->may_pass = true;
        reply->retry_after_s = s->retry_after_s;
        snprintf(reply->why, sizeof reply->why, "%s", s->status ? "" : "Connection reset by peer");
        return 0;
    }
    reply->status = refuses(s, ask) ? 412 : s->ignores_range ? 200 : ask->first >= s->size ? 416 : 206;
    if (reply->status != 206)
        return 0;
    if (bytes > s->size - ask->first)
        bytes = (size_t)(s->size - ask->first);
    reply->ranged = true;
    reply->first = ask->first + s->lies_about_range;
    reply->last = ask->first + bytes - 1;
    reply->total = s->size;
    snprintf(reply->etag, sizeof reply->etag, "%s", s->etag);
    snprintf(reply->modified, sizeof reply->modified, "%s", s->modified);
    snprintf(reply->encoding, sizeof reply->encoding, "%s", s->packs ? "gzip" : "");
    return bytes;
}

static void ask(void *context, const struct spl_remote_ask *ask, struct spl_remote_reply *reply)
{
    struct server *s = context;
    pthread_mutex_lock(&s->mutex);
    size_t bytes = answer(s, ask, reply), sent = 0;
    s->asked_ns = spl_now_ns();
    bool cut = bytes > 1 && s->cutting && s->cutting--, flip = bytes && s->flipping && s->flipping--;
    s->at_once_most = ++s->at_once > s->at_once_most ? s->at_once : s->at_once_most;
    uint64_t until_joined = s->until_joined;
    while (s->at_once_most < s->until_at_once && pthread_cond_wait(&s->more, &s->mutex) == 0)
        ;
    pthread_cond_broadcast(&s->more);
    pthread_mutex_unlock(&s->mutex);
    while (atomic_load(&spl_remote_counts.joined) < until_joined)
        usleep(1000);
    char *copy = malloc(bytes + 1);
    memcpy(copy, s->bytes + (bytes ? ask->first : 0), bytes);
    if (flip)
        copy[s->flipped < bytes ? s->flipped : 0] ^= 1;
    if (cut) {
        bytes = bytes * 2 / 3 + 1;
        reply->may_pass = true;
        snprintf(reply->why, sizeof reply->why, "Transferred a partial file");
    }
    for (bool goes_on = bytes && ask->begin(ask->context); goes_on && sent < bytes;) {
        size_t some = bytes - sent < 100001 ? bytes - sent : 100001;
        goes_on = ask->take(ask->context, copy + sent, some);
        sent += some;
    }
    free(copy);
    pthread_mutex_lock(&s->mutex);
    s->at_once--;
    pthread_mutex_unlock(&s->mutex);
}

static void close_link(void *context)
{
    ((struct server *)context)->closed++;
}

static void start(struct server *s, uint64_t size)
{
    *s = (struct server){.size = size, .etag = "\"one\"", .modified = "Sat, 28 Nov 2026 00:00:00 GMT"};
    pthread_mutex_init(&s->mutex, NULL);
    pthread_cond_init(&s->more, NULL);
    s->bytes = malloc(size + 1);
    for (uint64_t i = 0; i < size; i++)
        s->bytes[i] = (char)(i ^ i >> 8 ^ i >> 17);
}

static void stop(struct server *s)
{
    pthread_cond_destroy(&s->more);
    pthread_mutex_destroy(&s->mutex);
    free(s->bytes);
}

static int try_open(struct server *s, const struct spl_remote_how *how, struct spl_dataset_source *out,
                    struct spl_error *err)
{
    const struct spl_remote_link link = {.ask = ask, .close = close_link, .context = s};
    return spl_remote_open_link(&link, "https://h/a/hall.spld", how, out, err);
}

static struct spl_dataset_source open_with(struct server *s, const struct spl_remote_how *how)
{
    struct spl_dataset_source source;
    struct spl_error err = {0};
    if (try_open(s, how, &source, &err))
        fail_msg("%s", err.message);
    assert_true(source.size == s->size && source.far);
    return source;
}

static const struct spl_remote_how patient = {.deadline_ms = 60000}, hasty = {.deadline_ms = 1500};

static int read_range(struct spl_dataset_source *source, const struct server *s, uint64_t offset, size_t bytes,
                      struct spl_error *err)
{
    char *out = malloc(bytes + 1);
    out[bytes] = 77;
    int rc = spl_dataset_source_read(source, "hall", offset, out, bytes, err);
    if (!rc)
        assert_memory_equal(out, s->bytes + offset, bytes);
    assert_int_equal(out[bytes], 77);
    free(out);
    return rc;
}

static void expect_range(struct spl_dataset_source *source, const struct server *s, uint64_t offset, size_t bytes)
{
    struct spl_error err = {0};
    if (read_range(source, s, offset, bytes, &err))
        fail_msg("%s", err.message);
}

static void test_any_range_is_that_of_the_file(void **state)
{
    (void)state;
    static const uint64_t sizes[] = {1, 100, BLOCK - 1, BLOCK, BLOCK + 1, 2 * BLOCK, SIZE};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        struct server s;
        start(&s, sizes[i]);
        struct spl_dataset_source source = open_with(&s, &patient);
        expect_range(&source, &s, 0, sizes[i]);
        expect_range(&source, &s, sizes[i] - 1, 1);
        expect_range(&source, &s, sizes[i] / 2, 0);
        srand(7);
        for (int n = 0; n < 20; n++) {
            uint64_t offset = (uint64_t)rand() % sizes[i], left = sizes[i] - offset;
            expect_range(&source, &s, offset, (size_t)rand() % (left < 3 * BLOCK ? left : 3 * BLOCK) + 1);
        }
        spl_dataset_source_close(&source);
        assert_int_equal(s.closed, 1);
        stop(&s);
    }
}

static void test_neighbours_come_in_one_request(void **state)
{
    (void)state;
    struct server s;
    start(&s, SIZE);
    struct spl_dataset_source source = open_with(&s, &patient);
    assert_int_equal(s.asks, 1);
    expect_range(&source, &s, 0, BLOCK);
    assert_int_equal(s.asks, 1); // came with opening
    expect_range(&source, &s, 3 * BLOCK + 5, 16 * BLOCK);
    assert_int_equal(s.asks, 2);
    assert_true(s.asked[1].first == 3 * BLOCK && s.asked[1].bytes == 17 * BLOCK);
    expect_range(&source, &s, 19 * BLOCK + 1, 2 * BLOCK); // of three blocks one is still there
    assert_int_equal(s.asks, 3);
    assert_true(s.asked[2].first == 20 * BLOCK && s.asked[2].bytes == 2 * BLOCK);
    source.far->expect(source.context, 30 * BLOCK + 7, 5 * BLOCK); // small reads of what is wanted as a whole
    for (uint64_t at = 30 * BLOCK + 7; at < 35 * BLOCK; at += 4096)
        expect_range(&source, &s, at, 4096);
    assert_int_equal(s.asks, 4);
    spl_dataset_source_close(&source);
    stop(&s);
}

static void test_what_may_pass_passes(void **state)
{
    (void)state;
    static const long statuses[] = {0, 429, 503};
    for (size_t i = 0; i < sizeof statuses / sizeof *statuses; i++) {
        struct server s;
        start(&s, SMALL);
        s.status = statuses[i];
        s.failing = 2;
        struct spl_dataset_source source = open_with(&s, &patient);
        s.failing = 1;
        s.cutting = 2;
        uint64_t before = atomic_load(&spl_remote_counts.retries);
        expect_range(&source, &s, 2 * BLOCK, 8 * BLOCK);
        assert_int_equal(atomic_load(&spl_remote_counts.retries), before + 3);
        assert_true(s.asked[s.asks - 1].first > 2 * BLOCK); // it went on where it had broken off
        spl_dataset_source_close(&source);
        stop(&s);
    }
}

static void test_a_server_that_stays_away(void **state)
{
    (void)state;
    struct server s;
    struct spl_dataset_source source;
    struct spl_error err = {0};
    start(&s, SMALL);
    s.failing = 1000;
    assert_int_equal(try_open(&s, &hasty, &source, &err), SPL_E_TIMEOUT);
    assert_true(strstr(err.message, "https://h/a/hall.spld") && strstr(err.message, "Connection reset"));
    assert_int_equal(s.closed, 0);
    s.failing = 0;
    source = open_with(&s, &hasty);
    s.failing = 1000;
    err = (struct spl_error){0};
    assert_int_equal(read_range(&source, &s, BLOCK, 10, &err), SPL_E_TIMEOUT);
    assert_null(strstr(err.message, "https")); // clients are told the id
    assert_non_null(strstr(err.message, "cannot read hall: "));
    for (bool soon = false; !soon;) { // unless the machine was away for as long as it rests
        const uint64_t asked_ns = s.asked_ns;
        const int asks = s.asks; // nobody else is at it
        err = (struct spl_error){0};
        assert_int_equal(read_range(&source, &s, 2 * BLOCK, 10, &err), SPL_E_TIMEOUT);
        soon = spl_now_ns() - asked_ns < hasty.deadline_ms * SPL_NS_PER_MS;
        // nobody waits for it once more so soon
        assert_true(!soon || (s.asks == asks && strstr(err.message, "a moment ago")));
    }
    s.failing = 0;
    usleep((unsigned)hasty.deadline_ms * 1000);
    expect_range(&source, &s, BLOCK, 10); // nothing of a failure stays
    spl_dataset_source_close(&source);
    source = open_with(&s, &patient);
    s.failing = 1;
    s.status = 503;
    s.retry_after_s = 3600; // longer than anybody waits: told at once
    err = (struct spl_error){0};
    uint64_t began_ns = spl_now_ns();
    assert_int_equal(read_range(&source, &s, 9 * BLOCK, 10, &err), SPL_E_TIMEOUT);
    assert_true(spl_now_ns() - began_ns < patient.deadline_ms * SPL_NS_PER_MS / 2 && strstr(err.message, "503"));
    spl_dataset_source_close(&source);
    stop(&s);
}

static void test_refusals_are_told_at_once(void **state)
{
    (void)state;
    static const struct {
        long status;
        int opening;
        const char *part;
    } rows[] = {{401, SPL_E_IO, "credentials"},
                {403, SPL_E_IO, "credentials"},
                {404, SPL_E_NOT_FOUND, "look at the path"},
                {410, SPL_E_NOT_FOUND, "look at the path"},
                {416, SPL_E_INPUT, "empty"},
                {307, SPL_E_IO, "AWS_REGION"},
                {200, SPL_E_INPUT, "no byte ranges"}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct server s;
        struct spl_dataset_source source;
        struct spl_error err = {0};
        char status[10];
        snprintf(status, sizeof status, " %ld", rows[i].status);
        start(&s, SMALL);
        s.status = rows[i].status;
        s.failing = 1;
        assert_int_equal(try_open(&s, &patient, &source, &err), rows[i].opening);
        assert_true(strstr(err.message, rows[i].part) && strstr(err.message, status) &&
                    strstr(err.message, "https://h/a/"));
        source = open_with(&s, &patient);
        s.failing = 1;
        err = (struct spl_error){0};
        bool cut = rows[i].status == 416; // once it is open: shorter than it was, so another file
        assert_int_equal(read_range(&source, &s, BLOCK, 1, &err), cut ? SPL_E_CORRUPT : SPL_E_IO);
        assert_true(strstr(err.message, cut ? "changed while it was served" : rows[i].part) && s.asks == 3);
        spl_dataset_source_close(&source);
        stop(&s);
    }
}

static void test_answers_that_are_none(void **state)
{
    (void)state;
    for (int i = 0; i < 4; i++) {
        struct server s;
        struct spl_dataset_source source;
        struct spl_error err = {0};
        start(&s, i ? SMALL : 0);
        s.lies_about_range = i == 1;
        s.packs = i == 2;
        s.ignores_range = i == 3;
        static const int codes[] = {SPL_E_INPUT, SPL_E_IO, SPL_E_IO, SPL_E_INPUT};
        assert_int_equal(try_open(&s, &patient, &source, &err), codes[i]);
        assert_int_equal(s.asks, 1);
        stop(&s);
    }
}

/* Found by the server that was told what is wanted, or by the head of an answer that minds nothing; by length, tag or
 * date. */
static void test_a_file_that_changes(void **state)
{
    (void)state;
    for (int how = 0; how < 8; how++) {
        struct server s;
        struct spl_error err = {0};
        start(&s, SMALL);
        s.ignores_conditions = how & 1;
        if (how / 2 == 1)
            s.etag[0] = '\0';
        if (how / 2 == 3)
            strcpy(s.etag, "W/\"weak\"");
        struct spl_dataset_source source = open_with(&s, &patient);
        expect_range(&source, &s, 5 * BLOCK, BLOCK);
        if (how / 2 == 0)
            strcpy(s.etag, "\"two\"");
        else if (how / 2 == 1)
            strcpy(s.modified, "Sun, 29 Nov 2026 00:00:00 GMT");
        else if (how / 2 == 2)
            s.size--, s.ignores_conditions = true;
        else
            strcpy(s.etag, "W/\"other\""), s.ignores_conditions = true;
        memset(s.bytes + 7 * BLOCK, 0, BLOCK); // what must not be seen
        assert_false(source.far->has_changed(source.context));
        assert_int_equal(read_range(&source, &s, 5 * BLOCK + 9, 2 * BLOCK, &err), SPL_E_CORRUPT);
        assert_non_null(strstr(err.message, "hall changed while it was served; open it anew"));
        assert_true(source.far->has_changed(source.context));
        expect_range(&source, &s, 5 * BLOCK, BLOCK); // which was there before
        int asks = s.asks;
        assert_int_equal(read_range(&source, &s, 9 * BLOCK, 1, NULL), SPL_E_CORRUPT);
        assert_int_equal(s.asks, asks); // for good
        spl_dataset_source_close(&source);
        stop(&s);
    }
}

static int get_asks(struct server *s)
{
    pthread_mutex_lock(&s->mutex);
    int asks = s->asks;
    pthread_mutex_unlock(&s->mutex);
    return asks;
}

struct reader {
    pthread_t thread;
    struct spl_dataset_source *source;
    struct server *s;
    uint64_t offset;
    size_t bytes;
    int rc;
};

static void *read_on_thread(void *context)
{
    struct reader *r = context;
    r->rc = read_range(r->source, r->s, r->offset, r->bytes, NULL);
    return NULL;
}

static void test_equal_requests_are_joined(void **state)
{
    (void)state;
    enum { readers = 8 };
    for (int fails = 0; fails < 2; fails++) {
        struct server s;
        start(&s, SIZE);
        struct spl_dataset_source source = open_with(&s, &patient);
        struct reader all[readers];
        s.until_joined = atomic_load(&spl_remote_counts.joined) + readers - 1;
        s.failing = fails;
        s.status = 403;
        for (int i = 0; i < readers; i++) { // the first has all that the others want
            all[i] = (struct reader){
                .source = &source, .s = &s, .offset = (i ? 10 + i % 4 : 10) * BLOCK, .bytes = i ? 5 : 4 * BLOCK};
            pthread_create(&all[i].thread, NULL, read_on_thread, &all[i]);
            while (!i && get_asks(&s) < 2)
                usleep(1000);
        }
        for (int i = 0; i < readers; i++) {
            pthread_join(all[i].thread, NULL);
            assert_int_equal(all[i].rc, fails ? SPL_E_IO : SPL_OK);
        }
        assert_int_equal(s.asks, 2);
        s.until_joined = 0;
        expect_range(&source, &s, 10 * BLOCK, 4 * BLOCK);
        spl_dataset_source_close(&source);
        stop(&s);
    }
}

/* Many threads, much that fails: every read has its bytes. */
static void test_crowd(void **state)
{
    (void)state;
    enum { readers = 6, rounds = 3 };
    struct server s;
    start(&s, SIZE);
    struct spl_dataset_source source = open_with(&s, &patient);
    s.until_at_once = 2;
    for (int round = 0; round < rounds; round++) {
        struct reader all[readers];
        s.failing = round % 2;
        s.cutting = 3;
        for (int i = 0; i < readers; i++) {
            all[i] = (struct reader){
                .source = &source, .s = &s, .offset = (uint64_t)(round * 5 + i * 2) * BLOCK + 99, .bytes = 3 * BLOCK};
            pthread_create(&all[i].thread, NULL, read_on_thread, &all[i]);
        }
        for (int i = 0; i < readers; i++) {
            pthread_join(all[i].thread, NULL);
            assert_int_equal(all[i].rc, SPL_OK);
        }
    }
    assert_true(s.at_once_most > 1);
    spl_dataset_source_close(&source);
    stop(&s);
}

static void *cancel_soon(void *context)
{
    usleep(100000);
    atomic_store((atomic_bool *)context, true);
    return NULL;
}

static void test_cancelling(void **state)
{
    (void)state;
    struct server s;
    struct spl_error err = {0};
    atomic_bool cancelled = false;
    pthread_t thread;
    start(&s, SMALL);
    struct spl_dataset_source source =
        open_with(&s, &(struct spl_remote_how){.deadline_ms = 60000, .cancelled = &cancelled});
    s.failing = 1000;
    pthread_create(&thread, NULL, cancel_soon, &cancelled);
    uint64_t began_ns = spl_now_ns();
    assert_int_equal(read_range(&source, &s, BLOCK, 1, &err), SPL_E_CANCELLED);
    assert_true(spl_now_ns() - began_ns < 30 * SPL_NS_PER_S);
    pthread_join(thread, NULL);
    spl_dataset_source_close(&source);
    stop(&s);
}

static struct spl_page_cache *make_cache(const char *name)
{
    struct spl_page_cache *cache;
    assert_int_equal(spl_page_cache_open(in_folder(name), 100 << 20, &cache, NULL), SPL_OK);
    return cache;
}

static void test_the_page_cache(void **state)
{
    (void)state;
    struct server s;
    struct spl_page_cache *cache = make_cache("pages");
    const struct spl_remote_how how = {.deadline_ms = 5000, .cache = cache};
    start(&s, SIZE);
    for (int round = 0; round < 3; round++) { // as after restarts
        int asks = s.asks;
        struct spl_dataset_source source = open_with(&s, &how);
        uint64_t hits = atomic_load(&spl_remote_counts.cache_hits);
        assert_true(s.asked[asks].first == 0 && s.asked[asks].bytes == 4096); // is it still the same?
        expect_range(&source, &s, 0, 100); // came with that
        expect_range(&source, &s, 4000, 96);
        assert_int_equal(s.asks, asks + 1);
        expect_range(&source, &s, 20 * BLOCK, 10 * BLOCK);
        assert_int_equal(s.asks, asks + (round ? 1 : 2));
        assert_int_equal(atomic_load(&spl_remote_counts.cache_hits), hits + (round ? 10 : 0));
        if (round == 2) { // what its reader finds wrong is asked for again
            source.far->forget(source.context, 22 * BLOCK + 5, BLOCK);
            expect_range(&source, &s, 20 * BLOCK, 10 * BLOCK);
            assert_true(s.asks == asks + 2 && s.asked[asks + 1].first == 22 * BLOCK &&
                        s.asked[asks + 1].bytes == 2 * BLOCK);
        }
        if (round == 1) { // what came at first may be wrong, or of another state by now
            source.far->forget(source.context, 10, 1);
            expect_range(&source, &s, 0, 100);
            expect_range(&source, &s, 4000, 200);
            assert_true(s.asks == asks + 2 && s.asked[asks + 1].first == 0 && s.asked[asks + 1].bytes == BLOCK);
        }
        spl_dataset_source_close(&source);
    }
    strcpy(s.etag, "\"two\""); // a new state has blocks of its own
    s.bytes[25 * BLOCK] ^= 1;
    struct spl_dataset_source source = open_with(&s, &how);
    int asks = s.asks;
    expect_range(&source, &s, 20 * BLOCK, 10 * BLOCK);
    assert_int_equal(s.asks, asks + 1);
    spl_dataset_source_close(&source);
    s.etag[0] = s.modified[0] = '\0'; // a server that says nothing of states: nothing is kept
    for (int round = 0; round < 2; round++) {
        source = open_with(&s, &how);
        asks = s.asks;
        expect_range(&source, &s, 20 * BLOCK, BLOCK);
        assert_int_equal(s.asks, asks + 1);
        spl_dataset_source_close(&source);
    }
    spl_page_cache_let_go(cache);
    stop(&s);
}

/* A dataset whose bytes are spoilt on their way has them right at the second attempt, wherever they lie; one that is
 * damaged at its server is refused, or its page is. */
static void test_bytes_that_are_spoilt(void **state)
{
    (void)state;
    enum { count = 3000 };
    struct server s;
    struct spl_page_cache *cache = make_cache("spoilt");
    char path[300];
    snprintf(path, sizeof path, "%s", in_folder("hall.spld"));
    struct make_splat *splats = calloc(count, sizeof *splats);
    for (int i = 0; i < count; i++)
        splats[i] = (struct make_splat){.position = {i % 50, i / 50, i % 7}, .normal = {0, 0, 1}, .radius = 0.5f};
    make_dataset_file(path, splats, count, 2);
    free(splats);
    FILE *file = fopen(path, "rb");
    struct stat status;
    assert_true(file && !fstat(fileno(file), &status));
    start(&s, (uint64_t)status.st_size);
    assert_int_equal(fread(s.bytes, 1, s.size, file), s.size);
    fclose(file);
    const size_t in_page = SPL_FILE_ALIGNMENT + 100; // the first page begins at the first multiple of it
    const struct spl_dataset_opening how = {.tables_bytes = SPL_TABLES_BYTES};
    for (int kept = 0; kept < 2; kept++) {
        struct spl_dataset *dataset;
        s.flipping = 1;
        s.flipped = kept ? 30 : s.size - 100; // in the header, in what is behind pages
        struct spl_dataset_source source =
            open_with(&s, &(struct spl_remote_how){.deadline_ms = 5000, .cache = kept ? cache : NULL});
        struct spl_error err = {0};
        uint32_t *page;
        assert_int_equal(spl_dataset_open_source_as(&source, "https://h/a/hall.spld", &how, &dataset, &err),
                         SPL_E_CORRUPT);
        source.far->forget(source.context, 0, source.size); // as who opens it by its URL does
        assert_int_equal(spl_dataset_open_source_as(&source, "https://h/a/hall.spld", &how, &dataset, NULL), SPL_OK);
        assert_true(spl_dataset_is_remote(dataset) && !strcmp(spl_dataset_get_info(dataset)->id, "hall"));
        page = malloc(spl_dataset_get_page_bytes(dataset, 0));
        assert_int_equal(spl_dataset_read_page(dataset, 0, page, NULL), SPL_OK);
        s.flipping = 1; // on its way, then
        s.flipped = in_page;
        source.far->forget(source.context, 0, source.size);
        int asks = s.asks;
        assert_int_equal(spl_dataset_read_page(dataset, 0, page, NULL), SPL_OK);
        assert_int_equal(s.asks, asks + 2);
        s.flipping = 1000;
        source.far->forget(source.context, 0, source.size);
        err = (struct spl_error){0};
        assert_int_equal(spl_dataset_read_page(dataset, 0, page, &err), SPL_E_CORRUPT);
        assert_non_null(strstr(err.message, "hall: page 0 fails its checksum, fetched twice"));
        assert_int_equal(s.asks, asks + 4);
        s.flipping = 0;
        free(page);
        spl_dataset_close(dataset);
    }
    assert_int_equal(s.closed, 2);
    spl_page_cache_let_go(cache);
    stop(&s);
}

/* A file of which its server says that it is as long as a file can be, and nothing but its beginning is there. */
struct liar {
    struct spl_file_header header;
    struct spl_section sections[4]; /* behind it */
    size_t held_most;               /* memory, while it was asked */
};

static size_t count_held(void)
{
    struct mallinfo2 info = mallinfo2();
    return info.uordblks + info.hblkhd;
}

static int fetch_lie(void *context, uint64_t offset, void *out, size_t bytes, struct spl_error *err)
{
    struct liar *liar = context;
    size_t held = count_held(), there = offsetof(struct liar, held_most);
    liar->held_most = held > liar->held_most ? held : liar->held_most;
    memset(out, 0, bytes);
    if (offset < there)
        memcpy(out, (char *)liar + offset, bytes < there - offset ? bytes : there - offset);
    return offset + bytes > (64 << 20) + there ? spl_fail(err, SPL_E_TIMEOUT, "nothing comes any more") : SPL_OK;
}

static void hint(void *context, uint64_t offset, uint64_t bytes)
{
    (void)context, (void)offset, (void)bytes;
}

static bool is_same(void *context)
{
    (void)context;
    return false;
}

static void test_a_server_that_claims_exabytes(void **state)
{
    (void)state;
    static const struct spl_source_far far = {
        .fetch = fetch_lie, .expect = hint, .forget = hint, .has_changed = is_same};
    enum { TABLE, ROWS, ATOM, PDIR, TOO_FAR, COUNT };
    static const struct {
        int code;
        const char *message;
        size_t held_most;
    } wanted[COUNT] = {[TABLE] = {SPL_E_CORRUPT, "section table has more than 4194304 rows", 1 << 20},
                       [ROWS] = {SPL_E_TIMEOUT, "nothing comes any more", 129 << 20}, // of which 64 MiB came
                       [ATOM] = {SPL_E_CORRUPT, "section ATOM is shorter than its header, or longer", 1 << 20},
                       [PDIR] = {SPL_E_CORRUPT, "section PDIR is not a whole number of rows", 1 << 20},
                       [TOO_FAR] = {SPL_E_LIMIT, "more than a dataset can have", 1 << 20}};
    for (int lie = 0; lie < COUNT; lie++) {
        struct liar *liar = calloc(1, sizeof *liar);
        const uint64_t size = lie == TOO_FAR ? UINT64_MAX : INT64_MAX / 2 & ~(uint64_t)63;
        struct spl_file_header *header = &liar->header;
        struct spl_dataset *dataset;
        struct spl_error err = {0};
        *header = (struct spl_file_header){.version = SPL_FILE_VERSION,
                                           .header_bytes = sizeof *header,
                                           .file_bytes = size,
                                           .table_offset = sizeof *header,
                                           .section_count = 2};
        memcpy(header->magic, SPL_FILE_MAGIC, sizeof header->magic);
        if (lie == TABLE || lie == ROWS)
            header->section_count = lie == TABLE ? UINT32_MAX : SPL_SECTIONS_MAX;
        liar->sections[0] = (struct spl_section){.type = SPL_SECTION_META, .offset = 256, .bytes = 2};
        liar->sections[1] = (struct spl_section){.type = lie == ATOM ? SPL_SECTION_ATOMS : SPL_SECTION_DIRECTORY,
                                                 .offset = 320,
                                                 .bytes = size / 2 & ~(uint64_t)63};
        header->table_hash = XXH3_64bits(liar->sections, 2 * sizeof *liar->sections);
        header->header_hash = XXH3_64bits(header, offsetof(struct spl_file_header, header_hash));
        const struct spl_dataset_source source = {.size = size, .context = liar, .far = &far, .owned = true};
        const size_t before = count_held();
        assert_int_equal(spl_dataset_open_source_as(&source, "https://h/a/hall.spld",
                                                    &(struct spl_dataset_opening){.tables_bytes = SPL_TABLES_BYTES},
                                                    &dataset, &err),
                         wanted[lie].code);
        assert_non_null(strstr(err.message, wanted[lie].message));
        assert_true(!liar->held_most || liar->held_most <= before + wanted[lie].held_most);
        free(liar);
    }
}

/* What is kept of many files is bounded for all of them together, and what was read last stays. */
static void test_many_files(void **state)
{
    (void)state;
    enum { count = 40 };
    struct server s;
    struct spl_dataset_source sources[count];
    struct spl_error err = {0};
    start(&s, SMALL);
    const size_t before = count_held();
    for (int i = 0; i < count; i++) {
        sources[i] = open_with(&s, &(struct spl_remote_how){0});
        assert_int_equal(read_range(&sources[i], &s, 2 * BLOCK, 8 * BLOCK, &err), SPL_OK);
    }
    if (before) // nobody counts under sanitisers
        assert_in_range(count_held() - before, 60 << 20, 76 << 20);
    int asks = s.asks;
    expect_range(&sources[count - 1], &s, 2 * BLOCK, 8 * BLOCK);
    expect_range(&sources[count - 5], &s, 2 * BLOCK, 8 * BLOCK);
    assert_int_equal(s.asks, asks);
    expect_range(&sources[0], &s, 2 * BLOCK, 8 * BLOCK); // longest ago
    assert_int_equal(s.asks, asks + 1);
    for (int i = 0; i < count; i++)
        spl_dataset_source_close(&sources[i]);
    assert_true(count_held() <= before + (1 << 20));
    stop(&s);
}

/* What small files take is what they have: as many as fit stay, all of them read by one request each. */
static void test_many_small_files(void **state)
{
    (void)state;
    enum { count = 300, small = 30000 };
    struct server s;
    struct spl_dataset_source sources[count];
    start(&s, small);
    const size_t before = count_held();
    for (int i = 0; i < count; i++)
        sources[i] = open_with(&s, &(struct spl_remote_how){0});
    assert_int_equal(s.asks, count);
    if (before)
        assert_in_range(count_held() - before, count * small, count * (small + 12000));
    for (int i = 0; i < count; i++)
        expect_range(&sources[i], &s, 0, small);
    assert_int_equal(s.asks, count);
    for (int i = 0; i < count; i++)
        spl_dataset_source_close(&sources[i]);
    stop(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_any_range_is_that_of_the_file),  cmocka_unit_test(test_neighbours_come_in_one_request),
        cmocka_unit_test(test_what_may_pass_passes),           cmocka_unit_test(test_a_server_that_stays_away),
        cmocka_unit_test(test_refusals_are_told_at_once),      cmocka_unit_test(test_answers_that_are_none),
        cmocka_unit_test(test_a_file_that_changes),            cmocka_unit_test(test_equal_requests_are_joined),
        cmocka_unit_test(test_crowd),                          cmocka_unit_test(test_cancelling),
        cmocka_unit_test(test_the_page_cache),                 cmocka_unit_test(test_bytes_that_are_spoilt),
        cmocka_unit_test(test_a_server_that_claims_exabytes),  cmocka_unit_test(test_many_files),
        cmocka_unit_test(test_many_small_files),
    };
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
