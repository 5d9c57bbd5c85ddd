/* Datasets on a gpu thread's device: which ones the renderer knows, their pages, and what has no room. Versions are
 * added a page at a time between frames, so that nobody waits for them. Owned by the gpu thread. */
#include <inttypes.h>

#include "base/clock.h"
#include "base/log.h"
#include "dataset/dataset.h"
#include "service/view/gpu.h"
#include "service/view/key.h"

static const uint64_t look_around_ns = 100 * SPL_NS_PER_MS; // while pages are read before anybody is served

void spl_gpu_publish_residency(struct gpu *gpu)
{
    struct spl_pipeline *pipeline = gpu->pipeline;
    struct spl_residency_info info;
    struct spl_replica *replica;
    TAILQ_FOREACH(replica, &gpu->replicas, resident)
    {
        spl_renderer_get_residency(gpu->renderer, replica->entry->dataset, &info);
        atomic_store(&replica->resident_bytes, info.bytes);
    }
    spl_renderer_get_residency(gpu->renderer, NULL, &info);
    atomic_store(&pipeline->device_bytes, info.taken_bytes);
    atomic_store(&pipeline->device_limit_bytes, info.limit_bytes);
    atomic_fetch_add(&pipeline->options.counters->pages_evicted, info.pages_evicted - gpu->pages_evicted);
    gpu->pages_loaded = info.pages_loaded;
    gpu->pages_evicted = info.pages_evicted;
}

int spl_gpu_upload(struct gpu *gpu, struct spl_error *err)
{
    struct spl_residency_info info;
    int rc = spl_renderer_upload(gpu->renderer, err);
    if (rc)
        return rc;
    gpu->uploads_left = spl_renderer_wait(gpu->renderer, 0);
    spl_renderer_get_residency(gpu->renderer, NULL, &info);
    atomic_store(&gpu->pipeline->pages_pending, info.pages_pending);
    if (info.pages_loaded != gpu->pages_loaded || info.pages_evicted != gpu->pages_evicted)
        spl_gpu_publish_residency(gpu);
    return 0;
}

/* On the renderer's io thread. */
static void on_page_read(void *context)
{
    struct spl_pipeline *pipeline = context;
    spl_queue_interrupt(pipeline->render);
}

/* How many of the dataset's maps have room at a time, beside what is always there: working memory, the first page, and
 * of a GPU what a slot goes through on its way. What never has is told once, with the limit that holds everything. */
static void judge_maps(struct gpu *gpu, struct spl_catalog_entry *entry)
{
    const struct spl_dataset_info *info = entry->info;
    const uint64_t mib = 1 << 20;
    uint64_t always = gpu->working_bytes + spl_dataset_get_page_bytes(entry->dataset, 0), most = 0, room;
    struct spl_residency_info residency;
    uint32_t fit = 0;
    for (uint32_t map = 0; map < info->maps; map++) {
        uint64_t bytes = spl_dataset_get_map_bytes(entry->dataset, map);
        most = bytes > most ? bytes : most;
    }
    if (!info->maps)
        return;
    spl_renderer_get_residency(gpu->renderer, entry->dataset, &residency);
    always += spl_renderer_get_device(gpu->renderer)->software ? 0 : most;
    room = residency.limit_bytes > always ? residency.limit_bytes - always : 0;
    for (uint32_t map = 0; map < info->maps; map++) {
        uint64_t bytes = spl_dataset_get_map_bytes(entry->dataset, map);
        fit += bytes <= room;
        room -= bytes <= room ? bytes : 0;
    }
    /* an eighth more than all pages: lists of what is drawn */
    uint64_t holds = (always + info->page_bytes + info->page_bytes / 8 + mib - 1) / mib;
    atomic_store(&entry->maps_at_once, fit);
    if (!atomic_exchange(&entry->limit_bytes, holds * mib) && fit < info->maps)
        spl_log_warn("dataset %s: memory-limit, %" PRIu64 " bytes, has room for the maps of %u of its %u stations at a "
                     "time; the others' show the splats' own colours. --memory-limit %" PRIu64 "M holds all",
                     info->id, residency.limit_bytes, fit, info->maps, holds);
}

/* Page by page, so that nobody who stops waits for a dataset. A file that was cut or overwritten in place, or whose
 * disk does not answer, costs its own views only. */
static int preload(struct gpu *gpu, const struct spl_catalog_entry *entry, struct spl_error *err)
{
    struct spl_error why = {0};
    bool more = true;
    int rc = 0;
    for (uint32_t page = 0, before = 0; more && !rc && !spl_queue_is_closed(gpu->pipeline->render); before = page) {
        rc = spl_renderer_preload_page(gpu->renderer, entry->dataset, &page, &more, &why);
        if (page != before)
            spl_pipeline_touch(gpu->pipeline);
        else if (more)
            spl_renderer_wait(gpu->renderer, spl_now_ns() + look_around_ns);
    }
    if (rc == SPL_E_CORRUPT || rc == SPL_E_IO || rc == SPL_E_TIMEOUT) {
        spl_log_error("dataset %s cannot be loaded: %s", entry->info->id, why.message);
        return 0;
    }
    return rc ? spl_fail(err, rc, "%s", why.message) : 0;
}

/* A page that is being read of it ends by itself: nobody waits for a disk here. */
static void let_go(struct gpu *gpu, struct spl_replica *replica)
{
    spl_renderer_remove(gpu->renderer, replica->entry->dataset);
    TAILQ_REMOVE(&gpu->replicas, replica, resident);
    atomic_store(&replica->resident_bytes, 0);
    spl_gpu_publish_residency(gpu);
}

/* Gives back an entry that was to be added. */
static void refuse(struct gpu *gpu, struct spl_replica *replica, const struct spl_error *why)
{
    replica->err = *why;
    replica->loading = false;
    spl_pipeline_report_change(gpu->pipeline, replica, SPL_ENTRY_REFUSED);
}

void spl_gpu_refuse(struct gpu *gpu, struct spl_replica *replica, const struct spl_error *why)
{
    let_go(gpu, replica);
    refuse(gpu, replica, why);
}

/* What the device has no room for is refused at start, when nobody has asked for it yet; not in a device that is
 * reopened, where requests refer to it: there its views fail, and say why. */
static int refuse_misfit(struct gpu *gpu, struct spl_replica *replica, int rc, struct spl_error *err)
{
    if (rc != SPL_E_LIMIT && rc != SPL_E_NOMEM)
        return rc;
    if (spl_pipeline_get_state(gpu->pipeline) == SPL_PIPELINE_STARTING) {
        spl_gpu_refuse(gpu, replica, err);
    } else {
        spl_log_error("dataset %s cannot be loaded: %s", replica->entry->info->id, err->message);
    }
    *err = (struct spl_error){0};
    return 0;
}

int spl_gpu_build(struct gpu *gpu, struct spl_error *err)
{
    struct spl_pipeline *pipeline = gpu->pipeline;
    struct spl_replica *replica, *next;
    struct spl_renderer_options options = pipeline->options.renderer;
    uint64_t maps = 0;
    options.wake = on_page_read;
    options.wake_context = pipeline;
    TAILQ_FOREACH(replica, &gpu->replicas, resident)
    {
        const struct spl_catalog_entry *entry = replica->entry;
        size_t bytes = spl_dataset_get_page_bytes(entry->dataset, 0);
        if (options.first_page_bytes < bytes + 4) // and the word more that residency.c takes
            options.first_page_bytes = bytes + 4;
        maps = entry->info->map_bytes > maps ? entry->info->map_bytes : maps;
        uint32_t chunks = spl_dataset_get_tables(entry->dataset, 0)->chunk_count; // which are always kept
        if (options.first_page_chunks < chunks)
            options.first_page_chunks = chunks;
    }
    struct spl_error why = {0};
    int rc = spl_renderer_create(&options, &gpu->renderer, &why);
    spl_pipeline_touch(pipeline);
    if (rc == SPL_E_LIMIT && maps)
        return spl_fail_field(err, rc, why.field, "%s; with the maps of all stations %" PRIu64 "M more", why.message,
                              (maps >> 20) + 1);
    if (rc)
        return spl_fail_field(err, rc, why.field, "%s", why.message);
    gpu->pages_loaded = gpu->pages_evicted = 0;
    gpu->working_bytes = spl_renderer_get_memory(gpu->renderer);
    pthread_mutex_lock(&pipeline->mutex);
    pipeline->device = *spl_renderer_get_device(gpu->renderer);
    pthread_mutex_unlock(&pipeline->mutex);
    atomic_store(&pipeline->renderer, spl_renderer_hash(&pipeline->device));
    TAILQ_FOREACH(replica, &gpu->replicas, resident)
    {
        spl_plan_set_device(replica->entry->plan, spl_renderer_get_device(gpu->renderer));
        replica->pages_wanted = 0;
        if ((rc = spl_renderer_add(gpu->renderer, replica->entry->dataset, err)))
            return rc;
        judge_maps(gpu, replica->entry);
    }
    for (replica = TAILQ_FIRST(&gpu->replicas); replica; replica = next) {
        next = TAILQ_NEXT(replica, resident);
        /* What is on a server comes when a view wants it: one that hangs would hold up all. */
        bool here = !replica->loading && !replica->aside && !spl_dataset_is_remote(replica->entry->dataset);
        if (here && (rc = preload(gpu, replica->entry, err)) && (rc = refuse_misfit(gpu, replica, rc, err)))
            return rc;
    }
    spl_gpu_publish_residency(gpu);
    return 0;
}

void spl_gpu_tear_down(struct gpu *gpu)
{
    if (!gpu->renderer)
        return;
    spl_renderer_destroy(gpu->renderer);
    gpu->renderer = NULL;
    atomic_store(&gpu->pipeline->device_bytes, 0);
    atomic_store(&gpu->pipeline->pages_pending, 0);
}

void spl_gpu_take_orders(struct gpu *gpu)
{
    for (struct spl_replica *replica; (replica = spl_pipeline_take_order(gpu->pipeline));) {
        if (replica->state == SPL_ENTRY_LEAVING) {
            let_go(gpu, replica);
            spl_pipeline_report_change(gpu->pipeline, replica, SPL_ENTRY_GONE);
            continue;
        }
        spl_plan_set_device(replica->entry->plan, spl_renderer_get_device(gpu->renderer));
        TAILQ_INSERT_TAIL(&gpu->replicas, replica, resident);
        replica->pages_wanted = 0;
        replica->loading = true;
        struct spl_error err = {0};
        if (spl_renderer_add(gpu->renderer, replica->entry->dataset, &err))
            spl_gpu_refuse(gpu, replica, &err);
    }
}

bool spl_gpu_has_others(const struct gpu *gpu, const struct spl_replica *replica)
{
    struct spl_replica *other;
    TAILQ_FOREACH(other, &gpu->replicas, resident)
    if (other != replica && !other->aside)
        return true;
    return false;
}

struct spl_replica *spl_gpu_find_loading(struct gpu *gpu)
{
    struct spl_replica *replica;
    TAILQ_FOREACH(replica, &gpu->replicas, resident)
    if (replica->loading)
        return replica;
    return NULL;
}

int spl_gpu_load_page(struct gpu *gpu, struct spl_replica *replica, struct spl_error *err)
{
    bool more;
    struct spl_error why = {0};
    const struct spl_dataset *dataset = replica->entry->dataset;
    uint32_t before = replica->pages_wanted;
    int rc = spl_renderer_preload_page(gpu->renderer, dataset, &replica->pages_wanted, &more, &why);
    if (!rc && spl_dataset_is_remote(dataset)) // its first page comes as well: others do not wait for its server
        more = false;
    gpu->loading_waits = !rc && more && replica->pages_wanted == before;
    if (gpu->loading_waits)
        return 0;
    if (rc == SPL_E_DEVICE_LOST)
        return spl_fail(err, rc, "%s", why.message);
    spl_gpu_publish_residency(gpu);
    if (rc) {
        spl_gpu_refuse(gpu, replica, &why);
    } else if (!more) {
        replica->loading = false;
        judge_maps(gpu, replica->entry);
        spl_pipeline_report_change(gpu->pipeline, replica, SPL_ENTRY_RESIDENT);
    }
    return 0;
}

void spl_gpu_refuse_loading(struct gpu *gpu)
{
    struct spl_error err = {.code = SPL_E_CANCELLED, .message = "the service is stopping"};
    for (struct spl_replica *replica; (replica = spl_gpu_find_loading(gpu));) {
        TAILQ_REMOVE(&gpu->replicas, replica, resident);
        refuse(gpu, replica, &err);
    }
}
