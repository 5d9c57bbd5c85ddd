/* libmicrohttpd without threads, driven by the uv loop: its epoll descriptor is polled, its timeouts run on a timer,
 * and a request that waits for a view is suspended, so that nothing here ever blocks.
 *
 * A PUT is routed before its body, which change_route.c takes whatever its size; one that wants a body like others
 * (wants_body) is routed again behind it; bodies.c keeps them. Invariants: a suspended request is in `waiting`, or has
 * a change; libmicrohttpd 0.9.75 goes on with what lies in its buffer (the next chunk, the end of the body) though the
 * request was suspended a moment ago, and nothing is taken then: it asks again once it is resumed. Owned by the loop's
 * thread. */
#include "service/http.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/memory.h"
#include "service/access/door.h"
#include "service/datasets/library.h"
#include "service/exchange.h"
#include "service/ops/ops.h"
#include "service/reply.h"
#include "service/sent_bytes.h"
#include "service/state.h"

enum { idle_s = 30 };

/* The first thing MHD says of a request: its target, still encoded. What is returned becomes the request's context. */
static void *on_uri(void *context, const char *uri, struct MHD_Connection *handle)
{
    struct spl_service *service = context;
    struct request *request = spl_alloc(1, sizeof *request, NULL);
    const union MHD_ConnectionInfo *info = MHD_get_connection_info(handle, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
    if (!request || !info || !info->socket_context) {
        free(request);
        return NULL;
    }
    request->service = service;
    request->handle = handle;
    request->connection = info->socket_context;
    request->connection->request = request;
    request->began_ns = spl_now_ns();
    request->query = "";
    request->target_begin = uri;
    request->target_end = uri + strlen(uri);
    size_t length = strnlen(uri, uri_max + 1);
    if (length <= uri_max && !(request->uri = strdup(uri))) {
        request->connection->request = NULL;
        free(request);
        return NULL;
    }
    char *mark = request->uri ? strchr(request->uri, '?') : NULL;
    if (mark) {
        *mark = '\0';
        request->query = mark + 1;
    }
    request->number = spl_count(service->counters, requests) + 1;
    spl_request_set_id(request, NULL);
    spl_connection_enter(request->connection, PHASE_READING);
    service->http->requests_open++;
    spl_refuse_many_parameters(request, uri);
    return request;
}

void spl_request_finish(struct request *request, enum MHD_RequestTerminationCode code)
{
    spl_access_log_write(request, code);
    spl_assert(!request->waits);
    spl_change_abandon(request);
    request->connection->request = NULL;
    request->connection->taken = SPL_TAKEN_UNKNOWN; // the next one may have been read with it
    spl_connection_enter(request->connection, PHASE_IDLE);
    request->service->http->requests_open--;
    if (request->response)
        MHD_destroy_response(request->response);
    spl_body_end_long(request);
    spl_rays_destroy(request->rays);
    json_decref(request->rest);
    spl_body_drop(request);
    free(request->uri);
    free(request);
}

static void on_completed(void *context, struct MHD_Connection *handle, void **request_context,
                         enum MHD_RequestTerminationCode code)
{
    (void)context;
    (void)handle;
    if (*request_context)
        spl_request_finish(*request_context, code);
    *request_context = NULL;
}

static void count_reply(struct request *request)
{
    struct spl_counters *counters = request->service->counters;
    if (request->status < 300)
        spl_count(counters, replies_2xx);
    else if (request->status < 500)
        spl_count(counters, replies_4xx);
    else
        spl_count(counters, replies_5xx);
}

/* What every reply says and is counted by, once. */
static void prepare_reply(struct request *request)
{
    request->prepared = true;
    spl_body_drop(request); // nobody reads it any more, however long the reply is written
    if (request->service->draining || request->closes)
        MHD_add_response_header(request->response, MHD_HTTP_HEADER_CONNECTION, "close");
    MHD_add_response_header(request->response, "X-Request-Id", request->id);
    MHD_add_response_header(request->response, "X-Content-Type-Options", "nosniff");
    spl_door_add_cors(request);
    count_reply(request);
    spl_latency_observe(&request->service->ops->latencies, request->route, SPL_LATENCY_REQUEST,
                        (double)(spl_now_ns() - request->began_ns) / SPL_NS_PER_S);
    spl_connection_enter(request->connection, PHASE_WRITING);
}

/* libmicrohttpd 0.9.75 asks too early where "Expect: 100-continue" stands before no body and another request lies
 * behind: it takes no reply yet, and asks again. */
static enum MHD_Result send_reply(struct request *request)
{
    if (!request->response)
        return MHD_NO;
    bool again = request->prepared;
    if (!again)
        prepare_reply(request);
    enum MHD_Result queued = MHD_queue_response(request->handle, request->status, request->response);
    return again ? queued : MHD_YES;
}

static void refuse_body(struct request *request)
{
    char detail[64];
    snprintf(detail, sizeof detail, "the body is larger than %zu MiB", spl_body_get_most(request) >> 20);
    spl_reply_problem(request, MHD_HTTP_CONTENT_TOO_LARGE, "limit", "body", detail);
}

/* Does the client wait for our word before it sends its body, or mean to send more than `most`? */
static bool announces_more(struct request *request, uint64_t most)
{
    const char *length = MHD_lookup_connection_value(request->handle, MHD_HEADER_KIND, MHD_HTTP_HEADER_CONTENT_LENGTH);
    bool asks = MHD_lookup_connection_value(request->handle, MHD_HEADER_KIND, MHD_HTTP_HEADER_EXPECT);
    uint64_t announced = length ? strtoull(length, NULL, 10) : 0;
    return announced > (asks ? most : spl_body_get_drained(request));
}

/* What can be said before the body: that it is too large, or all of a PUT that is refused. */
static bool answer_headers(struct request *request)
{
    if (!strcmp(request->method, MHD_HTTP_METHOD_PUT)) {
        spl_connection_enter(request->connection, PHASE_UPLOADING);
        spl_route(request, request->method);
        if (!request->wants_body)
            return !request->change && announces_more(request, 0);
    }
    if (!strcmp(request->method, MHD_HTTP_METHOD_POST) && spl_route_takes_long(request)) {
        spl_connection_enter(request->connection, PHASE_UPLOADING);
        spl_route(request, request->method);
        if (!request->wants_body)
            return announces_more(request, 0);
    }
    if (!announces_more(request, spl_body_get_most(request)))
        return false;
    refuse_body(request);
    return true;
}

/* False: the connection had better end. A refusal is sent past libmicrohttpd then, which sends none before a body's
 * end. */
static bool take_body(struct request *request, const char *data, size_t length)
{
    if (request->change)
        return spl_change_take(request, data, length);
    bool refused = request->response != NULL;
    bool endless = spl_chunk_get_size(request, data) > spl_body_get_drained(request); // and need not go on coming
    if (refused || endless)
        request->body_seen += length; // read and dropped
    else if (!spl_body_append(request, data, length) && request->body_seen <= spl_body_get_drained(request))
        return false; // no memory
    if (!endless && request->body_seen <= spl_body_get_drained(request))
        return true;
    spl_refuse_on_socket(request, refused ? request->status : MHD_HTTP_CONTENT_TOO_LARGE, "body",
                         "the body is not taken, and too long to be read to its end");
    return false;
}

/* Nothing may wait any more: MHD cannot be stopped while a connection is suspended. */
static enum MHD_Result refuse_as_it_ends(struct request *request)
{
    struct spl_error err = {0};
    spl_fail(&err, SPL_E_CANCELLED, "the service is stopping");
    spl_change_abandon(request);
    spl_reply_error(request, &err);
    return send_reply(request);
}

static enum MHD_Result on_request(void *context, struct MHD_Connection *handle, const char *url, const char *method,
                                  const char *version, const char *data, size_t *length, void **request_context)
{
    (void)context;
    (void)url;
    struct request *request = *request_context;
    if (!request || request->abandoned)
        return MHD_NO;
    if (request->suspended)
        return MHD_YES;
    if (!request->started) {
        request->started = true;
        request->has_host = strcmp(version, MHD_HTTP_VERSION_1_0);
        snprintf(request->method, sizeof request->method, "%s", method);
        spl_request_set_id(request, MHD_lookup_connection_value(handle, MHD_HEADER_KIND, "X-Request-Id"));
        spl_refuse_many_headers(request);
        if (request->abandoned)
            return MHD_NO;
        return !spl_check_framing(request, method, version) || answer_headers(request) ? send_reply(request) : MHD_YES;
    }
    if (request->service->http->ends && !request->response)
        return *length ? MHD_NO : refuse_as_it_ends(request);
    if (*length) {
        request->comes = true;
        bool taken = take_body(request, data, *length);
        *length = 0;
        return taken ? MHD_YES : MHD_NO;
    }
    if (request->change) {
        spl_change_end(request);
    } else if (!request->response) {
        spl_connection_enter(request->connection, PHASE_WORKING);
        if (spl_waiting_postpone(request))
            return MHD_YES;
        const uint64_t began_ns = spl_now_ns();
        if (request->body_seen > spl_body_get_most(request))
            refuse_body(request);
        else
            spl_route(request, method);
        spl_turn_add(request->service, began_ns);
        if (!request->place)
            spl_body_drop(request); // it is read, however long its view takes
    }
    return request->suspended ? MHD_YES : send_reply(request);
}

void spl_request_suspend(struct request *request)
{
    if (request->suspended)
        return;
    request->suspended = true;
    MHD_suspend_connection(request->handle);
}

void spl_request_resume(struct request *request)
{
    if (!request->suspended)
        return;
    request->suspended = false;
    request->connection->taken = SPL_TAKEN_UNKNOWN; // the same of the rest of its body
    MHD_resume_connection(request->handle);
}

void spl_http_turns_init(struct spl_http_turns *turns, struct spl_service *service)
{
    uv_timer_init(&service->loop, &turns->timer);
    uv_idle_init(&service->loop, &turns->again);
    turns->timer.data = turns->again.data = service;
}

void spl_http_init(struct spl_service *service)
{
    struct spl_http *http = service->http;
    http->listen_fd = -1;
    TAILQ_INIT(&http->postponed);
    spl_http_turns_init(&http->turns, service);
    uv_timer_init(&service->loop, &http->wait_timer);
    uv_timer_init(&service->loop, &http->slow_timer);
    uv_idle_init(&service->loop, &http->next);
    http->next.data = http->wait_timer.data = http->slow_timer.data = service;
}

static void on_timer(uv_timer_t *timer)
{
    spl_http_pump(timer->data);
}

static void on_poll(uv_poll_t *poll, int status, int events)
{
    (void)status;
    (void)events;
    spl_http_pump(poll->data);
}

static void on_again(uv_idle_t *again)
{
    uv_idle_stop(again);
    spl_http_pump(again->data);
}

/* Not by a timer of 0 ms: libuv runs timers until none is due, so that nothing but MHD would have its turn while a
 * client reads as fast as we write. An idle handle runs once a turn. Now and then there is a rest: MHD also wants to go
 * on while it can make nothing of what fills a buffer (a chunk's first line without an end: connections.c). */
bool spl_http_run(struct MHD_Daemon *daemon, struct spl_http_turns *turns, uv_timer_cb on_timeout, uv_idle_cb on_turn)
{
    enum { turns_max = 16, rest_ms = 1 };
    MHD_UNSIGNED_LONG_LONG timeout_ms;
    MHD_run(daemon);
    bool wants = MHD_get_timeout(daemon, &timeout_ms) == MHD_YES;
    bool again = wants && !timeout_ms && ++turns->eager % turns_max;
    if (wants && !again)
        uv_timer_start(&turns->timer, on_timeout, timeout_ms ? timeout_ms : rest_ms, 0);
    else
        uv_timer_stop(&turns->timer);
    if (again)
        uv_idle_start(&turns->again, on_turn);
    else
        uv_idle_stop(&turns->again);
    return wants && !timeout_ms;
}

void spl_http_pump(struct spl_service *service)
{
    struct spl_http *http = service->http;
    if (http->daemon && spl_http_run(http->daemon, &http->turns, on_timer, on_again))
        spl_connections_refuse_endless(service);
}

int spl_http_start(struct spl_service *service, struct spl_error *err)
{
    struct spl_http *http = service->http;
    http->daemon = MHD_start_daemon(
        MHD_USE_EPOLL | MHD_ALLOW_SUSPEND_RESUME | MHD_USE_ERROR_LOG, 0, NULL, NULL, on_request, service,
        MHD_OPTION_EXTERNAL_LOGGER, spl_malformed_log, service, MHD_OPTION_LISTEN_SOCKET, http->listen_fd,
        MHD_OPTION_URI_LOG_CALLBACK, on_uri, service, MHD_OPTION_NOTIFY_COMPLETED, on_completed,
        service, MHD_OPTION_NOTIFY_CONNECTION, spl_connection_notify, service, MHD_OPTION_CONNECTION_LIMIT,
        (unsigned)service->options->connections, MHD_OPTION_PER_IP_CONNECTION_LIMIT,
        (unsigned)service->options->connections_per_address, MHD_OPTION_CONNECTION_TIMEOUT, (unsigned)idle_s,
        MHD_OPTION_CONNECTION_MEMORY_LIMIT, (size_t)connection_pool, MHD_OPTION_SIGPIPE_HANDLED_BY_APP, 1,
        MHD_OPTION_END);
    if (!http->daemon)
        return spl_fail(err, SPL_E_IO, "libmicrohttpd refuses to start");
    const union MHD_DaemonInfo *info = MHD_get_daemon_info(http->daemon, MHD_DAEMON_INFO_EPOLL_FD);
    int rc = info ? uv_poll_init(&service->loop, &http->poll, info->epoll_fd) : UV_EINVAL;
    http->listen_fd = -1; // MHD closes it
    if (rc) {
        MHD_stop_daemon(http->daemon);
        http->daemon = NULL;
        return spl_fail(err, SPL_E_IO, "the loop cannot poll libmicrohttpd: %s", uv_strerror(rc));
    }
    http->poll.data = service;
    uv_poll_start(&http->poll, UV_READABLE, on_poll);
    spl_connections_watch(service);
    spl_http_pump(service);
    return 0;
}

void spl_http_quiesce(struct spl_service *service)
{
    struct spl_http *http = service->http;
    if (!http->daemon)
        return;
    spl_http_pump(service); // what is in the backlog is still served
    int fd = MHD_quiesce_daemon(http->daemon);
    if (fd >= 0)
        close(fd);
}

void spl_http_stop(struct spl_service *service)
{
    struct spl_http *http = service->http;
    if (!http->daemon)
        return;
    uv_close((uv_handle_t *)&http->poll, NULL);
    MHD_stop_daemon(http->daemon);
    http->daemon = NULL;
}
