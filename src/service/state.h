/* What the files of the loop share. Everything here is owned by the loop's thread but for the atomics in `counters`. */
#ifndef SPL_SERVICE_STATE_H
#define SPL_SERVICE_STATE_H

#include <jansson.h>
#include <microhttpd.h>
#include <sys/queue.h>
#include <uv.h>

#include "service/access/access.h"
#include "service/datasets/catalog.h"
#include "service/ops/access_log.h"
#include "service/ops/latency.h"
#include "service/ops/loop_turns.h"
#include "service/service.h"
#include "service/view/cache.h"
#include "service/view/pipeline.h"

enum {
    uri_max = 8 * 1024,
    body_max = 1024 * 1024,
    connection_pool = 14 * 1024, /* libmicrohttpd's pool; see oversize.c */
    reply_bytes_max = 1 << 30, /* of small views, and of large ones; beyond, they are refused until clients have read */
};

enum phase {
    PHASE_IDLE,      /* between a reply and the next request's first line */
    PHASE_READING,   /* from accept, or a first line, to the end of the request */
    PHASE_UPLOADING, /* a dataset's body, from one MiB that is stored to the next that is there */
    PHASE_WORKING,
    PHASE_WRITING,
};

/* One TCP connection, from accept to close. */
struct connection {
    LIST_ENTRY(connection) link; // spl_service.connections
    struct spl_service *service;
    int fd; // owned by: MHD
    enum phase phase;
    uint64_t since_ns;   /* when the phase began */
    uint64_t sent_bytes; /* at the end of the last request that was logged */
    struct request *request; // may be NULL; the one that is under way
};

/* A claim on a view that is on its way; in the caller's storage. */
struct ticket {
    LIST_ENTRY(ticket) link; // flight.tickets
    struct flight *flight;   // NULL: nothing is claimed
    uint64_t deadline_ns;
    const char *route; /* for statistics; static, NULL: none */
    bool shared;       /* it was on its way for another request already */
    /* Once, unless it is dropped: the rendering, borrowed, or NULL and why not. */
    void (*done)(struct ticket *ticket, struct spl_rendering *rendering, const struct spl_error *err);
};

/* One request, from its first line until its reply is written. */
struct request {
    LIST_ENTRY(request) link; // spl_service.waiting, while `waits`
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
    char *body;        // may be NULL
    size_t body_length, body_capacity, body_seen;
    const struct spl_token *token; // may be NULL; what it shows, only while it is routed
    bool started;
    bool has_host;  /* of HTTP/1.1, which demands it */
    bool head;      /* the method is HEAD */
    bool closes;    /* the connection ends with the reply */
    bool prepared;  /* the reply has its last headers and is counted */
    bool abandoned; /* the client has left: close without a reply */
    bool suspended; /* libmicrohttpd does not go on with it */
    bool waits;     /* suspended, until a view is ready or deadline_ns */
    uint64_t deadline_ns;
    struct batch *batch;           // may be NULL; the views that it waits for
    struct spl_tour_wish *wish;    // may be NULL; the tour that it waits for
    struct ticket ticket;          /* of the view that it waits for */
    bool validated;                /* the reply to a GET of a view: it carries ETag and Cache-Control */
    bool versioned;                /* the URL names the dataset's version */
    bool large;                    /* the view goes the large ones' way */
    struct change *change;         /* of a dataset, in progress; NULL otherwise */
    struct MHD_Response *response; // may be NULL
    unsigned status;
};

/* Looks at the served paths and brings the catalog up to date with them. */
struct library {
    uv_timer_t timer;
    size_t tasks;                /* in the thread pool */
    bool looking;                /* one of them is a look */
    bool stopped;                /* nothing new is begun, what comes back is thrown away */
    atomic_bool cancelled;       /* what is being opened is given up; read by every thread that opens */
    uint64_t looks;              /* so far */
    struct spl_error last;       /* of the last look, so that it is logged once */
    const char *directory;       // may be NULL; where clients' datasets go: the first directory served
    LIST_HEAD(, change) changes; /* of clients, in progress */
    uint64_t changes_made;       /* a look that began before one of them says nothing */
};

/* When a libmicrohttpd daemon has its next turn without a descriptor's event. */
struct spl_http_turns {
    uv_timer_t timer; /* its own timeouts */
    uv_idle_t again;  /* it has more to do at once */
    unsigned eager;   /* times that it had */
};

struct spl_service {
    const struct spl_service_options *options;
    struct spl_catalog catalog;
    struct spl_catalog_entry **entries; /* of the catalog at start, for the pipeline */
    struct library library;
    struct spl_access *access; // may be NULL: there is nothing to check
    struct spl_pipeline *pipeline;
    struct spl_tours *tours; /* tour.h; NULL without --tours */
    struct spl_counters counters;
    struct spl_latencies latencies;
    struct spl_access_log access_log;
    uint64_t started_ns;
    double started_unix_s; /* the same by the clock on the wall, read once */
    char url[192];
    int listen_fd; /* -1 once MHD has it */
    int ops_fd;    /* passed by the supervisor; -1 = none, or once MHD has it */

    uv_loop_t loop;
    struct spl_loop_turns loop_turns;
    uv_async_t wake;
    uv_signal_t signals[2], hangup;
    uv_poll_t http_poll;
    struct spl_http_turns http_turns;
    uv_timer_t wait_timer;              /* deadlines and departures, while requests wait */
    uv_timer_t slow_timer;              /* connections that take too long */
    uv_timer_t drain_timer;             /* while stopping */
    uv_timer_t look_timer;              /* health.c */
    enum spl_pipeline_state said_state; /* to the supervisor; owned by: health.c */
    struct MHD_Daemon *ops;             // may be NULL
    uv_poll_t ops_poll;
    struct spl_http_turns ops_turns;

    struct MHD_Daemon *daemon; // may be NULL
    LIST_HEAD(, connection) connections;
    LIST_HEAD(, request) waiting;
    LIST_HEAD(, flight) flights;
    struct spl_cache *cache;
    size_t waiting_count, requests_open, connections_open;
    size_t reply_bytes;       /* of views that clients have not read yet and that are not in the cache */
    size_t large_reply_bytes; /* the same of large views */
    bool loading;             /* the datasets at start are being opened; there is no pipeline yet */
    bool leaving;             /* asked to stop: /readyz says no */
    bool draining;            /* nothing more is accepted */
    uint64_t drain_began_ns;
    struct spl_error failure;
};

/* http.c: the MHD daemon inside the uv loop. */
int spl_http_start(struct spl_service *service, struct spl_error *err);
void spl_http_quiesce(struct spl_service *service); /* stops accepting; idempotent */
void spl_http_stop(struct spl_service *service);    /* closes every connection; idempotent */
void spl_http_pump(struct spl_service *service);    /* lets MHD work; call after a resume */
void spl_request_finish(struct request *request, enum MHD_RequestTerminationCode code); /* frees it */
/* The one way to have libmicrohttpd leave a request alone, and take it up again; both idempotent. */
void spl_request_suspend(struct request *request);
void spl_request_resume(struct request *request);

/* framing.c: false, with the reply set, for a request whose end another reader could see elsewhere. `line` and `version`
 * are libmicrohttpd's method, where the request's bytes begin, and version. */
bool spl_check_framing(struct request *request, const char *line, const char *version);

/* Lets a daemon do what it can without waiting, and has one of the handles call back when it wants to go on. */
void spl_http_run(struct MHD_Daemon *daemon, struct spl_http_turns *turns, uv_timer_cb on_timer, uv_idle_cb on_again);

/* connections.c: every connection, and how long its phases may take. */
void spl_connection_notify(void *service, struct MHD_Connection *handle, void **socket_context,
                           enum MHD_ConnectionNotificationCode code);
void spl_connection_enter(struct connection *connection, enum phase phase); /* its time begins */
void spl_connections_watch(struct spl_service *service);                    /* from now on the slow ones are closed */

/* oversize.c: requests that libmicrohttpd would not answer are `abandoned`, answered past it. The first looks at the
 * target, still encoded; the second is for when the headers are there. */
void spl_refuse_many_parameters(struct request *request, const char *uri);
void spl_refuse_many_headers(struct request *request);
/* Answers past libmicrohttpd and ends the connection; `detail` needs no quoting. */
void spl_refuse_on_socket(struct request *request, unsigned status, const char *field, const char *detail);

/* flights.c: views on their way. Boards the flight of an equal request or launches one; SPL_E_BUSY when the queue is
 * full. The caller has set ticket->deadline_ns, route and done, and keeps the ticket where it is until then or until it
 * is dropped: the view is given up with its last ticket. */
int spl_flight_board(struct spl_service *service, struct ticket *ticket, struct spl_catalog_entry *entry,
                     const struct spl_view_request *request, const struct spl_key *key, struct spl_error *err);
void spl_ticket_drop(struct ticket *ticket); /* harmless where nothing is claimed */

/* waiting.c: requests that wait for views. */
void spl_waiting_add(struct request *request, uint64_t deadline_ns); /* suspends it */
void spl_waiting_resume(struct request *request);                    /* its response is set */
void spl_waiting_complete(struct spl_service *service);              /* hands out every job that is done */
void spl_waiting_sweep(struct spl_service *service);                 /* deadlines and departures */
void spl_waiting_refuse_all(struct spl_service *service);

/* loading.c: opens the datasets at start beside the loop, then calls spl_service_go_on() or stops the loop. */
int spl_loading_start(struct spl_service *service, struct spl_error *err);

/* service.c: cache, tours and pipeline, once datasets and tours are open. */
int spl_service_go_on(struct spl_service *service, struct spl_error *err);

/* library.c: datasets that come, change and go while the service runs. */
void spl_library_start(struct spl_service *service);        /* once the pipeline is ready */
void spl_library_take_changes(struct spl_service *service); /* what the gpu thread has added, refused and let go of */
void spl_library_serve(struct spl_catalog_slot *slot, struct spl_catalog_entry *entry); /* takes the resident `entry` */
void spl_library_stop(struct spl_service *service); /* waits for the thread pool; idempotent */

/* change_route.c, change.c: PUT and DELETE of a dataset. */
void spl_put_dataset(struct request *request, const struct spl_call *call);
void spl_delete_dataset(struct request *request, const struct spl_call *call);
bool spl_change_take(struct request *request, const char *data, size_t length); /* of the body; false: no memory */
void spl_change_end(struct request *request);                                   /* of the body */
void spl_change_abandon(struct request *request);                               /* its client has left; idempotent */
void spl_change_refuse_all(struct spl_service *service);
void spl_change_forget_all(struct spl_service *service); /* once no thread has one, and no request */
/* `entry` is resident, or refused with entry->err. True: it is a client's, and taken. */
bool spl_change_take_answer(struct spl_service *service, struct spl_catalog_entry *entry);

/* routes.c: fills request->response, or hands a job to the pipeline. */
void spl_route(struct request *request, const char *method);

/* What a route's handler is called with; valid during the call. */
enum spl_http_method { SPL_GET, SPL_POST, SPL_PUT, SPL_DELETE }; /* HEAD is GET as well: MHD leaves the body out */
struct spl_call {
    enum spl_http_method method;
    char id[256];                    /* of the dataset in the path, decoded; "" without */
    struct spl_catalog_entry *entry; // may be NULL: no {id} in the path, or a route of scope ADMIN
    char name[256];                  /* the path's other segment, decoded; "" without */
    char number[24];                 /* the path's {n}, decoded; "" without */
};

/* view/route.c: /v1/datasets/{id}/view and /pick. */
void spl_make_view(struct request *request, const struct spl_call *call);
void spl_pick(struct request *request, const struct spl_call *call);

/* batch.c: /v1/datasets/{id}/views. */
void spl_make_views(struct request *request, const struct spl_call *call);
void spl_batch_go_on(struct batch *batch);   /* asks for the next views where it may; never blocks */
void spl_batch_abandon(struct batch *batch); /* its request no longer waits for it; NULL-safe */

/* tour/create.c: its request no longer waits for it; NULL-safe. */
void spl_tour_wish_abandon(struct spl_tour_wish *wish);

/* view/route.c: what views and batches of them check alike. */
int spl_view_check_version(const struct spl_view_request *view, const struct spl_dataset_info *info,
                           struct spl_error *err);
/* Too much waits for clients. */
bool spl_view_has_no_room(const struct spl_service *service, const struct spl_view_request *view,
                          struct spl_error *err);
struct spl_camera_limits spl_view_get_limits(const struct spl_service *service);

/* profile_route.c: /v1/datasets/{id}/profile. */
void spl_show_profile(struct request *request, const struct spl_call *call);

/* openapi_route.c: /v1/openapi.yaml and .json. */
void spl_show_openapi_yaml(struct request *request, const struct spl_call *call);
void spl_show_openapi_json(struct request *request, const struct spl_call *call);

/* page_route.c: / for browsers, /viewer/, /embed/ and /clients/, all from the binary. */
bool spl_wants_page(struct request *request); /* its Accept names text/html, and nothing of JSON before that */
void spl_show_page(struct request *request);
void spl_show_viewer_file(struct request *request, const struct spl_call *call);
void spl_show_embed(struct request *request, const struct spl_call *call);
void spl_list_clients(struct request *request, const struct spl_call *call);
void spl_show_client(struct request *request, const struct spl_call *call);

/* reply.c: each sets request->response and status; without memory the response stays NULL and the connection closes. */
void spl_reply_problem(struct request *request, unsigned status, const char *type, const char *field,
                       const char *detail);
void spl_reply_error(struct request *request, const struct spl_error *err); /* status and Retry-After by its code */
void spl_reply_json(struct request *request, json_t *json);                 /* takes the reference */
void spl_reply_empty(struct request *request, unsigned status);
void spl_reply_text(struct request *request, const char *type, char *body); /* 200; takes `body`, malloc'd or NULL */
/* 200, of a length that nobody knows when it begins; `destroy` gets `context` with the last of the reply, not after
 * failure. The only way to such a reply, HEAD included. */
void spl_reply_stream(struct request *request, size_t block, MHD_ContentReaderCallback read, void *context,
                      MHD_ContentReaderFreeCallback destroy);

/* The same for views. `origin` is Splatd-Cache's value. */
void spl_reply_rendering(struct request *request, struct spl_rendering *rendering, const char *origin);
void spl_reply_not_modified(struct request *request, const struct spl_key *key);
/* A batch; takes *bundle. `failed` parts of it are problems. */
void spl_reply_bundle(struct request *request, struct spl_encoded *bundle, size_t failed);
/* The body of a problem, malloc'd; NULL without memory. */
char *spl_problem_text(const struct request *request, const struct spl_error *err);
/* What HEAD says of a view that nobody has rendered. */
void spl_reply_view_head(struct request *request, const struct spl_view_request *view, const struct spl_key *key);

/* describe.c: new references; NULL without memory. */
json_t *spl_describe_slot(const struct spl_catalog_slot *slot);
json_t *spl_describe_dataset(const struct spl_catalog_entry *entry, bool full);
json_t *spl_describe_status(struct request *request);

uint64_t spl_resident_bytes(void); /* of this process, 0 when unknown */

#endif
