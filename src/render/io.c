/* The io threads; see io.h.
 *
 * Invariants: staged[far] counts the bytes of reads under way and of those ended that were not given back, from afar
 * or not, and is raised before memory is taken; it exceeds SPL_IO_BYTES only for one read alone, and from afar by what
 * hangs, SPL_IO_HANGING_BYTES at most. Memory that is given back while there is more to read is kept for that, within
 * the same bound: to have it anew costs as much as the read. A read is in one list at a time, but for those taken,
 * which are in none. Of a source as many reads are under way as it says, and as many that hang; a thread is begun
 * where one of another could be, and none is idle. Only idle threads wait without a deadline, for work; destroy()
 * wakes them, waits for those that are not in the middle of a read, and leaves the others behind: then `io` is theirs,
 * and the last one frees it. */
#include "render/io.h"

#include <pthread.h>
#include <stdlib.h>

#include "base/condition.h"
#include "base/memory.h"
#include "render/spares.h"

enum state { FREE, WAITS, BEING_READ, ENDED, TAKEN };

enum { READS = 4 * SPL_IO_READS, hanging_most = 4 /* of a source, before it gets no more threads */ };
static const uint64_t hangs_ns = SPL_NS_PER_S;

TAILQ_HEAD(read_list, spl_io_read);

struct spl_io {
    pthread_mutex_t mutex;
    pthread_cond_t work, ended_one;
    void (*wake)(void *context); // may be NULL
    void *wake_context;
    bool closing, left_behind;            // guarded by: mutex, as all below
    struct read_list free, waiting, being_read, ended;
    unsigned threads, idle, reading; /* idle: that look for work, or are about to */
    size_t used, under_way;          /* not free; of these, waiting, being read or ended */
    uint64_t staged[2], numbers, moved_ns;
    size_t used_far;
    struct spl_spares spares;
    struct spl_io_read reads[READS];
};

static bool goes_before(const struct spl_io_read *a, const struct spl_io_read *b)
{
    if (a->rank.awaited != b->rank.awaited)
        return a->rank.awaited;
    if (!a->rank.awaited && a->rank.walk != b->rank.walk)
        return a->rank.walk > b->rank.walk;
    return a->number < b->number;
}

/* When something of it was last seen. */
static uint64_t get_sign_ns(const struct spl_io_read *read)
{
    uint64_t moved_ns = read->what.get_moved_ns ? read->what.get_moved_ns(read->what.source, read->what.index) : 0;
    return moved_ns > read->began_ns ? moved_ns : read->began_ns;
}

static bool hangs(const struct spl_io_read *read)
{
    uint64_t sign_ns = get_sign_ns(read), now_ns = spl_now_ns();
    return now_ns > sign_ns && now_ns - sign_ns >= hangs_ns;
}

/* Are as many under way of its source as may be? A part where something hangs is no place for more threads. */
static bool is_busy(struct spl_io *io, const struct spl_io_what *what)
{
    const unsigned most = what->at_once ? what->at_once : 1;
    unsigned moving = 0, hanging = 0;
    bool part_hangs = false;
    struct spl_io_read *read;
    TAILQ_FOREACH(read, &io->being_read, link)
    {
        const bool own = read->what.source == what->source, hung = own && hangs(read);
        moving += own && !hung;
        hanging += hung;
        part_hangs |= hung && read->what.part == what->part;
    }
    return part_hangs || moving >= most || hanging >= (most < hanging_most ? most : hanging_most);
}

/* Is there memory for it, and from afar a thread? */
static bool has_room(struct spl_io *io, const struct spl_io_read *next)
{
    const uint64_t staged = io->staged[next->far];
    uint64_t hanging = 0;
    unsigned from_afar = 0;
    struct spl_io_read *read;
    TAILQ_FOREACH(read, &io->being_read, link)
    {
        from_afar += read->far;
        hanging += next->far && read->far && hangs(read) ? read->what.bytes : 0;
    }
    if (hanging > SPL_IO_HANGING_BYTES)
        hanging = SPL_IO_HANGING_BYTES;
    return (!next->far || from_afar < SPL_IO_THREADS / 4 * 3) &&
           (staged <= hanging || staged - hanging + next->what.bytes <= SPL_IO_BYTES);
}

/* The best that waits for a thread only, of those from afar or of the others, if there is room for it. */
static struct spl_io_read *choose_of(struct spl_io *io, bool far)
{
    struct spl_io_read *best = NULL, *read;
    TAILQ_FOREACH(read, &io->waiting, link)
    if (read->far == far && (!best || goes_before(read, best)) && !is_busy(io, &read->what))
        best = read;
    return best && has_room(io, best) ? best : NULL;
}

static struct spl_io_read *choose(struct spl_io *io)
{
    struct spl_io_read *near = choose_of(io, false), *far = choose_of(io, true);
    return !near || (far && goes_before(far, near)) ? far : near;
}

static void give_back(struct spl_io *io, struct spl_io_read *read)
{
    io->used_far -= read->far;
    if (read->data) {
        io->staged[read->far] -= read->what.bytes;
        const uint64_t staged = io->staged[0] + io->staged[1];
        io->moved_ns = spl_now_ns(); // there is room again: nothing hung if it was waited for
        if (!io->under_way)
            spl_spares_drop(&io->spares);
        spl_spares_keep(&io->spares, read->data, read->room,
                        io->under_way && staged < SPL_IO_BYTES ? SPL_IO_BYTES - staged : 0);
    }
    *read = (struct spl_io_read){.state = FREE};
    TAILQ_INSERT_HEAD(&io->free, read, link);
    io->used--;
    pthread_cond_broadcast(&io->work); // there is room again
}

static void *run(void *argument);

static int start_thread(struct spl_io *io)
{
    pthread_t thread;
    pthread_attr_t detached;
    pthread_attr_init(&detached);
    pthread_attr_setdetachstate(&detached, PTHREAD_CREATE_DETACHED);
    int code = pthread_create(&thread, &detached, run, io);
    pthread_attr_destroy(&detached);
    io->threads += !code;
    io->idle += !code;
    return code;
}

/* Is there something to read that nobody turns to? Where no thread can be had, those that there are come to it. */
static void see_to_waiting(struct spl_io *io)
{
    if (io->idle)
        pthread_cond_broadcast(&io->work);
    else if (io->threads < SPL_IO_THREADS && choose(io))
        start_thread(io);
}

/* Reads one, without the mutex. Called and left with it. */
static void perform(struct spl_io *io, struct spl_io_read *read)
{
    struct spl_io_what what = read->what;
    struct spl_error err = {0};
    if (what.hold)
        what.hold(what.source); // before its owner can end the read and close it
    TAILQ_REMOVE(&io->waiting, read, link);
    TAILQ_INSERT_TAIL(&io->being_read, read, link);
    read->state = BEING_READ;
    read->began_ns = spl_now_ns();
    size_t room;
    void *data = spl_spares_take(&io->spares, what.bytes, &room);
    io->reading++;
    io->staged[read->far] += what.bytes;
    io->moved_ns = read->began_ns;
    see_to_waiting(io);
    pthread_mutex_unlock(&io->mutex);
    if (!data)
        data = spl_alloc_raw(what.bytes, 1, &err);
    if (data && what.read(what.source, what.index, data, &err)) {
        free(data);
        data = NULL;
    }
    if (what.get_moved_ns) { // the source may be gone when it was let go of
        pthread_mutex_lock(&io->mutex);
        read->what.get_moved_ns = NULL;
        pthread_mutex_unlock(&io->mutex);
    }
    if (what.let_go)
        what.let_go(what.source);
    pthread_mutex_lock(&io->mutex);
    io->moved_ns = read->ended_ns = spl_now_ns();
    io->reading--;
    TAILQ_REMOVE(&io->being_read, read, link);
    if (io->closing) { // nobody comes for it
        free(data);
        data = NULL;
    }
    read->data = data;
    read->room = room;
    read->err = err;
    if (!data)
        io->staged[read->far] -= what.bytes;
    if (read->unwanted) {
        io->under_way--;
        give_back(io, read);
    } else {
        read->state = ENDED;
        TAILQ_INSERT_TAIL(&io->ended, read, link);
    }
    pthread_cond_broadcast(&io->ended_one);
}

static void release(struct spl_io *io)
{
    spl_spares_drop(&io->spares);
    for (size_t i = 0; i < READS; i++)
        free(io->reads[i].data);
    pthread_cond_destroy(&io->ended_one);
    pthread_cond_destroy(&io->work);
    pthread_mutex_destroy(&io->mutex);
    free(io);
}

/* Counted as idle when it begins. One idle thread stays. */
static void *run(void *argument)
{
    struct spl_io *io = argument;
    struct spl_io_read *next;
    pthread_mutex_lock(&io->mutex);
    while (!io->closing) {
        if (!(next = choose(io))) {
            if (io->idle > 1)
                break;
            pthread_cond_wait(&io->work, &io->mutex);
            continue;
        }
        io->idle--;
        perform(io, next);
        if (io->wake && !io->closing) {
            pthread_mutex_unlock(&io->mutex);
            io->wake(io->wake_context); // destroy() waits for this, as nothing is being read
            pthread_mutex_lock(&io->mutex);
        }
        io->idle++;
    }
    io->idle--;
    io->threads--;
    bool last = io->left_behind && !io->threads;
    pthread_cond_broadcast(&io->ended_one);
    pthread_mutex_unlock(&io->mutex);
    if (last)
        release(io);
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
    TAILQ_INIT(&io->being_read);
    TAILQ_INIT(&io->ended);
    for (size_t i = 0; i < READS; i++)
        TAILQ_INSERT_TAIL(&io->free, &io->reads[i], link);
    pthread_mutex_init(&io->mutex, NULL);
    pthread_cond_init(&io->work, NULL);
    spl_condition_init(&io->ended_one);
    pthread_mutex_lock(&io->mutex);
    int code = start_thread(io);
    pthread_mutex_unlock(&io->mutex);
    if (code) {
        spl_io_destroy(io);
        return spl_fail_errno(err, code, "cannot start the io thread");
    }
    *out = io;
    return SPL_OK;
}

void spl_io_destroy(struct spl_io *io)
{
    if (!io)
        return;
    pthread_mutex_lock(&io->mutex);
    io->closing = true;
    spl_spares_drop(&io->spares);
    for (size_t i = 0; i < READS; i++) {
        free(io->reads[i].data);
        io->reads[i].data = NULL;
    }
    pthread_cond_broadcast(&io->work);
    while (io->threads > io->reading)
        pthread_cond_wait(&io->ended_one, &io->mutex);
    io->left_behind = io->threads;
    bool left_behind = io->left_behind;
    pthread_mutex_unlock(&io->mutex);
    if (!left_behind)
        release(io);
}

static size_t count_of(const struct spl_io *io, const void *source)
{
    size_t count = 0;
    for (size_t i = 0; i < READS; i++)
        count += io->reads[i].state != FREE && io->reads[i].what.source == source;
    return count;
}

struct spl_io_read *spl_io_try_begin(struct spl_io *io, const struct spl_io_what *what, struct spl_io_rank rank)
{
    spl_assert(what->bytes > 0);
    pthread_mutex_lock(&io->mutex);
    struct spl_io_read *read = TAILQ_FIRST(&io->free);
    if (io->used >= SPL_IO_READS && count_of(io, what->source) >= SPL_IO_READS)
        read = NULL;
    const bool far = what->get_moved_ns;
    if (far && io->used_far >= READS / 4 * 3)
        read = NULL;
    if (read) {
        io->used++;
        io->used_far += far;
        TAILQ_REMOVE(&io->free, read, link);
        *read = (struct spl_io_read){.what = *what, .rank = rank, .number = io->numbers++, .far = far, .state = WAITS};
        TAILQ_INSERT_TAIL(&io->waiting, read, link);
        io->under_way++;
        if (!is_busy(io, what)) // a thread turns to it
            io->moved_ns = spl_now_ns();
        see_to_waiting(io);
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
    io->staged[read->far] -= read->what.bytes;
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

bool spl_io_wait(struct spl_io *io, uint64_t deadline_ns)
{
    pthread_mutex_lock(&io->mutex);
    while (TAILQ_EMPTY(&io->ended) && io->under_way)
        if (!spl_condition_wait(&io->ended_one, &io->mutex, deadline_ns))
            break;
    bool ended = !TAILQ_EMPTY(&io->ended);
    pthread_mutex_unlock(&io->mutex);
    return ended;
}

static size_t count_hanging(struct spl_io *io)
{
    size_t count = 0;
    const struct spl_io_read *read;
    TAILQ_FOREACH(read, &io->being_read, link)
    count += hangs(read);
    if (count && !TAILQ_EMPTY(&io->waiting)) // what hangs by now has made room
        see_to_waiting(io);
    return count;
}

uint64_t spl_io_get_moved_ns(struct spl_io *io, const void *source)
{
    uint64_t latest_ns = 0;
    struct spl_io_read *read;
    pthread_mutex_lock(&io->mutex);
    count_hanging(io); // who waits for pages asks this, again and again
    TAILQ_FOREACH(read, &io->being_read, link)
    if (read->what.source == source && get_sign_ns(read) > latest_ns)
        latest_ns = get_sign_ns(read);
    latest_ns = latest_ns ? latest_ns : io->moved_ns;
    pthread_mutex_unlock(&io->mutex);
    return latest_ns;
}

static bool any_hangs(struct spl_io *io, const void *source, bool of_part, uint32_t part)
{
    bool answer = false;
    struct spl_io_read *read;
    pthread_mutex_lock(&io->mutex);
    TAILQ_FOREACH(read, &io->being_read, link)
    answer |= read->what.source == source && (!of_part || read->what.part == part) && hangs(read);
    pthread_mutex_unlock(&io->mutex);
    return answer;
}

bool spl_io_hangs(struct spl_io *io, const void *source)
{
    return any_hangs(io, source, false, 0);
}

bool spl_io_part_hangs(struct spl_io *io, const void *source, uint32_t part)
{
    return any_hangs(io, source, true, part);
}

size_t spl_io_count_hanging(struct spl_io *io)
{
    pthread_mutex_lock(&io->mutex);
    size_t count = count_hanging(io);
    pthread_mutex_unlock(&io->mutex);
    return count;
}

size_t spl_io_count(struct spl_io *io)
{
    pthread_mutex_lock(&io->mutex);
    size_t count = io->under_way;
    pthread_mutex_unlock(&io->mutex);
    return count;
}
