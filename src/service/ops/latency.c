/* Histograms of latencies by route, with the fixed bounds below: from cached replies (0.1 ms) to frames on software
 * drivers (10 s). The number of routes is that of the route table, so nothing a client sends makes a new series.
 *
 * Owned by the loop's thread: no locks, no atomics. */
#include "service/ops/latency.h"

#include <string.h>

static const double bounds_s[SPL_HISTOGRAM_BUCKETS] = {0.0001, 0.00025, 0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05,
                                                       0.1,    0.25,    0.5,    1,     2.5,    5,     10,   30};

static const char no_route[] = "none"; /* and what the table has no room for */

static const struct {
    const char *name, *help;
} table[SPL_LATENCY_COUNT] = {
    [SPL_LATENCY_REQUEST] = {"request_duration", "From a request's first line until its reply was queued."},
    [SPL_LATENCY_QUEUE] = {"queue_duration", "How long what is rendered waited for the device."},
    [SPL_LATENCY_FRAME] = {"frame_duration", "How long frames took to render."},
    [SPL_LATENCY_ENCODE] = {"encode_duration", "How long images took to encode."},
};

static const struct {
    const char *name;
    size_t offset; /* in struct spl_frame_stats */
} stages[SPL_LATENCY_STAGES] = {
#define STAGE(name) {#name, offsetof(struct spl_frame_stats, name##_ms)},
#include "render/stages.def"
#undef STAGE
};

static struct spl_route_latency *find(struct spl_latencies *latencies, const char *route)
{
    size_t i = 0;
    if (!latencies->count)
        latencies->routes[latencies->count++].route = no_route;
    while (i < latencies->count && strcmp(latencies->routes[i].route, route))
        i++;
    if (i == SPL_LATENCY_ROUTES)
        return &latencies->routes[0];
    if (i == latencies->count)
        latencies->routes[latencies->count++].route = route;
    return &latencies->routes[i];
}

void spl_latency_observe(struct spl_latencies *latencies, const char *route, enum spl_latency which, double seconds)
{
    struct spl_histogram *histogram = &find(latencies, route ? route : no_route)->of[which];
    size_t i = 0;
    while (i < SPL_HISTOGRAM_BUCKETS && seconds > bounds_s[i])
        i++;
    histogram->buckets[i]++;
    histogram->sum_s += seconds;
}

void spl_latency_add_stages(struct spl_latencies *latencies, const struct spl_frame_stats *stats)
{
    for (int i = 0; i < SPL_LATENCY_STAGES; i++)
        latencies->stage_ms[i] += *(const double *)((const char *)stats + stages[i].offset);
}

void spl_print_label(FILE *out, const char *text)
{
    for (; *text; text++) {
        if (*text == '\\' || *text == '"')
            fputc('\\', out);
        if (*text == '\n')
            fputs("\\n", out);
        else
            fputc(*text, out);
    }
}

static void print_histogram(FILE *out, const char *name, const char *route, const struct spl_histogram *histogram)
{
    unsigned long long sum = 0;
    for (size_t i = 0; i <= SPL_HISTOGRAM_BUCKETS; i++) {
        char bound[32] = "+Inf";
        if (i < SPL_HISTOGRAM_BUCKETS)
            snprintf(bound, sizeof bound, "%g", bounds_s[i]);
        sum += histogram->buckets[i];
        fprintf(out, "splatd_%s_seconds_bucket{route=\"%s\",le=\"%s\"} %llu\n", name, route, bound, sum);
    }
    fprintf(out, "splatd_%s_seconds_sum{route=\"%s\"} %.9g\n", name, route, histogram->sum_s);
    fprintf(out, "splatd_%s_seconds_count{route=\"%s\"} %llu\n", name, route, sum);
}

static int is_used(const struct spl_histogram *histogram)
{
    for (size_t i = 0; i <= SPL_HISTOGRAM_BUCKETS; i++)
        if (histogram->buckets[i])
            return 1;
    return 0;
}

void spl_latency_print(const struct spl_latencies *latencies, FILE *out)
{
    for (int m = 0; m < SPL_LATENCY_COUNT; m++) {
        fprintf(out, "# HELP splatd_%s_seconds %s\n# TYPE splatd_%s_seconds histogram\n", table[m].name, table[m].help,
                table[m].name);
        for (size_t i = 0; i < latencies->count; i++)
            if (is_used(&latencies->routes[i].of[m]))
                print_histogram(out, table[m].name, latencies->routes[i].route, &latencies->routes[i].of[m]);
    }
    fprintf(out, "# HELP splatd_stage_seconds_total Time that stages of frames have taken.\n"
                 "# TYPE splatd_stage_seconds_total counter\n");
    for (int i = 0; i < SPL_LATENCY_STAGES; i++)
        fprintf(out, "splatd_stage_seconds_total{stage=\"%s\"} %.9g\n", stages[i].name, latencies->stage_ms[i] / 1000);
}
