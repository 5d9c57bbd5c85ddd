/* Bodies that are kept in memory while they come: how many bytes all of them may have together, and the few that may be
 * long. Small ones always get in. What is beyond that is counted by its room until somebody has read it; where there is
 * no more, and for a place among long ones, a client that dawdles is cut as soon as another wants what it has, and left
 * alone while nobody does. So whoever would keep all has to send 256 KiB to each body every 5 s.
 *
 * Invariant: spl_http.body_bytes is the sum of all requests' body_counted, and long_bodies counts those that are long.
 * What of a body is not kept, because it was refused or is too large, is read and dropped up to drain_max, because a
 * client that is cut off while sending seldom reads the reply. Owned by the loop's thread. */
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "service/exchange.h"
#include "service/http.h"
#include "service/ops/counters.h"
#include "service/reply.h"
#include "service/state.h"

enum {
    drain_max = 8 * body_max,
    body_small = 64 * 1024,          /* is not counted */
    body_bytes_max = 128 * body_max, /* of what is counted; long bodies have a bound of their own */
    step = 256 * 1024,
    patience_s = 5, /* fewer bytes than a step in this time is to dawdle */
};

size_t spl_body_get_most(const struct request *request)
{
    return request->body_most > body_max ? request->body_most : body_max;
}

size_t spl_body_get_drained(const struct request *request)
{
    size_t most = spl_body_get_most(request);
    return most > drain_max ? most : drain_max;
}

static void count(struct request *request, size_t bytes)
{
    size_t *all = &request->service->http->body_bytes;
    *all = *all - request->body_counted + bytes;
    request->body_counted = bytes;
}

char *spl_body_take(struct request *request)
{
    char *body = request->body;
    request->body = NULL;
    request->body_length = request->body_capacity = 0;
    count(request, 0);
    return body;
}

void spl_body_drop(struct request *request)
{
    free(spl_body_take(request));
}

void spl_body_end_long(struct request *request)
{
    request->service->http->long_bodies -= request->is_long;
    request->is_long = false;
}

/* The one that dawdles longest among the long ones, or the counted; may be NULL. Those whose body is there are not
 * looked at: they wait for us. */
static struct request *find_dawdler(struct spl_http *http, bool is_long)
{
    struct connection *connection;
    struct request *slowest = NULL;
    uint64_t before = spl_now_ns() - patience_s * SPL_NS_PER_S;
    LIST_FOREACH(connection, &http->connections, link)
    {
        struct request *request = connection->request;
        bool comes = connection->phase == PHASE_UPLOADING || connection->phase == PHASE_READING;
        if (!request || !comes || !(is_long ? request->is_long : request->body_counted > 0) ||
            request->stepped_ns > before)
            continue;
        if (!slowest || request->stepped_ns < slowest->stepped_ns)
            slowest = request;
    }
    return slowest;
}

static void give_up(struct request *request)
{
    spl_count(request->service->counters, slow_closed);
    spl_refuse_on_socket(request, MHD_HTTP_REQUEST_TIMEOUT, "body",
                         request->is_long
                             ? "the body comes too slowly to keep its place among long ones, which another wants"
                             : "the body comes too slowly to keep its memory, which another request wants");
    spl_body_end_long(request);
    spl_body_drop(request);
}

/* One of the few from now on; false: there are enough, and it is refused. */
static bool begin_long(struct request *request)
{
    struct spl_http *http = request->service->http;
    struct request *dawdler = http->long_bodies == long_bodies_max ? find_dawdler(http, true) : NULL;
    if (dawdler)
        give_up(dawdler);
    if (http->long_bodies == long_bodies_max) {
        struct spl_error err = {0};
        spl_fail_field(&err, SPL_E_BUSY, "body", "%d bodies of more than 1 MiB are on their way; come back later",
                       (int)long_bodies_max);
        spl_reply_error(request, &err);
        return false;
    }
    request->is_long = true;
    http->long_bodies++;
    count(request, 0);
    return true;
}

/* Counts the room that the body is about to grow to; false: all have as much as they may, and it is refused. */
static bool count_room(struct request *request, size_t room)
{
    struct spl_http *http = request->service->http;
    struct request *dawdler;
    while (http->body_bytes - request->body_counted + room > body_bytes_max && (dawdler = find_dawdler(http, false)) &&
           dawdler != request)
        give_up(dawdler);
    if (http->body_bytes - request->body_counted + room > body_bytes_max) {
        struct spl_error err = {0};
        spl_fail_field(&err, SPL_E_BUSY, "body", "bodies on their way have %d MiB together; come back later",
                       (int)(body_bytes_max / body_max));
        spl_reply_error(request, &err);
        return false;
    }
    count(request, room);
    return true;
}

/* Twice as much where it grows, but not past what makes it another kind of body. A long one has all its room at once,
 * most of it untouched: growing copies, which took 80 ms of 16 MiB. */
static size_t get_room(const struct request *request)
{
    const size_t seen = request->body_seen, twice = 2 * request->body_capacity;
    const size_t most = seen <= body_small ? body_small : body_max;
    if (request->is_long)
        return spl_body_get_most(request);
    if (seen <= request->body_capacity)
        return request->body_capacity;
    return twice < seen ? seen : twice < most ? twice : most;
}

/* Has the body room for what has been seen of it, and is that counted? False: it is refused, or `*lacks` memory. */
static bool make_room(struct request *request, bool *lacks)
{
    if (!request->is_long && request->body_seen > body_max && !begin_long(request))
        return false;
    const size_t room = get_room(request);
    if (!request->is_long && room > body_small && room > request->body_counted && !count_room(request, room))
        return false;
    uint64_t at = request->body_seen / step;
    if (!request->stepped_ns || at != request->steps) {
        request->steps = at;
        request->stepped_ns = spl_now_ns();
    }
    char *grown = room > request->body_capacity ? spl_realloc(request->body, room, 1, NULL) : request->body;
    *lacks = !grown;
    if (*lacks)
        return false;
    request->body = grown;
    request->body_capacity = room;
    return true;
}

bool spl_body_append(struct request *request, const char *data, size_t length)
{
    bool lacks = false;
    request->body_seen += length;
    if (request->body_seen > spl_body_get_most(request)) {
        spl_body_drop(request);
        return request->body_seen <= spl_body_get_drained(request);
    }
    if (!make_room(request, &lacks)) {
        spl_body_drop(request);
        return !lacks;
    }
    memcpy(request->body + request->body_length, data, length);
    request->body_length += length;
    return true;
}
