/* A user's browser sends what any page asks it to: here, and with the user's way through the network. Where a token
 * decides that is harmless, for a page has none. Where none is asked for, two things keep pages of others out:
 *
 * - Host must name this service (host.c), or a page could make its own name point here and read everything.
 * - What changes something must come from no page, from one of ours or of a listed origin, or as application/json,
 *   which browsers send to another origin only after a preflight, and that is answered for listed origins alone.
 *
 * What only reads may come from any page, so that an <img> and an <iframe> work anywhere; the page cannot look into
 * them. Owned by the loop's thread. */
#include "service/access/door.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "service/access/host.h"
#include "service/exchange.h"
#include "service/ops/counters.h"
#include "service/reply.h"
#include "service/state.h"

static const char *get_header(struct request *request, const char *name)
{
    return MHD_lookup_connection_value(request->handle, MHD_HEADER_KIND, name);
}

static bool refuse(struct request *request, unsigned status, const char *type, const char *field, const char *detail)
{
    spl_count(request->service->counters, refused_access);
    spl_reply_problem(request, status, type, field, detail);
    return false;
}

static enum MHD_Result count_host(void *context, enum MHD_ValueKind kind, const char *name, const char *value)
{
    (void)kind;
    (void)value;
    *(unsigned *)context += !strcasecmp(name, MHD_HTTP_HEADER_HOST);
    return MHD_YES;
}

bool spl_door_check_host(struct request *request, bool anonymous)
{
    const char *host = get_header(request, MHD_HTTP_HEADER_HOST);
    char detail[400];
    unsigned count = 0;
    MHD_get_connection_values(request->handle, MHD_HEADER_KIND, count_host, &count);
    if (count > 1 || (!count && request->has_host))
        return refuse(request, MHD_HTTP_BAD_REQUEST, "input", MHD_HTTP_HEADER_HOST, "a request has one Host");
    if (!anonymous || !host || spl_host_is_ours(host, &request->service->options->host_names))
        return true;
    snprintf(detail, sizeof detail,
             "this service is not known here as '%.200s'; start it with --host-name NAME if that name is its own, or "
             "ask by an address or localhost", host);
    return refuse(request, MHD_HTTP_MISDIRECTED_REQUEST, "host", MHD_HTTP_HEADER_HOST, detail);
}

/* The request's Origin where its pages may read replies; NULL otherwise. */
static const char *allowed_origin(struct request *request)
{
    const struct spl_text_list *cors = &request->service->options->cors;
    const char *origin = cors->count ? get_header(request, MHD_HTTP_HEADER_ORIGIN) : NULL;
    for (size_t i = 0; origin && i < cors->count; i++)
        if (!strcmp(cors->items[i], "*") || !strcasecmp(cors->items[i], origin))
            return origin;
    return NULL;
}

static bool is_json(const char *type)
{
    static const char json[] = "application/json";
    return type && !strncasecmp(type, json, sizeof json - 1) && strchr("; \t", type[sizeof json - 1]);
}

bool spl_door_check_origin(struct request *request)
{
    const char *origin = get_header(request, MHD_HTTP_HEADER_ORIGIN);
    if (!origin || is_json(get_header(request, MHD_HTTP_HEADER_CONTENT_TYPE)) || allowed_origin(request) ||
        spl_origin_is_ours(origin, get_header(request, MHD_HTTP_HEADER_HOST), &request->service->options->host_names))
        return true;
    return refuse(request, MHD_HTTP_FORBIDDEN, "forbidden", MHD_HTTP_HEADER_ORIGIN,
                  "pages of other origins change nothing here; start the service with --cors ORIGIN if that page may, "
                  "or send a token");
}

bool spl_door_check_preflight(struct request *request, const char *method)
{
    if (strcmp(method, MHD_HTTP_METHOD_OPTIONS) || !allowed_origin(request) ||
        !get_header(request, "Access-Control-Request-Method"))
        return true;
    spl_reply_empty(request);
    if (!request->response)
        return false;
    MHD_add_response_header(request->response, "Access-Control-Allow-Methods", "GET, HEAD, POST, PUT, DELETE");
    MHD_add_response_header(request->response, "Access-Control-Allow-Headers",
                            "Authorization, Content-Type, If-Match, If-None-Match, Range");
    MHD_add_response_header(request->response, "Access-Control-Max-Age", "600");
    return false;
}

void spl_door_add_cors(struct request *request)
{
    const struct spl_text_list *cors = &request->service->options->cors;
    if (!cors->count || !request->response)
        return;
    const char *origin = allowed_origin(request);
    MHD_add_response_header(request->response, MHD_HTTP_HEADER_VARY, "Origin");
    if (!origin || MHD_get_response_header(request->response, MHD_HTTP_HEADER_ACCESS_CONTROL_ALLOW_ORIGIN))
        return;
    MHD_add_response_header(request->response, MHD_HTTP_HEADER_ACCESS_CONTROL_ALLOW_ORIGIN, origin);
    MHD_add_response_header(request->response, "Access-Control-Expose-Headers", "*");
}
