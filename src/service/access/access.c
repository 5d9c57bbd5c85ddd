/* What is checked before a request is looked at: by which name and from which page it comes (door.c), how often its
 * address asks, whether its token or its signature allows what it wants.
 *
 * Without tokens and rates service->access is NULL, and everybody may view and make tours. No reply and no line
 * of the log holds a token or a signature. A change of the files takes effect by SIGHUP; a request's token is borrowed
 * only while it is routed. Owned by the loop's thread. */
#include "service/access/access.h"

#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/socket.h>
#include <time.h>

#include "base/clock.h"
#include "base/log.h"
#include "base/memory.h"
#include "service/access/buckets.h"
#include "service/access/door.h"
#include "service/access/sign.h"
#include "service/listen.h"
#include "service/exchange.h"
#include "service/http.h"
#include "service/ops/counters.h"
#include "service/reply.h"
#include "service/state.h"

struct spl_access {
    struct spl_tokens *tokens;     // may be NULL: everybody may view and make tours
    struct spl_sign_key key;       /* of URLs; empty: none is accepted */
    struct spl_buckets *addresses; // may be NULL: no limit
    struct spl_buckets *all;       // may be NULL
};

/* Can only this machine reach the main listener, a socket that was passed or the address that is to be opened? */
static int find_local(const struct spl_service *service, bool *local, struct spl_error *err)
{
    struct sockaddr_storage bound;
    socklen_t length = sizeof bound;
    if (service->http->listen_fd < 0)
        return spl_listen_is_local("listen", service->options->listen, local, err);
    *local = !getsockname(service->http->listen_fd, (struct sockaddr *)&bound, &length) &&
             spl_sockaddr_is_local((const struct sockaddr *)&bound);
    return 0;
}

static int read_secrets(const struct spl_service_options *options, struct spl_tokens **tokens, struct spl_sign_key *key,
                        struct spl_error *err)
{
    *tokens = NULL;
    *key = (struct spl_sign_key){0};
    struct spl_error why = {0};
    const char *field = "tokens";
    int rc = *options->tokens ? spl_tokens_read(options->tokens, tokens, &why) : 0;
    if (!rc && *options->url_key) {
        field = "url-key";
        rc = spl_sign_key_read(options->url_key, key, &why);
    }
    if (rc) {
        spl_fail_field(err, rc, field, "%s", why.message);
        spl_tokens_destroy(*tokens);
        *tokens = NULL;
    }
    return rc;
}

int spl_access_init(struct spl_service *service, struct spl_error *err)
{
    const struct spl_service_options *options = service->options;
    bool local;
    int rc = find_local(service, &local, err);
    if (rc)
        return rc;
    if (!*options->tokens && !options->allow_anonymous && !local)
        return spl_fail_field(err, SPL_E_USAGE, "listen",
                              "--listen %.100s can be reached from elsewhere; give --tokens FILE, or --allow-anonymous "
                              "if everybody there may use the service", options->listen);
    if (!*options->tokens && !options->rate_limit && !options->rate_limit_total)
        return 0;
    struct spl_access *access = service->access = spl_alloc(1, sizeof *access, err);
    if (!access)
        return SPL_E_NOMEM;
    rc = read_secrets(options, &access->tokens, &access->key, err);
    if (!rc && options->rate_limit)
        rc = spl_buckets_create(options->rate_limit, &access->addresses, err);
    if (!rc && options->rate_limit_total)
        rc = spl_buckets_create(options->rate_limit_total, &access->all, err);
    if (rc)
        spl_access_finish(service);
    return rc;
}

void spl_access_finish(struct spl_service *service)
{
    struct spl_access *access = service->access;
    if (!access)
        return;
    spl_tokens_destroy(access->tokens);
    spl_sign_key_finish(&access->key);
    spl_buckets_destroy(access->addresses);
    spl_buckets_destroy(access->all);
    free(access);
    service->access = NULL;
}

void spl_access_reload(struct spl_service *service)
{
    struct spl_access *access = service->access;
    struct spl_tokens *tokens;
    struct spl_sign_key key;
    struct spl_error err = {0};
    if (!access || !access->tokens) {
        spl_log_info("SIGHUP: there are no tokens to read again");
    } else if (read_secrets(service->options, &tokens, &key, &err)) {
        spl_log_error("SIGHUP: the tokens stay as they were: %s", err.message);
    } else {
        spl_tokens_destroy(access->tokens);
        spl_sign_key_finish(&access->key);
        access->tokens = tokens;
        access->key = key;
        spl_log_info("SIGHUP: %zu tokens read", spl_tokens_get_count(tokens));
    }
}

/* An IPv4 address, or the 64 bits of IPv6 that a network gives to one customer. */
static void fill_key(struct request *request, uint8_t key[SPL_BUCKET_KEY])
{
    const union MHD_ConnectionInfo *info = MHD_get_connection_info(request->handle, MHD_CONNECTION_INFO_CLIENT_ADDRESS);
    const struct sockaddr *address = info ? info->client_addr : NULL;
    memset(key, 0, SPL_BUCKET_KEY);
    if (address && address->sa_family == AF_INET) {
        memcpy(key + 12, &((const struct sockaddr_in *)(const void *)address)->sin_addr, 4);
    } else if (address && address->sa_family == AF_INET6) {
        const struct in6_addr *six = &((const struct sockaddr_in6 *)(const void *)address)->sin6_addr;
        if (IN6_IS_ADDR_V4MAPPED(six))
            memcpy(key + 12, six->s6_addr + 12, 4);
        else
            memcpy(key, six->s6_addr, 8);
    }
}

static const uint8_t everybody[SPL_BUCKET_KEY];

static bool refuse_rate(struct request *request, const char *whose, unsigned wait_s)
{
    char detail[128], seconds[16];
    snprintf(detail, sizeof detail, "%s more often than the service allows; come back after %u s", whose, wait_s);
    snprintf(seconds, sizeof seconds, "%u", wait_s);
    spl_count(request->service->counters, refused_rate);
    spl_reply_problem(request, MHD_HTTP_TOO_MANY_REQUESTS, "rate", "", detail);
    if (request->response)
        MHD_add_response_header(request->response, MHD_HTTP_HEADER_RETRY_AFTER, seconds);
    return false;
}

static const char one_asks[] = "this address asks", all_ask[] = "all clients together ask";

static bool is_within_rates(struct request *request)
{
    struct spl_access *access = request->service->access;
    uint8_t key[SPL_BUCKET_KEY];
    unsigned wait_s = 0;
    if (access->addresses) {
        fill_key(request, key);
        wait_s = spl_buckets_take(access->addresses, key, spl_now_ns());
    }
    if (wait_s)
        return refuse_rate(request, one_asks, wait_s);
    if (access->all)
        wait_s = spl_buckets_take(access->all, everybody, spl_now_ns());
    return !wait_s || refuse_rate(request, all_ask, wait_s);
}

bool spl_access_charge(struct request *request, unsigned count)
{
    struct spl_access *access = request->service->access;
    uint8_t key[SPL_BUCKET_KEY];
    if (!access || !access->addresses)
        return true;
    fill_key(request, key);
    const unsigned wait_s = spl_buckets_charge(access->addresses, key, count);
    return !wait_s || refuse_rate(request, one_asks, wait_s);
}

bool spl_access_take_one(struct spl_service *service)
{
    struct spl_access *access = service->access;
    return !access || !access->all || !spl_buckets_take(access->all, everybody, spl_now_ns());
}

/* Does no token decide about the request? One that is shown does, right or wrong, where there are tokens. */
static bool is_anonymous(struct request *request)
{
    struct spl_access *access = request->service->access;
    return !access || !access->tokens ||
           (request->service->options->allow_anonymous &&
            !MHD_lookup_connection_value(request->handle, MHD_HEADER_KIND, MHD_HTTP_HEADER_AUTHORIZATION));
}

bool spl_access_admit(struct request *request, const char *method)
{
    return spl_door_check_host(request, is_anonymous(request)) &&
           (!request->service->access || request->wants_body || is_within_rates(request)) && /* it is routed again */
           spl_door_check_preflight(request, method);
}

static bool refuse(struct request *request, unsigned status, const char *field, const char *challenge,
                   const char *detail)
{
    spl_count(request->service->counters, refused_access);
    spl_reply_problem(request, status, status == MHD_HTTP_UNAUTHORIZED ? "unauthorized" : "forbidden", field, detail);
    if (request->response && challenge)
        MHD_add_response_header(request->response, MHD_HTTP_HEADER_WWW_AUTHENTICATE, challenge);
    return false;
}

/* Lets a signed URL through and takes exp and sig off its query. */
static bool check_signature(struct request *request)
{
    struct spl_error err = {0};
    struct spl_signed found;
    if (spl_sign_check(&request->service->access->key, request->uri, request->query, (int64_t)time(NULL), &found, &err))
        return refuse(request, MHD_HTTP_FORBIDDEN, err.field, NULL, err.message);
    snprintf(request->grant, sizeof request->grant, "%s", found.grant);
    request->expires_s = found.expires_s;
    // the query lies in request->uri, which is ours
    request->uri[request->query - request->uri + (ptrdiff_t)found.kept] = '\0';
    return true;
}

/* A token in a URL would end up in logs and histories. */
static bool has_token_in_query(const char *query)
{
    for (const char *pair = query; *pair; pair += strcspn(pair, "&"), pair += *pair == '&')
        if (!strncmp(pair, "token=", 6) || !strncmp(pair, "access_token=", 13))
            return true;
    return false;
}

/* Also where it does not stand at the end, as it has to. */
static bool has_signature_in_query(const char *query)
{
    for (const char *pair = query; *pair; pair += strcspn(pair, "&"), pair += *pair == '&')
        if (!strncmp(pair, "sig=", 4) || !strncmp(pair, "embed=", 6))
            return true;
    return false;
}

/* Neither a token nor a signature that counts. */
static bool refuse_unknown(struct request *request)
{
    static const char challenge[] = "Bearer realm=\"splatd\"";
    if (request->service->access->key.bytes && has_signature_in_query(request->query))
        return refuse(request, MHD_HTTP_UNAUTHORIZED, "sig", challenge,
                      "the signature does not match: it allows the GET that was signed, to which nothing is added and "
                      "in which nothing changes its place; anything else needs a token");
    return refuse(request, MHD_HTTP_UNAUTHORIZED, "", challenge,
                  "this needs a token; send it as 'Authorization: Bearer TOKEN'");
}

/* The token that the request shows, NULL when there is none or it is unknown; *shown says which. */
static const struct spl_token *find_token(struct request *request, bool *shown)
{
    const char *value = MHD_lookup_connection_value(request->handle, MHD_HEADER_KIND, MHD_HTTP_HEADER_AUTHORIZATION);
    *shown = value;
    if (!value || strncasecmp(value, "Bearer ", 7))
        return NULL;
    value += 7 + strspn(value + 7, " ");
    return spl_tokens_find(request->service->access->tokens, value, strlen(value));
}

bool spl_access_check(struct request *request, enum spl_scope scope, const struct spl_call *call)
{
    struct spl_access *access = request->service->access;
    bool changes = call->method != SPL_GET && scope != SPL_SCOPE_VIEW;
    if (changes && is_anonymous(request) && !spl_door_check_origin(request))
        return false;
    if (!access || !access->tokens)
        return scope != SPL_SCOPE_ADMIN ||
               refuse(request, MHD_HTTP_FORBIDDEN, "", NULL,
                      "this needs an admin token, and the service was started without --tokens");
    if (has_token_in_query(request->query)) {
        spl_reply_problem(request, MHD_HTTP_BAD_REQUEST, "input", "token",
                          "a token does not belong into a URL; send it as 'Authorization: Bearer TOKEN'");
        return false;
    }
    bool shown;
    request->token = find_token(request, &shown);
    if (scope == SPL_SCOPE_NONE)
        return true;
    if (access->key.bytes && call->method == SPL_GET && spl_sign_is_signed(request->query) &&
        spl_sign_covers(request->uri, strlen(request->uri)))
        return check_signature(request);
    if (!shown)
        return (request->service->options->allow_anonymous && scope != SPL_SCOPE_ADMIN) || refuse_unknown(request);
    if (!request->token)
        return refuse(request, MHD_HTTP_UNAUTHORIZED, "", "Bearer realm=\"splatd\", error=\"invalid_token\"",
                      "the token is not known here");
    if (spl_token_allows(request->token, scope, call->id))
        return true;
    char challenge[96], detail[96];
    snprintf(challenge, sizeof challenge, "Bearer realm=\"splatd\", error=\"insufficient_scope\", scope=\"%s\"",
             spl_scope_names[scope]);
    snprintf(detail, sizeof detail, "the token does not allow '%s'%s", spl_scope_names[scope],
             *call->id ? " of this dataset" : "");
    return refuse(request, MHD_HTTP_FORBIDDEN, "", challenge, detail);
}

bool spl_access_may_see(struct request *request, const char *id)
{
    struct spl_access *access = request->service->access;
    if (!access || !access->tokens || request->service->options->allow_anonymous)
        return true;
    return request->token && spl_token_allows(request->token, SPL_SCOPE_VIEW, id);
}
