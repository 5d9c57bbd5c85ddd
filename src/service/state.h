/* The service: its loop and its life, and a context for each of its rooms. What is in a context only the room's own
 * header says: a file includes this one to get from room to room, and the headers of those that it enters. Everything
 * is owned by the loop's thread but the counters, which any thread adds to. */
#ifndef SPL_SERVICE_STATE_H
#define SPL_SERVICE_STATE_H

#include <stdbool.h>
#include <uv.h>

#include "base/error.h"
#include "service/ops/options.h"

struct spl_service {
    const struct spl_service_options *options;
    struct spl_counters *counters; // ops/counters.h
    struct spl_http *http;         // http.h
    struct spl_views *views;       // view/views.h
    struct spl_library *library;   // datasets/library.h
    struct spl_ops *ops;           // ops/ops.h
    struct spl_access *access;     // access/access.h; NULL: there is nothing to check
    struct spl_tours *tours;       // tour/tour.h; NULL without --tours, and until datasets are open

    uv_loop_t loop;
    uv_async_t wake; /* has the loop look at what other threads have done */
    uv_signal_t signals[2], hangup;
    uv_timer_t drain_timer; /* while stopping */
    bool leaving;           /* asked to stop: /readyz says no */
    bool draining;          /* nothing more is accepted */
    uint64_t drain_began_ns;
    bool drain_idle; /* nothing was open at the last look: what has come since was read after that */
    struct spl_error failure;
};

/* Cache, tours and pipeline, once datasets and tours are open. */
int spl_service_go_on(struct spl_service *service, struct spl_error *err);

#endif
