/* One view of a dataset: checked, then handed to the pipeline. Owned by the loop's thread. */
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "service/state.h"

static int parse_view(struct request *request, const struct spl_catalog_entry *entry, bool post,
                      struct spl_view_request *view, struct spl_error *err)
{
    struct spl_camera_limits limits = {.side_px = SPL_SERVICE_SIDE_MAX,
                                       .pixels = request->service->options->pixels_max};
    int rc =
        post
            ? spl_view_request_from_json(request->body, request->body_length, &entry->defaults, &limits, view, err)
            : spl_view_request_from_query(request->query, strlen(request->query), &entry->defaults, &limits, view, err);
    if (rc && rc != SPL_E_NOMEM)
        err->code = SPL_E_INPUT; // whatever is wrong with a view is the client's to change
    return rc;
}

void spl_make_view(struct request *request, const struct spl_call *call)
{
    const struct spl_catalog_entry *entry = call->entry;
    struct spl_service *service = request->service;
    struct spl_error err = {0};
    struct spl_view_request view;
    struct spl_job *job = NULL;
    if (parse_view(request, entry, call->method == SPL_POST, &view, &err))
        goto refuse;
    if (service->reply_bytes > reply_bytes_max) {
        spl_fail(&err, SPL_E_BUSY, "%zu bytes of images wait for slow clients; come back later", service->reply_bytes);
        goto refuse;
    }
    if (!(job = spl_alloc(1, sizeof *job, &err)))
        goto refuse;
    job->entry = spl_catalog_entry_ref(call->entry);
    job->dataset = entry->dataset;
    job->plan = entry->plan;
    job->request = view;
    job->accepted_ns = spl_now_ns();
    job->deadline_ns = job->accepted_ns + service->options->deadline_ms * SPL_NS_PER_MS;
    job->owner = request;
    if (!spl_pipeline_submit(service->pipeline, job, &err)) {
        spl_waiting_add(request, job);
        return;
    }
    spl_count(&service->counters, refused_full);
refuse:
    spl_job_destroy(job);
    spl_reply_error(request, &err);
}
