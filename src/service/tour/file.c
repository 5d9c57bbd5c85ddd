/* A file of a tour as a reply: whole, or the range that was asked for.
 *
 * MHD reads it through a callback, block by block, because each block must count as progress of the connection: a large
 * video over a slow line takes longer than a reply may. Blocks are read on the loop, mostly from the page cache. Owned
 * by the loop's thread. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "service/exchange.h"
#include "service/http.h"
#include "service/range.h"
#include "service/reply.h"
#include "service/tour/tour.h"

enum { block_bytes = 64 << 10 };

struct reading {
    struct spl_tour *tour; // held; its `readers`
    struct connection *connection;
    struct spl_tour_file file; /* what of it was asked for */
};

static ssize_t on_read(void *context, uint64_t position, char *out, size_t room)
{
    (void)position; // it follows what was read
    struct reading *reading = context;
    size_t got = spl_tour_file_read(&reading->file, out, room);
    reading->connection->since_ns = spl_now_ns();
    return got ? (ssize_t)got : MHD_CONTENT_READER_END_WITH_ERROR; // the size was said: it became shorter
}

static void on_free(void *context)
{
    struct reading *reading = context;
    spl_tour_file_close(&reading->file);
    reading->tour->readers--;
    spl_tour_let_go(reading->tour);
    free(reading);
}

/* A range counts only while the file is the one that the client has a part of. */
static enum spl_range wanted(struct request *request, const char *tag, uint64_t size, uint64_t *first, uint64_t *length)
{
    const char *same = MHD_lookup_connection_value(request->handle, MHD_HEADER_KIND, MHD_HTTP_HEADER_IF_RANGE);
    const char *range = MHD_lookup_connection_value(request->handle, MHD_HEADER_KIND, MHD_HTTP_HEADER_RANGE);
    if (request->head) // of which no ranges are defined (RFC 9110, 14.2)
        range = NULL;
    return spl_range_parse(same && strcmp(same, tag) ? NULL : range, size, first, length);
}

static void add_cache_headers(struct request *request, const char *tag)
{
    spl_reply_add_header(request, MHD_HTTP_HEADER_ETAG, "%s", tag);
    spl_reply_add_header(request, MHD_HTTP_HEADER_CACHE_CONTROL, "private, max-age=31536000, immutable");
    spl_reply_add_header(request, MHD_HTTP_HEADER_ACCEPT_RANGES, "bytes");
}

static void refuse_range(struct request *request, uint64_t size)
{
    char detail[96];
    snprintf(detail, sizeof detail, "the range begins behind the file's %llu bytes", (unsigned long long)size);
    spl_reply_problem(request, MHD_HTTP_RANGE_NOT_SATISFIABLE, "range", "Range", detail);
    if (request->response)
        spl_reply_add_header(request, MHD_HTTP_HEADER_CONTENT_RANGE, "bytes */%llu", (unsigned long long)size);
}

void spl_tour_reply_file(struct request *request, struct spl_tour *tour, const char *name, const char *type,
                         const char *tag)
{
    struct spl_error why = {0}, err = {0};
    struct spl_tour_file file;
    uint64_t length;
    if (!spl_check_match(request, tag))
        return;
    if (spl_client_has(request, tag)) {
        request->status = MHD_HTTP_NOT_MODIFIED;
        if ((request->response = MHD_create_response_from_buffer(0, "", MHD_RESPMEM_PERSISTENT)))
            add_cache_headers(request, tag);
        return;
    }
    if (spl_tour_file_open(tour->tours->directory, tour->name, name, &file, &why)) {
        spl_fail(&err, SPL_E_IO, "%s", why.message); // also where it is not there: the tour says that it is
        spl_reply_error(request, &err);
        return;
    }
    const uint64_t size = file.left;
    enum spl_range range = wanted(request, tag, size, &file.offset, &length);
    if (range == SPL_RANGE_UNSATISFIABLE) {
        refuse_range(request, size);
        goto close_file;
    }
    file.left = length;
    struct reading *reading = spl_alloc(1, sizeof *reading, NULL);
    if (!reading)
        goto close_file;
    *reading = (struct reading){tour, request->connection, file};
    request->response = MHD_create_response_from_callback(length, block_bytes, on_read, reading, on_free);
    if (!request->response) {
        free(reading);
        goto close_file;
    }
    tour->readers++;
    request->status = range == SPL_RANGE_PART ? MHD_HTTP_PARTIAL_CONTENT : MHD_HTTP_OK;
    spl_reply_add_header(request, MHD_HTTP_HEADER_CONTENT_TYPE, "%s", type);
    add_cache_headers(request, tag);
    if (range == SPL_RANGE_PART)
        spl_reply_add_header(request, MHD_HTTP_HEADER_CONTENT_RANGE, "bytes %" PRIu64 "-%" PRIu64 "/%" PRIu64,
                             file.offset, file.offset + length - 1, size);
    return;
close_file:
    spl_tour_file_close(&file);
}
