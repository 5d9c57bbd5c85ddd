/* Requests that libmicrohttpd refuses by itself, before it asks anybody: a length or a chunk's size that is no number,
 * a line of the headers without a name. It would send a page of its own, behind two heads where the length is at fault
 * (0.9.75 builds the reply twice). It says so in its log first, on the loop's thread, and there the request is answered
 * past it; what it sends behind that finds the socket shut.
 *
 * The log names no connection. One whose length is no number is known by it; else it is the only one that could be, of
 * those that something was read of in the last half second, or nobody is answered here. Also how large a chunk claims
 * to be, which libmicrohttpd keeps to itself. Owned by the loop's thread. */
#include <stdio.h>
#include <string.h>

#include "service/exchange.h"
#include "service/http.h"
#include "service/sent_bytes.h"
#include "service/state.h"

enum fault { FAULT_NONE, FAULT_NO_NUMBER, FAULT_TOO_LARGE };

/* What is wrong with the length of a request whose headers come, as libmicrohttpd sees it. */
static enum fault judge_length(struct request *request)
{
    const char *text;
    size_t length;
    uint64_t value = 0;
    if (MHD_lookup_connection_value(request->handle, MHD_HEADER_KIND, MHD_HTTP_HEADER_TRANSFER_ENCODING) ||
        MHD_lookup_connection_value_n(request->handle, MHD_HEADER_KIND, MHD_HTTP_HEADER_CONTENT_LENGTH,
                                      strlen(MHD_HTTP_HEADER_CONTENT_LENGTH), &text, &length) == MHD_NO)
        return FAULT_NONE;
    if (!length || strspn(text, "0123456789") != length)
        return FAULT_NO_NUMBER;
    for (size_t i = 0; i < length; i++)
        if (__builtin_mul_overflow(value, 10, &value) || __builtin_add_overflow(value, text[i] - '0', &value))
            return FAULT_TOO_LARGE;
    return FAULT_NONE;
}

static bool comes(const struct request *request)
{
    return request && !request->prepared && !request->abandoned && !request->suspended;
}

/* Answers all whose length is at fault: their turn would come. */
static bool refuse_lengths(struct spl_service *service)
{
    struct connection *connection;
    bool any = false;
    LIST_FOREACH(connection, &service->http->connections, link)
    {
        struct request *request = connection->request;
        enum fault fault = comes(request) && !request->started ? judge_length(request) : FAULT_NONE;
        if (fault == FAULT_NO_NUMBER)
            spl_refuse_on_socket(request, MHD_HTTP_BAD_REQUEST, MHD_HTTP_HEADER_CONTENT_LENGTH,
                                 "Content-Length is no number: it takes decimal digits alone");
        else if (fault == FAULT_TOO_LARGE)
            spl_refuse_on_socket(request, MHD_HTTP_CONTENT_TOO_LARGE, MHD_HTTP_HEADER_CONTENT_LENGTH,
                                 "Content-Length is larger than any body may be");
        any |= fault != FAULT_NONE;
    }
    return any;
}

/* Was nothing read of the connection since it was looked at last? Then it is not what libmicrohttpd has stumbled over:
 * that comes with new bytes, or with those behind a request that has ended or waited. */
static bool is_at_rest(const struct connection *connection)
{
    return connection->taken != SPL_TAKEN_UNKNOWN && connection->taken == spl_taken_bytes(connection->fd);
}

/* The only request that libmicrohttpd can mean; NULL: there are several, or one that is answered, or a first line that
 * nobody has seen yet. */
static struct request *find_culprit(struct spl_service *service, bool chunk, unsigned status)
{
    struct connection *connection;
    struct request *found = NULL;
    LIST_FOREACH(connection, &service->http->connections, link)
    {
        struct request *request = connection->request;
        const bool first_line = !request && !chunk && status == MHD_HTTP_BAD_REQUEST;
        if (!first_line && (!request || request->prepared || request->suspended ||
                            (request->started ? !request->chunks : chunk)))
            continue;
        if (is_at_rest(connection))
            continue;
        if (first_line)
            return NULL;
        if (found || request->abandoned)
            return NULL;
        found = request;
    }
    return found;
}

void spl_malformed_log(void *context, const char *format, va_list arguments)
{
    static const char refuses[] = "Error processing request (HTTP response code is %u ('%s')";
    struct spl_service *service = context;
    if (strncmp(format, refuses, strlen(refuses)) || refuse_lengths(service))
        return;
    unsigned status = va_arg(arguments, unsigned);
    bool chunk = strstr(va_arg(arguments, const char *), "chunk");
    struct request *request = find_culprit(service, chunk, status);
    if (!request)
        return;
    if (chunk && status == MHD_HTTP_CONTENT_TOO_LARGE)
        spl_refuse_on_socket(request, status, "body", "a chunk is larger than any body may be");
    else if (chunk && status == MHD_HTTP_BAD_REQUEST)
        spl_refuse_on_socket(request, status, MHD_HTTP_HEADER_TRANSFER_ENCODING,
                             "a chunk's size is no hexadecimal number, or no line's end stands behind a chunk");
    else if (status == MHD_HTTP_REQUEST_HEADER_FIELDS_TOO_LARGE)
        spl_refuse_on_socket(request, status, "headers", "URL and headers, or lines behind a body, are too large");
    else if (status == MHD_HTTP_BAD_REQUEST)
        spl_refuse_on_socket(request, status, "headers", "a line of the headers has no name, or no colon behind it");
}

uint64_t spl_chunk_get_size(const struct request *request, const char *data)
{
    const char *begin = request->chunks, *end = data - 1, *from;
    uint64_t size = 0;
    if (!begin || data <= begin + 1 || data > begin + connection_pool || *end != '\n')
        return 0;
    for (from = end; from > begin && from[-1] != '\n'; from--)
        ;
    for (; from < end; from++) {
        static const char digits[] = "0123456789abcdef";
        const char *digit = *from ? strchr(digits, *from >= 'A' && *from <= 'F' ? *from | 0x20 : *from) : NULL;
        if (!digit || size >> 60)
            break;
        size = size << 4 | (uint64_t)(digit - digits);
    }
    return size;
}
