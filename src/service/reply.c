/* Replies: JSON, RFC 9457 problems, text, long bodies, and what has no length yet. A problem's status and Retry-After
 * follow from its error. Owned by the loop's thread. */
#include "service/reply.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "base/memory.h"
#include "geom/json.h"
#include "service/exchange.h"
#include "service/ops/access_log.h"
#include "service/pages.h"
#include "service/state.h"
#include "service/view/views.h"

void spl_reply_add_header(struct request *request, const char *name, const char *format, ...)
{
    char text[1024];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    for (char *c = text; *c; c++)
        if (*c < 0x20 || *c > 0x7e)
            *c = '?'; // names of devices come from drivers
    MHD_add_response_header(request->response, name, text);
}

/* Takes `body`, malloc'd or NULL. */
static void set_text(struct request *request, unsigned status, const char *type, char *body)
{
    request->status = status;
    request->response = body ? MHD_create_response_from_buffer(strlen(body), body, MHD_RESPMEM_MUST_FREE) : NULL;
    if (!request->response)
        free(body);
    else
        spl_reply_add_header(request, MHD_HTTP_HEADER_CONTENT_TYPE, "%s", type);
}

void spl_reply_empty(struct request *request)
{
    request->status = MHD_HTTP_NO_CONTENT;
    request->response = MHD_create_response_from_buffer(0, "", MHD_RESPMEM_PERSISTENT);
}

void spl_reply_text(struct request *request, const char *type, char *body)
{
    set_text(request, MHD_HTTP_OK, type, body);
}

void spl_reply_json(struct request *request, json_t *json)
{
    set_text(request, MHD_HTTP_OK, "application/json", spl_json_print(json));
}

/* Text that came from outside, as JSON: jansson refuses what is not UTF-8. */
static json_t *outside_text(const char *text)
{
    json_t *json = json_string(text);
    if (json)
        return json;
    char plain[1024];
    snprintf(plain, sizeof plain, "%s", text);
    for (char *c = plain; *c; c++)
        if (*c < 0x20 || *c > 0x7e)
            *c = '?';
    return json_string(plain);
}

char *spl_problem_print(const struct request *request, unsigned status, const char *type, const char *field,
                        const char *detail)
{
    json_t *json = json_pack("{s:o, s:s, s:i, s:o, s:o}", "type", json_sprintf("urn:splatd:error:%s", type), "title",
                             MHD_get_reason_phrase_for(status), "status", (int)status, "detail", outside_text(detail),
                             "instance", json_sprintf("urn:splatd:request:%s", request->id));
    if (json && field[0])
        json_object_set_new(json, "field", outside_text(field));
    char *text = json ? json_dumps(json, JSON_INDENT(1)) : NULL;
    json_decref(json);
    return text;
}

/* The status of each code; what is not here is 500. */
static unsigned status_of_code(int code)
{
    static const unsigned short statuses[] = {
        [-SPL_OK] = MHD_HTTP_OK,
        [-SPL_E_NOMEM] = MHD_HTTP_SERVICE_UNAVAILABLE,
        [-SPL_E_INPUT] = MHD_HTTP_BAD_REQUEST,
        [-SPL_E_USAGE] = MHD_HTTP_BAD_REQUEST,
        [-SPL_E_UNSUPPORTED] = MHD_HTTP_NOT_IMPLEMENTED,
        [-SPL_E_NOT_FOUND] = MHD_HTTP_NOT_FOUND,
        [-SPL_E_LIMIT] = MHD_HTTP_CONTENT_TOO_LARGE,
        [-SPL_E_BUSY] = MHD_HTTP_SERVICE_UNAVAILABLE,
        [-SPL_E_TIMEOUT] = MHD_HTTP_SERVICE_UNAVAILABLE,
        [-SPL_E_NO_DEVICE] = MHD_HTTP_SERVICE_UNAVAILABLE,
        [-SPL_E_DEVICE_LOST] = MHD_HTTP_SERVICE_UNAVAILABLE,
        [-SPL_E_CANCELLED] = MHD_HTTP_SERVICE_UNAVAILABLE,
    };
    bool known = code <= 0 && (size_t)-code < sizeof statuses / sizeof *statuses && statuses[-code];
    return known ? statuses[-code] : MHD_HTTP_INTERNAL_SERVER_ERROR;
}

/* 413 is about bodies, which only PUT brings; a parameter beyond a limit is the client's to change, like any other, and
 * for a view the device has too little memory, whatever was sent. */
static unsigned status_of(const struct request *request, const struct spl_error *err)
{
    if (err->code == SPL_E_LIMIT && err->field[0])
        return MHD_HTTP_BAD_REQUEST;
    if (err->code == SPL_E_LIMIT && strcmp(request->method, MHD_HTTP_METHOD_PUT))
        return MHD_HTTP_INSUFFICIENT_STORAGE;
    return status_of_code(err->code);
}

char *spl_problem_text(const struct request *request, const struct spl_error *err)
{
    return spl_problem_print(request, status_of(request, err), spl_code_get_info(err->code)->name, err->field,
                             err->message);
}

void spl_reply_problem(struct request *request, unsigned status, const char *type, const char *field,
                       const char *detail)
{
    if (!spl_problem_wants_page(request)) {
        set_text(request, status, "application/problem+json", spl_problem_print(request, status, type, field, detail));
        return;
    }
    set_text(request, status, "text/html; charset=utf-8", spl_problem_print_page(request, status, detail));
    if (!request->response)
        return;
    spl_reply_add_header(request, "Content-Security-Policy", "%s", spl_page_policy);
    spl_reply_add_header(request, MHD_HTTP_HEADER_VARY, "%s", MHD_HTTP_HEADER_ACCEPT);
}

void spl_reply_error(struct request *request, const struct spl_error *err)
{
    const struct spl_code_info *info = spl_code_get_info(err->code);
    unsigned status = status_of(request, err);
    if (status >= 500 && !info->retry && spl_access_log_admit(request->service))
        spl_log_error("request %s: %s", request->id, err->message);
    spl_reply_problem(request, status, info->name, err->field, err->message);
    if (request->response && info->retry)
        spl_reply_add_header(request, MHD_HTTP_HEADER_RETRY_AFTER, "%u",
                             spl_fleet_get_retry_after(request->service->views->fleet, request->large));
}

struct pieces {
    const char *bytes;
    size_t length;
    void (*release)(void *);
    void *context;
};

static ssize_t read_piece(void *context, uint64_t position, char *out, size_t room)
{
    const struct pieces *pieces = context;
    size_t left = pieces->length - (size_t)position, n = left < room ? left : room;
    memcpy(out, pieces->bytes + position, n);
    return (ssize_t)n;
}

static void release_pieces(void *context)
{
    struct pieces *pieces = context;
    pieces->release(pieces->context);
    free(pieces);
}

static struct MHD_Response *make_pieces(const void *bytes, size_t length, void (*release)(void *), void *context)
{
    enum { piece_bytes = 256 << 10 };
    struct pieces *pieces = spl_alloc(1, sizeof *pieces, NULL);
    struct MHD_Response *response =
        pieces ? MHD_create_response_from_callback(length, piece_bytes, read_piece, pieces, release_pieces) : NULL;
    if (!response)
        free(pieces);
    else
        *pieces = (struct pieces){bytes, length, release, context};
    return response;
}

void spl_reply_bytes(struct request *request, const void *bytes, size_t length, void (*release)(void *), void *context)
{
    enum { whole_bytes = 1 << 20 }; // of frames nothing is copied
    request->status = MHD_HTTP_OK;
    request->response = length > whole_bytes
                            ? make_pieces(bytes, length, release, context)
                            : MHD_create_response_from_buffer_with_free_callback_cls(
                                  length, (void *)(uintptr_t)bytes, release, context);
}

void spl_reply_stream(struct request *request, size_t block, MHD_ContentReaderCallback read, void *context,
                      MHD_ContentReaderFreeCallback destroy)
{
    request->status = MHD_HTTP_OK;
    request->response = MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, block, read, context, destroy);
    // libmicrohttpd 0.9.75 ends a HEAD of unknown length with the last chunk of a body that there is not; without
    // chunks it closes the connection
    if (request->response && request->head)
        MHD_set_response_options(request->response, MHD_RF_HTTP_1_0_COMPATIBLE_STRICT, MHD_RO_END);
}
