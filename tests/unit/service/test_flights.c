/* Views on their way, over the fake renderer: equal ones share a frame, each request keeps its own deadline, those that
 * leave take nobody along. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#include "base/clock.h"
#include "service/ops/counters.h"
#include "service/state.h"
#include "service/view/flights.h"
#include "service/view/views.h"
#include "support/fake_renderer.h"

static struct spl_counters counters;
static struct spl_views views;
static struct spl_service service = {.counters = &counters, .views = &views};
static struct spl_catalog_entry entry = {.references = 1};

static void wake(void *context)
{
    (void)context;
}

/* Frames are held until land(). */
static void start(void)
{
    atomic_store(&fake_frames.held, true);
    counters = (struct spl_counters){0};
    views = (struct spl_views){0};
    struct spl_fleet_options options = {
        .devices = "fake", .pipeline = {.queue = 8, .encoders = 1, .counters = &counters, .wake = wake}};
    assert_int_equal(spl_cache_create(1 << 20, &views.cache, NULL), 0);
    assert_int_equal(spl_fleet_create(&options, &views.fleet, NULL), 0);
    for (int ms = 0; ms < 60000 && spl_fleet_get_state(views.fleet) != SPL_PIPELINE_READY; ms++)
        usleep(1000);
}

static void stop(void)
{
    assert_true(LIST_EMPTY(&views.flights));
    spl_fleet_destroy(views.fleet);
    spl_cache_destroy(views.cache);
    assert_int_equal(views.reply_bytes, 0);
}

struct passenger {
    struct ticket ticket; /* first: a ticket is its passenger */
    int answers, code;
    uint8_t *bytes;
};

static void on_done(struct ticket *ticket, struct spl_rendering *rendering, const struct spl_error *err)
{
    struct passenger *passenger = (struct passenger *)ticket;
    passenger->answers++;
    passenger->code = err->code;
    passenger->bytes = rendering ? rendering->encoded.bytes : NULL;
}

/* Asks for view `n`. */
static int ask(struct passenger *passenger, uint64_t n, uint64_t deadline_ms)
{
    struct spl_view_request request = {.encode = SPL_SIZED(spl_encode_options, .format = SPL_FORMAT_RAW)};
    spl_view_init(&request.view);
    request.view.camera = (struct spl_camera){.width = 4, .height = 4};
    struct spl_key key = {.words = {n, n}};
    *passenger =
        (struct passenger){.ticket = {.done = on_done, .deadline_ns = spl_now_ns() + deadline_ms * SPL_NS_PER_MS}};
    return spl_flight_board(&service, &passenger->ticket, &entry, &request, &key, NULL);
}

static void land(const struct passenger *until)
{
    atomic_store(&fake_frames.held, false);
    for (int ms = 0; ms < 60000 && !until->answers; ms++) {
        for (struct spl_job *job; (job = spl_fleet_take(views.fleet));)
            job->done(job);
        usleep(1000);
    }
    assert_int_equal(until->answers, 1);
}

static void equal_views_share_a_frame(void **state)
{
    (void)state;
    start();
    struct passenger p[5], other;
    for (int i = 0; i < 5; i++) {
        assert_int_equal(ask(&p[i], 1, 600000), 0);
        assert_int_equal(p[i].ticket.shared, i > 0);
    }
    assert_int_equal(ask(&other, 2, 600000), 0);
    assert_false(other.ticket.shared);
    land(&other);
    for (int i = 0; i < 5; i++) {
        assert_int_equal(p[i].answers, 1);
        assert_int_equal(p[i].code, 0);
        assert_ptr_equal(p[i].bytes, p[0].bytes);
    }
    assert_int_equal(counters.frames, 2);
    assert_int_equal(counters.views_shared, 4);
    stop();
}

static void who_leaves_takes_nobody_along(void **state)
{
    (void)state;
    start();
    struct passenger first, second, third;
    ask(&first, 1, 600000);
    ask(&second, 1, 600000);
    spl_ticket_drop(&first.ticket);
    spl_ticket_drop(&first.ticket); // harmless
    ask(&third, 1, 600000);
    assert_true(third.ticket.shared);
    land(&third);
    assert_int_equal(first.answers, 0);
    assert_int_equal(second.code, 0);
    assert_int_equal(counters.frames, 1);
    stop();
}

static void the_last_to_leave_ends_the_flight(void **state)
{
    (void)state;
    start();
    struct passenger busy, p, again;
    ask(&busy, 1, 600000);
    ask(&p, 2, 600000);
    spl_ticket_drop(&p.ticket);
    ask(&again, 2, 600000);
    assert_false(again.ticket.shared);
    land(&again);
    assert_int_equal(again.code, 0);
    assert_int_equal(p.answers, 0);
    assert_int_equal(counters.frames, 2);
    stop();
}

/* The one with more time joins while the view waits in the queue: the view's deadline is raised. */
static void a_late_passenger_raises_the_deadline(void **state)
{
    (void)state;
    start();
    struct passenger busy, early, late;
    ask(&busy, 1, 600000);
    ask(&early, 2, 1);
    ask(&late, 2, 600000);
    assert_true(late.ticket.shared);
    while (spl_remaining_ns(early.ticket.deadline_ns))
        usleep(500);
    land(&late);
    assert_int_equal(late.code, 0);
    assert_true(early.answers == 1 && early.code == 0); /* of one flight that landed, not of one that was cut short */
    assert_int_equal(counters.frames, 2);
    stop();
}

/* The frame has begun under the first one's deadline: it fails, and is launched again for the other. */
static void a_frame_that_was_cut_short_is_launched_again(void **state)
{
    (void)state;
    start();
    struct passenger early, late;
    ask(&early, 1, 200);
    while (!atomic_load(&fake_frames.drawing) && spl_remaining_ns(early.ticket.deadline_ns))
        usleep(500);
    while (spl_remaining_ns(early.ticket.deadline_ns) || atomic_load(&fake_frames.drawing))
        usleep(500);
    ask(&late, 1, 600000); // it is not known here yet
    assert_true(late.ticket.shared);
    land(&late);
    assert_int_equal(late.code, 0);
    assert_int_equal(early.answers, 1);
    stop();
}

static void a_full_queue_refuses_and_keeps_nothing(void **state)
{
    (void)state;
    start();
    struct passenger p[40];
    int boarded = 0, last = 0;
    for (int i = 0; i < 40; i++)
        if (!ask(&p[i], (uint64_t)i + 1, 600000))
            last = i, boarded++;
        else
            assert_null(p[i].ticket.flight);
    assert_in_range(boarded, 8, 10);
    for (int i = 0; i < 40; i++)
        if (i != last)
            spl_ticket_drop(&p[i].ticket);
    land(&p[last]);
    stop();
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(equal_views_share_a_frame),
        cmocka_unit_test(who_leaves_takes_nobody_along),
        cmocka_unit_test(the_last_to_leave_ends_the_flight),
        cmocka_unit_test(a_late_passenger_raises_the_deadline),
        cmocka_unit_test(a_frame_that_was_cut_short_is_launched_again),
        cmocka_unit_test(a_full_queue_refuses_and_keeps_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
