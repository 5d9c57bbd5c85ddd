/* Requests whose words do not fit. The connection pool bounds request line, headers and the reply's headers together;
 * the first two have smaller bounds, so that our 414 and 431 answer them. libmicrohttpd writes zeros over the whole
 * pool between requests, so all of it is resident on every idle connection and costs time with every request: it is
 * small. Owned by the loop's thread. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

#include "service/exchange.h"
#include "service/http.h"
#include "service/ops/access_log.h"
#include "service/ops/counters.h"
#include "service/reply.h"
#include "service/state.h"

enum {
    value_memory = 64,       /* of the pool, for each header, parameter and cookie beside its text */
    reply_memory = 5 * 1024, /* of the pool, for a reply's headers */
    parameters_max = 64,
};

/* libmicrohttpd 0.9.75 falls silent when the parameters of a query, or a reply's headers, do not fit what is left of
 * its pool, so such a request is answered past it, right on the socket, and the connection ended. Without memory it
 * ends without an answer. */
void spl_refuse_on_socket(struct request *request, unsigned status, const char *field, const char *detail)
{
    bool head = !strcmp(request->method, MHD_HTTP_METHOD_HEAD); // the body's length is told all the same
    if (!request->started) // its id is read with the headers
        spl_request_set_id(request, MHD_lookup_connection_value(request->handle, MHD_HEADER_KIND, "X-Request-Id"));
    const char *type = status == MHD_HTTP_BAD_REQUEST ? "input" : "limit";
    char *text = spl_problem_print(request, status, type, field, detail), *reply = NULL;
    int length = !text
                     ? -1
                     : asprintf(&reply,
                                "HTTP/1.1 %u %s\r\nContent-Type: application/problem+json\r\nConnection: close\r\n"
                                "X-Content-Type-Options: nosniff\r\nX-Request-Id: %s\r\nContent-Length: %zu\r\n\r\n%s",
                                status, MHD_get_reason_phrase_for(status), request->id, strlen(text), head ? "" : text);
    request->status = status;
    request->abandoned = true;
    if (length > 0 && send(request->connection->fd, reply, (size_t)length, MSG_NOSIGNAL | MSG_DONTWAIT) == length)
        spl_count(request->service->counters, replies_4xx);
    shutdown(request->connection->fd, SHUT_RDWR);
    free(length < 0 ? NULL : reply);
    free(text);
}

void spl_refuse_many_parameters(struct request *request, const char *uri)
{
    unsigned count = 0;
    for (; *uri && count <= parameters_max; uri++)
        count += *uri == '&';
    if (count > parameters_max)
        spl_refuse_on_socket(request, MHD_HTTP_URI_TOO_LONG, "url", "the URL has too many parameters");
}

/* Once the headers are there. Cookies lie in the pool twice. */
void spl_refuse_many_headers(struct request *request)
{
    struct MHD_Connection *handle = request->handle;
    const union MHD_ConnectionInfo *info = MHD_get_connection_info(handle, MHD_CONNECTION_INFO_REQUEST_HEADER_SIZE);
    const char *cookie = MHD_lookup_connection_value(handle, MHD_HEADER_KIND, MHD_HTTP_HEADER_COOKIE);
    int kinds = MHD_HEADER_KIND | MHD_GET_ARGUMENT_KIND | MHD_COOKIE_KIND;
    int values = MHD_get_connection_values(handle, (enum MHD_ValueKind)kinds, NULL, NULL);
    size_t used = (info ? info->header_size : 0) + value_memory * (size_t)values + (cookie ? strlen(cookie) : 0);
    if (used > connection_pool - reply_memory)
        spl_refuse_on_socket(request, MHD_HTTP_REQUEST_HEADER_FIELDS_TOO_LARGE, "headers",
                         "URL and headers are larger than 12 KiB together; POST takes long views");
}
