/* A ring of pointers under one mutex, with one condition for "not empty" and one for "not full".
 *
 * Invariant: 0 <= length <= capacity, items[(first + i) % capacity] for i < length are the items in order of arrival.
 * Conditions run on CLOCK_MONOTONIC, so that a jump of the wall clock neither shortens nor stretches a wait. Any
 * thread. */
#include "base/queue.h"

#include <pthread.h>
#include <stdlib.h>

#include "base/condition.h"
#include "base/memory.h"

struct spl_queue {
    pthread_mutex_t mutex;
    pthread_cond_t filled, drained;
    size_t capacity;
    size_t first, length; // guarded by: mutex
    bool closed;          // guarded by: mutex
    bool interrupted;     // guarded by: mutex
    void *items[]; // guarded by: mutex
};

int spl_queue_create(size_t capacity, struct spl_queue **out, struct spl_error *err)
{
    spl_assert(capacity > 0 && capacity < SIZE_MAX / 2 / sizeof(void *));
    struct spl_queue *queue = spl_alloc(1, sizeof *queue + capacity * sizeof *queue->items, err);
    if (!queue)
        return SPL_E_NOMEM;
    queue->capacity = capacity;
    pthread_mutex_init(&queue->mutex, NULL);
    spl_condition_init(&queue->filled);
    spl_condition_init(&queue->drained);
    *out = queue;
    return 0;
}

void spl_queue_destroy(struct spl_queue *queue)
{
    if (!queue)
        return;
    pthread_cond_destroy(&queue->drained);
    pthread_cond_destroy(&queue->filled);
    pthread_mutex_destroy(&queue->mutex);
    free(queue);
}

static void append(struct spl_queue *queue, void *item)
{
    queue->items[(queue->first + queue->length++) % queue->capacity] = item;
    pthread_cond_signal(&queue->filled);
}

bool spl_queue_try_push(struct spl_queue *queue, void *item)
{
    spl_assert(item);
    pthread_mutex_lock(&queue->mutex);
    bool room = !queue->closed && queue->length < queue->capacity;
    if (room)
        append(queue, item);
    pthread_mutex_unlock(&queue->mutex);
    return room;
}

int spl_queue_push(struct spl_queue *queue, void *item, uint64_t deadline_ns, struct spl_error *err)
{
    spl_assert(item);
    int rc = 0;
    pthread_mutex_lock(&queue->mutex);
    while (!queue->closed && queue->length == queue->capacity)
        if (!spl_condition_wait(&queue->drained, &queue->mutex, deadline_ns))
            break;
    if (queue->closed)
        rc = spl_fail(err, SPL_E_CANCELLED, "the queue was closed");
    else if (queue->length == queue->capacity)
        rc = spl_fail(err, SPL_E_TIMEOUT, "a queue of %zu stayed full until the deadline", queue->capacity);
    else
        append(queue, item);
    pthread_mutex_unlock(&queue->mutex);
    return rc;
}

void *spl_queue_pop(struct spl_queue *queue, uint64_t deadline_ns)
{
    void *item = NULL;
    pthread_mutex_lock(&queue->mutex);
    while (!queue->closed && !queue->length && !queue->interrupted)
        if (!spl_condition_wait(&queue->filled, &queue->mutex, deadline_ns))
            break;
    if (queue->length) {
        item = queue->items[queue->first];
        queue->first = (queue->first + 1) % queue->capacity;
        queue->length--;
        pthread_cond_signal(&queue->drained);
    } else {
        queue->interrupted = false;
    }
    pthread_mutex_unlock(&queue->mutex);
    return item;
}

size_t spl_queue_take_if(struct spl_queue *queue, bool (*take)(void *item, void *context), void *context)
{
    pthread_mutex_lock(&queue->mutex);
    size_t kept = 0, before = queue->length;
    for (size_t i = 0; i < before; i++) {
        void *item = queue->items[(queue->first + i) % queue->capacity];
        if (!take(item, context))
            queue->items[(queue->first + kept++) % queue->capacity] = item;
    }
    queue->length = kept;
    if (kept < before)
        pthread_cond_broadcast(&queue->drained);
    pthread_mutex_unlock(&queue->mutex);
    return before - kept;
}

void spl_queue_interrupt(struct spl_queue *queue)
{
    pthread_mutex_lock(&queue->mutex);
    queue->interrupted = true;
    pthread_cond_signal(&queue->filled);
    pthread_mutex_unlock(&queue->mutex);
}

void spl_queue_close(struct spl_queue *queue)
{
    pthread_mutex_lock(&queue->mutex);
    queue->closed = true;
    pthread_cond_broadcast(&queue->filled);
    pthread_cond_broadcast(&queue->drained);
    pthread_mutex_unlock(&queue->mutex);
}

bool spl_queue_is_closed(struct spl_queue *queue)
{
    pthread_mutex_lock(&queue->mutex);
    bool closed = queue->closed;
    pthread_mutex_unlock(&queue->mutex);
    return closed;
}

size_t spl_queue_get_length(struct spl_queue *queue)
{
    pthread_mutex_lock(&queue->mutex);
    size_t length = queue->length;
    pthread_mutex_unlock(&queue->mutex);
    return length;
}

size_t spl_queue_get_capacity(const struct spl_queue *queue)
{
    return queue->capacity;
}
