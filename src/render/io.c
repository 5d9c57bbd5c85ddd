/* The io thread; see io.h.
 *
 * Invariants: `staged` counts the bytes of the read under way and of those ended that were not given back, and is raised
 * before memory is taken; it exceeds SPL_IO_BYTES only for one read alone. A read is in one list at a time, but for the
 * one that is being read and those taken, which are in none. Only the io thread waits without a deadline, for work;
 * destroy() wakes it. */
#include "render/io.h"

#include <pthread.h>
#include <stdlib.h>

#include "base/clock.h"
#include "base/memory.h"

enum state { FREE, WAITS, BEING_READ, ENDED, TAKEN };

TAILQ_HEAD(read_list, spl_io_read);

struct spl_io {
    pthread_mutex_t mutex;
    pthread_cond_t work, ended_one;
    pthread_t thread;
    bool started;
    void (*wake)(void *context); // may be NULL
    void *wake_context;
    bool closing;                         // guarded by: mutex, as all below
    struct read_list free, waiting, ended;
    struct spl_io_read *current; /* that is being read; NULL = none */
    size_t under_way;            /* waiting, current or ended */
    uint64_t staged, numbers;
    struct spl_io_read reads[SPL_IO_READS];
};

static bool goes_before(const struct spl_io_read *a, const struct spl_io_read *b)
{
    if (a->rank.awaited != b->rank.awaited)
        return a->rank.awaited;
    if (!a->rank.awaited && a->rank.walk != b->rank.walk)
        return a->rank.walk > b->rank.walk;
    return a->number < b->number;
}

/* The best that waits, if there is room for it. */
static struct spl_io_read *choose(struct spl_io *io)
{
    struct spl_io_read *best = TAILQ_FIRST(&io->waiting), *read;
    TAILQ_FOREACH(read, &io->waiting, link)
    if (goes_before(read, best))
        best = read;
    return best && (!io->staged || io->staged + best->what.bytes <= SPL_IO_BYTES) ? best : NULL;
}

static void give_back(struct spl_io *io, struct spl_io_read *read)
{
    if (read->data)
        io->staged -= read->what.bytes;
    free(read->data);
    *read = (struct spl_io_read){.state = FREE};
    TAILQ_INSERT_HEAD(&io->free, read, link);
    pthread_cond_signal(&io->work); // there is room again
}

/* Reads one, without the mutex. Called and left with it. */
static void perform(struct spl_io *io, struct spl_io_read *read)
{
    struct spl_io_what what = read->what;
    struct spl_error err = {0};
    TAILQ_REMOVE(&io->waiting, read, link);
    read->state = BEING_READ;
    io->current = read;
    io->staged += what.bytes;
    pthread_mutex_unlock(&io->mutex);
    void *data = spl_alloc_raw(what.bytes, 1, &err);
    if (data && what.read(what.source, what.index, data, &err)) {
        free(data);
        data = NULL;
    }
    pthread_mutex_lock(&io->mutex);
    io->current = NULL;
    read->data = data;
    read->err = err;
    if (!data)
        io->staged -= what.bytes;
    if (read->unwanted) {
        io->under_way--;
        give_back(io, read);
    } else {
        read->state = ENDED;
        TAILQ_INSERT_TAIL(&io->ended, read, link);
    }
    pthread_cond_broadcast(&io->ended_one);
}

static void *run(void *argument)
{
    struct spl_io *io = argument;
    struct spl_io_read *next;
    pthread_mutex_lock(&io->mutex);
    while (!io->closing) {
        if (!(next = choose(io))) {
            pthread_cond_wait(&io->work, &io->mutex);
            continue;
        }
        perform(io, next);
        pthread_mutex_unlock(&io->mutex);
        if (io->wake)
            io->wake(io->wake_context);
        pthread_mutex_lock(&io->mutex);
    }
    pthread_mutex_unlock(&io->mutex);
    return NULL;
}

int spl_io_create(void (*wake)(void *context), void *wake_context, struct spl_io **out, struct spl_error *err)
{
    *out = NULL;
    struct spl_io *io = spl_alloc(1, sizeof *io, err);
    if (!io)
        return SPL_E_NOMEM;
    io->wake = wake;
    io->wake_context = wake_context;
    TAILQ_INIT(&io->free);
    TAILQ_INIT(&io->waiting);
    TAILQ_INIT(&io->ended);
    for (size_t i = 0; i < SPL_IO_READS; i++)
        TAILQ_INSERT_TAIL(&io->free, &io->reads[i], link);
    pthread_condattr_t monotonic;
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_mutex_init(&io->mutex, NULL);
    pthread_cond_init(&io->work, NULL);
    pthread_cond_init(&io->ended_one, &monotonic);
    pthread_condattr_destroy(&monotonic);
    int code = pthread_create(&io->thread, NULL, run, io);
    if (code) {
        spl_io_destroy(io);
        return spl_fail_errno(err, code, "cannot start the io thread");
    }
    io->started = true;
    *out = io;
    return SPL_OK;
}

void spl_io_destroy(struct spl_io *io)
{
    if (!io)
        return;
    pthread_mutex_lock(&io->mutex);
    io->closing = true;
    pthread_cond_signal(&io->work);
    pthread_mutex_unlock(&io->mutex);
    if (io->started)
        pthread_join(io->thread, NULL);
    for (size_t i = 0; i < SPL_IO_READS; i++)
        free(io->reads[i].data);
    pthread_cond_destroy(&io->ended_one);
    pthread_cond_destroy(&io->work);
    pthread_mutex_destroy(&io->mutex);
    free(io);
}

struct spl_io_read *spl_io_try_begin(struct spl_io *io, const struct spl_io_what *what, struct spl_io_rank rank)
{
    spl_assert(what->bytes > 0);
    pthread_mutex_lock(&io->mutex);
    struct spl_io_read *read = TAILQ_FIRST(&io->free);
    if (read) {
        TAILQ_REMOVE(&io->free, read, link);
        *read = (struct spl_io_read){.what = *what, .rank = rank, .number = io->numbers++, .state = WAITS};
        TAILQ_INSERT_TAIL(&io->waiting, read, link);
        io->under_way++;
        pthread_cond_signal(&io->work);
    }
    pthread_mutex_unlock(&io->mutex);
    return read;
}

void spl_io_raise(struct spl_io *io, struct spl_io_read *read, struct spl_io_rank rank)
{
    pthread_mutex_lock(&io->mutex);
    struct spl_io_read again = {.rank = rank, .number = io->numbers};
    if (read->state == WAITS && goes_before(&again, read)) {
        read->rank = rank;
        read->number = io->numbers++;
    }
    pthread_mutex_unlock(&io->mutex);
}

struct spl_io_read *spl_io_take(struct spl_io *io)
{
    pthread_mutex_lock(&io->mutex);
    struct spl_io_read *read = TAILQ_FIRST(&io->ended);
    if (read) {
        TAILQ_REMOVE(&io->ended, read, link);
        read->state = TAKEN;
        io->under_way--;
    }
    pthread_mutex_unlock(&io->mutex);
    return read;
}

void *spl_io_take_data(struct spl_io *io, struct spl_io_read *read)
{
    pthread_mutex_lock(&io->mutex);
    void *data = read->data;
    spl_assert(read->state == TAKEN && data);
    io->staged -= read->what.bytes;
    read->data = NULL;
    pthread_mutex_unlock(&io->mutex);
    return data;
}

void spl_io_end(struct spl_io *io, struct spl_io_read *read)
{
    if (!read)
        return;
    pthread_mutex_lock(&io->mutex);
    spl_assert(read->state != FREE && !read->unwanted);
    if (read->state == BEING_READ) {
        read->unwanted = true;
    } else {
        if (read->state != TAKEN) {
            TAILQ_REMOVE(read->state == WAITS ? &io->waiting : &io->ended, read, link);
            io->under_way--;
        }
        give_back(io, read);
    }
    pthread_mutex_unlock(&io->mutex);
}

/* False once the deadline has passed. */
static bool wait_until(struct spl_io *io, uint64_t deadline_ns)
{
    if (!spl_remaining_ns(deadline_ns))
        return false;
    struct timespec t = {.tv_sec = (time_t)(deadline_ns / SPL_NS_PER_S), .tv_nsec = (long)(deadline_ns % SPL_NS_PER_S)};
    if (deadline_ns == SPL_NEVER)
        pthread_cond_wait(&io->ended_one, &io->mutex);
    else
        pthread_cond_timedwait(&io->ended_one, &io->mutex, &t);
    return true;
}

bool spl_io_wait(struct spl_io *io, uint64_t deadline_ns)
{
    pthread_mutex_lock(&io->mutex);
    while (TAILQ_EMPTY(&io->ended) && io->under_way)
        if (!wait_until(io, deadline_ns))
            break;
    bool ended = !TAILQ_EMPTY(&io->ended);
    pthread_mutex_unlock(&io->mutex);
    return ended;
}

bool spl_io_wait_for(struct spl_io *io, const void *source, uint64_t deadline_ns)
{
    pthread_mutex_lock(&io->mutex);
    while (io->current && io->current->what.source == source)
        if (!wait_until(io, deadline_ns))
            break;
    bool none = !io->current || io->current->what.source != source;
    pthread_mutex_unlock(&io->mutex);
    return none;
}

size_t spl_io_count(struct spl_io *io)
{
    pthread_mutex_lock(&io->mutex);
    size_t count = io->under_way;
    pthread_mutex_unlock(&io->mutex);
    return count;
}
