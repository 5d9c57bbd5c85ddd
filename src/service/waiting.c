/* Requests that wait for views, for the pool to read a path or look up a coordinate system, or for the loop to have
 * time for them: their MHD connection is suspended until all is ready, the deadline passes or the client leaves.
 *
 * A body of a MiB takes 30 ms to read, a list of a thousand tours as long, and hundreds may be there at once: one turn
 * of the loop handles requests for 20 ms and ends the last of them; those that come later have the next turns, the
 * oldest first. MHD looks at all that are suspended whenever some are taken up, so small ones are, many at a time.
 *
 * MHD does not watch suspended connections, so a timer looks at their sockets while there are any. A client that has
 * closed its sending side counts as gone, as with nginx. Invariant: request->waits is set exactly while the request is
 * in the list. Owned by the loop's thread. */
#include <poll.h>

#include "base/clock.h"
#include "service/datasets/library.h"
#include "service/exchange.h"
#include "service/http.h"
#include "service/ops/counters.h"
#include "service/ops/ops.h"
#include "service/place/wait.h"
#include "service/reply.h"
#include "service/state.h"
#include "service/tour/tour.h"
#include "service/view/views.h"

enum { sweep_ms = 20, sweep_sockets = 64, turn_ms = 20, small_bytes = 4096, small_at_once = 64,
       turn_deadline_ms = 60000 };

static void let_go(struct request *request)
{
    spl_ticket_drop(&request->ticket);
    spl_batch_abandon(request->batch);
    spl_tour_wish_abandon(request->wish);
    spl_tour_abandon(request);
    spl_place_abandon(request->place);
    spl_ray_wish_abandon(request->ray_wish);
    spl_saving_abandon(request->saving);
    spl_waiting_resume(request);
}

static void give_up(struct request *request)
{
    struct spl_error err = {0};
    spl_ticket_fail_late(&request->ticket, (double)request->service->options->deadline_ms, &err);
    spl_count(request->service->counters, deadline_missed);
    spl_reply_error(request, &err);
    let_go(request);
}

static void let_departed_go(struct request **requests, struct pollfd *sockets, nfds_t count)
{
    if (poll(sockets, count, 0) <= 0)
        return;
    for (nfds_t i = 0; i < count; i++) {
        if (!(sockets[i].revents & (POLLRDHUP | POLLHUP | POLLERR)))
            continue;
        spl_count(requests[i]->service->counters, clients_left);
        requests[i]->abandoned = true;
        let_go(requests[i]);
    }
}

static void sweep(struct spl_service *service)
{
    struct request *batch[sweep_sockets], *request, *next;
    struct pollfd sockets[sweep_sockets];
    nfds_t count = 0;
    uint64_t now = spl_now_ns();
    for (request = LIST_FIRST(&service->http->waiting); request; request = next) {
        next = LIST_NEXT(request, link);
        if (now >= request->deadline_ns) {
            give_up(request);
            continue;
        }
        if (request->batch)
            spl_batch_go_on(request->batch);
        if (!request->waits)
            continue;
        batch[count] = request;
        sockets[count++] = (struct pollfd){.fd = request->connection->fd, .events = POLLRDHUP};
        if (count == sweep_sockets) {
            let_departed_go(batch, sockets, count);
            count = 0;
        }
    }
    let_departed_go(batch, sockets, count);
    spl_http_pump(service);
}

static void on_timer(uv_timer_t *timer)
{
    sweep(timer->data);
}

void spl_waiting_add(struct request *request, uint64_t deadline_ns)
{
    struct spl_service *service = request->service;
    request->waits = true;
    request->deadline_ns = deadline_ns;
    LIST_INSERT_HEAD(&service->http->waiting, request, link);
    if (!service->http->waiting_count++)
        uv_timer_start(&service->http->wait_timer, on_timer, sweep_ms, sweep_ms);
    spl_request_suspend(request);
}

void spl_waiting_resume(struct request *request)
{
    struct spl_service *service = request->service;
    LIST_REMOVE(request, link);
    request->waits = false;
    if (request->postponed)
        TAILQ_REMOVE(&service->http->postponed, request, postponed_link);
    request->postponed = false;
    if (!--service->http->waiting_count)
        uv_timer_stop(&service->http->wait_timer);
    spl_request_resume(request);
}

void spl_waiting_refuse_all(struct spl_service *service)
{
    service->http->ends = true;
    while (!LIST_EMPTY(&service->http->waiting)) {
        struct spl_error err = {0};
        spl_fail(&err, SPL_E_CANCELLED, "the service is stopping");
        struct request *request = LIST_FIRST(&service->http->waiting);
        spl_reply_error(request, &err);
        let_go(request);
    }
    spl_http_pump(service);
}

static uint64_t *handled_ns(struct spl_service *service)
{
    const uint64_t turn_ns = service->ops->loop_turns.told_ns;
    if (service->http->turn_ns != turn_ns) {
        service->http->turn_ns = turn_ns;
        service->http->handled_ns = 0;
    }
    return &service->http->handled_ns;
}

bool spl_turn_is_over(struct spl_service *service)
{
    return *handled_ns(service) >= turn_ms * SPL_NS_PER_MS;
}

void spl_turn_add(struct spl_service *service, uint64_t began_ns)
{
    *handled_ns(service) += spl_now_ns() - began_ns;
}

/* The oldest, and as many small ones as come after it. True: there was one. */
static bool admit(struct spl_http *http)
{
    size_t count = 0;
    for (struct request *request; (request = TAILQ_FIRST(&http->postponed)); count++) {
        const bool large = request->body_length > small_bytes;
        if (count && (large || count == small_at_once))
            break;
        request->admitted = true;
        spl_waiting_resume(request);
        if (large)
            return true;
    }
    return count;
}

static void on_next(uv_idle_t *next)
{
    struct spl_service *service = next->data;
    const uint64_t until_ns = spl_now_ns() + turn_ms * SPL_NS_PER_MS; // MHD's own part of it counts, too
    while (!spl_turn_is_over(service) && spl_now_ns() < until_ns && admit(service->http))
        spl_http_pump(service);
    if (TAILQ_EMPTY(&service->http->postponed))
        uv_idle_stop(next);
}

/* Behind those that came before it, also where it was taken up and found no time. */
static void line_up(struct spl_http *http, struct request *request)
{
    struct request *later = request->admitted ? TAILQ_FIRST(&http->postponed) : NULL;
    if (!request->admitted)
        request->postponed_as = ++http->postponed_ever;
    while (later && later->postponed_as < request->postponed_as)
        later = TAILQ_NEXT(later, postponed_link);
    if (later)
        TAILQ_INSERT_BEFORE(later, request, postponed_link);
    else
        TAILQ_INSERT_TAIL(&http->postponed, request, postponed_link);
    request->postponed = true;
}

bool spl_waiting_postpone(struct request *request)
{
    struct spl_service *service = request->service;
    struct spl_http *http = service->http;
    if (!spl_turn_is_over(service) && (request->admitted || TAILQ_EMPTY(&http->postponed)))
        return false;
    uint64_t patience_ms = service->options->deadline_ms; // as a view's; what waits for no view is in less of a hurry
    if (!request->body_length && patience_ms < turn_deadline_ms)
        patience_ms = turn_deadline_ms;
    spl_waiting_add(request, request->admitted ? request->deadline_ns : spl_now_ns() + patience_ms * SPL_NS_PER_MS);
    line_up(http, request);
    uv_idle_start(&http->next, on_next);
    return true;
}
