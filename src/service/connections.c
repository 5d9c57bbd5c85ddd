/* Connections and how long they may take. Each phase has a time limit of its own, which trickling bytes does not
 * extend: libmicrohttpd's own limit is about silence only. A connection that is too slow is shut down here, as one
 * whose client has left or sends what libmicrohttpd can make nothing of; it then sees it closed. Owned by the loop's
 * thread. */
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
    connection->looked_at = SPL_TAKEN_UNKNOWN;
    spl_connection_enter(connection, PHASE_READING);
    LIST_INSERT_HEAD(&service->http->connections, connection, link);
    service->http->connections_open++;
    *socket_context = connection;
}

/* Is more to come of a request, or the first of one, and libmicrohttpd free to take it? */
static bool is_awaited(const struct connection *connection)
{
    const struct request *request = connection->request;
    return connection->phase <= PHASE_UPLOADING &&
           (!request || !(request->prepared || request->suspended || request->abandoned));
}

/* Has the client closed its side, with nothing left to read and nothing that is yet to be sent it? Nothing comes of
 * what is there then, but by a libmicrohttpd that has not had its turn, so this is to last from one sweep to the next.
 * libmicrohttpd 0.9.75 waits for an edge of epoll that does not come when the end of the stream arrived with the last
 * data, or while the connection was suspended. */
static bool has_left(const struct connection *connection)
{
    struct pollfd socket = {.fd = connection->fd, .events = POLLRDHUP | POLLOUT};
    int unread = 1;
    return is_awaited(connection) && poll(&socket, 1, 0) > 0 && socket.revents & (POLLRDHUP | POLLHUP | POLLERR) &&
           socket.revents & (POLLOUT | POLLHUP | POLLERR) && !ioctl(connection->fd, FIONREAD, &unread) && !unread;
}

/* Does libmicrohttpd leave unread what came, and could it send what it may have to say first ("100 Continue")? */
static bool is_left_unread(const struct connection *connection)
{
    struct pollfd socket = {.fd = connection->fd, .events = POLLOUT};
    int unread = 0;
    return connection->request && connection->request->started && is_awaited(connection) &&
           !ioctl(connection->fd, FIONREAD, &unread) && unread > 0 && poll(&socket, 1, 0) > 0 &&
           socket.revents & POLLOUT;
}

/* Whoever has a turn reads all that its buffer has room for, so that what does not change over some of them never will:
 * it holds the beginning of a line without an end. Those that have not begun libmicrohttpd refuses by itself. */
void spl_connections_refuse_endless(struct spl_service *service)
{
    enum { looks_max = 3, look_ms = 5 };
    struct spl_http *http = service->http;
    const uint64_t now = spl_now_ns();
    struct connection *connection;
    if (now - http->looked_ns < look_ms * SPL_NS_PER_MS)
        return;
    http->looked_ns = now;
    LIST_FOREACH(connection, &http->connections, link)
    {
        const uint64_t taken = is_left_unread(connection) ? spl_taken_bytes(connection->fd) : SPL_TAKEN_UNKNOWN;
        connection->looks = taken != SPL_TAKEN_UNKNOWN && taken == connection->looked_at ? connection->looks + 1 : 0;
        connection->looked_at = taken;
        if (connection->looks >= looks_max)
            spl_refuse_on_socket(connection->request, MHD_HTTP_BAD_REQUEST, MHD_HTTP_HEADER_TRANSFER_ENCODING,
                                 "the line that a chunk begins with is too long");
    }
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
        const bool left = has_left(connection);
        if (left && connection->had_left)
            shutdown(connection->fd, SHUT_RDWR);
        connection->had_left = left;
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
