/* Datasets and the service as JSON. Owned by the loop's thread. */
#include <stdio.h>
#include <unistd.h>

#include "base/clock.h"
#include "dataset/dataset.h"
#include "service/state.h"

static json_t *vector(const double v[3])
{
    return json_pack("[f, f, f]", v[0], v[1], v[2]);
}

static json_t *describe_layers(void)
{
    json_t *list = json_array();
    for (int i = 0; i < SPL_LAYER_COUNT; i++)
        json_array_append_new(list, json_string(spl_layer_name((enum spl_layer)i)));
    return list;
}

/* Those that are drawn as they are called: without radii something else stands in for discs. */
static json_t *describe_methods(const struct spl_dataset_info *info)
{
    json_t *list = json_array();
    for (int i = 0; i < SPL_METHOD_COUNT; i++)
        if (spl_method_for((enum spl_method)i, info) == (enum spl_method)i)
            json_array_append_new(list, json_string(spl_method_name((enum spl_method)i)));
    return list;
}

static json_t *count(uint64_t n)
{
    return json_integer((json_int_t)n);
}

/* A member that memory was refused for is left out. */
static void set(json_t *object, const char *name, json_t *value)
{
    json_object_set_new(object, name, value);
}

json_t *spl_describe_slot(const struct spl_catalog_slot *slot)
{
    json_t *json = slot->current ? spl_describe_dataset(slot->current, false) : json_object();
    const char *state = slot->current ? "ready" : slot->reason[0] ? "failed" : "loading";
    set(json, "id", json_string(slot->id));
    set(json, "state", json_string(state));
    if (slot->reason[0])
        set(json, "reason", json_string(slot->reason));
    return json;
}

static json_t *describe_textures(const struct spl_dataset_info *info)
{
    json_t *methods = json_array();
    for (int i = 0; i < SPL_METHOD_COUNT; i++)
        if (spl_method_has_textures((enum spl_method)i))
            json_array_append_new(methods, json_string(spl_method_name((enum spl_method)i)));
    return json_pack("{s:i, s:i, s:o}", "size", (int)info->texture_size, "atoms", (int)info->atoms, "methods", methods);
}

/* A copy: a reply is taken apart while other threads may read META. */
static json_t *describe_color(const struct spl_dataset *dataset)
{
    const json_t *color = json_object_get(spl_dataset_get_meta(dataset), "color");
    return color ? json_deep_copy(color) : json_null();
}

json_t *spl_describe_dataset(const struct spl_catalog_entry *entry, bool full)
{
    const struct spl_dataset_info *info = entry->info;
    json_t *json = json_object();
    set(json, "id", json_string(info->id));
    set(json, "version", json_sprintf("%016llx", (unsigned long long)info->version));
    set(json, "state", json_string("ready"));
    set(json, "uri", json_string(entry->uri));
    set(json, "view", json_sprintf("%s/view", entry->uri));
    set(json, "unit", json_string("m"));
    set(json, "splats", count(info->splats));
    set(json, "points", count(info->points));
    set(json, "bytes", count(info->file_bytes));
    set(json, "resident_bytes", count(atomic_load(&entry->resident_bytes)));
    set(json, "bounds", json_pack("{s:o, s:o}", "min", vector(info->bounds_min), "max", vector(info->bounds_max)));
    if (!full)
        return json;
    struct spl_profile profile;
    bool profiled = !spl_plan_copy_profile(entry->plan, &profile, NULL);
    set(json, "profile", profiled ? json_sprintf("%s/profile", entry->uri) : json_null());
    spl_profile_finish(&profile);
    set(json, "levels", count(info->levels));
    set(json, "leaf_splats", count(info->leaf_splats));
    set(json, "page_bytes", count(info->page_bytes));
    set(json, "splat_radius", json_real(info->splat_radius));
    set(json, "layers", describe_layers());
    set(json, "methods", describe_methods(info));
    set(json, "color", describe_color(entry->dataset));
    set(json, "textures", info->atoms ? describe_textures(info) : json_null());
    json_t *formats = json_array();
    for (int i = 0; i < SPL_FORMAT_COUNT; i++)
        if (spl_format_is_built((enum spl_format)i))
            json_array_append_new(formats, json_string(spl_format_name((enum spl_format)i)));
    set(json, "formats", formats);
    set(json, "default_view",
        json_pack("{s:o, s:o, s:o, s:f}", "eye", vector(info->default_eye), "target", vector(info->default_target),
                  "up", vector(info->default_up), "fov", info->default_fov));
    return json;
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

static json_t *describe_counters(struct spl_counters *counters)
{
    json_t *json = json_object();
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
    static const char *const states[] = {"starting", "ready", "rebuilding", "failed"};
    struct spl_pipeline_status status;
    spl_pipeline_get_status(service->pipeline, &status);
    const char *state = service->draining ? "stopping" : states[spl_pipeline_get_state(service->pipeline)];
    json_t *json = json_object(), *ids = json_array();
    for (size_t i = 0; i < service->catalog.count; i++)
        if (spl_access_may_see(request, service->catalog.slots[i].id))
            json_array_append_new(ids, json_string(service->catalog.slots[i].id));
    set(json, "version", json_string(SPLATD_VERSION));
    set(json, "state", json_string(state));
    set(json, "uptime_s", json_real((double)(spl_now_ns() - service->started_ns) / SPL_NS_PER_S));
    set(json, "device", describe_device(&status.device));
    set(json, "limits", describe_limits(service->options));
    set(json, "parameters", spl_service_options_describe(service->options));
    set(json, "datasets", ids);
    set(json, "tours", service->tours ? json_string("/v1/tours") : json_null());
    set(json, "memory",
        json_pack("{s:o, s:o, s:o, s:o}", "device_bytes", count(status.device_bytes), "device_limit_bytes",
                  count(status.device_limit_bytes), "resident_bytes", count(spl_resident_bytes()), "reply_bytes",
                  count(service->reply_bytes + service->large_reply_bytes)));
    set(json, "cache", describe_cache(service->cache));
    set(json, "queues",
        json_pack("{s:o, s:{s:o, s:o, s:o, s:o}, s:o}", "render",
                  describe_queue(status.render_length, status.render_capacity), "large", "length",
                  count(status.large_length), "samples", count(status.large_samples), "samples_max",
                  count(status.large_samples_max), "bytes", count(status.large_bytes), "encode",
                  describe_queue(status.encode_length, status.encode_capacity)));
    set(json, "frame_ms", json_real(status.frame_ms));
    set(json, "connections", count(service->connections_open));
    set(json, "counters", describe_counters(&service->counters));
    return json;
}
