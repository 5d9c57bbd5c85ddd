/* Bounded queues of pointers: the only tie between threads. Any number of producers and consumers; nothing waits
 * without a deadline unless the caller says SPL_NEVER. */
#ifndef SPL_BASE_QUEUE_H
#define SPL_BASE_QUEUE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

struct spl_queue;

/* `capacity` >= 1 items. The caller owns *out. */
int spl_queue_create(size_t capacity, struct spl_queue **out, struct spl_error *err);

/* NULL-safe. Items still inside are not touched; no thread may be waiting. */
void spl_queue_destroy(struct spl_queue *queue);

/* Never waits for room. False when the queue is full or closed; the caller then keeps `item` (not NULL). */
bool spl_queue_try_push(struct spl_queue *queue, void *item);

/* Waits for room until `deadline_ns`: SPL_E_TIMEOUT when there was none, SPL_E_CANCELLED when the queue was closed. On
 * failure the caller keeps `item` (not NULL). */
int spl_queue_push(struct spl_queue *queue, void *item, uint64_t deadline_ns, struct spl_error *err);

/* The oldest item; NULL when none came until `deadline_ns` (0 = never waits), the queue is closed and empty, or empty
 * and a consumer was interrupted. */
void *spl_queue_pop(struct spl_queue *queue, uint64_t deadline_ns);

/* Has `take` look at every item inside, oldest first and each once, and takes out those that it returns true for, which
 * are its own then; the others keep their order. `take` is called under the queue's lock: it neither waits nor uses the
 * queue. How many were taken out. */
size_t spl_queue_take_if(struct spl_queue *queue, bool (*take)(void *item, void *context), void *context);

/* Makes one pop() on an empty queue, the one that waits or the next, return NULL. */
void spl_queue_interrupt(struct spl_queue *queue);

/* Refuses further items and wakes everyone; what is inside can still be popped. */
void spl_queue_close(struct spl_queue *queue);
bool spl_queue_is_closed(struct spl_queue *queue);

size_t spl_queue_get_length(struct spl_queue *queue);
size_t spl_queue_get_capacity(const struct spl_queue *queue);

#endif
