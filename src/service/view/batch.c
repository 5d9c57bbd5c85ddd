/* Many views for one request: POST …/views.
 *
 * A batch has at most `seats` views on their way at a time, so that the device is never idle for it and other people's
 * views get between; where the queue is full, or all clients together ask too often, it tries again with the next
 * sweep. Parts are in the order of the request; one that failed is a problem document in its place. Once all are there,
 * a thread of libuv puts them together.
 * Invariant: a batch belongs to its request until it is abandoned or bundled; while it is being bundled it is freed by
 * finish() alone. Owned by the loop's thread, but `parts` and `bundle` while a thread has them. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "service/access/access.h"
#include "service/exchange.h"
#include "service/headers.h"
#include "service/http.h"
#include "service/ops/counters.h"
#include "service/place/wait.h"
#include "service/reply.h"
#include "service/state.h"
#include "service/view/bundle.h"
#include "service/view/reply.h"
#include "service/view/views.h"

enum { seats = 2, batch_bytes_max = 256 << 20 };

struct item {
    struct spl_rendering *rendering; // may be NULL: not yet, or failed
    struct spl_error err;
    char *problem, *problem_headers; // owned; of a part that failed
};

struct seat {
    struct ticket ticket; /* first: a ticket is its seat */
    struct batch *batch;
    size_t item;
};

struct batch {
    struct request *request; // NULL: abandoned
    struct spl_service *service;
    struct spl_catalog_entry *entry; // one reference, until all views are there
    struct spl_views_request views;
    struct item *items;
    size_t next, done, failed, bytes;
    struct seat seats[seats];
    bool may_begin; /* the next one is counted; the first was with the request */
    bool bundling;
    uv_work_t work;
    struct spl_part *parts;
    struct spl_encoded bundle;
    struct spl_error err;
};

static void destroy(struct batch *batch)
{
    if (!batch)
        return;
    for (size_t i = 0; i < batch->views.count && batch->items; i++) {
        spl_rendering_unref(batch->items[i].rendering);
        free(batch->items[i].problem);
        free(batch->items[i].problem_headers);
    }
    spl_catalog_entry_unref(batch->entry);
    spl_encoded_finish(&batch->bundle);
    spl_views_request_finish(&batch->views);
    free(batch->parts);
    free(batch->items);
    free(batch);
}

static void settle(struct batch *batch, size_t i, struct spl_rendering *rendering, const struct spl_error *err)
{
    struct item *item = &batch->items[i];
    batch->done++;
    if (rendering && batch->bytes + rendering->encoded.length > batch_bytes_max) {
        spl_fail_field(&item->err, SPL_E_LIMIT, "views",
                       "the views before it have %zu bytes already; at most %d go into one reply", batch->bytes,
                       (int)batch_bytes_max);
    } else if (rendering) {
        item->rendering = spl_rendering_ref(rendering);
        batch->bytes += rendering->encoded.length;
    } else {
        item->err = *err;
    }
    batch->failed += !item->rendering;
}

/* Runs on a thread of libuv. */
static void bundle(uv_work_t *work)
{
    struct batch *batch = work->data;
    if (!batch->err.code)
        spl_bundle(batch->views.container, batch->parts, batch->views.count, &batch->bundle, &batch->err);
}

static void finish(uv_work_t *work, int status)
{
    struct batch *batch = work->data;
    struct request *request = batch->request;
    (void)status;
    if (request) {
        request->batch = NULL;
        if (batch->err.code)
            spl_reply_error(request, &batch->err);
        else
            spl_reply_bundle(request, &batch->bundle, batch->failed);
        spl_waiting_resume(request);
        spl_http_pump(batch->service);
    }
    destroy(batch);
}

static bool make_problem(struct batch *batch, struct item *item)
{
    struct spl_headers headers;
    item->problem = spl_problem_text(batch->request, &item->err);
    spl_headers_open(&headers);
    spl_headers_add(&headers, "Content-Type", "application/problem+json");
    bool good = spl_headers_close(&headers) && item->problem;
    item->problem_headers = headers.text;
    return good;
}

/* Names the parts and hands them to a thread. */
static void assemble(struct batch *batch)
{
    bool good = (batch->parts = spl_alloc(batch->views.count, sizeof *batch->parts, &batch->err)) != NULL;
    for (size_t i = 0; good && i < batch->views.count; i++) {
        struct item *item = &batch->items[i];
        const struct spl_view_request *view = &batch->views.views[i];
        struct spl_part *part = &batch->parts[i];
        if (!item->rendering && !(good = make_problem(batch, item)))
            break;
        const struct spl_encoded *encoded = item->rendering ? &item->rendering->encoded : NULL;
        snprintf(part->name, sizeof part->name, "%03zu%s", i,
                 encoded ? spl_format_suffix(view->encode.format) : ".json");
        part->headers = encoded ? item->rendering->headers : item->problem_headers;
        part->bytes = encoded ? encoded->bytes : (const uint8_t *)item->problem;
        part->length = encoded ? encoded->length : strlen(item->problem);
    }
    spl_catalog_entry_unref(batch->entry);
    batch->entry = NULL;
    batch->bundling = true;
    batch->work.data = batch;
    if (!good)
        spl_fail(&batch->err, SPL_E_NOMEM, "out of memory for a batch of %zu views", batch->views.count);
    int rc = uv_queue_work(&batch->service->loop, &batch->work, bundle, finish);
    spl_assert(!rc); // it allocates nothing
}

static void on_done(struct ticket *ticket, struct spl_rendering *rendering, const struct spl_error *err)
{
    struct seat *seat = (struct seat *)ticket;
    struct batch *batch = seat->batch;
    if (err->code == SPL_E_TIMEOUT)
        spl_count(batch->service->counters, deadline_missed);
    settle(batch, seat->item, rendering, err);
    spl_batch_go_on(batch);
}

static struct seat *find_seat(struct batch *batch)
{
    for (size_t i = 0; i < seats; i++)
        if (!batch->seats[i].ticket.flight)
            return &batch->seats[i];
    return NULL;
}

/* From the cache, or by a flight. SPL_E_BUSY: nothing has happened. */
static int begin(struct batch *batch, struct seat *seat, size_t i, struct spl_error *err)
{
    struct spl_service *service = batch->service;
    const struct spl_view_request *view = &batch->views.views[i];
    struct spl_key key = {0};
    if (!view->planned) {
        key = spl_key_make(view, batch->entry->info, spl_fleet_get_renderer(service->views->fleet));
        struct spl_rendering *rendering = spl_cache_find(service->views->cache, &key);
        if (rendering) {
            spl_count(service->counters, cache_hits);
            settle(batch, i, rendering, err);
            return 0;
        }
    }
    seat->batch = batch;
    seat->item = i;
    seat->ticket.done = on_done;
    seat->ticket.route = batch->request->route;
    seat->ticket.deadline_ns = spl_now_ns() + service->options->deadline_ms * SPL_NS_PER_MS;
    int rc = spl_flight_board(service, &seat->ticket, batch->entry, view, &key, err);
    if (!rc && !view->planned)
        spl_count(service->counters, cache_misses);
    return rc;
}

void spl_batch_go_on(struct batch *batch)
{
    if (batch->bundling)
        return;
    for (struct seat *seat; batch->next < batch->views.count && (seat = find_seat(batch));) {
        struct spl_error err = {0};
        batch->may_begin = batch->may_begin || spl_access_take_one(batch->service);
        int rc = batch->may_begin ? begin(batch, seat, batch->next, &err) : SPL_E_BUSY;
        if (rc == SPL_E_BUSY)
            return; // the next sweep tries again
        batch->may_begin = false;
        if (rc)
            settle(batch, batch->next, NULL, &err);
        batch->next++;
    }
    if (batch->done == batch->views.count)
        assemble(batch);
}

void spl_batch_abandon(struct batch *batch)
{
    if (!batch)
        return;
    for (size_t i = 0; i < seats; i++)
        spl_ticket_drop(&batch->seats[i].ticket);
    batch->request->batch = NULL;
    batch->request = NULL;
    if (!batch->bundling)
        destroy(batch);
}

void spl_make_views(struct request *request, const struct spl_call *call)
{
    struct spl_service *service = request->service;
    struct spl_camera_limits limits = spl_view_get_limits(service);
    struct spl_error err = {0};
    struct batch *batch = spl_alloc(1, sizeof *batch, &err);
    if (!batch)
        goto refuse;
    int rc = spl_views_request_from_json(request->body, request->body_length, &call->entry->defaults, &limits,
                                         &batch->views, &err);
    if (rc && spl_place_wait(request, call, spl_make_views, &err)) {
        destroy(batch);
        return;
    }
    if (rc) {
        spl_view_blame(&err);
        goto refuse;
    }
    for (size_t i = 0; i < batch->views.count; i++) {
        char part[32];
        snprintf(part, sizeof part, "views[%zu]", i);
        if (spl_view_check_part(&batch->views.views[i], call->entry->info, part, &err) ||
            spl_view_has_no_room(service, &batch->views.views[i], &err))
            goto refuse;
    }
    if (!(batch->items = spl_alloc(batch->views.count, sizeof *batch->items, &err)))
        goto refuse;
    batch->service = service;
    batch->request = request;
    batch->may_begin = true;
    batch->entry = spl_catalog_entry_ref(call->entry);
    struct spl_pipeline_status status;
    spl_fleet_get_status(service->views->fleet, &status);
    if (status.render_length >= status.render_capacity) {
        spl_count(service->counters, refused_full);
        spl_fail(&err, SPL_E_BUSY, "the queue of views is full; come back later");
        goto refuse;
    }
    if (!spl_access_charge(request, (unsigned)batch->views.count - 1)) {
        destroy(batch);
        return;
    }
    request->batch = batch;
    spl_waiting_add(request, spl_now_ns() + (batch->views.count + 1) * service->options->deadline_ms * SPL_NS_PER_MS);
    spl_batch_go_on(batch);
    return;
refuse:
    destroy(batch);
    spl_reply_error(request, &err);
}
