/* /v1/status: the service as JSON, its device, limits, queues, memory and counters. Owned by the loop's thread. */
#include <stdio.h>
#include <unistd.h>

#include "base/clock.h"
#include "service/access/access.h"
#include "service/datasets/library.h"
#include "service/exchange.h"
#include "service/ops/ops.h"
#include "service/state.h"
#include "service/view/views.h"

static json_t *count(uint64_t n)
{
    return json_integer((json_int_t)n);
}

/* A member that memory was refused for is left out. */
static void set(json_t *object, const char *name, json_t *value)
{
    json_object_set_new(object, name, value);
}

uint64_t spl_resident_bytes(void)
{
    unsigned long long size = 0, resident = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    if (file && fscanf(file, "%llu %llu", &size, &resident) != 2)
        resident = 0;
    if (file)
        fclose(file);
    return resident * (uint64_t)sysconf(_SC_PAGESIZE);
}

static json_t *describe_device(const struct spl_device_info *device)
{
    return json_pack("{s:s, s:i, s:s, s:s, s:b}", "backend", device->backend, "index", (int)device->index, "name",
                     device->name, "driver", device->driver, "software", device->software);
}

static const char *const states[] = {"starting", "ready", "rebuilding", "failed"};

/* One of several, with what it does at present. */
static json_t *describe_pipeline(struct spl_pipeline *pipeline)
{
    struct spl_pipeline_status status;
    spl_pipeline_get_status(pipeline, &status);
    json_t *json = describe_device(&status.device);
    set(json, "state", json_string(states[spl_pipeline_get_state(pipeline)]));
    set(json, "device_bytes", count(status.device_bytes));
    set(json, "device_limit_bytes", count(status.device_limit_bytes));
    set(json, "queue_length", count(status.render_length + status.large_length));
    set(json, "frames", count(status.frames));
    set(json, "frame_ms", json_real(status.frame_ms));
    return json;
}

static json_t *describe_devices(struct spl_fleet *fleet)
{
    json_t *json = json_array();
    for (size_t i = 0; i < spl_fleet_get_count(fleet); i++)
        json_array_append_new(json, describe_pipeline(spl_fleet_get(fleet, i)));
    return json;
}

static json_t *describe_counters(struct spl_counters *counters)
{
    json_t *json = json_object();
    spl_counters_collect(counters);
#define COUNTER(name, help) set(json, #name, count(atomic_load(&counters->name)));
#include "service/ops/counters.def"
#undef COUNTER
    return json;
}

static json_t *describe_limits(const struct spl_service_options *options)
{
    json_t *json = json_object();
    set(json, "side_px", count(SPL_SERVICE_SIDE_MAX));
    set(json, "pixels", count(options->pixels_max));
    set(json, "samples", count(options->samples_max));
    set(json, "body_bytes", count(body_max));
    set(json, "url_bytes", count(uri_max));
    set(json, "deadline_ms", count(options->deadline_ms));
    return json;
}

static json_t *describe_cache(const struct spl_cache *cache)
{
    struct spl_cache_status status;
    spl_cache_get_status(cache, &status);
    return json_pack("{s:o, s:o, s:o, s:o}", "entries", count(status.entries), "bytes", count(status.bytes),
                     "limit_bytes", count(status.limit_bytes), "evictions", count(status.evictions));
}

static json_t *describe_queue(size_t length, size_t capacity)
{
    return json_pack("{s:o, s:o}", "length", count(length), "capacity", count(capacity));
}

json_t *spl_describe_status(struct request *request)
{
    struct spl_service *service = request->service;
    const struct spl_views *views = service->views;
    const struct spl_catalog *catalog = &service->library->catalog;
    struct spl_pipeline_status status;
    spl_fleet_get_status(views->fleet, &status);
    const char *state = service->draining ? "stopping" : states[spl_fleet_get_state(views->fleet)];
    json_t *json = json_object(), *ids = json_array();
    for (size_t i = 0; i < catalog->count; i++)
        if (spl_access_may_see(request, catalog->slots[i].id))
            json_array_append_new(ids, json_string(catalog->slots[i].id));
    set(json, "version", json_string(SPLATD_VERSION));
    set(json, "state", json_string(state));
    set(json, "uptime_s", json_real((double)(spl_now_ns() - service->ops->started_ns) / SPL_NS_PER_S));
    set(json, "device", describe_device(&status.device));
    set(json, "devices", describe_devices(views->fleet));
    set(json, "limits", describe_limits(service->options));
    set(json, "parameters", spl_service_options_describe(service->options));
    set(json, "datasets", ids);
    set(json, "tours", service->tours ? json_string("/v1/tours") : json_null());
    set(json, "memory",
        json_pack("{s:o, s:o, s:o, s:o}", "device_bytes", count(status.device_bytes), "device_limit_bytes",
                  count(status.device_limit_bytes), "resident_bytes", count(spl_resident_bytes()), "reply_bytes",
                  count(views->reply_bytes + views->large_reply_bytes)));
    set(json, "cache", describe_cache(views->cache));
    set(json, "queues",
        json_pack("{s:o, s:{s:o, s:o, s:o, s:o}, s:o}", "render",
                  describe_queue(status.render_length, status.render_capacity), "large", "length",
                  count(status.large_length), "samples", count(status.large_samples), "samples_max",
                  count(status.large_samples_max), "bytes", count(status.large_bytes), "encode",
                  describe_queue(status.encode_length, status.encode_capacity)));
    set(json, "frame_ms", json_real(status.frame_ms));
    set(json, "connections", count(service->http->connections_open));
    set(json, "counters", describe_counters(service->counters));
    return json;
}
