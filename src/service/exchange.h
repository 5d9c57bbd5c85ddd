/* One request of HTTP and its reply, and how it waits for what others make. Owned by the loop's thread. */
#ifndef SPL_SERVICE_EXCHANGE_H
#define SPL_SERVICE_EXCHANGE_H

#include <jansson.h>
#include <microhttpd.h>
#include <stdbool.h>
#include <stdint.h>
#include <sys/queue.h>

#include "service/view/flights.h"

/* From its first line until its reply is written. */
struct request {
    LIST_ENTRY(request) link;            // spl_http.waiting, while `waits`
    TAILQ_ENTRY(request) postponed_link; // spl_http.postponed, while `postponed`
    struct spl_service *service;
    struct MHD_Connection *handle;
    struct connection *connection;
    uint64_t number, began_ns;
    char id[65]; /* X-Request-Id of the reply */
    char method[16];
    const char *route; /* its pattern; NULL when there is none */
    const char *cache; /* for the log: "hit", "miss", …; NULL where no cache was asked */
    char *uri;         /* path, cut at '?'; NULL when the URI was too long */
    const char *query; /* inside uri, "" when there is none */
    const char *target_begin, *target_end; // of libmicrohttpd's own text; for framing.c alone
    const char *chunks; // may be NULL; where libmicrohttpd keeps a body in chunks, for malformed.c alone
    char *body;        // may be NULL
    size_t body_length, body_capacity, body_seen;
    size_t body_counted; /* bytes of it in spl_http.body_bytes */
    const struct spl_token *token; // may be NULL; what it shows, only while it is routed
    char grant[96];                // "exp=…&sig=…" of a signed URL, which its query has no more; else ""
    int64_t expires_s;             // Unix time, of that; 0 = it is not signed
    bool started;
    bool has_host;  /* of HTTP/1.1, which demands it */
    bool head;      /* the method is HEAD */
    bool closes;    /* the connection ends with the reply */
    bool comes;     /* some of its body has come */
    bool prepared;  /* the reply has its last headers and is counted */
    bool abandoned; /* the client has left: close without a reply */
    bool suspended; /* libmicrohttpd does not go on with it */
    bool waits;     /* suspended, until a view is ready or deadline_ns */
    bool postponed; /* it waits for a turn of the loop that has time for it, */
    bool admitted;  /* and this is the one, if those before it leave time */
    uint64_t postponed_as; /* its number among these */
    uint64_t deadline_ns;
    struct batch *batch;           // may be NULL; the views that it waits for
    struct spl_tour_wish *wish;    // may be NULL; the path being read that it waits for
    struct spl_tour *tour;         // may be NULL; the tour that it made or removed, until that is on the disk
    struct spl_place_wish *place;  // may be NULL; the coordinate system that it waits for
    struct spl_saving *saving;     // may be NULL; the view being saved that it waits for
    bool wants_body;               /* it is routed again once its body is there */
    size_t body_most;              /* bytes that body may have, set by then; 0 = body_max */
    bool is_long;                  /* it has more than body_max: one of spl_http.long_bodies */
    uint64_t steps, stepped_ns;    /* how far its body has come, and when; for bodies.c alone */
    struct spl_ray_wish *ray_wish; // may be NULL; the list of rays being read that it waits for
    struct spl_rays *rays;         // may be NULL: not read yet; with what stood beside it in JSON:
    json_t *rest;                  // may be NULL: the query has it
    unsigned places;               /* such that it has waited for */
    struct ticket ticket;          /* of the view that it waits for */
    bool validated;                /* the reply to a GET of a view: it carries ETag and Cache-Control */
    bool versioned;                /* the URL names the dataset's version */
    bool large;                    /* the view goes the large ones' way */
    struct change *change;         /* of a dataset, in progress; NULL otherwise */
    struct MHD_Response *response; // may be NULL
    unsigned status;
};

/* What a route's handler is called with; valid during the call. */
enum spl_http_method { SPL_GET, SPL_POST, SPL_PUT, SPL_DELETE }; /* HEAD is GET as well: MHD leaves the body out */
struct spl_call {
    enum spl_http_method method;
    char id[256];                    /* of the dataset in the path, decoded; "" without */
    struct spl_catalog_entry *entry; // may be NULL: no {id} in the path, or a route of scope ADMIN
    char name[256];                  /* the path's other segment, or a tile's three, decoded; "" without */
    char number[24];                 /* the path's {n}, decoded; "" without */
};

/* routes.c: fills request->response, or has the request wait. */
void spl_route(struct request *request, const char *method);
/* A POST that is routed before its body, which may be a long one. */
bool spl_route_takes_long(const struct request *request);

/* http.c: frees it. */
void spl_request_finish(struct request *request, enum MHD_RequestTerminationCode code);
/* The one way to have libmicrohttpd leave a request alone, and take it up again; both idempotent. */
void spl_request_suspend(struct request *request);
void spl_request_resume(struct request *request);

/* waiting.c: requests that wait for views, batches and tours. */
void spl_waiting_add(struct request *request, uint64_t deadline_ns); /* suspends it */
void spl_waiting_resume(struct request *request);                    /* its response is set */
void spl_waiting_refuse_all(struct spl_service *service);            /* and all that comes later */

/* waiting.c: how long one turn of the loop handles requests. What that took since `began_ns` is added; once the turn is
 * over, or others wait, a request that is to be handled is postponed: then true, and it is handled again. */
bool spl_turn_is_over(struct spl_service *service);
void spl_turn_add(struct spl_service *service, uint64_t began_ns);
bool spl_waiting_postpone(struct request *request);

#endif
