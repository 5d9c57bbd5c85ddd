/* Datasets that come, change and go while the service runs.
 *
 * A timer has the thread pool list the served paths. A file is opened once two looks in a row found the same bytes
 * there, so that one that is being copied is left alone; it is opened and verified in the pool, made resident by the
 * gpu thread, and only then takes the place of the version before it, which lives until its last request is answered.
 * A file that is gone for two looks is dropped the same way; one that is refused is logged once and not opened again
 * until it changes. Everything here but the two functions run_* belongs to the loop's thread. */
#include "service/datasets/library.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "base/memory.h"
#include "dataset/remote_url.h"
#include "service/state.h"
#include "service/tour/tour.h"
#include "service/view/views.h"

enum { looks_before_drop = 2, rests_most = 6 /* 64 looks, two minutes, between openings that fail */ };

/* One listing of the served paths; belongs to the pool while it runs. */
struct look {
    uv_work_t work;
    struct spl_service *service;
    uint64_t changes; /* of clients, when it began */
    struct spl_catalog_entry **collections; /* whose tiles are looked for, with a reference each */
    size_t collection_count;
    struct spl_catalog_files files;
    struct spl_error err;
};

/* One dataset being opened, or being closed; the same. */
struct opening {
    uv_work_t work;
    struct spl_service *service;
    char id[sizeof((struct spl_catalog_slot *)0)->id];
    char *path;
    struct spl_dataset_opening how;
    struct spl_file_mark mark;
    struct spl_catalog_entry *entry; // may be NULL
    struct spl_error err;
};

/* Said once, however often it is tried again. */
static void refuse(struct spl_catalog_slot *slot, const struct spl_error *err)
{
    char before[sizeof slot->reason];
    memcpy(before, slot->reason, sizeof before);
    slot->busy = false;
    slot->next = NULL;
    spl_catalog_set_reason(slot, err->message);
    if (strcmp(before, slot->reason))
        spl_log_warn("dataset %s %s: %s", slot->id, slot->current ? "keeps its version" : "is not served",
                     err->message);
}

/* It is opened anew, after ever longer rests. */
static void rest(struct spl_catalog_slot *slot)
{
    slot->rest = 1u << (slot->failures < rests_most ? slot->failures++ : rests_most);
}

static void free_opening(struct opening *opening)
{
    free(opening->path);
    free(opening);
}

static void open_far(struct spl_service *service);

static void run_opening(uv_work_t *work)
{
    struct opening *opening = work->data;
    spl_catalog_entry_open(opening->path, opening->path, &opening->how, &opening->entry, &opening->err);
}

static void after_opening(uv_work_t *work, int status)
{
    (void)status;
    struct opening *opening = work->data;
    struct spl_service *service = opening->service;
    struct spl_catalog_slot *slot = spl_catalog_find_slot(&service->library->catalog, opening->id);
    service->library->tasks--;
    service->library->far_openings -= spl_remote_is_url(opening->path);
    if (slot && opening->err.code && !service->library->stopped) {
        if (spl_catalog_may_pass(opening->path, &opening->err))
            rest(slot);
        else
            slot->opened = opening->mark;
        refuse(slot, &opening->err);
    } else if (slot && opening->entry && !service->library->stopped) {
        slot->opened = opening->mark;
        slot->next = opening->entry;
        spl_fleet_add(service->views->fleet, opening->entry);
        opening->entry = NULL;
    }
    spl_catalog_entry_unref(opening->entry);
    free_opening(opening);
    open_far(service);
}

struct spl_dataset_opening spl_library_get_opening(struct spl_service *service)
{
    return (struct spl_dataset_opening){.verify = service->options->verify,
                                        .tables_bytes = service->options->tables_bytes,
                                        .cancelled = &service->library->cancelled,
                                        .page_cache = service->library->page_cache,
                                        .remote_deadline_ms = service->options->remote_deadline_ms};
}

static void open_slot(struct spl_service *service, struct spl_catalog_slot *slot)
{
    const bool far = spl_remote_is_url(slot->path);
    if (far && service->library->far_openings == SPL_FAR_OPENINGS_MAX) // the pool has threads for others
        return;
    struct opening *opening = spl_alloc(1, sizeof *opening, NULL);
    if (!opening || !(opening->path = strdup(slot->path))) {
        free(opening);
        return; // the next look tries again
    }
    opening->work.data = opening;
    opening->service = service;
    opening->how = spl_library_get_opening(service);
    opening->mark = slot->seen;
    snprintf(opening->id, sizeof opening->id, "%s", slot->id);
    if (uv_queue_work(&service->loop, &opening->work, run_opening, after_opening)) {
        free_opening(opening);
        return;
    }
    slot->busy = true;
    service->library->tasks++;
    service->library->far_openings += far;
}

/* What is on servers and was not tried yet: at start, so that nobody waits for them. */
static void open_far(struct spl_service *service)
{
    struct spl_library *library = service->library;
    for (size_t i = 0; i < library->catalog.count && !library->stopped && library->far_openings < SPL_FAR_OPENINGS_MAX;
         i++) {
        struct spl_catalog_slot *slot = &library->catalog.slots[i];
        if (!slot->busy && !slot->current && !slot->reason[0] && spl_remote_is_url(slot->path))
            open_slot(service, slot);
    }
}

bool spl_library_has_nothing_yet(const struct spl_service *service)
{
    const struct spl_catalog *catalog = &service->library->catalog;
    bool opens = false;
    for (size_t i = 0; i < catalog->count; i++) {
        const struct spl_catalog_slot *slot = &catalog->slots[i];
        if (slot->current)
            return false;
        opens |= !slot->reason[0] && spl_remote_is_url(slot->path);
    }
    return opens;
}

static void run_closing(uv_work_t *work)
{
    struct opening *closing = work->data;
    spl_catalog_entry_destroy(closing->entry);
}

static void after_closing(uv_work_t *work, int status)
{
    (void)status;
    struct opening *closing = work->data;
    closing->service->library->tasks--;
    free_opening(closing);
}

/* Unmapping takes a while; here where there is no other way. */
static void close_entry(struct spl_service *service, struct spl_catalog_entry *entry)
{
    struct opening *closing = spl_alloc(1, sizeof *closing, NULL);
    if (closing) {
        closing->work.data = closing;
        closing->service = service;
        closing->entry = entry;
        if (!uv_queue_work(&service->loop, &closing->work, run_closing, after_closing)) {
            service->library->tasks++;
            return;
        }
    }
    free(closing);
    spl_catalog_entry_destroy(entry);
}

void spl_library_serve(struct spl_catalog_slot *slot, struct spl_catalog_entry *entry)
{
    const struct spl_dataset_info *info = entry->info;
    spl_log_info("dataset %s: version %016llx %s, %llu splats, %llu bytes", slot->id, (unsigned long long)info->version,
                 slot->current ? "replaces the one before" : "is served", (unsigned long long)info->splats,
                 (unsigned long long)info->file_bytes);
    if (slot->current && slot->current != entry)
        spl_saved_inherit(entry->saved, slot->current->saved);
    spl_catalog_entry_unref(slot->current);
    slot->current = entry;
    slot->next = NULL;
    slot->busy = false;
    slot->reason[0] = '\0';
}

/* No request finds it any more; those that refer to it are refused by the device's thread. */
static void put_aside(struct spl_service *service, struct spl_catalog_entry *entry)
{
    struct spl_catalog_slot *slot = spl_catalog_find_slot(&service->library->catalog, entry->info->id);
    if (slot && slot->current == entry) {
        slot->current = NULL;
        spl_catalog_set_reason(slot, entry->err.message);
        spl_log_error("dataset %s is put aside: %s", slot->id, entry->err.message);
        spl_catalog_entry_unref(entry);
    }
    spl_catalog_entry_unref(entry);
}

void spl_library_take_changes(struct spl_service *service)
{
    for (struct spl_catalog_entry *entry; (entry = spl_fleet_take_change(service->views->fleet));) {
        if (entry->state == SPL_ENTRY_GONE) {
            close_entry(service, entry);
            continue;
        }
        if (entry->state == SPL_ENTRY_ASIDE) {
            put_aside(service, entry);
            continue;
        }
        struct spl_catalog_slot *slot = spl_catalog_find_slot(&service->library->catalog, entry->info->id);
        bool resident = entry->state == SPL_ENTRY_RESIDENT;
        if (spl_change_take_answer(service, entry))
            continue;
        if (slot && slot->next == entry && resident) {
            spl_library_serve(slot, entry);
            spl_tours_take_up(service->tours, entry);
            continue;
        }
        if (slot && (slot->next == entry || slot->current == entry)) {
            if (slot->current == entry) // at start: there is no version before it
                slot->current = NULL;
            const bool far = spl_remote_is_url(slot->path); // its server may answer otherwise later
            if (entry->err.code == SPL_E_TIMEOUT ||         // its disk did not answer
                (far && (entry->err.code == SPL_E_IO || entry->err.code == SPL_E_CORRUPT))) {
                slot->opened = (struct spl_file_mark){0};
                rest(slot);
            }
            refuse(slot, &entry->err);
        }
        spl_catalog_entry_unref(entry);
    }
}

/* One file of a look, which makes its slot or brings it up to date. False when there is no room for one. */
static bool meet(struct spl_service *service, const struct spl_catalog_file *file)
{
    char id[sizeof((struct spl_catalog_slot *)0)->id];
    size_t length;
    const char *stem = spl_catalog_id_of(file->path, &length);
    struct spl_error err = {0};
    if (!stem)
        return true;
    snprintf(id, sizeof id, "%.*s", (int)length, stem);
    struct spl_catalog_slot *slot = spl_catalog_find_slot(&service->library->catalog, id);
    if (!slot) {
        if (!(slot = spl_catalog_add_slot(&service->library->catalog, id, file->path, &err)))
            return false;
        slot->in_directory = file->in_directory;
        slot->seen = file->mark;
        slot->met = service->library->looks;
        return true; // opened when the next look finds the same
    }
    if (strcmp(slot->path, file->path))
        return true; // the same id elsewhere waits until this file is gone
    slot->missed = 0;
    slot->met = service->library->looks;
    bool settled = spl_file_mark_is_equal(&slot->seen, &file->mark);
    if (!slot->busy && slot->opened.inode && slot->current && spl_dataset_has_changed(slot->current->dataset)) {
        slot->opened = (struct spl_file_mark){0};
        spl_catalog_set_reason(slot, "it changed while it was served; it is being opened anew");
    }
    slot->seen = file->mark;
    if (!settled)
        slot->failures = slot->rest = 0;
    else if (slot->rest)
        slot->rest--;
    else if (!slot->busy && !spl_file_mark_is_equal(&slot->opened, &file->mark))
        open_slot(service, slot);
    return true;
}

static void drop_missing(struct spl_service *service, const struct spl_catalog_files *files)
{
    struct spl_catalog *catalog = &service->library->catalog;
    for (size_t i = catalog->count; i-- > 0;) {
        struct spl_catalog_slot *slot = &catalog->slots[i];
        if (slot->met == service->library->looks || slot->busy || spl_catalog_is_unlisted(files, slot->path) ||
            ++slot->missed < looks_before_drop)
            continue;
        spl_log_info("dataset %s: its file is gone, no longer served", slot->id);
        spl_catalog_remove_slot(catalog, slot);
    }
}

static void run_look(uv_work_t *work)
{
    struct look *look = work->data;
    const struct spl_service_options *options = look->service->options;
    spl_catalog_list(options->datasets.items, options->datasets.count, &look->files, &look->err);
    for (size_t i = 0; i < look->collection_count; i++)
        spl_dataset_look_for_tiles(look->collections[i]->dataset);
}

/* None where there is no memory: the next look has them. */
static void take_collections(struct look *look, const struct spl_catalog *catalog)
{
    look->collections = spl_alloc(catalog->count ? catalog->count : 1, sizeof(struct spl_catalog_entry *), NULL);
    for (size_t i = 0; look->collections && i < catalog->count; i++)
        if (catalog->slots[i].current && catalog->slots[i].current->info->tiles)
            look->collections[look->collection_count++] = spl_catalog_entry_ref(catalog->slots[i].current);
}

static void free_look(struct look *look)
{
    for (size_t i = 0; i < look->collection_count; i++)
        spl_catalog_entry_unref(look->collections[i]);
    free(look->collections);
    free(look);
}

static void after_look(uv_work_t *work, int status)
{
    (void)status;
    struct look *look = work->data;
    struct spl_service *service = look->service;
    struct spl_library *library = service->library;
    library->tasks--;
    library->looking = false;
    const struct spl_error *why = look->err.code ? &look->err : &look->files.why;
    if (why->code && strcmp(library->last.message, why->message))
        spl_log_warn("datasets are left as they are: %s", why->message);
    library->last = *why;
    if (!look->err.code && !library->stopped && look->changes == library->changes_made) {
        size_t left_out = look->files.left_out;
        library->looks++;
        for (size_t i = 0; i < look->files.count; i++)
            left_out += !meet(service, &look->files.items[i]);
        drop_missing(service, &look->files);
        spl_catalog_say_left_out(&service->library->catalog, left_out, &look->files);
    }
    spl_catalog_files_finish(&look->files);
    free_look(look);
}

static void on_timer(uv_timer_t *timer)
{
    struct spl_service *service = timer->data;
    struct look *look = service->library->looking ? NULL : spl_alloc(1, sizeof *look, NULL);
    if (!look)
        return;
    look->work.data = look;
    look->service = service;
    look->changes = service->library->changes_made;
    take_collections(look, &service->library->catalog);
    if (uv_queue_work(&service->loop, &look->work, run_look, after_look)) {
        free_look(look);
        return;
    }
    service->library->looking = true;
    service->library->tasks++;
}

void spl_library_init(struct spl_service *service)
{
    uv_timer_init(&service->loop, &service->library->timer);
    service->library->timer.data = service;
}

void spl_library_start(struct spl_service *service)
{
    uint64_t interval_ms = service->options->watch_ms;
    open_far(service);
    if (interval_ms)
        uv_timer_start(&service->library->timer, on_timer, interval_ms, interval_ms);
}

void spl_library_stop(struct spl_service *service)
{
    service->library->stopped = true;
    atomic_store(&service->library->cancelled, true);
    uv_timer_stop(&service->library->timer);
    while (service->library->tasks)
        uv_run(&service->loop, UV_RUN_ONCE);
    spl_change_forget_all(service);
}
