/* /metrics: every counter of counters.def, gauges of queues, memory and connections, the process itself, and the
 * histograms of latency.c. Names end in their unit: _seconds, _bytes, _total. Which device renders is a label of
 * splatd_device_info, so that a fleet that fell back to software is one query away. Owned by the loop's thread. */
#include "service/ops/prometheus.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <unistd.h>

#include "base/clock.h"
#include "service/datasets/library.h"
#include "service/ops/health.h"
#include "service/ops/ops.h"
#include "service/state.h"
#include "service/tour/tour.h"
#include "service/view/views.h"

static void print(FILE *out, const char *name, const char *type, const char *help, double value)
{
    fprintf(out, "# HELP %s %s\n# TYPE %s %s\n%s %.17g\n", name, help, name, type, name, value);
}

static void gauge(FILE *out, const char *name, const char *help, double value)
{
    print(out, name, "gauge", help, value);
}

static void print_counters(FILE *out, struct spl_counters *counters)
{
    spl_counters_collect(counters);
#define COUNTER(name, help) print(out, "splatd_" #name "_total", "counter", help, (double)atomic_load(&counters->name));
#include "service/ops/counters.def"
#undef COUNTER
}

/* `number` tells the same device twice apart. */
static void print_device(FILE *out, size_t number, const struct spl_device_info *device)
{
    fprintf(out, "splatd_device_info{number=\"%zu\",backend=\"", number);
    spl_print_label(out, device->backend);
    fprintf(out, "\",index=\"%u\",name=\"", device->index);
    spl_print_label(out, device->name);
    fprintf(out, "\",driver=\"");
    spl_print_label(out, device->driver);
    fprintf(out, "\",software=\"%s\"} 1\n", device->software ? "true" : "false");
}

static void print_devices(FILE *out, struct spl_fleet *fleet)
{
    static const char *const names[] = {"starting", "ready", "rebuilding", "failed"};
    struct spl_pipeline_status status;
    size_t of[sizeof names / sizeof *names] = {0};
    fprintf(out, "# HELP splatd_device_info What renders.\n# TYPE splatd_device_info gauge\n");
    for (size_t i = 0; i < spl_fleet_get_count(fleet); i++) {
        spl_pipeline_get_status(spl_fleet_get(fleet, i), &status);
        if (status.device.name[0])
            print_device(out, i, &status.device);
        of[spl_pipeline_get_state(spl_fleet_get(fleet, i))]++;
    }
    fprintf(out, "# HELP splatd_devices Devices that render, by their state.\n# TYPE splatd_devices gauge\n");
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        fprintf(out, "splatd_devices{state=\"%s\"} %zu\n", names[i], of[i]);
}

static void print_pipelines(FILE *out, struct spl_service *service)
{
    struct spl_pipeline_status status;
    if (!service->views->fleet)
        return;
    spl_fleet_get_status(service->views->fleet, &status);
    print_devices(out, service->views->fleet);
    gauge(out, "splatd_queue_length", "Views that wait for the device, and large ones until they are encoded.",
          (double)(status.render_length + status.large_length));
    gauge(out, "splatd_queue_capacity", "Views that may wait.", (double)status.render_capacity);
    gauge(out, "splatd_encode_queue_length", "Frames that wait for an encoder.", (double)status.encode_length);
    gauge(out, "splatd_encode_queue_capacity", "Frames that may wait.", (double)status.encode_capacity);
    gauge(out, "splatd_device_memory_bytes", "Device memory that the renderer holds.", (double)status.device_bytes);
    gauge(out, "splatd_device_memory_limit_bytes", "Device memory that it may hold.",
          (double)status.device_limit_bytes);
    gauge(out, "splatd_pages_pending", "Pages of datasets that are to be read, or are being read.",
          (double)status.pages_pending);
    gauge(out, "splatd_frame_mean_seconds", "Moving mean of the time a frame takes.", status.frame_ms / 1000);
    gauge(out, "splatd_standstill_seconds", "For how long nothing has moved although there is work; 0 when idle.",
          (double)spl_fleet_get_still_ns(service->views->fleet) / SPL_NS_PER_S);
}

static double seconds(struct timeval t)
{
    return (double)t.tv_sec + 1e-6 * (double)t.tv_usec;
}

static void print_process(FILE *out, struct spl_service *service)
{
    struct rusage usage;
    struct rlimit limit;
    double descriptors = -3; // ".", ".." and the folder's own
    DIR *folder = opendir("/proc/self/fd");
    while (folder && readdir(folder))
        descriptors++;
    if (folder) {
        closedir(folder);
        gauge(out, "process_open_fds", "Open file descriptors.", descriptors);
    }
    if (!getrlimit(RLIMIT_NOFILE, &limit))
        gauge(out, "process_max_fds", "Descriptors that may be open.", (double)limit.rlim_cur);
    if (!getrusage(RUSAGE_SELF, &usage))
        print(out, "process_cpu_seconds_total", "counter", "Processor time, user and system.",
              seconds(usage.ru_utime) + seconds(usage.ru_stime));
    gauge(out, "process_resident_memory_bytes", "Memory in use.", (double)spl_resident_bytes());
    gauge(out, "process_start_time_seconds", "When the process began, by the clock on the wall.",
          service->ops->started_unix_s);
}

/* One series a dataset: as many as the operator has put there, never what a client asks for. */
static void print_datasets(FILE *out, const struct spl_catalog *catalog)
{
    double served = 0, refused = 0;
    fprintf(out, "# HELP splatd_dataset_resident_bytes Device memory that a dataset's pages hold.\n"
                 "# TYPE splatd_dataset_resident_bytes gauge\n");
    for (size_t i = 0; i < catalog->count; i++) {
        const struct spl_catalog_slot *slot = &catalog->slots[i];
        served += slot->current != NULL;
        refused += slot->reason[0] != '\0';
        if (slot->current) // an id has no character that a label would have to escape
            fprintf(out, "splatd_dataset_resident_bytes{dataset=\"%s\"} %llu\n", slot->id,
                    (unsigned long long)spl_catalog_entry_get_resident_bytes(slot->current));
    }
    fprintf(out, "# HELP splatd_dataset_faulty_tiles Tiles of a collection that are missing, other ones or damaged, as "
                 "far as files are gone or views have met them; /v1/datasets says which.\n"
                 "# TYPE splatd_dataset_faulty_tiles gauge\n");
    for (size_t i = 0; i < catalog->count; i++) {
        const struct spl_catalog_slot *slot = &catalog->slots[i];
        if (slot->current && slot->current->info->tiles)
            fprintf(out, "splatd_dataset_faulty_tiles{dataset=\"%s\"} %u\n", slot->id,
                    spl_dataset_list_faulty(slot->current->dataset, NULL, 0));
    }
    gauge(out, "splatd_datasets", "Datasets that are served.", served);
    gauge(out, "splatd_datasets_refused", "Datasets whose newest file is not served; /v1/datasets says why.", refused);
}

static void print_tours(FILE *out, const struct spl_tours *tours)
{
    unsigned count[SPL_TOUR_FAILED + 1] = {0};
    const struct spl_tour *tour;
    if (tours) {
        TAILQ_FOREACH(tour, &tours->all, link)
        {
            count[tour->state]++;
        }
    }
    fprintf(out, "# HELP splatd_tours Tours that are kept.\n# TYPE splatd_tours gauge\n");
    for (int i = 0; i <= SPL_TOUR_FAILED; i++)
        fprintf(out, "splatd_tours{state=\"%s\"} %u\n", spl_tour_state_names[i], count[i]);
    gauge(out, "splatd_tours_bytes", "Disk that they fill.", tours ? (double)tours->bytes : 0);
}

char *spl_prometheus_print(struct spl_service *service)
{
    char *text = NULL, why[SPL_HEALTH_TEXT];
    size_t length;
    FILE *out = open_memstream(&text, &length);
    if (!out)
        return NULL;
    fprintf(out, "# HELP splatd_build_info What runs.\n# TYPE splatd_build_info gauge\n"
                 "splatd_build_info{version=\"" SPLATD_VERSION "\"} 1\n");
    gauge(out, "splatd_ready", "1 when /readyz says ok.", spl_health_is_ready(service, why));
    gauge(out, "splatd_alive", "1 when /healthz says ok.", spl_health_is_alive(service, why));
    print_datasets(out, &service->library->catalog);
    print_tours(out, service->tours);
    gauge(out, "splatd_connections", "Connections of the main listener.", (double)service->http->connections_open);
    gauge(out, "splatd_requests_open", "Requests that are being read, worked on or answered.",
          (double)service->http->requests_open);
    struct spl_cache_status cache = {0};
    if (service->views->cache) // there is none before the datasets are open
        spl_cache_get_status(service->views->cache, &cache);
    gauge(out, "splatd_cache_bytes", "Encoded replies that are kept.", (double)cache.bytes);
    gauge(out, "splatd_cache_entries", "How many they are.", (double)cache.entries);
    gauge(out, "splatd_reply_memory_bytes", "Images that clients have not read yet.", 
          (double)(service->views->reply_bytes + service->views->large_reply_bytes));
    print_pipelines(out, service);
    print_process(out, service);
    print_counters(out, service->counters);
    spl_loop_turns_print(&service->ops->loop_turns, out);
    spl_latency_print(&service->ops->latencies, out);
    bool failed = ferror(out);
    if (fclose(out) || failed) {
        free(text);
        return NULL;
    }
    return text;
}
