/* Requests over HTTP/1.1 and 2, through libcurl. Handles are lent to one request at a time and kept with their
 * connections, so that neighbours in time need no new one: some of a file, and of all some that were used last. Files
 * of one host, as tiles of a collection are, lend them to each other.
 *
 * Invariants: nothing but http and https is spoken, after a redirect too, and from https no redirect leads to http.
 * Bytes of any answer but a 206 whose head was found right never reach who asked. What is secret (user, password,
 * query, keys) is in no message: those are made here, of curl's words for a code, never of its own texts. S3's
 * signature covers each request anew, so it follows no redirect. A tile of a collection is sent on to its own origin
 * alone, or to the one that the collection itself was sent on to: what a server says of its neighbours is no reason to
 * ask a third party. curl sends user and password to no other host. */
#include "dataset/remote_link.h"

#include <inttypes.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/queue.h>

#include "base/clock.h"
#include "base/memory.h"
#include "base/work.h"
#include "dataset/remote_curl.h"

enum { handles_kept = 8, handles_kept_of_all = 64, redirects_most = 5 };
enum { refusal_bytes = 1024, swallowed_most = 64 << 10 };

struct server {
    const struct spl_curl *curl;
    char *url;
    size_t origin_bytes; /* of the URL, with its host */
    bool tls, s3, sign;
    char *key_id, *secret, *token_header, *provider; // NULL where nothing is signed
    bool bound; /* redirects lead to `own` and to `may_land` alone */
    char own[SPL_REMOTE_ORIGIN_MAX], may_land[SPL_REMOTE_ORIGIN_MAX];
    char landed[SPL_REMOTE_ORIGIN_MAX]; // guarded by: parked.mutex, as all below
    TAILQ_ENTRY(server) link; /* in its list where it has some */
    CURL *kept[handles_kept];
    unsigned kept_count;
};

/* Handles that nobody uses; those servers that were given one last stand behind the others. */
static struct {
    pthread_mutex_t mutex;
    TAILQ_HEAD(servers, server) servers;
    unsigned handles;
} parked = {.mutex = PTHREAD_MUTEX_INITIALIZER, .servers = TAILQ_HEAD_INITIALIZER(parked.servers)};

/* One request under way. */
struct exchange {
    const struct server *server;
    CURLU *at; // NULL: redirects may lead anywhere; else where it is
    bool astray; /* one would have led elsewhere */
    const struct spl_remote_ask *ask;
    struct spl_remote_reply *reply;
    bool begun, refused; /* the head of a 206 was found right; what comes is not wanted */
    size_t swallowed;
    uint64_t moved_ns; /* when something last came: curl's own measure of speed forgets too slowly */
    bool stalled;
    char refusal[refusal_bytes + 1]; /* the beginning of what an error says of itself */
    size_t refusal_used;
};

/* The value of header `name` on a line, without blanks; NULL where it is another header. */
static const char *value_of(const char *line, size_t length, const char *name, size_t *bytes)
{
    size_t known = strlen(name);
    if (length <= known || strncasecmp(line, name, known) || line[known] != ':')
        return NULL;
    const char *value = line + known + 1, *end = line + length;
    while (value < end && (*value == ' ' || *value == '\t'))
        value++;
    while (end > value && (unsigned char)end[-1] <= ' ')
        end--;
    *bytes = (size_t)(end - value);
    return value;
}

/* What is too long to be held to is as if it were not there. */
static void copy(char *out, size_t size, const char *value, size_t bytes)
{
    if (bytes < size)
        snprintf(out, size, "%.*s", (int)bytes, value);
}

/* Digits alone, at *at and before `end`; the largest number stands for larger ones. Moves *at behind them; false where
 * there are none. */
static bool read_number(const char **at, const char *end, uint64_t *out)
{
    const char *begin = *at;
    for (*out = 0; *at < end && **at >= '0' && **at <= '9'; ++*at) {
        const uint64_t digit = (uint64_t)(**at - '0');
        *out = *out > (UINT64_MAX - digit) / 10 ? UINT64_MAX : 10 * *out + digit;
    }
    return *at > begin;
}

static bool skip(const char **at, const char *end, char c)
{
    return *at < end && *(*at)++ == c;
}

/* "bytes FIRST-LAST/TOTAL" */
static void read_range(struct spl_remote_reply *reply, const char *value, size_t bytes)
{
    const char *at = value + 5, *end = value + bytes;
    reply->ranged = false;
    if (bytes < 5 || strncasecmp(value, "bytes", 5))
        return;
    while (at < end && (*at == ' ' || *at == '\t'))
        at++;
    reply->ranged = read_number(&at, end, &reply->first) && skip(&at, end, '-') &&
                    read_number(&at, end, &reply->last) && skip(&at, end, '/') &&
                    read_number(&at, end, &reply->total) && at == end && reply->total < UINT64_MAX;
}

/* Seconds; a date is left to curl, which gives up numbers that are too large. */
static void read_retry_after(struct spl_remote_reply *reply, const char *value, size_t bytes)
{
    uint64_t seconds;
    const char *at = value, *end = value + bytes;
    reply->retry_after_s = read_number(&at, end, &seconds) && at == end ? seconds : 0;
}

static size_t on_header(char *line, size_t one, size_t length, void *context)
{
    struct exchange *e = context;
    struct spl_remote_reply *reply = e->reply;
    const char *value;
    size_t bytes;
    (void)one;
    if (length > 5 && !strncmp(line, "HTTP/", 5)) { // of each answer on the way, redirects too
        *reply = (struct spl_remote_reply){0};
        const char *blank = memchr(line, ' ', length);
        for (const char *c = blank ? blank + 1 : line + length;
             c < line + length && *c >= '0' && *c <= '9' && reply->status < 100; c++)
            reply->status = 10 * reply->status + (*c - '0');
    } else if ((value = value_of(line, length, "content-range", &bytes))) {
        read_range(reply, value, bytes);
    } else if ((value = value_of(line, length, "retry-after", &bytes))) {
        read_retry_after(reply, value, bytes);
    } else if ((value = value_of(line, length, "etag", &bytes))) {
        copy(reply->etag, sizeof reply->etag, value, bytes);
    } else if ((value = value_of(line, length, "last-modified", &bytes))) {
        copy(reply->modified, sizeof reply->modified, value, bytes);
    } else if ((value = value_of(line, length, "content-encoding", &bytes))) {
        copy(reply->encoding, sizeof reply->encoding, bytes < sizeof reply->encoding ? value : "unknown",
             bytes < sizeof reply->encoding ? bytes : 7);
    } else if (e->at && reply->status >= 300 && reply->status < 400 &&
               (value = value_of(line, length, "location", &bytes))) {
        e->astray = !spl_curl_may_go_on(e->server->curl, e->at, value, bytes, e->server->own, e->server->may_land);
        return e->astray ? 0 : length;
    }
    return length;
}

static size_t on_body(char *data, size_t one, size_t bytes, void *context)
{
    struct exchange *e = context;
    (void)one;
    e->moved_ns = spl_now_ns();
    if (e->reply->status == 206) {
        if (!e->begun && !e->refused)
            e->begun = !(e->refused = !e->ask->begin(e->ask->context));
        e->refused = e->refused || !e->ask->take(e->ask->context, data, bytes);
        return e->refused ? 0 : bytes;
    }
    size_t room = refusal_bytes - e->refusal_used, some = bytes < room ? bytes : room;
    memcpy(e->refusal + e->refusal_used, data, some);
    e->refusal_used += some;
    e->swallowed += bytes; // a short refusal is read to its end, so that the connection can be used again
    e->refused = e->reply->status < 300 || e->swallowed > swallowed_most;
    return e->refused ? 0 : bytes;
}

/* Called once a second at least. */
static int on_progress(void *context, curl_off_t a, curl_off_t b, curl_off_t c, curl_off_t d)
{
    struct exchange *e = context;
    (void)a, (void)b, (void)c, (void)d;
    e->stalled = spl_now_ns() - e->moved_ns > e->ask->stall_ms * SPL_NS_PER_MS;
    return e->stalled || spl_is_cancelled(e->ask->cancelled);
}

/* <Code>AccessDenied</Code> of an S3 error: a word, or nothing. */
static void read_code(struct exchange *e)
{
    const char *begin = strstr(e->refusal, "<Code>");
    size_t length = begin ? strspn(begin + 6, "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789.") : 0;
    if (length && begin[6 + length] == '<')
        copy(e->reply->code, sizeof e->reply->code, begin + 6, length);
}

static bool may_pass(CURLcode code)
{
    switch (code) {
    case CURLE_COULDNT_RESOLVE_PROXY:
    case CURLE_COULDNT_RESOLVE_HOST:
    case CURLE_COULDNT_CONNECT:
    case CURLE_WEIRD_SERVER_REPLY:
    case CURLE_PARTIAL_FILE:
    case CURLE_OPERATION_TIMEDOUT:
    case CURLE_SSL_CONNECT_ERROR:
    case CURLE_GOT_NOTHING:
    case CURLE_SEND_ERROR:
    case CURLE_RECV_ERROR:
    case CURLE_HTTP2:
    case CURLE_HTTP2_STREAM:
    case CURLE_OUT_OF_MEMORY:
    case CURLE_AGAIN:
        return true;
    default:
        return false;
    }
}

static const char *explain(const struct server *server, const struct exchange *e, CURLcode code)
{
    if (e->stalled)
        return "nothing came any more";
    // without a head it is no redirect to another protocol: curl takes what does not begin like one for HTTP/0.9
    if (code == CURLE_UNSUPPORTED_PROTOCOL && !e->reply->status)
        return "its server sends what is no answer, or more bytes than the length that it says";
    return server->curl->curl_easy_strerror(code);
}

static struct curl_slist *add_header(const struct server *server, struct curl_slist *list, const char *name,
                                     const char *value, bool *refused)
{
    char line[512];
    struct curl_slist *longer = NULL;
    if (!*value)
        return list;
    int length = snprintf(line, sizeof line, "%s: %s", name, value);
    if (length > 0 && (size_t)length < sizeof line)
        longer = server->curl->curl_slist_append(list, line);
    *refused |= !longer;
    return longer ? longer : list;
}

/* All that one request is, on a handle that knows nothing but its connection. */
static bool set_up(const struct server *server, CURL *handle, struct exchange *e, struct curl_slist **headers)
{
    const struct spl_curl *curl = server->curl;
    const struct spl_remote_ask *ask = e->ask;
    const char *authorities = getenv("CURL_CA_BUNDLE");
    const uint64_t left_ms = spl_remaining_ns(ask->deadline_ns) / SPL_NS_PER_MS + 1;
    char range[64];
    bool refused = false;
    snprintf(range, sizeof range, "%" PRIu64 "-%" PRIu64, ask->first, ask->first + ask->bytes - 1);
    *headers = add_header(server, *headers, "If-Match", ask->if_match, &refused);
    *headers = add_header(server, *headers, "If-Unmodified-Since", ask->if_unmodified, &refused);
    *headers = add_header(server, *headers, "Accept-Encoding", "identity", &refused);
    if (server->token_header) {
        struct curl_slist *longer = curl->curl_slist_append(*headers, server->token_header);
        refused |= !longer;
        *headers = longer ? longer : *headers;
    }
#define SET(option, value) (refused |= curl->curl_easy_setopt(handle, option, value) != CURLE_OK)
    SET(CURLOPT_URL, server->url);
    SET(CURLOPT_PROTOCOLS_STR, "http,https");
    SET(CURLOPT_REDIR_PROTOCOLS_STR, server->tls ? "https" : "http,https");
    SET(CURLOPT_FOLLOWLOCATION, server->s3 ? 0L : 1L);
    SET(CURLOPT_MAXREDIRS, (long)redirects_most);
    SET(CURLOPT_PATH_AS_IS, server->s3 ? 1L : 0L);
    SET(CURLOPT_USERAGENT, "splatd/" SPLATD_VERSION);
    SET(CURLOPT_NOSIGNAL, 1L);
    SET(CURLOPT_RANGE, range);
    SET(CURLOPT_HTTPHEADER, *headers);
    SET(CURLOPT_CONNECTTIMEOUT_MS, (long)ask->connect_ms);
    SET(CURLOPT_TIMEOUT_MS, left_ms < 86400000 ? (long)left_ms : 86400000L);
#if LIBCURL_VERSION_NUM >= 0x075700
    /* a name that is still looked up at the deadline goes on without us; a library that is older than its header
     * refuses */
    curl->curl_easy_setopt(handle, CURLOPT_QUICK_EXIT, 1L);
#endif
    curl->curl_easy_setopt(handle, CURLOPT_BUFFERSIZE, 256L << 10); // refused where a handle still has its buffer
    SET(CURLOPT_HEADERFUNCTION, on_header);
    SET(CURLOPT_HEADERDATA, e);
    SET(CURLOPT_WRITEFUNCTION, on_body);
    SET(CURLOPT_WRITEDATA, e);
    SET(CURLOPT_NOPROGRESS, 0L);
    SET(CURLOPT_XFERINFOFUNCTION, on_progress);
    SET(CURLOPT_XFERINFODATA, e);
    if (authorities && *authorities)
        SET(CURLOPT_CAINFO, authorities);
    if (server->sign) {
        SET(CURLOPT_AWS_SIGV4, server->provider);
        SET(CURLOPT_USERNAME, server->key_id);
        SET(CURLOPT_PASSWORD, server->secret);
    }
#undef SET
    return !refused;
}

/* The mutex is held. */
static CURL *unpark(struct server *server)
{
    CURL *handle = server->kept[--server->kept_count];
    parked.handles--;
    if (!server->kept_count)
        TAILQ_REMOVE(&parked.servers, server, link);
    return handle;
}

/* One whose connections are as good, which has some; NULL: none. The mutex is held. */
static struct server *find_alike(const struct server *server)
{
    struct server *other;
    TAILQ_FOREACH_REVERSE(other, &parked.servers, servers, link)
    if (other->origin_bytes == server->origin_bytes && !strncmp(other->url, server->url, server->origin_bytes))
        return other;
    return NULL;
}

static CURL *take_handle(struct server *server)
{
    pthread_mutex_lock(&parked.mutex);
    struct server *from = server->kept_count ? server : find_alike(server);
    CURL *handle = from ? unpark(from) : NULL;
    pthread_mutex_unlock(&parked.mutex);
    return handle ? handle : server->curl->curl_easy_init();
}

static void give_handle(struct server *server, CURL *handle)
{
    server->curl->curl_easy_reset(handle);
    pthread_mutex_lock(&parked.mutex);
    if (server->kept_count)
        TAILQ_REMOVE(&parked.servers, server, link);
    TAILQ_INSERT_TAIL(&parked.servers, server, link);
    CURL *surplus = server->kept_count == handles_kept ? handle : NULL;
    if (!surplus) {
        server->kept[server->kept_count++] = handle;
        if (++parked.handles > handles_kept_of_all)
            surplus = unpark(TAILQ_FIRST(&parked.servers));
    }
    pthread_mutex_unlock(&parked.mutex);
    if (surplus)
        server->curl->curl_easy_cleanup(surplus);
}

static void note_landed(struct server *server, CURL *handle)
{
    char *url = NULL, origin[SPL_REMOTE_ORIGIN_MAX];
    if (server->curl->curl_easy_getinfo(handle, CURLINFO_EFFECTIVE_URL, &url) || !url ||
        !spl_curl_origin_of(server->curl, url, origin))
        return;
    pthread_mutex_lock(&parked.mutex);
    memcpy(server->landed, origin, sizeof origin);
    pthread_mutex_unlock(&parked.mutex);
}

static void get_landed(void *context, char out[SPL_REMOTE_ORIGIN_MAX])
{
    const struct server *server = context;
    pthread_mutex_lock(&parked.mutex);
    memcpy(out, server->landed, SPL_REMOTE_ORIGIN_MAX);
    pthread_mutex_unlock(&parked.mutex);
}

static void ask(void *context, const struct spl_remote_ask *what, struct spl_remote_reply *reply)
{
    struct server *server = context;
    struct exchange e = {.server = server, .ask = what, .reply = reply, .moved_ns = spl_now_ns()};
    struct curl_slist *headers = NULL;
    *reply = (struct spl_remote_reply){0};
    CURL *handle = take_handle(server);
    const bool bound = !server->bound || ((e.at = server->curl->curl_url()) &&
                                          !server->curl->curl_url_set(e.at, CURLUPART_URL, server->url, 0));
    if (!handle || !bound || !set_up(server, handle, &e, &headers)) {
        reply->may_pass = true;
        snprintf(reply->why, sizeof reply->why, "out of memory for a request");
    } else {
        CURLcode code = server->curl->curl_easy_perform(handle);
        curl_off_t seconds = 0;
        if (!reply->retry_after_s && !server->curl->curl_easy_getinfo(handle, CURLINFO_RETRY_AFTER, &seconds) &&
            seconds > 0)
            reply->retry_after_s = (uint64_t)seconds;
        read_code(&e);
        if (reply->status == 206 && !server->bound)
            note_landed(server, handle);
        if (e.astray) {
            snprintf(reply->why, sizeof reply->why,
                     "its server sends it on to another host, where the tiles of a collection are not looked for");
            reply->status = 0;
        } else if (code && !(code == CURLE_WRITE_ERROR && e.refused)) { // what was refused is said by its head
            bool partly = reply->status == 206;
            reply->may_pass = may_pass(code) || e.stalled;
            snprintf(reply->why, sizeof reply->why, "%s", explain(server, &e, code));
            if (!partly || !reply->may_pass)
                reply->status = 0;
        }
    }
    if (handle)
        give_handle(server, handle);
    server->curl->curl_url_cleanup(e.at);
    server->curl->curl_slist_free_all(headers);
}

static void close_server(void *context)
{
    struct server *server = context;
    CURL *handles[handles_kept];
    unsigned count = 0;
    pthread_mutex_lock(&parked.mutex);
    while (server->kept_count)
        handles[count++] = unpark(server);
    pthread_mutex_unlock(&parked.mutex);
    while (count)
        server->curl->curl_easy_cleanup(handles[--count]);
    if (server->secret)
        explicit_bzero(server->secret, strlen(server->secret));
    free(server->url);
    free(server->key_id);
    free(server->secret);
    free(server->token_header);
    free(server->provider);
    free(server);
}

static char *join(const char *a, const char *b)
{
    char *text = NULL;
    return asprintf(&text, "%s%s", a, b) < 0 ? NULL : text;
}

int spl_remote_link_open(const struct spl_remote_url *url, const struct spl_s3_account *account, const char *landed,
                         struct spl_remote_link *out, struct spl_error *err)
{
    *out = (struct spl_remote_link){0};
    const struct spl_curl *curl = spl_curl_open(err);
    if (!curl)
        return SPL_E_UNSUPPORTED;
    struct server *server = spl_alloc(1, sizeof *server, err);
    if (!server)
        return SPL_E_NOMEM;
    server->curl = curl;
    server->tls = url->tls;
    server->s3 = url->s3;
    server->sign = url->s3 && account->key_id && *account->key_id;
    bool refused = !(server->url = strdup(url->get));
    server->bound = landed;
    snprintf(server->may_land, sizeof server->may_land, "%s", landed ? landed : "");
    spl_curl_origin_of(curl, url->get, server->own);
    const char *host = strstr(url->get, "://");
    server->origin_bytes = host ? (size_t)(host + 3 - url->get) + strcspn(host + 3, "/?") : strlen(url->get);
    if (server->sign) {
        const char *region = account->region && *account->region ? account->region : "us-east-1";
        char provider[128];
        snprintf(provider, sizeof provider, "aws:amz:%.64s:s3", region);
        refused |= !(server->key_id = strdup(account->key_id)) || !(server->secret = strdup(account->secret)) ||
                   !(server->provider = strdup(provider));
        if (account->token && *account->token)
            refused |= !(server->token_header = join("x-amz-security-token: ", account->token));
    }
    if (refused) {
        close_server(server);
        return spl_fail(err, SPL_E_NOMEM, "out of memory for a URL");
    }
    *out = (struct spl_remote_link){
        .ask = ask, .close = close_server, .context = server, .get_landed = get_landed};
    return SPL_OK;
}
