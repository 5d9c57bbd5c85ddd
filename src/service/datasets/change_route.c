/* PUT and DELETE of datasets. A body of any size goes to disk a buffer at a time: while a thread of the pool writes,
 * the connection is suspended, so the client is no faster than the disk and the loop never waits for it.
 *
 *     PUT:     begin → append … append → commit (sync, verify, rename, open) → made resident → reply
 *     DELETE:  remove → reply
 *
 * Invariants: a change has its slot to itself (slot->busy) until it ends; `suspended` is set exactly while the request
 * is suspended for it; a change whose client has left loses its request, ends its step, cleans up and frees itself. The
 * functions run_* are the pool's, everything else the loop's. */
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/log.h"
#include "base/memory.h"
#include "service/datasets/store.h"
#include "service/state.h"

enum { step_bytes = 1 << 20, changes_max = 4 };

struct change {
    LIST_ENTRY(change) link; // library.changes
    uv_work_t work;
    struct spl_service *service;
    struct request *request; // NULL once the client has left
    char id[sizeof((struct spl_catalog_slot *)0)->id];
    char *target;                 /* path of the dataset's file */
    bool removing, fresh;         /* DELETE; there was no such dataset */
    bool working, suspended;      /* a thread has it; the request waits */
    bool ended;                   /* the whole body was seen */
    uint64_t seen;                /* bytes of the body */
    struct spl_incoming incoming; // owned by: the pool while `working`, as are the rest
    char *buffer;
    size_t filled, capacity;
    struct spl_file_mark mark;
    struct spl_catalog_entry *entry;         // may be NULL
    const struct spl_catalog_entry *loading; // may be NULL; handed to the gpu thread
    struct spl_error err;
};

static void reply_conflict(struct request *request, const char *detail)
{
    spl_reply_problem(request, MHD_HTTP_CONFLICT, "conflict", "id", detail);
}

static void resume(struct change *change)
{
    if (!change->suspended)
        return;
    change->suspended = false;
    spl_connection_enter(change->request->connection, PHASE_UPLOADING);
    MHD_resume_connection(change->request->handle);
}

/* Ends a change: gives the slot back and frees it. */
static void finish(struct change *change)
{
    struct spl_catalog *catalog = &change->service->catalog;
    struct spl_catalog_slot *slot = spl_catalog_find_slot(catalog, change->id);
    spl_assert(!change->working && !change->suspended);
    if (slot && !change->loading) {
        slot->busy = false;
        if (!slot->current && !slot->reason[0] && !slot->opened.inode)
            spl_catalog_remove_slot(catalog, slot); // it was made for this
    }
    if (change->request)
        change->request->change = NULL;
    spl_incoming_abort(&change->incoming);
    spl_catalog_entry_unref(change->entry);
    change->service->library.changes_made++;
    LIST_REMOVE(change, link);
    free(change->buffer);
    free(change->target);
    free(change);
}

static void answer_error(struct change *change)
{
    const struct spl_error *err = &change->err;
    if (change->incoming.no_room)
        spl_reply_problem(change->request, MHD_HTTP_INSUFFICIENT_STORAGE, "storage", "body", err->message);
    else if (err->code == SPL_E_CORRUPT || err->code == SPL_E_INPUT || err->code == SPL_E_UNSUPPORTED)
        spl_reply_problem(change->request, MHD_HTTP_UNPROCESSABLE_CONTENT, "input", "body", err->message);
    else
        spl_reply_error(change->request, err);
}

/* With the reply set, or without one when memory is out. */
static void answer(struct change *change)
{
    struct request *request = change->request;
    if (request) {
        resume(change);
        change->request = NULL;
        request->change = NULL;
    }
    finish(change);
}

static void run_step(uv_work_t *work)
{
    struct change *change = work->data;
    struct spl_incoming *incoming = &change->incoming;
    struct spl_error *err = &change->err;
    if (change->removing) {
        spl_stored_remove(change->target, err);
        return;
    }
    if (!incoming->path)
        spl_incoming_begin(incoming, change->target, err);
    if (!err->code && !spl_incoming_append(incoming, change->buffer, change->filled, err) && change->ended)
        spl_incoming_commit(incoming, change->target, &change->service->library.cancelled, &change->entry,
                            &change->mark, err);
    change->filled = 0;
}

static void put_in_slot(struct change *change, struct spl_catalog_slot *slot)
{
    slot->opened = slot->seen = change->mark;
    slot->next = change->loading = change->entry;
    spl_pipeline_add(change->service->pipeline, change->entry);
    change->entry = NULL;
}

static void after_step(uv_work_t *work, int status)
{
    (void)status;
    struct change *change = work->data;
    struct spl_service *service = change->service;
    struct request *request = change->request;
    struct spl_catalog_slot *slot = spl_catalog_find_slot(&service->catalog, change->id);
    change->working = false;
    service->library.tasks--;
    if (!request && !change->entry && !change->removing) {
        finish(change);
    } else if (change->err.code) {
        if (request)
            answer_error(change);
        answer(change);
    } else if (change->removing) {
        spl_log_info("dataset %s: removed by a client, no longer served", change->id);
        if (slot)
            spl_catalog_remove_slot(&service->catalog, slot);
        if (request)
            spl_reply_empty(request, MHD_HTTP_NO_CONTENT);
        answer(change);
    } else if (change->entry && slot && !service->library.stopped) {
        put_in_slot(change, slot); // the client may have left: what is in place stays
        if (!request)
            finish(change);
    } else if (change->entry) {
        answer(change);
    } else {
        resume(change);
    }
    spl_http_pump(service);
}

/* Hands the change to the pool; the request waits. */
static void step(struct change *change)
{
    struct spl_service *service = change->service;
    change->work.data = change;
    if (uv_queue_work(&service->loop, &change->work, run_step, after_step)) {
        spl_fail(&change->err, SPL_E_NOMEM, "no thread takes the dataset");
        answer_error(change);
        answer(change);
        return;
    }
    change->working = change->suspended = true;
    service->library.tasks++;
    spl_connection_enter(change->request->connection, PHASE_WORKING);
    MHD_suspend_connection(change->request->handle);
}

void spl_change_settle(struct spl_service *service, struct spl_catalog_entry *entry, const struct spl_error *refused)
{
    struct change *change;
    LIST_FOREACH(change, &service->library.changes, link)
    if (change->loading == entry)
        break;
    if (!change)
        return;
    change->loading = NULL;
    if (refused && change->request) {
        spl_reply_error(change->request, refused);
    } else if (change->request) {
        spl_reply_json(change->request, spl_describe_dataset(entry, true));
        change->request->status = change->fresh ? MHD_HTTP_CREATED : MHD_HTTP_OK;
        if (change->request->response)
            MHD_add_response_header(change->request->response, MHD_HTTP_HEADER_LOCATION, entry->uri);
    }
    answer(change);
    spl_http_pump(service);
}

/* The slot that the change may have, made where there is none; NULL when the request has its reply. */
static struct spl_catalog_slot *claim(struct request *request, const char *id, bool make)
{
    struct spl_service *service = request->service;
    struct spl_catalog_slot *slot = spl_catalog_find_slot(&service->catalog, id);
    struct change *change;
    struct spl_error err = {0};
    size_t changes = 0;
    LIST_FOREACH(change, &service->library.changes, link)
    changes++;
    if (service->draining || changes == changes_max || (slot && slot->busy)) {
        spl_fail_field(&err, SPL_E_BUSY, "id", "dataset '%s' is being changed, or too many others are; come back later",
                       id);
    } else if (slot && !slot->in_directory) {
        reply_conflict(request, "this dataset's file was named itself when the service was started, so only its "
                                "operator changes it");
        return NULL;
    } else if (!slot && !make) {
        spl_fail_field(&err, SPL_E_NOT_FOUND, "id", "there is no dataset '%s'; /v1/datasets lists them", id);
    } else if (!slot && !service->library.directory) {
        reply_conflict(request,
                       "the service was started without a directory of datasets, so there is no place for new ones");
        return NULL;
    } else if (!slot) {
        char *path = NULL;
        if (asprintf(&path, "%s/%s.spld", service->library.directory, id) < 0)
            path = NULL;
        if (path && (slot = spl_catalog_add_slot(&service->catalog, id, path, &err)))
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

static struct change *begin(struct request *request, const struct spl_call *call, bool removing)
{
    struct spl_service *service = request->service;
    if (!spl_catalog_id_is_valid(call->id, strlen(call->id))) {
        spl_reply_problem(request, MHD_HTTP_BAD_REQUEST, "input", "id",
                          "an id has at most 127 letters, digits, '.', '_' and '-', the first of them not a '.'");
        return NULL;
    }
    struct spl_catalog_slot *slot = claim(request, call->id, !removing);
    if (!slot)
        return NULL;
    struct change *change = spl_alloc(1, sizeof *change, NULL);
    if (!change || !(change->target = strdup(slot->path))) {
        free(change);
        struct spl_error err = {0};
        spl_reply_error(request, (spl_fail(&err, SPL_E_NOMEM, "out of memory for a dataset"), &err));
        return NULL;
    }
    change->service = service;
    change->request = request;
    change->removing = removing;
    change->fresh = !slot->current;
    memcpy(change->id, slot->id, sizeof change->id);
    LIST_INSERT_HEAD(&service->library.changes, change, link);
    slot->busy = true;
    request->change = change;
    return change;
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
    struct change *change = begin(request, call, false);
    if (!change || !spl_store_check_room(change->target, announced, &change->err))
        return;
    spl_reply_problem(request, MHD_HTTP_INSUFFICIENT_STORAGE, "storage", "body", change->err.message);
    finish(change);
}

void spl_delete_dataset(struct request *request, const struct spl_call *call)
{
    struct change *change = begin(request, call, true);
    if (change)
        step(change);
}

bool spl_change_take(struct request *request, const char *data, size_t length)
{
    struct change *change = request->change;
    change->seen += length;
    if (change->seen > request->service->options->max_upload) {
        refuse_size(request, change->seen);
        finish(change);
        return true;
    }
    if (change->filled + length > change->capacity) {
        size_t capacity = change->filled + length > step_bytes ? change->filled + length : step_bytes;
        char *grown = spl_realloc(change->buffer, capacity, 1, NULL);
        if (!grown)
            return false;
        change->buffer = grown;
        change->capacity = capacity;
    }
    memcpy(change->buffer + change->filled, data, length);
    change->filled += length;
    if (change->filled >= step_bytes)
        step(change);
    return true;
}

void spl_change_end(struct request *request)
{
    if (request->change->ended)
        return; // of a DELETE, or called again
    request->change->ended = true;
    if (!request->change->removing)
        step(request->change);
}

void spl_change_abandon(struct request *request)
{
    struct change *change = request->change;
    if (!change)
        return;
    request->change = NULL;
    change->request = NULL;
    change->suspended = false;
    if (!change->working && !change->loading)
        finish(change);
}

void spl_change_refuse_all(struct spl_service *service)
{
    struct change *change, *next;
    for (change = LIST_FIRST(&service->library.changes); change; change = next) {
        next = LIST_NEXT(change, link);
        struct request *request = change->request;
        if (!request || !change->suspended)
            continue;
        request->abandoned = true;
        resume(change);
        spl_change_abandon(request);
    }
    spl_http_pump(service);
}
