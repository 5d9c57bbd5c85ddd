/* PUT and DELETE of a view by name: checked, written by the pool, then in use, then the reply. One that ends in an
 * error has changed nothing.
 *
 * Invariant: a saving belongs to the pool until after(), whether its request still waits or not; of a dataset one runs
 * at a time. Owned by the loop's thread, but for run(). */
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/file.h"
#include "base/memory.h"
#include "dataset/saved_views.h"
#include "service/datasets/library.h"
#include "service/datasets/saved.h"
#include "service/exchange.h"
#include "service/http.h"
#include "service/reply.h"
#include "service/request/body.h"
#include "service/state.h"
#include "service/view/views.h"

enum { values_max = 64 };

struct spl_saving {
    uv_work_t work;
    struct request *request; // NULL once it has been given up
    struct spl_service *service;
    struct spl_catalog_entry *entry; /* a reference */
    struct spl_saved_view view;
    bool removes, fresh;
    char *text; /* of the file */
    struct spl_error err;
};

static void run(uv_work_t *work)
{
    struct spl_saving *saving = work->data;
    const char *path = spl_saved_get_path(saving->entry->saved);
    struct spl_error why = {0};
    spl_file_sweep_beside(path); /* what a kill left in the middle of this */
    int rc = spl_file_replace(path, saving->text, strlen(saving->text), &why);
    if (!rc && spl_file_sync_folder(path))
        rc = spl_fail_errno(&why, errno, "cannot sync the folder");
    if (rc) { // without the folder: clients read it
        char text[sizeof why.message];
        spl_catalog_hide_folder(text, sizeof text, why.message, path);
        spl_fail(&saving->err, rc, "the view is not saved: %s", text);
    }
}

static json_t *describe(const struct spl_saving *saving)
{
    json_t *json = spl_saved_view_to_json(&saving->view);
    json_object_set_new(json, "from", json_string("service"));
    return json;
}

static void after(uv_work_t *work, int status)
{
    (void)status;
    struct spl_saving *saving = work->data;
    struct spl_service *service = saving->service;
    struct request *request = saving->request;
    struct spl_catalog_entry *entry = saving->entry;
    const struct spl_saved_view *view = saving->removes ? NULL : &saving->view;
    const struct spl_catalog_slot *slot = spl_catalog_find_slot(&service->library->catalog, entry->info->id);
    if (!saving->err.code) {
        spl_saved_apply(entry->saved, saving->view.name, view);
        if (slot && slot->current && slot->current != entry)
            spl_saved_apply(slot->current->saved, saving->view.name, view);
    }
    entry->saving = false;
    if (request) {
        request->saving = NULL;
        spl_waiting_resume(request);
        if (saving->err.code) {
            spl_reply_error(request, &saving->err);
        } else if (saving->removes) {
            spl_reply_empty(request);
        } else {
            spl_reply_json(request, describe(saving));
            request->status = saving->fresh ? MHD_HTTP_CREATED : MHD_HTTP_OK;
        }
        spl_http_pump(service);
    }
    spl_catalog_entry_unref(entry);
    service->library->tasks--;
    free(saving->text);
    free(saving);
}

void spl_saving_abandon(struct spl_saving *saving)
{
    if (!saving)
        return;
    saving->request->saving = NULL;
    saving->request = NULL;
}

/* May views of the dataset be saved? A file that was named itself lies in a folder that is not the service's. */
static bool may_change(struct request *request, const struct spl_call *call)
{
    struct spl_service *service = request->service;
    const struct spl_catalog_slot *slot = spl_catalog_find_slot(&service->library->catalog, call->id);
    struct spl_error err = {0};
    if (!spl_view_name_is_valid(call->name)) {
        spl_fail_field(&err, SPL_E_INPUT, "name", "a view's name has " SPL_VIEW_NAME_FORMS);
    } else if (!call->entry || !slot) {
        spl_fail_field(&err, SPL_E_NOT_FOUND, "id", "there is no dataset '%s'; /v1/datasets lists them", call->id);
    } else if (!slot->in_directory) {
        spl_reply_problem(
            request, MHD_HTTP_CONFLICT, "conflict", "id",
            "this dataset's file was named itself when the service was started, so only its operator puts "
            "views beside it");
        return false;
    } else if (service->draining || slot->busy || call->entry->saving) {
        spl_fail_field(&err, SPL_E_BUSY, "id", "dataset '%s' is being changed; come back later", call->id);
    }
    if (err.code) {
        spl_reply_error(request, &err);
        return false;
    }
    bool own;
    return spl_check_conditions(request, spl_saved_has(call->entry->saved, call->name, &own) ? "" : NULL);
}

static void begin(struct request *request, const struct spl_call *call, const struct spl_saved_view *view, bool removes,
                  bool fresh)
{
    struct spl_service *service = request->service;
    struct spl_error err = {0};
    struct spl_saving *saving = spl_alloc(1, sizeof *saving, &err);
    if (!saving || spl_saved_prepare(call->entry->saved, view->name, removes ? NULL : view, &saving->text, &err)) {
        if (err.code == SPL_E_CORRUPT)
            spl_reply_problem(request, MHD_HTTP_CONFLICT, "conflict", "id", err.message);
        else
            spl_reply_error(request, &err);
        free(saving);
        return;
    }
    saving->work.data = saving;
    saving->request = request;
    saving->service = service;
    saving->entry = spl_catalog_entry_ref(call->entry);
    saving->view = *view;
    saving->removes = removes;
    saving->fresh = fresh;
    call->entry->saving = true;
    request->saving = saving;
    service->library->tasks++;
    spl_waiting_add(request, spl_now_ns() + service->options->deadline_ms * SPL_NS_PER_MS);
    uv_queue_work(&service->loop, &saving->work, run, after); // fails without a callback only
}

/* May what it shows be asked for of this dataset? */
static int check_settings(struct request *request, const struct spl_call *call, const struct spl_saved_view *view,
                          struct spl_error *err)
{
    struct spl_view_request shown;
    const struct spl_camera_limits limits = spl_view_get_limits(request->service);
    int rc = spl_view_request_from_saved(view, &call->entry->defaults, &limits, &shown, err);
    if (rc)
        return spl_view_blame(err);
    return spl_view_check_part(&shown, call->entry->info, "settings", err);
}

/* Called before the body, as every PUT is, and again when that is there. */
void spl_put_saved_view(struct request *request, const struct spl_call *call)
{
    struct spl_saved_view view;
    struct spl_error err = {0};
    if (!may_change(request, call))
        return;
    if (!request->wants_body) {
        request->wants_body = true;
        return;
    }
    json_t *json = spl_body_parse(request->body, request->body_length, values_max, SPL_BODY_TEXT, &err);
    int rc = json ? spl_saved_view_from_json(json, call->entry->info->default_up, false, true, &view, &err)
                  : SPL_E_INPUT;
    json_decref(json);
    if (rc || (rc = check_settings(request, call, &view, &err))) {
        spl_reply_error(request, &err);
        return;
    }
    bool own;
    strcpy(view.name, call->name); // it is valid, so it fits
    begin(request, call, &view, false, !spl_saved_has(call->entry->saved, view.name, &own));
}

void spl_delete_saved_view(struct request *request, const struct spl_call *call)
{
    struct spl_saved_view view = {0};
    bool own;
    if (!may_change(request, call))
        return;
    if (!spl_saved_has(call->entry->saved, call->name, &own)) {
        struct spl_error err = {0};
        spl_fail_field(&err, SPL_E_NOT_FOUND, "name", "dataset '%s' has no view '%s'", call->id, call->name);
        spl_reply_error(request, &err);
        return;
    }
    if (!own) {
        spl_reply_problem(request, MHD_HTTP_CONFLICT, "conflict", "name",
                          "the dataset was packed with this view; another pack leaves it out");
        return;
    }
    strcpy(view.name, call->name);
    begin(request, call, &view, true, false);
}
