/* Queues: order, bounds, deadlines, closing, and nothing lost or doubled between many threads. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <pthread.h>
#include <stdatomic.h>
#include <cmocka.h>

#include "base/clock.h"
#include "base/queue.h"

static int items[4096];

static void keeps_order_and_bound(void **state)
{
    (void)state;
    struct spl_queue *queue;
    assert_int_equal(spl_queue_create(3, &queue, NULL), 0);
    for (int round = 0; round < 5; round++) {
        for (int i = 0; i < 3; i++)
            assert_true(spl_queue_try_push(queue, &items[i]));
        assert_false(spl_queue_try_push(queue, &items[3]));
        assert_int_equal(spl_queue_get_length(queue), 3);
        for (int i = 0; i < 3; i++)
            assert_ptr_equal(spl_queue_pop(queue, 0), &items[i]);
        assert_null(spl_queue_pop(queue, 0));
    }
    spl_queue_destroy(queue);
    spl_queue_destroy(NULL);
}

static void waits_end_at_their_deadline(void **state)
{
    (void)state;
    struct spl_queue *queue;
    struct spl_error err = {0};
    assert_int_equal(spl_queue_create(1, &queue, NULL), 0);
    uint64_t deadline = spl_now_ns() + 5 * SPL_NS_PER_MS;
    assert_null(spl_queue_pop(queue, deadline));
    assert_true(spl_now_ns() >= deadline);
    assert_true(spl_queue_try_push(queue, &items[0]));
    assert_int_equal(spl_queue_push(queue, &items[1], spl_now_ns() + SPL_NS_PER_MS, &err), SPL_E_TIMEOUT);
    assert_int_equal(err.code, SPL_E_TIMEOUT);
    assert_ptr_equal(spl_queue_pop(queue, SPL_NEVER), &items[0]);
    spl_queue_destroy(queue);
}

static void closing_keeps_what_is_inside(void **state)
{
    (void)state;
    struct spl_queue *queue;
    assert_int_equal(spl_queue_create(2, &queue, NULL), 0);
    assert_true(spl_queue_try_push(queue, &items[0]));
    spl_queue_close(queue);
    assert_true(spl_queue_is_closed(queue));
    assert_false(spl_queue_try_push(queue, &items[1]));
    assert_int_equal(spl_queue_push(queue, &items[1], SPL_NEVER, NULL), SPL_E_CANCELLED);
    assert_ptr_equal(spl_queue_pop(queue, SPL_NEVER), &items[0]);
    assert_null(spl_queue_pop(queue, SPL_NEVER));
    spl_queue_destroy(queue);
}

static void an_interruption_ends_one_wait(void **state)
{
    (void)state;
    struct spl_queue *queue;
    assert_int_equal(spl_queue_create(2, &queue, NULL), 0);
    spl_queue_interrupt(queue);
    assert_null(spl_queue_pop(queue, SPL_NEVER)); // the next one, where none waits
    spl_queue_interrupt(queue);
    assert_true(spl_queue_try_push(queue, &items[0]));
    assert_ptr_equal(spl_queue_pop(queue, SPL_NEVER), &items[0]);
    assert_null(spl_queue_pop(queue, SPL_NEVER)); // still to come: the queue was not empty
    assert_true(spl_queue_try_push(queue, &items[1]));
    assert_ptr_equal(spl_queue_pop(queue, SPL_NEVER), &items[1]);
    spl_queue_interrupt(queue);
    assert_null(spl_queue_pop(queue, SPL_NEVER));
    uint64_t deadline = spl_now_ns() + 5 * SPL_NS_PER_MS;
    assert_null(spl_queue_pop(queue, deadline)); // and it has passed: this one waits again
    assert_true(spl_now_ns() >= deadline);
    spl_queue_destroy(queue);
}

static bool is_odd(void *item, void *context)
{
    *(int **)context = item; // the last that it was asked of
    return ((int *)item - items) % 2;
}

static bool is_any(void *item, void *context)
{
    return item && !context;
}

static void *push_one(void *queue)
{
    assert_int_equal(spl_queue_push(queue, &items[9], SPL_NEVER, NULL), 0);
    return NULL;
}

static void what_is_taken_out_leaves_the_rest_in_order(void **state)
{
    (void)state;
    struct spl_queue *queue;
    int *last = NULL;
    assert_int_equal(spl_queue_create(5, &queue, NULL), 0);
    assert_int_equal(spl_queue_take_if(queue, is_odd, &last), 0);
    assert_null(last);
    for (int first = 0; first < 5; first++) { // wherever the ring begins
        for (int i = 0; i < 5; i++)
            assert_true(spl_queue_try_push(queue, &items[i]));
        assert_int_equal(spl_queue_take_if(queue, is_odd, &last), 2);
        assert_ptr_equal(last, &items[4]);
        assert_int_equal(spl_queue_get_length(queue), 3);
        assert_true(spl_queue_try_push(queue, &items[5]));
        for (int i = 0; i < 6; i += i == 4 ? 1 : 2)
            assert_ptr_equal(spl_queue_pop(queue, 0), &items[i]);
        assert_null(spl_queue_pop(queue, 0));
        assert_true(spl_queue_try_push(queue, &items[6]));
        assert_int_equal(spl_queue_take_if(queue, is_odd, &last), 0);
        assert_ptr_equal(spl_queue_pop(queue, 0), &items[6]);
    }
    for (int i = 0; i < 5; i++)
        assert_true(spl_queue_try_push(queue, &items[i]));
    pthread_t producer; // who waits for room, if it does by now, has it
    pthread_create(&producer, NULL, push_one, queue);
    assert_int_equal(spl_queue_take_if(queue, is_any, NULL), 5);
    pthread_join(producer, NULL);
    assert_ptr_equal(spl_queue_pop(queue, 0), &items[9]);
    spl_queue_destroy(queue);
}

struct crowd {
    struct spl_queue *queue;
    atomic_int next, seen[4096];
};

static void *produce(void *argument)
{
    struct crowd *crowd = argument;
    for (int i; (i = atomic_fetch_add(&crowd->next, 1)) < 4096;)
        assert_int_equal(spl_queue_push(crowd->queue, &items[i], SPL_NEVER, NULL), 0);
    return NULL;
}

static void *consume(void *argument)
{
    struct crowd *crowd = argument;
    for (int *item; (item = spl_queue_pop(crowd->queue, SPL_NEVER));)
        atomic_fetch_add(&crowd->seen[item - items], 1);
    return NULL;
}

static void every_item_comes_out_once(void **state)
{
    (void)state;
    static struct crowd crowd;
    pthread_t producers[3], consumers[3];
    assert_int_equal(spl_queue_create(5, &crowd.queue, NULL), 0);
    for (int i = 0; i < 3; i++) {
        pthread_create(&producers[i], NULL, produce, &crowd);
        pthread_create(&consumers[i], NULL, consume, &crowd);
    }
    for (int i = 0; i < 3; i++)
        pthread_join(producers[i], NULL);
    spl_queue_close(crowd.queue);
    for (int i = 0; i < 3; i++)
        pthread_join(consumers[i], NULL);
    for (int i = 0; i < 4096; i++)
        assert_int_equal(crowd.seen[i], 1);
    spl_queue_destroy(crowd.queue);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(keeps_order_and_bound),
        cmocka_unit_test(waits_end_at_their_deadline),
        cmocka_unit_test(closing_keeps_what_is_inside),
        cmocka_unit_test(an_interruption_ends_one_wait),
        cmocka_unit_test(what_is_taken_out_leaves_the_rest_in_order),
        cmocka_unit_test(every_item_comes_out_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
