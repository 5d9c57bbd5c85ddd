/* Requests that wait for views, or for the pool to read a path: their MHD connection is suspended until all is ready, the deadline passes or the client
 * leaves.
 *
 * MHD does not watch suspended connections, so a timer looks at their sockets while there are any. A client that has
 * closed its sending side counts as gone, as with nginx. Invariant: request->waits is set exactly while the request is
 * in the list. Owned by the loop's thread. */
#include <poll.h>

#include "base/clock.h"
#include "service/state.h"

enum { sweep_ms = 20, sweep_sockets = 64 };

static void on_timer(uv_timer_t *timer)
{
    spl_waiting_sweep(timer->data);
}

void spl_waiting_add(struct request *request, uint64_t deadline_ns)
{
    struct spl_service *service = request->service;
    request->waits = true;
    request->deadline_ns = deadline_ns;
    LIST_INSERT_HEAD(&service->waiting, request, link);
    if (!service->waiting_count++)
        uv_timer_start(&service->wait_timer, on_timer, sweep_ms, sweep_ms);
    spl_request_suspend(request);
}

void spl_waiting_resume(struct request *request)
{
    struct spl_service *service = request->service;
    LIST_REMOVE(request, link);
    request->waits = false;
    if (!--service->waiting_count)
        uv_timer_stop(&service->wait_timer);
    spl_request_resume(request);
}

static void let_go(struct request *request)
{
    spl_ticket_drop(&request->ticket);
    spl_batch_abandon(request->batch);
    spl_tour_wish_abandon(request->wish);
    spl_waiting_resume(request);
}

/* Latencies of what was rendered, for whoever waited. */
static void observe(struct spl_service *service, const struct spl_job *job)
{
    const char *route = job->route;
    if (!job->rendered_ns)
        return;
    spl_latency_observe(&service->latencies, route, SPL_LATENCY_QUEUE, job->queue_ms / 1000);
    spl_latency_observe(&service->latencies, route, SPL_LATENCY_FRAME,
                        (double)(job->rendered_ns - job->began_ns) / SPL_NS_PER_S);
    spl_latency_add_stages(&service->latencies, &job->stats);
    if (!job->err.code)
        spl_latency_observe(&service->latencies, route, SPL_LATENCY_ENCODE, job->encode_ms / 1000);
}

void spl_waiting_complete(struct spl_service *service)
{
    for (struct spl_job *job; (job = spl_pipeline_take(service->pipeline));) {
        observe(service, job);
        if (job->done)
            job->done(job);
        else
            spl_job_destroy(job);
    }
    spl_http_pump(service);
}

static void give_up(struct request *request)
{
    struct spl_error err = {0};
    spl_fail(&err, SPL_E_TIMEOUT, "the deadline of %llu ms passed before the reply was ready",
             (unsigned long long)request->service->options->deadline_ms);
    spl_count(&request->service->counters, deadline_missed);
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
        spl_count(&requests[i]->service->counters, clients_left);
        requests[i]->abandoned = true;
        let_go(requests[i]);
    }
}

void spl_waiting_sweep(struct spl_service *service)
{
    struct request *batch[sweep_sockets], *request, *next;
    struct pollfd sockets[sweep_sockets];
    nfds_t count = 0;
    uint64_t now = spl_now_ns();
    for (request = LIST_FIRST(&service->waiting); request; request = next) {
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

void spl_waiting_refuse_all(struct spl_service *service)
{
    while (!LIST_EMPTY(&service->waiting)) {
        struct spl_error err = {0};
        spl_fail(&err, SPL_E_CANCELLED, "the service is stopping");
        struct request *request = LIST_FIRST(&service->waiting);
        spl_reply_error(request, &err);
        let_go(request);
    }
    spl_http_pump(service);
}
