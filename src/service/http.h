/* HTTP/1.1 by libmicrohttpd inside the loop: its connections, and how many requests are open and wait. Owned by the
 * loop's thread. */
#ifndef SPL_SERVICE_HTTP_H
#define SPL_SERVICE_HTTP_H

#include <microhttpd.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <sys/queue.h>
#include <uv.h>

#include "base/error.h"

struct spl_service;
struct request;

enum {
    uri_max = 8 * 1024,
    body_max = 1024 * 1024,
    long_bodies_max = 8, /* that are longer, at a time */
    connection_pool = 17 * 1024, /* libmicrohttpd's pool; see oversize.c */
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
    LIST_ENTRY(connection) link; // spl_http.connections
    struct spl_service *service;
    int fd; // owned by: MHD
    enum phase phase;
    uint64_t since_ns;   /* when the phase began */
    uint64_t sent_bytes; /* at the end of the last request that was logged */
    uint64_t taken;      /* bytes that libmicrohttpd had read of it when it was looked at last, and has done with since;
                            SPL_TAKEN_UNKNOWN: it may have more to do with them */
    bool had_left;       /* its client, at the last sweep */
    uint64_t looked_at;  /* bytes that were read of it when it was looked at last, while more waited; else
                            SPL_TAKEN_UNKNOWN */
    unsigned looks;      /* in which these have been the same */
    struct request *request; // may be NULL; the one that is under way
};

/* When a libmicrohttpd daemon has its next turn without a descriptor's event. */
struct spl_http_turns {
    uv_timer_t timer; /* its own timeouts */
    uv_idle_t again;  /* it has more to do at once */
    unsigned eager;   /* times that it had */
};

struct spl_http {
    int listen_fd; /* -1 before it is open, and once MHD has it */
    char url[192];
    struct MHD_Daemon *daemon; // may be NULL
    uv_poll_t poll;
    struct spl_http_turns turns;
    LIST_HEAD(, connection) connections;
    size_t connections_open, requests_open;
    size_t long_bodies; /* of requests, longer than body_max */
    size_t body_bytes;  /* of the others, as far as they are counted */
    uv_timer_t slow_timer; /* connections that take too long */
    uint64_t looked_ns;    /* when those were looked for last whose buffers are full to no end */

    LIST_HEAD(, request) waiting; // the last came first
    size_t waiting_count;
    uv_timer_t wait_timer; /* deadlines and departures, while requests wait */

    TAILQ_HEAD(, request) postponed; /* those of them that wait for a turn of the loop that has time, oldest first */
    uint64_t postponed_ever;
    uv_idle_t next;               /* while there are any */
    uint64_t turn_ns, handled_ns; /* the turn that was looked at last, and what handling took in it */
    bool ends;                    /* what still comes is refused at once */
};

/* http.c: the MHD daemon inside the uv loop. init makes what the loop holds, and opens nothing. */
void spl_http_init(struct spl_service *service);
int spl_http_start(struct spl_service *service, struct spl_error *err);
void spl_http_quiesce(struct spl_service *service); /* stops accepting; idempotent */
void spl_http_stop(struct spl_service *service);    /* closes every connection; idempotent */
void spl_http_pump(struct spl_service *service);    /* lets MHD work; call after a resume */

/* Lets a daemon do what it can without waiting, and has one of the handles, whose data is the service, call back when
 * it wants to go on; true: that is at once. */
void spl_http_turns_init(struct spl_http_turns *turns, struct spl_service *service);
bool spl_http_run(struct MHD_Daemon *daemon, struct spl_http_turns *turns, uv_timer_cb on_timer, uv_idle_cb on_again);

/* connections.c: every connection, and how long its phases may take. */
void spl_connection_notify(void *service, struct MHD_Connection *handle, void **socket_context,
                           enum MHD_ConnectionNotificationCode code);
void spl_connection_enter(struct connection *connection, enum phase phase); /* its time begins */
void spl_connections_watch(struct spl_service *service);                    /* from now on the slow ones are closed */

/* connections.c: answers and ends those in whose buffers libmicrohttpd waits for the end of a line and has no room for
 * it. To be called when it wants to go on at once, as it does with these forever; behind its turn. */
void spl_connections_refuse_endless(struct spl_service *service);

/* framing.c: false, with the reply set, for a request whose end another reader could see elsewhere. `line` and
 * `version` are libmicrohttpd's method, where the request's bytes begin, and version. */
bool spl_check_framing(struct request *request, const char *line, const char *version);

/* bodies.c: keeps a piece of the body, or refuses the request where others have what it needs, and keeps nothing more;
 * false: the connection had better end, without memory or past what is read at all. */
bool spl_body_append(struct request *request, const char *data, size_t length);
size_t spl_body_get_most(const struct request *request);    /* bytes that are kept */
size_t spl_body_get_drained(const struct request *request); /* that are read at all */
char *spl_body_take(struct request *request);    /* the caller's, to free; may be NULL */
void spl_body_drop(struct request *request);     /* idempotent, as the next */
void spl_body_end_long(struct request *request); /* its place among long ones is another's */

/* malformed.c: libmicrohttpd's log, where it says that it refuses a request by itself. */
void spl_malformed_log(void *service, const char *format, va_list arguments);
/* What the chunk that begins at `data` says of its size; 0: none begins there, or its size came earlier. */
uint64_t spl_chunk_get_size(const struct request *request, const char *data);

/* oversize.c: requests that libmicrohttpd would not answer are `abandoned`, answered past it. The first looks at the
 * target, still encoded; the second is for when the headers are there. */
void spl_refuse_many_parameters(struct request *request, const char *uri);
void spl_refuse_many_headers(struct request *request);
/* Answers past libmicrohttpd and ends the connection. */
void spl_refuse_on_socket(struct request *request, unsigned status, const char *field, const char *detail);

#endif
