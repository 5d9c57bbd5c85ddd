/* Encoded views as replies, with the headers that say what their pixels mean.
 *
 * Bytes of a view are handed to MHD as they came from the encoder, without a copy; what waits for a client's reading is
 * counted in spl_views.reply_bytes. Owned by the loop's thread. */
#include "service/view/reply.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/clock.h"
#include "base/memory.h"
#include "service/exchange.h"
#include "service/headers.h"
#include "service/reply.h"
#include "service/state.h"
#include "service/view/views.h"

static void add_headers(struct request *request, const char *text)
{
    for (const char *name = text, *value; (value = spl_headers_value(name)); name = spl_headers_next(value))
        MHD_add_response_header(request->response, name, value);
}

static void add_validator(struct request *request, const struct spl_key *key)
{
    char etag[SPL_ETAG_BYTES];
    spl_key_etag(key, etag);
    MHD_add_response_header(request->response, MHD_HTTP_HEADER_ETAG, etag);
    if (!request->versioned) {
        MHD_add_response_header(request->response, MHD_HTTP_HEADER_CACHE_CONTROL, "no-cache");
        return;
    }
    // what not everybody may see is kept by clients, not by proxies, and no longer than its signature holds
    enum { year_s = 365 * 24 * 3600 };
    int64_t left_s = request->expires_s ? request->expires_s - (int64_t)time(NULL) : year_s;
    left_s = left_s < 0 ? 0 : left_s > year_s ? year_s : left_s;
    spl_reply_add_header(request, MHD_HTTP_HEADER_CACHE_CONTROL, "%s, max-age=%" PRId64 ", immutable",
                         request->service->access ? "private" : "public", left_s);
}

static void release_rendering(void *rendering)
{
    spl_rendering_unref(rendering);
}

void spl_reply_rendering(struct request *request, struct spl_rendering *rendering, const char *origin)
{
    struct spl_encoded *encoded = &rendering->encoded;
    spl_reply_bytes(request, encoded->bytes, encoded->length, release_rendering, rendering);
    if (!request->response)
        return;
    spl_rendering_ref(rendering);
    add_headers(request, rendering->headers);
    if (!strcmp(origin, "hit"))
        spl_reply_add_header(request, "Server-Timing", "cache, total;dur=%.3f",
                             (double)(spl_now_ns() - request->began_ns) / SPL_NS_PER_MS);
    else
        spl_reply_add_header(request, "Server-Timing", "%s, total;dur=%.3f", rendering->timing,
                             (double)(spl_now_ns() - request->began_ns) / SPL_NS_PER_MS);
    spl_reply_add_header(request, "Splatd-Cache", "%s", origin);
    request->cache = origin;
    if (!rendering->reusable)
        spl_reply_add_header(request, MHD_HTTP_HEADER_CACHE_CONTROL, "no-store");
    else if (request->validated)
        add_validator(request, &rendering->key);
}

/* The bytes of a batch on their way to a client. */
struct outgoing {
    struct spl_views *views;
    struct spl_encoded bundle;
};

static void release_outgoing(void *context)
{
    struct outgoing *outgoing = context;
    outgoing->views->reply_bytes -= outgoing->bundle.length;
    spl_free_aside(outgoing->bundle.bytes, outgoing->bundle.length);
    free(outgoing);
}

void spl_reply_bundle(struct request *request, struct spl_encoded *bundle, size_t failed)
{
    struct outgoing *outgoing = spl_alloc(1, sizeof *outgoing, NULL);
    if (!outgoing)
        return;
    spl_reply_bytes(request, bundle->bytes, bundle->length, release_outgoing, outgoing);
    if (!request->response) {
        free(outgoing);
        return;
    }
    *outgoing = (struct outgoing){request->service->views, *bundle};
    *bundle = (struct spl_encoded){0};
    outgoing->views->reply_bytes += outgoing->bundle.length;
    spl_reply_add_header(request, MHD_HTTP_HEADER_CONTENT_TYPE, "%s", outgoing->bundle.media_type);
    spl_reply_add_header(request, "Server-Timing", "total;dur=%.3f",
                         (double)(spl_now_ns() - request->began_ns) / SPL_NS_PER_MS);
    spl_reply_add_header(request, "Splatd-Failed", "%zu", failed);
    spl_reply_add_header(request, MHD_HTTP_HEADER_CACHE_CONTROL, "no-store");
}

void spl_reply_not_modified(struct request *request, const struct spl_key *key)
{
    request->status = MHD_HTTP_NOT_MODIFIED;
    request->response = MHD_create_response_from_buffer(0, NULL, MHD_RESPMEM_PERSISTENT);
    if (request->response)
        add_validator(request, key);
}

static ssize_t read_nothing(void *context, uint64_t position, char *buffer, size_t size)
{
    (void)context;
    (void)position;
    (void)buffer;
    (void)size;
    return MHD_CONTENT_READER_END_OF_STREAM;
}

void spl_reply_view_head(struct request *request, const struct spl_view_request *view, const struct spl_key *key)
{
    struct spl_headers headers;
    spl_headers_open(&headers);
    spl_headers_add_view(&headers, view, NULL);
    if (!spl_headers_close(&headers))
        return;
    spl_reply_stream(request, 16, read_nothing, NULL, NULL); // a GET's length is known only once it is rendered
    if (request->response) {
        add_headers(request, headers.text);
        if (view->view.partial) /* what is on the device now may be less than what the key stands for */
            spl_reply_add_header(request, MHD_HTTP_HEADER_CACHE_CONTROL, "no-store");
        else
            add_validator(request, key);
    }
    free(headers.text);
}
