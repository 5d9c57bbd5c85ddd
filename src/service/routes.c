/* Which resources there are, and what each method does with them.
 *
 * A path is split at '/' before it is decoded, so an encoded slash never makes a segment, and an id is only ever
 * compared with those of the catalog. Owned by the loop's thread. */
#include <stdio.h>
#include <string.h>

#include "service/access/access.h"
#include "service/datasets/library.h"
#include "service/exchange.h"
#include "service/ops/ops.h"
#include "service/pages.h"
#include "service/place/wait.h"
#include "service/reply.h"
#include "service/state.h"
#include "service/tiles/tiles.h"
#include "service/tour/tour.h"
#include "service/view/views.h"

static const char *const methods[] = {[SPL_GET] = MHD_HTTP_METHOD_GET,
                                      [SPL_POST] = MHD_HTTP_METHOD_POST,
                                      [SPL_PUT] = MHD_HTTP_METHOD_PUT,
                                      [SPL_DELETE] = MHD_HTTP_METHOD_DELETE};
enum {
    GET = 1 << SPL_GET, /* and HEAD */
    POST = 1 << SPL_POST,
    PUT = 1 << SPL_PUT,
    DELETE = 1 << SPL_DELETE,
};

static void index_page(struct request *request, const struct spl_call *call)
{
    (void)call;
    if (spl_wants_page(request)) {
        spl_show_page(request);
        return;
    }
    const struct spl_catalog *catalog = &request->service->library->catalog;
    json_t *views = json_array();
    for (size_t i = 0; i < catalog->count; i++)
        if (catalog->slots[i].current && spl_access_may_see(request, catalog->slots[i].id))
            json_array_append_new(views, json_sprintf("%s/view", catalog->slots[i].current->uri));
    spl_reply_json(request,
                   json_pack("{s:s, s:s, s:s, s:s, s:s, s:s, s:s, s:o}", "name", "splatd", "version", SPLATD_VERSION,
                             "openapi", "/v1/openapi.json", "clients", "/clients/", "datasets", "/v1/datasets",
                             "methods", "/v1/methods", "status", "/v1/status", "views", views));
    if (request->response)
        MHD_add_response_header(request->response, MHD_HTTP_HEADER_VARY, MHD_HTTP_HEADER_ACCEPT);
}

static void show_status(struct request *request, const struct spl_call *call)
{
    (void)call;
    spl_reply_json(request, spl_describe_status(request));
}

/* "{id}" stands for a dataset, "{n}" for a number, "{z}/{x}/{y}" for a tile, "{name}" for any other segment. Methods of
 * one pattern that need different scopes are rows of their own. */
static const struct route {
    const char *pattern;
    unsigned methods;
    enum spl_scope scope; /* what a token must allow, for the dataset {id} where there is one */
    bool query;           /* takes parameters */
    void (*handle)(struct request *request, const struct spl_call *call);
} routes[] = {
    {"/", GET, SPL_SCOPE_NONE, false, index_page},
    {"/viewer/{name}", GET, SPL_SCOPE_NONE, false, spl_show_viewer_file},
    {"/embed/{name}", GET, SPL_SCOPE_NONE, true, spl_show_embed},
    {"/clients/", GET, SPL_SCOPE_NONE, false, spl_list_clients},
    {"/clients/{name}", GET, SPL_SCOPE_NONE, false, spl_show_client},
    {"/v1/openapi.yaml", GET, SPL_SCOPE_NONE, false, spl_show_openapi_yaml},
    {"/v1/openapi.json", GET, SPL_SCOPE_NONE, false, spl_show_openapi_json},
    {"/v1/methods", GET, SPL_SCOPE_NONE, false, spl_show_methods},
    {"/v1/status", GET, SPL_SCOPE_VIEW, false, show_status},
    {"/v1/datasets", GET, SPL_SCOPE_VIEW, false, spl_list_datasets},
    {"/v1/datasets/{id}", GET, SPL_SCOPE_VIEW, true, spl_show_dataset},
    {"/v1/datasets/{id}", PUT, SPL_SCOPE_ADMIN, false, spl_put_dataset}, // called before the body
    {"/v1/datasets/{id}", DELETE, SPL_SCOPE_ADMIN, false, spl_delete_dataset},
    {"/v1/datasets/{id}/profile", GET, SPL_SCOPE_VIEW, true, spl_show_profile},
    {"/v1/datasets/{id}/legend.svg", GET, SPL_SCOPE_VIEW, true, spl_show_legend},
    {"/v1/datasets/{id}/place", GET, SPL_SCOPE_VIEW, true, spl_show_place},
    {"/v1/datasets/{id}/stations", GET, SPL_SCOPE_VIEW, true, spl_show_stations},
    {"/v1/datasets/{id}/tiles.json", GET, SPL_SCOPE_VIEW, true, spl_show_tiles},
    {"/v1/datasets/{id}/tiles/{z}/{x}/{y}", GET, SPL_SCOPE_VIEW, true, spl_make_tile},
    {"/v1/datasets/{id}/view", GET | POST, SPL_SCOPE_VIEW, true, spl_make_view},
    {"/v1/datasets/{id}/thumbnail.jpg", GET, SPL_SCOPE_VIEW, true, spl_make_thumbnail},
    {"/v1/datasets/{id}/views/{name}", PUT, SPL_SCOPE_ADMIN, false, spl_put_saved_view}, // before and behind the body
    {"/v1/datasets/{id}/views/{name}", DELETE, SPL_SCOPE_ADMIN, false, spl_delete_saved_view},
    {"/v1/datasets/{id}/tours", POST, SPL_SCOPE_TOUR, false, spl_create_tour},
    {"/v1/tours", GET, SPL_SCOPE_TOUR, false, spl_list_tours},
    {"/v1/tours/{name}", GET, SPL_SCOPE_TOUR, false, spl_show_tour},
    {"/v1/tours/{name}", DELETE, SPL_SCOPE_TOUR, false, spl_remove_tour},
    {"/v1/tours/{name}/events", GET, SPL_SCOPE_TOUR, false, spl_show_tour_events},
    {"/v1/tours/{name}/stream", GET, SPL_SCOPE_TOUR, false, spl_show_tour_stream},
    {"/v1/tours/{name}/frames/{n}", GET, SPL_SCOPE_TOUR, false, spl_show_tour_frame},
    {"/v1/tours/{name}/frames.zip", GET, SPL_SCOPE_TOUR, false, spl_show_tour_zip},
    {"/v1/tours/{name}/video.mp4", GET, SPL_SCOPE_TOUR, false, spl_show_tour_video},
    {"/v1/datasets/{id}/views", POST, SPL_SCOPE_VIEW, false, spl_make_views},
    {"/v1/datasets/{id}/pick", GET | POST, SPL_SCOPE_VIEW, true, spl_pick},
    {"/v1/datasets/{id}/rays", POST, SPL_SCOPE_VIEW, true, spl_make_rays}, // the same; its query goes with NPY
};

/* What a path has in the holes of a pattern, still encoded. */
struct holes {
    const char *id, *name, *number; // may be NULL
    size_t id_length, name_length, number_length;
};

static bool match(const char *pattern, const char *path, struct holes *holes)
{
    while (*pattern) {
        if (*pattern != '{') {
            if (*pattern++ != *path++)
                return false;
            continue;
        }
        size_t length = strcspn(path, "/");
        if (!length)
            return false;
        if (!strncmp(pattern, "{id}", 4))
            holes->id = path, holes->id_length = length;
        else if (!strncmp(pattern, "{n}", 3))
            holes->number = path, holes->number_length = length;
        else if (!strncmp(pattern, "{x}", 3) || !strncmp(pattern, "{y}", 3)) // one name with {z}
            holes->name_length = (size_t)(path - holes->name) + length;
        else
            holes->name = path, holes->name_length = length;
        pattern = strchr(pattern, '}') + 1;
        path += length;
    }
    return !*path;
}

bool spl_route_takes_long(const struct request *request)
{
    for (size_t i = 0; request->uri && i < sizeof routes / sizeof *routes; i++)
        if (routes[i].handle == spl_make_rays && match(routes[i].pattern, request->uri, &(struct holes){0}))
            return true;
    return false;
}

static void refuse_method(struct request *request, unsigned allowed, const char *method)
{
    char allow[64] = "", detail[160];
    for (unsigned m = 0; m < sizeof methods / sizeof *methods; m++)
        if (allowed & 1u << m) {
            strcat(allow, *allow ? ", " : "");
            strcat(allow, m == SPL_GET ? "GET, HEAD" : methods[m]);
        }
    snprintf(detail, sizeof detail, "method %.32s is not allowed here; %s %s", method, allow,
             strchr(allow, ',') ? "are" : "is");
    spl_reply_problem(request, MHD_HTTP_METHOD_NOT_ALLOWED, "method", "", detail);
    if (request->response)
        MHD_add_response_header(request->response, MHD_HTTP_HEADER_ALLOW, allow);
}

static void refuse_query(struct request *request, enum spl_http_method method)
{
    char name[64], detail[192];
    size_t length = strcspn(request->query, "=&");
    memcpy(name, request->query, length = length < sizeof name ? length : sizeof name - 1);
    name[length] = '\0';
    snprintf(detail, sizeof detail, "unknown parameter '%s'; %s", name,
             method == SPL_POST ? "a POST takes its parameters in the body" : "this resource takes none");
    spl_reply_problem(request, MHD_HTTP_BAD_REQUEST, "input", name, detail);
}

/* Decodes what the path has in its holes. */
static int fill(const struct holes *holes, struct spl_call *call, struct spl_error *err)
{
    int rc = 0;
    if (holes->name)
        rc = spl_percent_decode(holes->name, holes->name_length, call->name, sizeof call->name, "name", err);
    if (!rc && holes->number)
        rc = spl_percent_decode(holes->number, holes->number_length, call->number, sizeof call->number, "n", err);
    if (!rc && holes->id)
        rc = spl_percent_decode(holes->id, holes->id_length, call->id, sizeof call->id, "id", err);
    return rc;
}

/* Finds the dataset; what changes datasets takes one that is not served as well. */
static int find(const struct spl_catalog *catalog, enum spl_scope scope, struct spl_call *call, struct spl_error *err)
{
    if (!*call->id || (call->entry = spl_catalog_find(catalog, call->id)) || scope == SPL_SCOPE_ADMIN)
        return 0;
    const struct spl_catalog_slot *slot = spl_catalog_find_slot(catalog, call->id);
    if (slot && slot->reason[0])
        return spl_fail_field(err, SPL_E_NOT_FOUND, "id", "dataset '%s' cannot be served: %.350s", call->id,
                              slot->reason);
    if (slot)
        return spl_fail_field(err, SPL_E_BUSY, "id", "dataset '%s' is being loaded; come back later", call->id);
    return spl_fail_field(err, SPL_E_NOT_FOUND, "id", "there is no dataset '%s'; /v1/datasets lists them", call->id);
}

static void enter(struct request *request, const struct route *route, enum spl_http_method method,
                  const struct holes *holes)
{
    struct spl_call call = {.method = method};
    struct spl_error err = {0};
    if (fill(holes, &call, &err)) {
        spl_reply_error(request, &err);
        return;
    }
    if (!spl_access_check(request, route->scope, &call))
        return;
    if (request->query[0] && ((method == SPL_POST && route->methods != POST) || !route->query))
        refuse_query(request, method);
    else if (find(&request->service->library->catalog, route->scope, &call, &err))
        spl_reply_error(request, &err);
    else
        route->handle(request, &call);
}

/* What is behind `parent`, a start of patterns, in `text`; false where `path` is not below it. */
static bool list_below(const char *parent, const char *path, char *text, size_t bytes)
{
    const char *hole = strchr(parent, '{');
    size_t used = 0, length = strlen(parent), begin = hole ? (size_t)(hole - parent) : length;
    if (strncmp(path, parent, begin))
        return false;
    const size_t id = hole ? strcspn(path + begin, "/") : 0;
    if (hole && (!id || !path[begin + id]))
        return false;
    for (size_t i = 0; i < sizeof routes / sizeof *routes; i++) {
        bool other = strncmp(routes[i].pattern, parent, length) || (!hole && strchr(routes[i].pattern + length, '/'));
        for (size_t k = 0; k < i && !other; k++)
            other = !strcmp(routes[k].pattern, routes[i].pattern);
        if (!other && used < bytes)
            used += (size_t)snprintf(text + used, bytes - used, "%s%s", used ? ", " : "", routes[i].pattern + length);
    }
    return true;
}

static void refuse_path(struct request *request)
{
    static const char *const parents[] = {"/v1/datasets/{id}/", "/v1/tours/{name}/", "/v1/"};
    char known[384], detail[512] = "there is nothing here; / lists what there is";
    for (size_t i = 0; i < sizeof parents / sizeof *parents; i++)
        if (list_below(parents[i], request->uri, known, sizeof known)) {
            snprintf(detail, sizeof detail, "there is nothing here; below %s there are %s", parents[i], known);
            break;
        }
    spl_reply_problem(request, MHD_HTTP_NOT_FOUND, "not-found", "", detail);
}

void spl_route(struct request *request, const char *method)
{
    if (!request->uri) {
        spl_reply_problem(request, MHD_HTTP_URI_TOO_LONG, "limit", "url",
                          "the URL is longer than 8 KiB; POST takes long views");
        return;
    }
    if (!spl_access_admit(request, method))
        return;
    request->head = !strcmp(method, MHD_HTTP_METHOD_HEAD);
    unsigned wanted = 0, allowed = 0, count = sizeof methods / sizeof *methods;
    const char *name = request->head ? MHD_HTTP_METHOD_GET : method;
    while (wanted < count && strcmp(name, methods[wanted]))
        wanted++;
    for (size_t i = 0; i < sizeof routes / sizeof *routes; i++) {
        struct holes holes = {0};
        if (!match(routes[i].pattern, request->uri, &holes))
            continue;
        request->route = routes[i].pattern;
        if (routes[i].methods & 1u << wanted) {
            enter(request, &routes[i], (enum spl_http_method)wanted, &holes);
            return;
        }
        allowed |= routes[i].methods;
    }
    if (allowed)
        refuse_method(request, allowed, method);
    else
        refuse_path(request);
}
