/* The page, its modules and the clients: files of api/viewer/ and api/clients/ that the build put into the binary.
 *
 * No name reaches a disk: what is not in the table is not there. Each file has a strong ETag from its content and is
 * asked about every time (no-cache), so that a new daemon never meets an old page. The page may load what the daemon
 * serves and nothing else; only /embed/ may be framed, and only what is under /clients/ may be loaded by other origins.
 * Owned by the loop's thread. */
#include "service/pages.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "base/decimal.h"
#include "service/exchange.h"
#include "service/reply.h"

struct asset {
    const char *name, *type, *etag;
    const unsigned char *bytes;
    size_t length;
};
#include "assets.h"

#define POLICY                                                                                                         \
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; "              \
    "base-uri 'none'; form-action 'none'; frame-ancestors "

const char spl_page_policy[] = POLICY "'none'";

static const struct asset *find(const char *folder, const char *name)
{
    size_t length = strlen(folder);
    for (size_t i = 0; i < sizeof assets / sizeof *assets; i++)
        if (!strncmp(assets[i].name, folder, length) && !strcmp(assets[i].name + length, name))
            return &assets[i];
    return NULL;
}

static void reply_with(struct request *request, const struct asset *asset, const char *const (*headers)[2])
{
    static const char *const always[][2] = {{MHD_HTTP_HEADER_CACHE_CONTROL, "no-cache"},
                                            {"Referrer-Policy", "no-referrer"},
                                            {NULL, NULL}};
    if (!spl_check_match(request, asset->etag))
        return;
    const bool same = spl_client_has(request, asset->etag);
    request->status = same ? MHD_HTTP_NOT_MODIFIED : MHD_HTTP_OK;
    request->response = MHD_create_response_from_buffer(same ? 0 : asset->length, (void *)(uintptr_t)asset->bytes,
                                                        MHD_RESPMEM_PERSISTENT);
    if (!request->response)
        return;
    MHD_add_response_header(request->response, MHD_HTTP_HEADER_CONTENT_TYPE, asset->type);
    MHD_add_response_header(request->response, MHD_HTTP_HEADER_ETAG, asset->etag);
    for (size_t i = 0; always[i][0]; i++)
        MHD_add_response_header(request->response, always[i][0], always[i][1]);
    for (; (*headers)[0]; headers++)
        MHD_add_response_header(request->response, (*headers)[0], (*headers)[1]);
}

struct wish {
    const char *type;
    double weight;
};

/* One line of Accept, of which there may be several; the first that names the type says it. */
static enum MHD_Result look(void *context, enum MHD_ValueKind kind, const char *header, const char *accept)
{
    (void)kind;
    struct wish *wish = context;
    if (!accept || strcasecmp(header, MHD_HTTP_HEADER_ACCEPT))
        return MHD_YES;
    for (const char *item = accept; *item; item += strcspn(item, ","), item += *item == ',') {
        item += strspn(item, " \t");
        size_t length = strcspn(item, " \t;,");
        if (length != strlen(wish->type) || strncasecmp(item, wish->type, length))
            continue;
        const char *end = item + strcspn(item, ","), *q = item + length;
        while (q < end && (strncasecmp(q, "q=", 2) || !strchr("; \t", q[-1])))
            q++;
        if (q == end)
            wish->weight = 1;
        else
            spl_decimal_parse(q + 2, &wish->weight);
        return MHD_NO;
    }
    return MHD_YES;
}

/* How much a client wants a media type that it names, 0 to 1; 0 when it does not name it. */
static double get_wish(const struct request *request, const char *type)
{
    struct wish wish = {.type = type};
    MHD_get_connection_values(request->handle, MHD_HEADER_KIND, look, &wish);
    return wish.weight;
}

bool spl_wants_page(struct request *request)
{
    double html = get_wish(request, "text/html");
    return html > 0 && html >= get_wish(request, "application/json");
}

void spl_show_page(struct request *request)
{
    static const char *const headers[][2] = {
        {"Content-Security-Policy", POLICY "'none'"}, {MHD_HTTP_HEADER_VARY, MHD_HTTP_HEADER_ACCEPT}, {NULL, NULL}};
    reply_with(request, find("viewer/", "index.html"), headers);
}

void spl_show_embed(struct request *request, const struct spl_call *call)
{
    (void)call; // the page asks for its dataset itself, and can then say what is wrong with it, or with its signature
    const char *query = request->query, *second = strchr(query, '&');
    if (*query &&
        (strncmp(query, "exp=", 4) || !second || second != strrchr(query, '&') || strncmp(second, "&sig=", 5))) {
        spl_reply_problem(request, MHD_HTTP_BAD_REQUEST, "input", "",
                          "the page takes camera and settings behind '#', and no parameters but those of splatd sign");
        return;
    }
    static const char *const headers[][2] = {{"Content-Security-Policy", POLICY "*"}, {NULL, NULL}};
    reply_with(request, find("viewer/", "embed.html"), headers);
}

static void show_file(struct request *request, const char *folder, const char *name, const char *const (*headers)[2],
                      const char *otherwise)
{
    const struct asset *asset = find(folder, name);
    if (asset)
        reply_with(request, asset, headers);
    else
        spl_reply_problem(request, MHD_HTTP_NOT_FOUND, "not-found", "name", otherwise);
}

void spl_show_viewer_file(struct request *request, const struct spl_call *call)
{
    static const char *const headers[][2] = {{"Content-Security-Policy", POLICY "'none'"}, {NULL, NULL}};
    show_file(request, "viewer/", call->name, headers, "there is no such file; / is the page");
}

void spl_list_clients(struct request *request, const struct spl_call *call)
{
    (void)call;
    static const char *const headers[][2] = {
        {"Content-Security-Policy", POLICY "'none'"}, {MHD_HTTP_HEADER_VARY, MHD_HTTP_HEADER_ACCEPT}, {NULL, NULL}};
    reply_with(request, find("list/", spl_wants_page(request) ? "clients.html" : "clients.json"), headers);
}

void spl_show_client(struct request *request, const struct spl_call *call)
{
    static const char *const headers[][2] = {
        {"Access-Control-Allow-Origin", "*"}, {"Cross-Origin-Resource-Policy", "cross-origin"}, {NULL, NULL}};
    show_file(request, "clients/", call->name, headers, "there is no such client; /clients/ lists them");
}
