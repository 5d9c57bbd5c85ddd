/* The few bodies that may be long at a time. A place is taken once a body is longer than others may be, and kept only
 * by who goes on sending: a client that dawdles is cut as soon as another wants its place, and left alone while nobody
 * does. So whoever would keep all places has to send 256 KiB to each of them every 5 s. Owned by the loop's thread. */
#include <stdlib.h>

#include "base/clock.h"
#include "service/exchange.h"
#include "service/http.h"
#include "service/ops/counters.h"
#include "service/reply.h"
#include "service/state.h"

enum { step = 256 * 1024, patience_s = 5 }; /* fewer bytes than a step in this time is to dawdle */

/* The one that dawdles longest; may be NULL. Those whose body is there are not looked at: they wait for us. */
static struct request *find_dawdler(struct spl_http *http)
{
    struct connection *connection;
    struct request *slowest = NULL;
    uint64_t before = spl_now_ns() - patience_s * SPL_NS_PER_S;
    LIST_FOREACH(connection, &http->connections, link)
    {
        struct request *request = connection->request;
        if (!request || !request->is_long || connection->phase != PHASE_UPLOADING || request->stepped_ns > before)
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
                         "the body comes too slowly to keep its place among long ones, which another request wants");
    spl_long_body_end(request);
    free(request->body);
    request->body = NULL;
    request->body_length = request->body_capacity = 0;
}

void spl_long_body_end(struct request *request)
{
    request->service->http->long_bodies -= request->is_long;
    request->is_long = false;
}

bool spl_long_body_begin(struct request *request)
{
    struct spl_http *http = request->service->http;
    struct spl_error err = {0};
    uint64_t at = request->body_seen / step;
    if (!request->is_long && request->body_seen > body_max) {
        struct request *dawdler = http->long_bodies == long_bodies_max ? find_dawdler(http) : NULL;
        if (dawdler)
            give_up(dawdler);
        if (http->long_bodies == long_bodies_max) {
            spl_fail_field(&err, SPL_E_BUSY, "body", "%d bodies of more than 1 MiB are on their way; come back later",
                           (int)long_bodies_max);
            spl_reply_error(request, &err);
            return false;
        }
        request->is_long = true;
        http->long_bodies++;
    }
    if (request->is_long && at != request->steps) {
        request->steps = at;
        request->stepped_ns = spl_now_ns();
    }
    return true;
}
