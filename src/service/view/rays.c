/* Rays: a POST of directions, answered as a view of them is. A million of them are 24 MiB, so their body is let in by
 * name (http.c) after its token and dataset were looked at, and the pool reads it while the request waits; the list
 * then stays with the request, and with every job that renders it.
 *
 * Invariant: a wish belongs to the pool until after(), whether its request still waits or not, and the body to the
 * wish. Owned by the loop's thread, but for read_list(). */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/clock.h"
#include "base/memory.h"
#include "service/datasets/library.h"
#include "service/exchange.h"
#include "service/http.h"
#include "service/place/wait.h"
#include "service/reply.h"
#include "service/request/body.h"
#include "service/state.h"
#include "service/view/views.h"

enum { lists_max = 32, header_most = 8192, beside_max = 4096 /* values beside directions: the loop reads and frees */ };

struct spl_ray_wish {
    uv_work_t work;
    struct request *request; // NULL once it has been given up
    struct spl_service *service;
    struct spl_call call; /* with a reference to its entry */
    char *body;
    size_t length;
    bool npy, is_long; /* counted as such, where its request has ended before it */
    struct spl_rays *rays;
    json_t *rest;
    struct spl_error err;
};

static int read_npy(struct spl_ray_wish *wish, struct spl_error *err)
{
    FILE *file = wish->length ? fmemopen(wish->body, wish->length, "rb") : NULL;
    if (!file)
        return spl_fail_field(err, wish->length ? SPL_E_NOMEM : SPL_E_INPUT, "directions", "the body is %s",
                              wish->length ? "more than memory holds" : "empty");
    int rc = spl_rays_from_npy(file, wish->length, "the body", &wish->rays, err);
    fclose(file);
    return rc;
}

/* As deep as the parser lets JSON be. */
static size_t count_values(json_t *json)
{
    size_t count = 1, i;
    const char *key;
    json_t *value;
    json_array_foreach(json, i, value)
    {
        count += count_values(value);
    }
    json_object_foreach(json, key, value)
    {
        count += count_values(value);
    }
    return count;
}

static int read_json(struct spl_ray_wish *wish, struct spl_error *err)
{
    if (wish->length > body_max)
        return spl_fail_field(err, SPL_E_INPUT, "body", "JSON may have 1 MiB; send longer lists as application/x-npy");
    json_t *json = spl_body_parse(wish->body, wish->length, SPL_RAYS_BODY_VALUES, SPL_BODY_TEXT, err);
    if (!json)
        return SPL_E_INPUT;
    int rc = json_is_object(json) ? spl_rays_from_json(json_object_get(json, "directions"), &wish->rays, err)
                                  : spl_fail_field(err, SPL_E_INPUT, "body", "the body must be a JSON object, not %s",
                                                   spl_json_type_name(json));
    if (rc) {
        json_decref(json);
        return rc;
    }
    json_object_del(json, "directions");
    if (count_values(json) > beside_max) {
        json_decref(json);
        return spl_fail_field(err, SPL_E_INPUT, "body", "beside 'directions' there are more than %d values",
                              (int)beside_max);
    }
    wish->rest = json;
    return 0;
}

static void read_list(uv_work_t *work)
{
    struct spl_ray_wish *wish = work->data;
    (wish->npy ? read_npy : read_json)(wish, &wish->err);
    free(wish->body); // here, since the loop would take milliseconds to hand 24 MiB back
    wish->body = NULL;
}

/* What is drawn has a reference of its own to the list: a client that reads its reply slowly keeps none, and no place
 * of those that send one. */
static void let_go(struct request *request)
{
    spl_rays_destroy(request->rays);
    request->rays = NULL;
    json_decref(request->rest);
    request->rest = NULL;
    spl_body_end_long(request);
}

static void answer(struct request *request, const struct spl_call *call)
{
    struct spl_service *service = request->service;
    struct spl_camera_limits limits = spl_view_get_limits(service);
    struct spl_view_request view;
    struct spl_error err = {0};
    if (request->rest && request->query[0])
        spl_fail_field(&err, SPL_E_INPUT, "body",
                       "parameters stand beside 'directions' in JSON; in the URL with NPY alone");
    else
        spl_rays_request_from(request->rest, request->query, strlen(request->query), request->rays,
                              &call->entry->defaults, &limits, &view, &err);
    if (err.code && spl_view_blame(&err) && spl_place_wait(request, call, spl_make_rays, &err))
        return;
    spl_view_answer(request, call, &view, &err);
    let_go(request);
}

static void after(uv_work_t *work, int status)
{
    (void)status;
    struct spl_ray_wish *wish = work->data;
    struct spl_service *service = wish->service;
    struct request *request = wish->request;
    if (request) {
        request->ray_wish = NULL;
        spl_waiting_resume(request);
        request->rays = wish->rays;
        request->rest = wish->rest;
        wish->rays = NULL;
        wish->rest = NULL;
        if (wish->err.code) {
            spl_reply_error(request, &wish->err);
            let_go(request);
        } else {
            answer(request, &wish->call);
        }
        spl_http_pump(service);
    }
    spl_catalog_entry_unref(wish->call.entry);
    spl_rays_destroy(wish->rays);
    json_decref(wish->rest);
    service->library->tasks--;
    service->views->lists--;
    service->http->long_bodies -= wish->is_long;
    free(wish->body);
    free(wish);
}

void spl_ray_wish_abandon(struct spl_ray_wish *wish)
{
    if (!wish)
        return;
    wish->is_long = wish->request->is_long;
    wish->request->is_long = false;
    wish->request->ray_wish = NULL;
    wish->request = NULL;
}

/* By what it says it is, or begins with. */
static bool is_npy(const struct request *request)
{
    static const char *const types[] = {"application/x-npy", "application/octet-stream"};
    const char *type = MHD_lookup_connection_value(request->handle, MHD_HEADER_KIND, MHD_HTTP_HEADER_CONTENT_TYPE);
    for (int i = 0; type && i < 2; i++)
        if (!strncasecmp(type, types[i], strlen(types[i])))
            return true;
    return request->body_length > 0 && request->body[0] == '\x93';
}

void spl_make_rays(struct request *request, const struct spl_call *call)
{
    struct spl_service *service = request->service;
    struct spl_error err = {0};
    if (!request->wants_body) {
        request->wants_body = true;
        request->body_most = SPL_RAYS_MAX * 3 * sizeof(double) + header_most;
        return;
    }
    if (request->rays) { /* it has waited for a coordinate system */
        answer(request, call);
        return;
    }
    struct spl_ray_wish *wish = service->views->lists < lists_max ? spl_alloc(1, sizeof *wish, NULL) : NULL;
    if (!wish) {
        spl_fail(&err, SPL_E_BUSY, "%zu lists of rays are being read; come back later", service->views->lists);
        spl_reply_error(request, &err);
        return;
    }
    *wish = (struct spl_ray_wish){.request = request, .service = service, .call = *call, .length = request->body_length,
                                  .npy = is_npy(request)};
    wish->work.data = wish;
    wish->body = spl_body_take(request);
    spl_catalog_entry_ref(call->entry);
    request->ray_wish = wish;
    service->library->tasks++;
    service->views->lists++;
    spl_waiting_add(request, spl_now_ns() + service->options->deadline_ms * SPL_NS_PER_MS);
    uv_queue_work(&service->loop, &wish->work, read_list, after); // fails without a callback only
}
