/* Datasets and the service as JSON. Owned by the loop's thread. */
#include <math.h>
#include <stdio.h>
#include <unistd.h>

#include "base/clock.h"
#include "service/state.h"

static json_t *vector(const double v[3])
{
    return json_pack("[f, f, f]", v[0], v[1], v[2]);
}

static json_t *names(const char *(*name)(int), int count)
{
    json_t *list = json_array();
    for (int i = 0; i < count; i++)
        json_array_append_new(list, json_string(name(i)));
    return list;
}

static const char *layer_name(int i)
{
    return spl_layer_name((enum spl_layer)i);
}

static const char *method_name(int i)
{
    return spl_method_name((enum spl_method)i);
}

static const char *format_name(int i)
{
    return spl_format_name((enum spl_format)i);
}

json_t *spl_describe_dataset(const struct spl_catalog_entry *entry, bool full)
{
    const struct spl_dataset_info *info = entry->info;
    json_t *json = json_pack("{s:s, s:s, s:o, s:s, s:I, s:I, s:I, s:{s:o, s:o}}", "id", info->id, "uri", entry->uri,
                             "view", json_sprintf("%s/view", entry->uri), "unit", "m", "splats", (json_int_t)info->splats,
                             "points", (json_int_t)info->points, "bytes", (json_int_t)info->file_bytes, "bounds", "min",
                             vector(info->bounds_min), "max", vector(info->bounds_max));
    if (!json)
        return NULL;
    json_object_set_new(json, "version", json_sprintf("%016llx", (unsigned long long)info->version));
    if (!full)
        return json;
    json_t *more = json_pack(
        "{s:I, s:I, s:I, s:f, s:o, s:o, s:o, s:{s:o, s:o, s:o, s:f}}", "levels", (json_int_t)info->levels, "leaf_splats",
        (json_int_t)info->leaf_splats, "page_bytes", (json_int_t)info->page_bytes, "splat_radius", info->splat_radius,
        "layers", names(layer_name, SPL_LAYER_COUNT), "methods", names(method_name, SPL_METHOD_COUNT), "formats",
        names(format_name, SPL_FORMAT_COUNT), "default_view", "eye", vector(info->default_eye), "target",
        vector(info->default_target), "up", vector(info->default_up), "fov", info->default_fov);
    if (more)
        json_object_update(json, more);
    json_decref(more);
    return json;
}

static json_int_t resident_bytes(void)
{
    unsigned long long size = 0, resident = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    if (file && fscanf(file, "%llu %llu", &size, &resident) != 2)
        resident = 0;
    if (file)
        fclose(file);
    return (json_int_t)resident * sysconf(_SC_PAGESIZE);
}

static json_t *describe_device(const struct spl_device_info *device)
{
    return json_pack("{s:s, s:i, s:s, s:s, s:b}", "backend", device->backend, "index", (int)device->index, "name",
                     device->name, "driver", device->driver, "software", device->software);
}

static json_t *describe_counters(struct spl_counters *counters)
{
    json_t *json = json_object();
#define COUNTER(name, help) json_object_set_new(json, #name, json_integer((json_int_t)atomic_load(&counters->name)));
#include "service/counters.def"
#undef COUNTER
    return json;
}

json_t *spl_describe_status(struct spl_service *service)
{
    static const char *const states[] = {"starting", "ready", "rebuilding", "failed"};
    const struct spl_service_options *options = service->options;
    struct spl_pipeline_status status;
    spl_pipeline_get_status(service->pipeline, &status);
    json_t *ids = json_array();
    for (size_t i = 0; i < service->catalog.count; i++)
        json_array_append_new(ids, json_string(service->catalog.entries[i].info->id));
    return json_pack(
        "{s:s, s:s, s:f, s:o, s:{s:i, s:I, s:i, s:i, s:i}, s:o, s:{s:I, s:I}, s:{s:{s:I, s:I}, s:{s:I, s:I}}, s:f, s:I, "
        "s:o}",
        "version", SPLATD_VERSION, "state", service->draining ? "stopping" : states[spl_pipeline_get_state(service->pipeline)],
        "uptime_s", (double)(spl_now_ns() - service->started_ns) / SPL_NS_PER_S, "device",
        describe_device(&status.device), "limits", "side_px", (int)SPL_SERVICE_SIDE_MAX, "pixels",
        (json_int_t)options->pixels_max, "body_bytes", (int)body_max, "url_bytes", (int)uri_max, "deadline_ms",
        (int)options->deadline_ms, "datasets", ids, "memory", "device_bytes", (json_int_t)status.device_bytes,
        "resident_bytes", resident_bytes(), "queues", "render", "length", (json_int_t)status.render_length, "capacity",
        (json_int_t)status.render_capacity, "encode", "length", (json_int_t)status.encode_length, "capacity",
        (json_int_t)status.encode_capacity, "frame_ms", status.frame_ms, "connections",
        (json_int_t)service->connections_open, "counters", describe_counters(&service->counters));
}
