/* Which resources there are, and what each method does with them.
 *
 * A path is split at '/' before it is decoded, so an encoded slash never makes a segment, and an id is only ever
 * compared with those of the catalog. Owned by the loop's thread. */
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "service/state.h"

enum { ALLOW_GET = 1, ALLOW_POST = 2 };

static void index_page(struct request *request, const struct spl_catalog_entry *entry, bool post)
{
    (void)entry;
    (void)post;
    struct spl_service *service = request->service;
    json_t *views = json_array();
    for (size_t i = 0; i < service->catalog.count; i++)
        json_array_append_new(views, json_sprintf("%s/view", service->catalog.entries[i].uri));
    spl_reply_json(request, json_pack("{s:s, s:s, s:s, s:s, s:o}", "name", "splatd", "version", SPLATD_VERSION,
                                      "datasets", "/v1/datasets", "status", "/v1/status", "views", views));
}

static void list_datasets(struct request *request, const struct spl_catalog_entry *entry, bool post)
{
    (void)entry;
    (void)post;
    struct spl_catalog *catalog = &request->service->catalog;
    json_t *list = json_array();
    for (size_t i = 0; i < catalog->count; i++)
        json_array_append_new(list, spl_describe_dataset(&catalog->entries[i], false));
    spl_reply_json(request, json_pack("{s:o}", "datasets", list));
}

static void show_dataset(struct request *request, const struct spl_catalog_entry *entry, bool post)
{
    (void)post;
    spl_reply_json(request, spl_describe_dataset(entry, true));
}

static void show_status(struct request *request, const struct spl_catalog_entry *entry, bool post)
{
    (void)entry;
    (void)post;
    spl_reply_json(request, spl_describe_status(request->service));
}

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

static void make_view(struct request *request, const struct spl_catalog_entry *entry, bool post)
{
    struct spl_service *service = request->service;
    struct spl_error err = {0};
    struct spl_view_request view;
    struct spl_job *job = NULL;
    if (parse_view(request, entry, post, &view, &err))
        goto refuse;
    if (service->reply_bytes > reply_bytes_max) {
        spl_fail(&err, SPL_E_BUSY, "%zu bytes of images wait for slow clients; come back later", service->reply_bytes);
        goto refuse;
    }
    if (!(job = spl_alloc(1, sizeof *job, &err)))
        goto refuse;
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

static const struct route {
    const char *pattern; /* "{id}" stands for one dataset */
    unsigned methods;
    bool query; /* takes parameters */
    void (*handle)(struct request *request, const struct spl_catalog_entry *entry, bool post);
} routes[] = {
    {"/", ALLOW_GET, false, index_page},
    {"/v1/status", ALLOW_GET, false, show_status},
    {"/v1/datasets", ALLOW_GET, false, list_datasets},
    {"/v1/datasets/{id}", ALLOW_GET, false, show_dataset},
    {"/v1/datasets/{id}/profile", ALLOW_GET, true, spl_show_profile},
    {"/v1/datasets/{id}/view", ALLOW_GET | ALLOW_POST, true, make_view},
};

/* Does `path` fit `pattern`? *id is then the encoded segment that stands for {id}, if there is one. */
static bool match(const char *pattern, const char *path, const char **id, size_t *id_length)
{
    const char *hole = strchr(pattern, '{');
    if (!hole)
        return !strcmp(pattern, path);
    size_t head = (size_t)(hole - pattern);
    if (strncmp(pattern, path, head))
        return false;
    *id = path + head;
    *id_length = strcspn(*id, "/");
    return *id_length && !strcmp(*id + *id_length, strchr(hole, '}') + 1);
}

static void refuse_method(struct request *request, unsigned methods, const char *method)
{
    const char *allow = methods & ALLOW_POST ? "GET, HEAD, POST" : "GET, HEAD";
    char detail[128];
    snprintf(detail, sizeof detail, "method %.32s is not allowed here; %s are", method, allow);
    spl_reply_problem(request, MHD_HTTP_METHOD_NOT_ALLOWED, "method", "", detail);
    if (request->response)
        MHD_add_response_header(request->response, MHD_HTTP_HEADER_ALLOW, allow);
}

static void refuse_query(struct request *request, bool post)
{
    char name[64], detail[192];
    size_t length = strcspn(request->query, "=&");
    memcpy(name, request->query, length = length < sizeof name ? length : sizeof name - 1);
    name[length] = '\0';
    snprintf(detail, sizeof detail, "unknown parameter '%s'; %s", name,
             post ? "a POST takes its parameters in the body" : "this resource takes none");
    spl_reply_problem(request, MHD_HTTP_BAD_REQUEST, "input", name, detail);
}

static void enter(struct request *request, const struct route *route, const char *method, const char *id,
                  size_t id_length)
{
    bool post = !strcmp(method, MHD_HTTP_METHOD_POST);
    bool get = !strcmp(method, MHD_HTTP_METHOD_GET) || !strcmp(method, MHD_HTTP_METHOD_HEAD);
    if (!(get && route->methods & ALLOW_GET) && !(post && route->methods & ALLOW_POST)) {
        refuse_method(request, route->methods, method);
        return;
    }
    if (request->query[0] && (post || !route->query)) {
        refuse_query(request, post);
        return;
    }
    const struct spl_catalog_entry *entry = NULL;
    if (id) {
        char name[256];
        struct spl_error err = {0};
        if (!spl_percent_decode(id, id_length, name, sizeof name, "id", &err) &&
            !(entry = spl_catalog_find(&request->service->catalog, name)))
            spl_fail_field(&err, SPL_E_NOT_FOUND, "id", "there is no dataset '%s'; /v1/datasets lists them", name);
        if (!entry) {
            spl_reply_error(request, &err);
            return;
        }
    }
    route->handle(request, entry, post);
}

void spl_route(struct request *request, const char *method)
{
    if (!request->uri) {
        spl_reply_problem(request, MHD_HTTP_URI_TOO_LONG, "limit", "url",
                          "the URL is longer than 8 KiB; POST takes long views");
        return;
    }
    for (size_t i = 0; i < sizeof routes / sizeof *routes; i++) {
        const char *id = NULL;
        size_t id_length = 0;
        if (match(routes[i].pattern, request->uri, &id, &id_length)) {
            enter(request, &routes[i], method, id, id_length);
            return;
        }
    }
    spl_reply_problem(request, MHD_HTTP_NOT_FOUND, "not-found", "", "there is nothing here; / lists what there is");
}
