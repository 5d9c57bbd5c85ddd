/* The life of a change, a step of the pool at a time:
 *
 *     PUT:     append … append → check (sync, verify, open) → made resident → place (rename, sync the folder) → reply
 *     DELETE:  remove → reply
 *
 * Invariants: nothing is put in place before all that may refuse it was asked, the device last, so a reply of failure
 * means that the file is as it was. A change has its slot to itself (slot->busy) until it ends. One whose client leaves
 * before the body is whole ends with the step that runs; one whose body is whole goes on. run_step() is the pool's,
 * everything else the loop's. */
#include "service/datasets/change.h"

#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/log.h"
#include "base/memory.h"
#include "service/exchange.h"
#include "service/http.h"
#include "service/reply.h"
#include "service/state.h"
#include "service/view/views.h"

struct change *spl_change_begin(struct request *request, struct spl_catalog_slot *slot)
{
    struct change *change = spl_alloc(1, sizeof *change, NULL);
    if (!change || !(change->target = strdup(slot->path))) {
        free(change);
        return NULL;
    }
    change->service = request->service;
    change->request = request;
    change->stepped_ns = spl_now_ns();
    change->fresh = !slot->current;
    memcpy(change->id, slot->id, sizeof change->id);
    LIST_INSERT_HEAD(&request->service->library->changes, change, link);
    slot->busy = true;
    request->change = change;
    return change;
}

static void destroy(struct change *change)
{
    change->service->library->changes_made++;
    LIST_REMOVE(change, link);
    free(change->buffer);
    free(change->target);
    free(change);
}

/* The request goes its own way. */
static void part(struct change *change)
{
    struct request *request = change->request;
    if (!request)
        return;
    change->request = NULL;
    request->change = NULL;
    spl_request_resume(request);
}

void spl_change_finish(struct change *change)
{
    struct spl_catalog *catalog = &change->service->library->catalog;
    struct spl_catalog_slot *slot = spl_catalog_find_slot(catalog, change->id);
    spl_assert(!change->working && !change->loading);
    if (slot) {
        slot->busy = false;
        slot->next = NULL;
        if (!slot->current && !slot->reason[0] && !slot->opened.inode)
            spl_catalog_remove_slot(catalog, slot); // it was made for this
    }
    part(change);
    spl_catalog_entry_unref(change->entry);
    change->entry = NULL;
    if (change->incoming.path)
        spl_change_run(change, SPL_CHANGE_CLEAN_UP); // removing a large file takes a while
    else
        destroy(change);
}

static void fail(struct change *change)
{
    const struct spl_error *err = &change->err;
    bool input = err->code == SPL_E_CORRUPT || err->code == SPL_E_INPUT || err->code == SPL_E_UNSUPPORTED;
    if (change->request && change->incoming.no_room)
        spl_reply_problem(change->request, MHD_HTTP_INSUFFICIENT_STORAGE, "storage", "body", err->message);
    else if (change->request && input)
        spl_reply_problem(change->request, MHD_HTTP_UNPROCESSABLE_CONTENT, "input", "body", err->message);
    else if (change->request)
        spl_reply_error(change->request, err);
    spl_change_finish(change);
}

static void run_step(uv_work_t *work)
{
    struct change *change = work->data;
    struct spl_incoming *incoming = &change->incoming;
    struct spl_error *err = &change->err;
    struct spl_dataset_opening how = spl_library_get_opening(change->service);
    how.verify = how.verify_all = true; // whatever the operator says: it comes from outside
    switch (change->step) {
    case SPL_CHANGE_APPEND:
    case SPL_CHANGE_CHECK:
        if ((incoming->path || !spl_incoming_begin(incoming, change->target, err)) &&
            !spl_incoming_append(incoming, change->buffer, change->filled, err) && change->step == SPL_CHANGE_CHECK)
            spl_incoming_check(incoming, change->target, &how, &change->entry, err);
        change->filled = 0;
        break;
    case SPL_CHANGE_PLACE:
        spl_incoming_place(incoming, change->target, &change->mark, err);
        break;
    case SPL_CHANGE_REMOVE:
        spl_stored_remove(change->target, err);
        break;
    case SPL_CHANGE_CLEAN_UP:
        spl_incoming_abort(incoming);
    }
}

static void hand_to_device(struct change *change, struct spl_catalog_slot *slot)
{
    struct spl_catalog_entry *entry = change->entry;
    change->entry = NULL;
    slot->next = change->loading = entry;
    spl_fleet_add(change->service->views->fleet, entry);
}

static void serve(struct change *change, struct spl_catalog_slot *slot)
{
    struct spl_catalog_entry *entry = change->entry;
    change->entry = NULL;
    slot->opened = slot->seen = change->mark;
    spl_library_serve(slot, entry);
    if (change->request) {
        spl_reply_json(change->request, spl_describe_dataset(entry, true));
        change->request->status = change->fresh ? MHD_HTTP_CREATED : MHD_HTTP_OK;
        if (change->request->response)
            MHD_add_response_header(change->request->response, MHD_HTTP_HEADER_LOCATION, entry->uri);
    }
    spl_change_finish(change);
}

static void remove_slot(struct change *change, struct spl_catalog_slot *slot)
{
    spl_log_info("dataset %s: removed by a client, no longer served", change->id);
    if (slot)
        spl_catalog_remove_slot(&change->service->library->catalog, slot);
    if (change->request)
        spl_reply_empty(change->request);
    spl_change_finish(change);
}

/* The part of the body that came is stored, and was not the last. */
static void go_on(struct change *change)
{
    if (!change->request) {
        spl_change_finish(change);
        return;
    }
    change->stepped_ns = spl_now_ns(); // the client is not to blame for how long the disk took
    spl_connection_enter(change->request->connection, PHASE_UPLOADING);
    spl_request_resume(change->request);
}

static void after_step(uv_work_t *work, int status)
{
    (void)status;
    struct change *change = work->data;
    struct spl_service *service = change->service;
    struct spl_catalog_slot *slot = spl_catalog_find_slot(&service->library->catalog, change->id);
    bool last = change->step == SPL_CHANGE_CLEAN_UP;
    change->working = false;
    service->library->tasks--;
    if (last)
        destroy(change);
    else if (change->err.code)
        fail(change);
    else if (change->step == SPL_CHANGE_REMOVE)
        remove_slot(change, slot);
    else if (change->step == SPL_CHANGE_APPEND)
        go_on(change);
    else if (!slot || service->library->stopped)
        spl_change_finish(change);
    else if (change->step == SPL_CHANGE_CHECK)
        hand_to_device(change, slot);
    else
        serve(change, slot);
    if (!last)
        spl_http_pump(service);
}

void spl_change_run(struct change *change, enum spl_change_step step)
{
    struct spl_service *service = change->service;
    change->work.data = change;
    change->step = step;
    if (uv_queue_work(&service->loop, &change->work, run_step, after_step)) {
        if (step == SPL_CHANGE_CLEAN_UP) {
            run_step(&change->work);
            destroy(change);
            return;
        }
        spl_fail(&change->err, SPL_E_NOMEM, "no thread takes the dataset");
        fail(change);
        return;
    }
    change->working = true;
    service->library->tasks++;
    if (!change->request)
        return;
    spl_connection_enter(change->request->connection, PHASE_WORKING);
    spl_request_suspend(change->request);
}

bool spl_change_take_answer(struct spl_service *service, struct spl_catalog_entry *entry)
{
    struct change *change;
    LIST_FOREACH(change, &service->library->changes, link)
    if (change->loading == entry)
        break;
    if (!change)
        return false;
    change->loading = NULL;
    change->entry = entry;
    change->err = entry->err;
    if (change->err.code)
        fail(change);
    else if (service->library->stopped)
        spl_change_finish(change);
    else
        spl_change_run(change, SPL_CHANGE_PLACE);
    spl_http_pump(service);
    return true;
}

void spl_change_abandon(struct request *request)
{
    struct change *change = request->change;
    if (!change)
        return;
    request->change = NULL;
    change->request = NULL;
    if (!change->working && !change->loading)
        spl_change_finish(change);
}

void spl_change_refuse_all(struct spl_service *service)
{
    struct change *change, *next;
    for (change = LIST_FIRST(&service->library->changes); change; change = next) {
        next = LIST_NEXT(change, link);
        struct request *request = change->request;
        if (!request || !request->suspended)
            continue;
        struct spl_error err = {0};
        spl_fail(&err, SPL_E_CANCELLED, "the service is stopping; what there was is unchanged, send the dataset again");
        spl_reply_error(request, &err);
        spl_change_abandon(request);
        spl_request_resume(request);
    }
    spl_http_pump(service);
}

void spl_change_forget_all(struct spl_service *service)
{
    for (struct change *change; (change = LIST_FIRST(&service->library->changes));) {
        spl_assert(!change->working && !change->request);
        spl_incoming_abort(&change->incoming);
        destroy(change);
    }
}
