/* What /metrics says beyond the counters: latencies by route, as histograms. Owned by the loop's thread. */
#ifndef SPL_SERVICE_LATENCY_H
#define SPL_SERVICE_LATENCY_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <splatd/render.h>

enum { SPL_HISTOGRAM_BUCKETS = 17, SPL_LATENCY_ROUTES = 64 };

enum spl_latency_stage {
#define STAGE(name) SPL_LATENCY_STAGE_##name,
#include "render/stages.def"
#undef STAGE
    SPL_LATENCY_STAGES
};

/* What is measured of a request: the whole until its reply is handed to the client's connection, and of those that are
 * rendered the wait in the queue, the frame and its encoding. */
enum spl_latency { SPL_LATENCY_REQUEST, SPL_LATENCY_QUEUE, SPL_LATENCY_FRAME, SPL_LATENCY_ENCODE, SPL_LATENCY_COUNT };

struct spl_histogram {
    uint64_t buckets[SPL_HISTOGRAM_BUCKETS + 1]; /* not cumulative; the last is beyond all bounds */
    double sum_s;
};

struct spl_latencies {
    struct spl_route_latency {
        const char *route; /* a pattern of the route table, borrowed for ever */
        struct spl_histogram of[SPL_LATENCY_COUNT];
    } routes[SPL_LATENCY_ROUTES];
    size_t count;
    double stage_ms[SPL_LATENCY_STAGES]; /* of all frames together */
};

/* Adds one observation. `route` is a string that stays, or NULL for requests of no route. */
void spl_latency_observe(struct spl_latencies *latencies, const char *route, enum spl_latency which, double seconds);

/* Adds what the stages of one frame took. */
void spl_latency_add_stages(struct spl_latencies *latencies, const struct spl_frame_stats *stats);

/* The histograms and the sums of stages in Prometheus' text format 0.0.4. */
void spl_latency_print(const struct spl_latencies *latencies, FILE *out);

/* `text` as the inside of a label's quotes. */
void spl_print_label(FILE *out, const char *text);

#endif
