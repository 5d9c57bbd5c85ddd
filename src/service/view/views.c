/* The life of the room of views, and what its routes check alike. Owned by the loop's thread, but for wake(). */
#include "service/view/views.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "dataset/dataset.h"
#include "render/view.h"
#include "service/datasets/library.h"
#include "service/http.h"
#include "service/ops/ops.h"
#include "service/state.h"

/* Of replies with small views, and with large ones; beyond, they are refused until clients have read. */
enum { reply_bytes_max = 1 << 30 };

/* Any thread: a job is done, or a pipeline's state has changed. */
static void wake(void *context)
{
    struct spl_service *service = context;
    uv_async_send(&service->wake);
}

static int start_fleet(struct spl_service *service, struct spl_error *err)
{
    const struct spl_catalog *catalog = &service->library->catalog;
    struct spl_catalog_entry **entries = service->views->entries = spl_alloc(catalog->count, sizeof *entries, err);
    size_t count = 0;
    if (!entries)
        return SPL_E_NOMEM;
    for (size_t i = 0; i < catalog->count; i++)
        if (catalog->slots[i].current)
            entries[count++] = catalog->slots[i].current;
    struct spl_fleet_options options = {
        .devices = service->options->device,
        .pipeline = {.renderer = SPL_SIZED(spl_renderer_options, .require_gpu = service->options->require_gpu,
                                           .memory_limit = service->options->memory_limit),
                     .entries = entries,
                     .entry_count = count,
                     .queue = service->options->queue,
                     .encoders = service->options->encoders,
                     .samples_max = 4 * service->options->samples_max,
                     .counters = service->counters,
                     .wake = wake,
                     .wake_context = service},
    };
    return spl_fleet_create(&options, &service->views->fleet, err);
}

int spl_views_start(struct spl_service *service, struct spl_error *err)
{
    int rc = spl_cache_create(service->options->cache_bytes, &service->views->cache, err);
    return rc ? rc : start_fleet(service, err);
}

void spl_views_finish(struct spl_service *service)
{
    struct spl_views *views = service->views;
    spl_fleet_destroy(views->fleet);
    spl_cache_destroy(views->cache);
    free(views->entries);
    *views = (struct spl_views){0};
}

/* Latencies of what was rendered, for whoever waited. */
static void observe(struct spl_service *service, const struct spl_job *job)
{
    const char *route = job->route;
    if (!job->rendered_ns)
        return;
    spl_latency_observe(&service->ops->latencies, route, SPL_LATENCY_QUEUE, job->queue_ms / 1000);
    spl_latency_observe(&service->ops->latencies, route, SPL_LATENCY_FRAME,
                        (double)(job->rendered_ns - job->began_ns) / SPL_NS_PER_S);
    spl_latency_add_stages(&service->ops->latencies, &job->stats);
    if (!job->err.code)
        spl_latency_observe(&service->ops->latencies, route, SPL_LATENCY_ENCODE, job->encode_ms / 1000);
}

void spl_views_complete(struct spl_service *service)
{
    for (struct spl_job *job; (job = spl_fleet_take(service->views->fleet));) {
        observe(service, job);
        if (job->done)
            job->done(job);
        else
            spl_job_destroy(job);
    }
    spl_http_pump(service);
}

int spl_view_blame(struct spl_error *err)
{
    if (err->code != SPL_E_NOMEM && err->code != SPL_E_BUSY && err->code != SPL_E_UNSUPPORTED)
        err->code = SPL_E_INPUT;
    return err->code;
}

void spl_view_set_unit(struct spl_view_request *view, const struct spl_dataset_info *info)
{
    snprintf(view->encode.unit, sizeof view->encode.unit, "%s", spl_unit_word(info));
    view->encode.ground.epsg = info->epsg;
    view->encode.crs = info->crs;
}

/* What a dataset lacks of a view's terms, by the parameter that asked for it: classes are the clip's last terms. */
static int blame_class(const struct spl_view_request *view, const struct spl_dataset_info *info, int rc,
                       struct spl_error *err)
{
    struct spl_view others = view->view;
    if (!rc || !view->classes || strcmp(err->field, "clip"))
        return rc;
    others.clip.count -= view->classes;
    if (!spl_view_check_colors(&others, info, NULL))
        snprintf(err->field, sizeof err->field, "class");
    return rc;
}

int spl_view_check_dataset(struct spl_view_request *view, const struct spl_dataset_info *info, struct spl_error *err)
{
    spl_view_set_unit(view, info);
    if (view->versioned && view->version != info->version)
        return spl_fail_field(err, SPL_E_NOT_FOUND, "v",
                              "version %016llx of dataset '%s' is not served; it is %016llx now",
                              (unsigned long long)view->version, info->id, (unsigned long long)info->version);
    if (!view->planned) // what is drawn is what is said, kept and learned of
        view->view.method = spl_method_for(view->view.method, info);
    if (view->picks && !spl_method_has_normals(view->view.method, info)) // the reply says null
        view->view.layers &= ~(1u << SPL_LAYER_NORMAL);
    int rc = view->planned ? spl_view_check_colors(&view->view, info, err) // it may get another method
                           : spl_view_check_layers(&view->view, info, err);
    return blame_class(view, info, rc, err);
}

int spl_view_check_part(struct spl_view_request *view, const struct spl_dataset_info *info, const char *part,
                        struct spl_error *err)
{
    struct spl_error why = {0};
    char field[sizeof why.field + 32];
    int rc = spl_view_check_dataset(view, info, &why);
    snprintf(field, sizeof field, "%s%s%s", part, why.field[0] ? "." : "", why.field);
    return rc ? spl_fail_field(err, rc, field, "%s", why.message) : 0;
}

/* Large views have their own share, in which those on their way count: replies that nobody reads keep no small view
 * from being made. */
bool spl_view_has_no_room(const struct spl_service *service, const struct spl_view_request *view, struct spl_error *err)
{
    bool large = spl_request_is_large(view);
    const struct spl_views *views = service->views;
    size_t bytes = views->reply_bytes;
    if (large) {
        struct spl_pipeline_status status;
        spl_fleet_get_status(views->fleet, &status);
        bytes = views->large_reply_bytes + status.large_bytes;
    }
    uint64_t own = large ? spl_view_get_frame_bytes(&view->view) : 0;
    if (!bytes || bytes + own <= reply_bytes_max) // one alone always gets in
        return false;
    spl_fail(err, SPL_E_BUSY, "%zu bytes of images are on their way to clients; come back later", bytes);
    return true;
}

struct spl_camera_limits spl_view_get_limits(const struct spl_service *service)
{
    return (struct spl_camera_limits){.side_px = SPL_SERVICE_SIDE_MAX,
                                      .pixels = service->options->pixels_max,
                                      .samples = service->options->samples_max,
                                      .bytes = SPL_FRAME_BYTES_MAX};
}
