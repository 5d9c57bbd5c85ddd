/* /healthz, /readyz and /metrics on a listener of their own: its own MHD daemon in the same loop, so that neither the
 * connection limits of the main one nor its clients can keep a probe out. While the loop runs every answer is made at
 * once, from numbers that are there anyway; a loop that hangs does not answer, which is an answer too.
 *
 * Owned by the loop's thread. */
#include "service/ops/ops.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/log.h"
#include "service/listen.h"
#include "service/ops/health.h"
#include "service/ops/prometheus.h"
#include "service/state.h"

enum { connections_max = 64, connection_memory = 16 * 1024, idle_s = 10 };

static const char plain[] = "text/plain; charset=utf-8";

/* Takes `body`, malloc'd or NULL. */
static enum MHD_Result reply(struct MHD_Connection *handle, unsigned status, const char *type, char *body)
{
    struct MHD_Response *response =
        body ? MHD_create_response_from_buffer(strlen(body), body, MHD_RESPMEM_MUST_FREE) : NULL;
    if (!response) {
        free(body);
        return MHD_NO;
    }
    MHD_add_response_header(response, MHD_HTTP_HEADER_CONTENT_TYPE, type);
    MHD_add_response_header(response, MHD_HTTP_HEADER_CACHE_CONTROL, "no-store");
    if (status == MHD_HTTP_METHOD_NOT_ALLOWED)
        MHD_add_response_header(response, MHD_HTTP_HEADER_ALLOW, "GET, HEAD");
    enum MHD_Result result = MHD_queue_response(handle, status, response);
    MHD_destroy_response(response);
    return result;
}

static enum MHD_Result reply_health(struct MHD_Connection *handle, bool good, const char *why)
{
    char *body = NULL;
    if (asprintf(&body, "%s%s\n", good ? "ok" : "no: ", good ? "" : why) < 0)
        body = NULL;
    return reply(handle, good ? MHD_HTTP_OK : MHD_HTTP_SERVICE_UNAVAILABLE, plain, body);
}

static enum MHD_Result on_request(void *context, struct MHD_Connection *handle, const char *url, const char *method,
                                  const char *version, const char *data, size_t *length, void **request_context)
{
    static int seen;
    (void)version;
    (void)data;
    struct spl_service *service = context;
    char why[SPL_HEALTH_TEXT] = "";
    if (!*request_context || *length) { // the first call is about the headers; bodies are dropped
        *request_context = &seen;
        *length = 0;
        return MHD_YES;
    }
    if (strcmp(method, MHD_HTTP_METHOD_GET) && strcmp(method, MHD_HTTP_METHOD_HEAD))
        return reply(handle, MHD_HTTP_METHOD_NOT_ALLOWED, plain, strdup("GET and HEAD are allowed here\n"));
    if (!strcmp(url, "/healthz")) {
        bool alive = spl_health_is_alive(service, why);
        return reply_health(handle, alive, why);
    }
    if (!strcmp(url, "/readyz")) {
        bool ready = spl_health_is_ready(service, why);
        return reply_health(handle, ready, why);
    }
    if (!strcmp(url, "/metrics"))
        return reply(handle, MHD_HTTP_OK, "text/plain; version=0.0.4; charset=utf-8", spl_prometheus_print(service));
    return reply(handle, MHD_HTTP_NOT_FOUND, plain, strdup("there are /healthz, /readyz and /metrics\n"));
}

static void pump(struct spl_service *service);

static void on_timer(uv_timer_t *timer)
{
    pump(timer->data);
}

static void on_again(uv_idle_t *again)
{
    uv_idle_stop(again);
    pump(again->data);
}

static void on_poll(uv_poll_t *poll, int status, int events)
{
    (void)status;
    (void)events;
    pump(poll->data);
}

static void pump(struct spl_service *service)
{
    struct spl_ops *ops = service->ops;
    if (ops->daemon)
        spl_http_run(ops->daemon, &ops->turns, on_timer, on_again);
}

void spl_ops_init(struct spl_service *service)
{
    struct spl_ops *ops = service->ops;
    ops->started_ns = spl_now_ns();
    ops->started_unix_s = (double)time(NULL);
    ops->listen_fd = -1;
    spl_loop_turns_watch(&ops->loop_turns, &service->loop);
    spl_http_turns_init(&ops->turns, service);
    uv_timer_init(&service->loop, &ops->look_timer);
    ops->look_timer.data = service;
}

/* Hands `fd` to a daemon that the loop polls. */
static int serve(struct spl_service *service, int fd, struct spl_error *err)
{
    struct spl_ops *ops = service->ops;
    ops->daemon = MHD_start_daemon(MHD_USE_EPOLL, 0, NULL, NULL, on_request, service, MHD_OPTION_LISTEN_SOCKET, fd,
                                    MHD_OPTION_CONNECTION_LIMIT, (unsigned)connections_max,
                                    MHD_OPTION_CONNECTION_TIMEOUT, (unsigned)idle_s, MHD_OPTION_CONNECTION_MEMORY_LIMIT,
                                    (size_t)connection_memory, MHD_OPTION_SIGPIPE_HANDLED_BY_APP, 1, MHD_OPTION_END);
    if (!ops->daemon) {
        close(fd);
        return spl_fail(err, SPL_E_IO, "libmicrohttpd refuses to start the ops listener");
    }
    const union MHD_DaemonInfo *info = MHD_get_daemon_info(ops->daemon, MHD_DAEMON_INFO_EPOLL_FD);
    int rc = info ? uv_poll_init(&service->loop, &ops->poll, info->epoll_fd) : UV_EINVAL;
    if (rc) {
        MHD_stop_daemon(ops->daemon);
        ops->daemon = NULL;
        return spl_fail(err, SPL_E_IO, "the loop cannot poll the ops listener: %s", uv_strerror(rc));
    }
    ops->poll.data = service;
    uv_poll_start(&ops->poll, UV_READABLE, on_poll);
    return 0;
}

int spl_ops_start(struct spl_service *service, struct spl_error *err)
{
    const struct spl_service_options *options = service->options;
    struct spl_ops *ops = service->ops;
    struct spl_error busy = {0};
    char url[192];
    int fd = -1, rc = 0;
    if (ops->listen_fd >= 0) {
        fd = ops->listen_fd;
        ops->listen_fd = -1;
        spl_listen_print(fd, url, sizeof url);
    } else if (options->ops_listen[0]) {
        rc = spl_listen("ops-listen", options->ops_listen, &fd, url, sizeof url, &busy);
    } else {
        return 0;
    }
    if (rc == SPL_E_IO && options->origin[SPL_PARAMETER_ops_listen] == SPL_FROM_DEFAULT) {
        spl_log_warn("no /healthz, /readyz and /metrics: %s", busy.message);
        return 0;
    }
    if (rc) {
        if (err && !err->code)
            *err = busy;
        return rc;
    }
    rc = serve(service, fd, err);
    if (!rc)
        spl_log_info("health and metrics on %s", url);
    return rc;
}

void spl_ops_stop(struct spl_service *service)
{
    struct spl_ops *ops = service->ops;
    if (!ops->daemon)
        return;
    uv_close((uv_handle_t *)&ops->poll, NULL);
    MHD_stop_daemon(ops->daemon);
    ops->daemon = NULL;
}
