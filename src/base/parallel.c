/* An atomic cursor over the range; the caller's thread is worker 0. */
#include "base/parallel.h"

#include <pthread.h>
#include <stdatomic.h>
#include <unistd.h>

enum { threads_max = 64 };

struct loop {
    size_t count, grain;
    void (*body)(void *, size_t, size_t, unsigned);
    void *context;
    atomic_size_t cursor;
};

struct worker {
    struct loop *loop;
    unsigned index;
    pthread_t thread;
};

static void *run(void *argument)
{
    struct worker *w = argument;
    struct loop *l = w->loop;
    for (;;) {
        size_t begin = atomic_fetch_add(&l->cursor, l->grain);
        if (begin >= l->count)
            return NULL;
        size_t end = l->count - begin < l->grain ? l->count : begin + l->grain;
        l->body(l->context, begin, end, w->index);
    }
}

unsigned spl_thread_count(unsigned requested)
{
    long online = requested ? (long)requested : sysconf(_SC_NPROCESSORS_ONLN);
    return online < 1 ? 1 : online > threads_max ? threads_max : (unsigned)online;
}

void spl_parallel_for(unsigned threads, size_t count, size_t grain,
                      void (*body)(void *context, size_t begin, size_t end, unsigned worker), void *context)
{
    struct loop loop = {.count = count, .grain = grain ? grain : 1, .body = body, .context = context};
    struct worker workers[threads_max];
    unsigned wanted = spl_thread_count(threads), started = 1;
    workers[0] = (struct worker){.loop = &loop};
    for (; started < wanted && started * loop.grain < count; started++) {
        workers[started] = (struct worker){.loop = &loop, .index = started};
        if (pthread_create(&workers[started].thread, NULL, run, &workers[started]))
            break;
    }
    run(&workers[0]);
    for (unsigned i = 1; i < started; i++)
        pthread_join(workers[i].thread, NULL);
}
