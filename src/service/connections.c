/* Connections and how long they may take. Each phase has a time limit of its own, which trickling bytes does not
 * extend: libmicrohttpd's own limit is about silence only. A connection that is too slow is shut down here, and
 * libmicrohttpd then sees it closed. Owned by the loop's thread. */
#include "service/http.h"

#include <poll.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include "base/clock.h"
#include "base/memory.h"
#include "service/exchange.h"
#include "service/ops/counters.h"
#include "service/sent_bytes.h"
#include "service/state.h"

enum { slow_sweep_ms = 500 };

/* How long a connection may stay in a phase. */
static const uint64_t phase_max_ns[] = {
    [PHASE_IDLE] = 40 * SPL_NS_PER_S,     [PHASE_READING] = 10 * SPL_NS_PER_S, [PHASE_UPLOADING] = 60 * SPL_NS_PER_S,
    [PHASE_WORKING] = SPL_NEVER, // views have deadlines
    [PHASE_WRITING] = 120 * SPL_NS_PER_S,
};

static const uint64_t drain_reading_max_ns = 2 * SPL_NS_PER_S; /* half a request holds up no exit */

void spl_connection_enter(struct connection *connection, enum phase phase)
{
    connection->phase = phase;
    connection->since_ns = spl_now_ns();
}

/* libmicrohttpd closes the socket next. What is unread then (the next request of a pipeline behind "Connection: close",
 * the rest of a body that was refused) would have the kernel send a reset and drop what it still has to send of our
 * last reply. Never blocks: what comes later still resets the connection, but behind the reply. */
static void read_to_the_end(const struct connection *connection)
{
    enum { reads_max = 64 };
    char unread[16 * 1024];
    for (int i = 0; i < reads_max && recv(connection->fd, unread, sizeof unread, MSG_DONTWAIT) > 0; i++)
        ;
}

void spl_connection_notify(void *context, struct MHD_Connection *handle, void **socket_context,
                           enum MHD_ConnectionNotificationCode code)
{
    struct spl_service *service = context;
    struct connection *connection = *socket_context;
    if (code == MHD_CONNECTION_NOTIFY_CLOSED) {
        if (!connection)
            return;
        read_to_the_end(connection);
        // libmicrohttpd 0.9.75 forgets a request with two errors (its parameters, then its headers do not fit the pool)
        if (connection->request)
            spl_request_finish(connection->request, MHD_REQUEST_TERMINATED_WITH_ERROR);
        LIST_REMOVE(connection, link);
        service->http->connections_open--;
        free(connection);
        return;
    }
    const union MHD_ConnectionInfo *info = MHD_get_connection_info(handle, MHD_CONNECTION_INFO_CONNECTION_FD);
    if (!info || !(connection = spl_alloc(1, sizeof *connection, NULL)))
        return; // its requests are refused
    connection->service = service;
    connection->fd = info->connect_fd;
    // a byte out of band would be counted, but not read; without any, what was read is what came, less what waits
    setsockopt(connection->fd, SOL_SOCKET, SO_OOBINLINE, &(int){1}, sizeof(int));
    connection->taken = spl_taken_bytes(connection->fd);
    spl_connection_enter(connection, PHASE_READING);
    LIST_INSERT_HEAD(&service->http->connections, connection, link);
    service->http->connections_open++;
    *socket_context = connection;
}

/* Has the client of an unfinished upload closed its side? libmicrohttpd 0.9.75 waits for an edge of epoll that does not
 * come when the end of the stream arrived with the last data, while the connection was suspended. */
static bool has_ended_early(const struct connection *connection)
{
    struct pollfd socket = {.fd = connection->fd, .events = POLLRDHUP};
    int unread = 1;
    return connection->phase == PHASE_UPLOADING && poll(&socket, 1, 0) > 0 &&
           socket.revents & (POLLRDHUP | POLLHUP | POLLERR) && !ioctl(connection->fd, FIONREAD, &unread) && !unread;
}

/* libmicrohttpd then sees it closed. A request whose rest does not come is told so, where its first line is there. */
static void cut(const struct connection *connection)
{
    struct request *request = connection->request;
    bool comes = connection->phase == PHASE_READING || connection->phase == PHASE_UPLOADING;
    if (request && comes && !request->prepared && !request->suspended && !request->abandoned)
        spl_refuse_on_socket(request, MHD_HTTP_REQUEST_TIMEOUT, request->started ? "body" : "headers",
                             "the rest of the request did not come in time");
    else
        shutdown(connection->fd, SHUT_RDWR);
}

/* What was read is done with, but behind a request that waits, or whose client is told first to go on. */
static void note_taken(struct connection *connection)
{
    const struct request *request = connection->request;
    const bool waits = request && (request->suspended || (request->started && !request->comes));
    connection->taken = waits ? SPL_TAKEN_UNKNOWN : spl_taken_bytes(connection->fd);
}

/* Cuts connections whose phase lasts too long. */
static void on_slow_timer(uv_timer_t *timer)
{
    struct spl_service *service = timer->data;
    uint64_t now = spl_now_ns();
    struct connection *connection;
    LIST_FOREACH(connection, &service->http->connections, link)
    {
        note_taken(connection);
        bool hurry = service->draining && connection->phase == PHASE_READING;
        if (has_ended_early(connection))
            shutdown(connection->fd, SHUT_RDWR);
        if (now - connection->since_ns <= (hurry ? drain_reading_max_ns : phase_max_ns[connection->phase]))
            continue;
        spl_count(service->counters, slow_closed);
        cut(connection);
        connection->since_ns = now;
    }
}

void spl_connections_watch(struct spl_service *service)
{
    uv_timer_start(&service->http->slow_timer, on_slow_timer, slow_sweep_ms, slow_sweep_ms);
}
