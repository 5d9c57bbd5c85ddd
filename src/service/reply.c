/* Replies: JSON, RFC 9457 problems, and encoded views with the headers that say what their pixels mean.
 *
 * Bytes of a view are handed to MHD as they came from the encoder, without a copy. Owned by the loop's thread. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/log.h"
#include "base/memory.h"
#include "service/state.h"

static void header(struct request *request, const char *name, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

static void header(struct request *request, const char *name, const char *format, ...)
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
        header(request, MHD_HTTP_HEADER_CONTENT_TYPE, "%s", type);
}

void spl_reply_text(struct request *request, const char *type, char *body)
{
    set_text(request, MHD_HTTP_OK, type, body);
}

void spl_reply_json(struct request *request, json_t *json)
{
    char *text = json ? json_dumps(json, JSON_INDENT(1) | JSON_REAL_PRECISION(17)) : NULL;
    json_decref(json);
    set_text(request, MHD_HTTP_OK, "application/json", text);
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

void spl_reply_problem(struct request *request, unsigned status, const char *type, const char *field,
                       const char *detail)
{
    json_t *json = json_pack("{s:o, s:s, s:i, s:o, s:o}", "type", json_sprintf("urn:splatd:error:%s", type), "title",
                             MHD_get_reason_phrase_for(status), "status", (int)status, "detail", outside_text(detail),
                             "instance", json_sprintf("urn:splatd:request:%s", request->id));
    if (json && field[0])
        json_object_set_new(json, "field", outside_text(field));
    char *text = json ? json_dumps(json, JSON_INDENT(1)) : NULL;
    json_decref(json);
    set_text(request, status, "application/problem+json", text);
}

void spl_reply_error(struct request *request, const struct spl_error *err)
{
    const struct spl_code_info *info = spl_code_get_info(err->code);
    if (info->http_status >= 500 && !info->retry && spl_access_log_admit(request->service))
        spl_log_error("request %s: %s", request->id, err->message);
    // 413 is about bodies; a parameter beyond a limit is the client's to change, like any other
    unsigned status = err->code == SPL_E_LIMIT && err->field[0] ? MHD_HTTP_BAD_REQUEST : (unsigned)info->http_status;
    spl_reply_problem(request, status, info->name, err->field, err->message);
    if (request->response && info->retry)
        header(request, MHD_HTTP_HEADER_RETRY_AFTER, "%u", spl_pipeline_get_retry_after(request->service->pipeline));
}

static void add_camera(struct request *request, const struct spl_camera *camera)
{
    const double *r = camera->rotation, *eye = camera->eye;
    char far[32] = "null"; // JSON has no infinity
    if (isfinite(camera->far))
        snprintf(far, sizeof far, "%.9g", camera->far);
    header(request, "Splatd-Camera",
           "{\"eye\":[%.17g,%.17g,%.17g],\"rotation\":[%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g],"
           "\"fx\":%.17g,\"fy\":%.17g,\"cx\":%.17g,\"cy\":%.17g,\"width\":%u,\"height\":%u,\"near\":%.9g,\"far\":%s}",
           eye[0], eye[1], eye[2], r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8], camera->fx, camera->fy,
           camera->cx, camera->cy, camera->width, camera->height, camera->near, far);
}

static void add_depth(struct request *request, const struct spl_job *job)
{
    const struct spl_view_request *view = &job->request;
    if (view->layer != SPL_LAYER_DEPTH && view->layer != SPL_LAYER_RANGE)
        return;
    header(request, "Splatd-Depth-Unit", "m");
    switch (view->encode.format) {
    case SPL_FORMAT_PNG:
        header(request, "Splatd-Depth-Scale", "%.17g", view->encode.depth_scale);
        header(request, "Splatd-Depth-Invalid", "0");
        header(request, "Splatd-Depth-Saturated", "%llu", (unsigned long long)job->encoded.saturated);
        break;
    case SPL_FORMAT_JPEG:
        header(request, "Splatd-Depth-Near", "%.9g", (double)job->encoded.near);
        header(request, "Splatd-Depth-Far", "%.9g", (double)job->encoded.far);
        break;
    default:
        header(request, "Splatd-Depth-Scale", "1");
        header(request, "Splatd-Depth-Invalid", "NaN");
        break;
    }
}

/* What was chosen, what was promised, what it took. Such bytes depend on how busy the machine was: nobody keeps them.
 */
static void add_plan(struct request *request, const struct spl_job *job)
{
    const struct spl_choice *choice = &job->choice;
    uint64_t now = spl_now_ns();
    if (job->plan)
        spl_plan_learn_reply(job->plan, &job->request, (double)(now - job->rendered_ns) / SPL_NS_PER_MS);
    if (!job->plan || !job->request.planned)
        return;
    double took_ms = (double)(now - job->began_ns) / SPL_NS_PER_MS;
    bool late = took_ms > SPL_BUDGET_TOLERANCE * job->request.demand.budget_ms; // false without a budget
    char psnr[32] = "";
    if (isfinite(choice->psnr))
        snprintf(psnr, sizeof psnr, "; psnr=%.2f", choice->psnr);
    header(request, "Splatd-Chosen", "method=%s; lod=%g; supersample=%g", spl_method_name(choice->setting.method),
           choice->setting.lod, choice->setting.supersample);
    header(request, "Splatd-Promised", "ms=%.2f%s", job->promised_ms, psnr);
    header(request, "Splatd-Took", "ms=%.2f", took_ms);
    header(request, "Splatd-Demand", "%s", !choice->meets ? "best-effort" : late ? "missed" : "met");
    header(request, MHD_HTTP_HEADER_CACHE_CONTROL, "no-store");
}

/* Encoded bytes on their way to a client. */
struct outgoing {
    struct spl_service *service;
    struct spl_encoded encoded;
};

static void release_outgoing(void *context)
{
    struct outgoing *outgoing = context;
    outgoing->service->reply_bytes -= outgoing->encoded.length;
    spl_encoded_finish(&outgoing->encoded);
    free(outgoing);
}

void spl_reply_view(struct request *request, struct spl_job *job)
{
    struct spl_pipeline_status status;
    struct outgoing *outgoing = spl_alloc(1, sizeof *outgoing, NULL);
    if (!outgoing)
        return;
    request->status = MHD_HTTP_OK;
    request->response = MHD_create_response_from_buffer_with_free_callback_cls(job->encoded.length, job->encoded.bytes,
                                                                               release_outgoing, outgoing);
    if (!request->response) {
        free(outgoing);
        return;
    }
    *outgoing = (struct outgoing){request->service, job->encoded};
    request->service->reply_bytes += job->encoded.length;
    header(request, MHD_HTTP_HEADER_CONTENT_TYPE, "%s", job->encoded.media_type);
    const struct spl_frame_stats *s = &job->stats;
    header(request, "Server-Timing",
           "queue;dur=%.3f, frame;dur=%.3f, select;dur=%.3f, depth;dur=%.3f, shade;dur=%.3f, resolve;dur=%.3f, "
           "readback;dur=%.3f, encode;dur=%.3f, total;dur=%.3f",
           job->queue_ms, s->total_ms, s->select_ms, s->depth_ms, s->shade_ms, s->resolve_ms, s->readback_ms,
           job->encode_ms, (double)(spl_now_ns() - request->began_ns) / SPL_NS_PER_MS);
    add_camera(request, &job->request.view.camera);
    add_depth(request, job);
    add_plan(request, job);
    job->encoded = (struct spl_encoded){0}; // the response owns the bytes
    header(request, "Splatd-Complete", "%s", s->complete ? "true" : "false");
    spl_pipeline_get_status(request->service->pipeline, &status);
    header(request, "Splatd-Device", "%s: %s", status.device.backend, status.device.name);
}
