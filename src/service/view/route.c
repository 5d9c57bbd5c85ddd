/* One view of a dataset: checked, then answered from what is known, or rendered. Owned by the loop's thread. */
#include <stddef.h>
#include <string.h>

#include "base/clock.h"
#include "service/exchange.h"
#include "service/ops/counters.h"
#include "service/place/wait.h"
#include "service/reply.h"
#include "service/state.h"
#include "service/view/reply.h"
#include "service/view/views.h"

typedef int parse_fn(const char *text, size_t length, const struct spl_camera_defaults *defaults,
                     const struct spl_camera_limits *limits, struct spl_view_request *out, struct spl_error *err);

/* From the body of a POST, from the query of anything else. */
static int parse_view(struct request *request, const struct spl_call *call, parse_fn *parse,
                      struct spl_view_request *view, struct spl_error *err)
{
    struct spl_camera_limits limits = spl_view_get_limits(request->service);
    bool posted = call->method == SPL_POST;
    const char *text = posted ? request->body : request->query;
    int rc = parse(text, posted ? request->body_length : strlen(text), &call->entry->defaults, &limits, view, err);
    return rc ? spl_view_blame(err) : 0;
}

static void answer(struct ticket *ticket, struct spl_rendering *rendering, const struct spl_error *err)
{
    struct request *request = (struct request *)((char *)ticket - offsetof(struct request, ticket));
    if (err->code == SPL_E_TIMEOUT)
        spl_count(request->service->counters, deadline_missed);
    if (rendering)
        spl_reply_rendering(request, rendering, ticket->shared ? "shared" : "miss");
    else
        spl_reply_error(request, err);
    spl_waiting_resume(request);
}

/* What can be said without rendering: the client wants another, or has it, the cache has it, or HEAD wants none. */
static bool answer_at_once(struct request *request, const struct spl_view_request *view, const struct spl_key *key)
{
    struct spl_service *service = request->service;
    char etag[SPL_ETAG_BYTES];
    spl_key_etag(key, etag);
    if (request->validated && !spl_check_match(request, etag))
        return true;
    if (request->validated && spl_client_has(request, etag)) {
        spl_count(service->counters, not_modified);
        spl_reply_not_modified(request, key);
        return true;
    }
    struct spl_rendering *rendering = spl_cache_find(service->views->cache, key);
    if (rendering) {
        spl_count(service->counters, cache_hits);
        spl_reply_rendering(request, rendering, "hit");
        return true;
    }
    if (request->head)
        spl_reply_view_head(request, view, key);
    else
        spl_count(service->counters, cache_misses);
    return request->head;
}

void spl_view_answer(struct request *request, const struct spl_call *call, struct spl_view_request *view,
                     struct spl_error *err)
{
    struct spl_catalog_entry *entry = call->entry;
    struct spl_service *service = request->service;
    struct spl_key key = {0};
    if (err->code || spl_view_check_dataset(view, entry->info, err))
        goto refuse;
    if (!view->planned) {
        key = spl_key_make(view, entry->info, spl_fleet_get_renderer(service->views->fleet));
        request->validated = call->method == SPL_GET;
        request->versioned = view->versioned && !view->named;
        if (answer_at_once(request, view, &key))
            return;
    }
    request->large = spl_request_is_large(view);
    if (spl_view_has_no_room(service, view, err))
        goto refuse;
    request->ticket.done = answer;
    request->ticket.route = request->route;
    request->ticket.deadline_ns = spl_now_ns() + service->options->deadline_ms * SPL_NS_PER_MS;
    if (!spl_flight_board(service, &request->ticket, entry, view, &key, err)) {
        spl_waiting_add(request, request->ticket.deadline_ns);
        return;
    }
    spl_count(service->counters, refused_full);
refuse:
    spl_reply_error(request, err);
}

static void make(struct request *request, const struct spl_call *call, parse_fn *parse, spl_handler *handler)
{
    struct spl_error err = {0};
    struct spl_view_request view;
    if (parse_view(request, call, parse, &view, &err) && spl_place_wait(request, call, handler, &err))
        return;
    spl_view_answer(request, call, &view, &err);
}

void spl_make_view(struct request *request, const struct spl_call *call)
{
    make(request, call, call->method == SPL_POST ? spl_view_request_from_json : spl_view_request_from_query,
         spl_make_view);
}

void spl_pick(struct request *request, const struct spl_call *call)
{
    make(request, call, call->method == SPL_POST ? spl_pick_request_from_json : spl_pick_request_from_query,
         spl_pick);
}

void spl_make_thumbnail(struct request *request, const struct spl_call *call)
{
    make(request, call, spl_thumbnail_request_from_query, spl_make_thumbnail);
}
