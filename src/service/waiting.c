/* Requests that wait for views, or for the pool to read a path or look up a coordinate system: their MHD connection is
 * suspended until all is ready, the deadline passes or the client leaves.
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
#include "service/place/wait.h"
#include "service/reply.h"
#include "service/state.h"
#include "service/tour/tour.h"
#include "service/view/views.h"

enum { sweep_ms = 20, sweep_sockets = 64 };

static void let_go(struct request *request)
{
    spl_ticket_drop(&request->ticket);
    spl_batch_abandon(request->batch);
    spl_tour_wish_abandon(request->wish);
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
    if (!--service->http->waiting_count)
        uv_timer_stop(&service->http->wait_timer);
    spl_request_resume(request);
}

void spl_waiting_refuse_all(struct spl_service *service)
{
    while (!LIST_EMPTY(&service->http->waiting)) {
        struct spl_error err = {0};
        spl_fail(&err, SPL_E_CANCELLED, "the service is stopping");
        struct request *request = LIST_FIRST(&service->http->waiting);
        spl_reply_error(request, &err);
        let_go(request);
    }
    spl_http_pump(service);
}
