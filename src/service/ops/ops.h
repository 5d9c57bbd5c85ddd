/* The room of those who run the service: what it counts and measures, and the second listener, which says so with
 * /healthz, /readyz and /metrics. Owned by the loop's thread but the counters, which any thread adds to. */
#ifndef SPL_SERVICE_OPS_H
#define SPL_SERVICE_OPS_H

#include <jansson.h>

#include "base/error.h"
#include "service/http.h"
#include "service/ops/access_log.h"
#include "service/ops/counters.h"
#include "service/ops/latency.h"
#include "service/ops/loop_turns.h"
#include "service/view/pipeline.h"

struct spl_service;
struct request;

struct spl_ops {
    struct spl_counters counters;
    struct spl_latencies latencies;
    struct spl_access_log access_log;
    struct spl_loop_turns loop_turns;
    uint64_t started_ns;
    double started_unix_s;              /* the same by the clock on the wall, read once */
    uv_timer_t look_timer;              /* health.c */
    uint64_t looked_ns, woke_ns;        /* health.c */
    enum spl_pipeline_state said_state; /* to the supervisor; health.c */

    int listen_fd;             /* passed by the supervisor; -1 = none, or once MHD has it */
    struct MHD_Daemon *daemon; // may be NULL
    uv_poll_t poll;
    struct spl_http_turns turns;
};

/* Time begins, and what the loop holds is made. */
void spl_ops_init(struct spl_service *service);

/* Binds what `ops-listen` says and answers from the first turn of the loop on; nothing to do where it is "". A default
 * address that is taken is a warning, one that was asked for an error. */
int spl_ops_start(struct spl_service *service, struct spl_error *err);

/* Closes every connection; idempotent. */
void spl_ops_stop(struct spl_service *service);

/* status.c: /v1/status, a new reference, NULL without memory; and this process's memory, 0 when unknown. */
json_t *spl_describe_status(struct request *request);
uint64_t spl_resident_bytes(void);

#endif
