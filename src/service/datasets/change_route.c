/* PUT and DELETE of datasets over HTTP. A body of any size goes to disk a buffer at a time: while a thread of the pool
 * writes, the request waits, so the client is no faster than the disk and the loop never waits for it. What becomes of
 * it is change.c's. Owned by the loop's thread. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/array.h"
#include "base/clock.h"
#include "service/datasets/change.h"
#include "service/exchange.h"
#include "service/http.h"
#include "service/ops/counters.h"
#include "service/reply.h"
#include "service/state.h"

enum { step_bytes = 1 << 20, changes_max = 4, slow_bytes = 256 << 10, patience_s = 5 };

static void reply_conflict(struct request *request, const char *detail)
{
    spl_reply_problem(request, MHD_HTTP_CONFLICT, "conflict", "id", detail);
}

static size_t count_changes(struct spl_service *service)
{
    struct change *change;
    size_t count = 0;
    LIST_FOREACH(change, &service->library->changes, link)
    count++;
    return count;
}

/* Of bodies that others wait for, the one that has dawdled longest is cut, as those are that are kept in memory
 * (bodies.c). Its place is free once what there is of its file has been removed. */
static void cut_dawdler(struct spl_service *service)
{
    struct change *change, *slowest = NULL;
    uint64_t before = spl_now_ns() - patience_s * SPL_NS_PER_S;
    LIST_FOREACH(change, &service->library->changes, link)
    {
        if (!change->request) // its place is free soon
            return;
        bool comes = change->step == SPL_CHANGE_APPEND && !change->working;
        if (comes && change->stepped_ns < (slowest ? slowest->stepped_ns : before))
            slowest = change;
    }
    if (!slowest)
        return;
    spl_count(service->counters, slow_closed);
    spl_refuse_on_socket(slowest->request, MHD_HTTP_REQUEST_TIMEOUT, "body",
                         "the body comes too slowly to keep its place among uploads, which another wants");
    spl_change_abandon(slowest->request);
}

/* The slot that the change may have, made where there is none; NULL when the request has its reply. */
static struct spl_catalog_slot *claim(struct request *request, const char *id, bool make)
{
    struct spl_service *service = request->service;
    struct spl_catalog_slot *slot = spl_catalog_find_slot(&service->library->catalog, id);
    struct spl_error err = {0};
    char tag[24] = "";
    if (slot && slot->current)
        snprintf(tag, sizeof tag, "\"%016llx\"", (unsigned long long)slot->current->info->version);
    const bool busy = slot && (slot->busy || (slot->current && slot->current->saving));
    if (service->draining || busy) {
        spl_fail_field(&err, SPL_E_BUSY, "id", "dataset '%s' is being changed; come back later", id);
    } else if (slot && !slot->in_directory) {
        reply_conflict(request, "this dataset's file was named itself when the service was started, so only its "
                                "operator changes it");
        return NULL;
    } else if (!slot && !make) {
        spl_fail_field(&err, SPL_E_NOT_FOUND, "id", "there is no dataset '%s'; /v1/datasets lists them", id);
    } else if (!slot && !service->library->directory) {
        reply_conflict(request,
                       "the service was started without a directory of datasets, so there is no place for new ones");
        return NULL;
    } else if (!spl_check_conditions(request, slot ? tag : NULL)) {
        return NULL;
    } else if (!slot) {
        char *path = NULL;
        if (asprintf(&path, "%s/%s.spld", service->library->directory, id) < 0)
            path = NULL;
        if (path && (slot = spl_catalog_add_slot(&service->library->catalog, id, path, &err)))
            slot->in_directory = true;
        else if (!path)
            spl_fail(&err, SPL_E_NOMEM, "out of memory for a path");
        free(path);
    }
    if (err.code) {
        spl_reply_error(request, &err);
        return NULL;
    }
    return slot;
}

static struct change *begin(struct request *request, const struct spl_call *call, bool make)
{
    if (!spl_catalog_id_is_valid(call->id, strlen(call->id))) {
        spl_reply_problem(request, MHD_HTTP_BAD_REQUEST, "input", "id",
                          "an id has at most " SPL_CATALOG_ID_RULE);
        return NULL;
    }
    const char *ending = strrchr(call->id, '.');
    if (make && ending && !strcasecmp(ending, ".spld")) { /* as 'curl -T hall.spld URL/' makes of a folder's URL */
        char detail[256];
        snprintf(detail, sizeof detail, "the id is the file's name without .spld: PUT /v1/datasets/%.*s",
                 (int)(ending - call->id), call->id);
        spl_reply_problem(request, MHD_HTTP_BAD_REQUEST, "input", "id", detail);
        return NULL;
    }
    struct spl_catalog_slot *slot = claim(request, call->id, make);
    if (!slot)
        return NULL;
    struct change *change = spl_change_begin(request, slot);
    struct spl_error err = {0};
    if (!change)
        spl_reply_error(request, (spl_fail(&err, SPL_E_NOMEM, "out of memory for a dataset"), &err));
    return change;
}

/* Last of all, so that nobody gives way to a change that is refused for anything else. False: it is, and has ended. */
static bool find_place(struct change *change)
{
    struct spl_service *service = change->service;
    struct spl_error err = {0};
    if (count_changes(service) > changes_max) // with this one
        cut_dawdler(service);
    if (count_changes(service) <= changes_max)
        return true;
    spl_fail_field(&err, SPL_E_BUSY, "id", "%d datasets are being changed; come back later", (int)changes_max);
    spl_reply_error(change->request, &err);
    spl_change_finish(change);
    return false;
}

static void refuse_size(struct request *request, uint64_t bytes)
{
    char detail[128];
    snprintf(detail, sizeof detail, "the body has %llu bytes or more, the service takes %llu",
             (unsigned long long)bytes, (unsigned long long)request->service->options->max_upload);
    spl_reply_problem(request, MHD_HTTP_CONTENT_TOO_LARGE, "limit", "body", detail);
}

/* Called when the headers are there; the body comes through spl_change_take(). */
void spl_put_dataset(struct request *request, const struct spl_call *call)
{
    const char *length = MHD_lookup_connection_value(request->handle, MHD_HEADER_KIND, MHD_HTTP_HEADER_CONTENT_LENGTH);
    uint64_t announced = length ? strtoull(length, NULL, 10) : 0;
    if (announced > request->service->options->max_upload) {
        refuse_size(request, announced);
        return;
    }
    struct change *change = begin(request, call, true);
    if (!change)
        return;
    if (!spl_store_check_room(change->target, announced, &change->err)) {
        find_place(change);
        return;
    }
    spl_reply_problem(request, MHD_HTTP_INSUFFICIENT_STORAGE, "storage", "body", change->err.message);
    spl_change_finish(change);
}

void spl_delete_dataset(struct request *request, const struct spl_call *call)
{
    struct change *change = begin(request, call, false);
    if (change && find_place(change))
        spl_change_run(change, SPL_CHANGE_REMOVE);
}

bool spl_change_take(struct request *request, const char *data, size_t length)
{
    struct change *change = request->change;
    spl_assert(!change->working);
    change->seen += length;
    if (change->seen / slow_bytes != change->steps) {
        change->steps = change->seen / slow_bytes;
        change->stepped_ns = spl_now_ns();
    }
    if (change->seen > request->service->options->max_upload) {
        refuse_size(request, change->seen);
        spl_change_finish(change);
        return true;
    }
    size_t wanted = change->filled + length, usual = step_bytes + connection_pool;
    if (spl_array_reserve(change->buffer, change->capacity, wanted > usual ? wanted : usual, NULL))
        return false;
    memcpy(change->buffer + change->filled, data, length);
    change->filled += length;
    if (change->filled >= step_bytes)
        spl_change_run(change, SPL_CHANGE_APPEND);
    return true;
}

void spl_change_end(struct request *request)
{
    if (request->change->step == SPL_CHANGE_APPEND)
        spl_change_run(request->change, SPL_CHANGE_CHECK);
}
