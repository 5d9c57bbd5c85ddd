/* Which pages are there, asked for and uploaded; see residency.h. A software device draws from host-visible memory,
 * which pages are copied to; a GPU's go through a staging buffer, which has its room before they have theirs. The
 * renderer's thread. */
#include "render/residency.h"

#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/array.h"
#include "base/memory.h"
#include "render/hold.h"
#include "render/slot.h"

static const uint64_t errors_last_ns = SPL_NS_PER_S;

enum {
    remote_reads = 4, /* of a dataset from afar at once */
    tile_reads = 32,  /* of a collection from afar: mostly of one small tile each, a round trip */
    failures_max = 16, // that are remembered where nobody waits: each takes a read's place
    uploads_max = 16,  // at a time, and SPL_IO_BYTES: tiles come between
};

int spl_residency_init(struct spl_residency *residency, struct spl_gpu *gpu, void (*wake)(void *context),
                       void *wake_context, struct spl_error *err)
{
    *residency = (struct spl_residency){.gpu = gpu, .frame = 1};
    LIST_INIT(&residency->holds);
    return spl_io_create(wake, wake_context, &residency->io, err);
}

void spl_residency_drop_slot(struct spl_residency *residency, struct spl_resident_page *page)
{
    spl_io_end(residency->io, page->read);
    spl_gpu_buffer_destroy(residency->gpu, page->buffer);
    free(page->tables);
    page->read = NULL;
    page->buffer = NULL;
    page->tables = NULL;
    page->host_bytes = 0;
    residency->failures -= page->failed;
    page->filled = page->failed = page->missed = false;
}

static void drop_dataset(struct spl_residency *residency, struct spl_resident_dataset *resident)
{
    spl_hold_let_go_dataset(residency, resident);
    for (uint32_t i = 0; i < resident->slot_count; i++)
        spl_residency_drop_slot(residency, &resident->pages[i]);
}

void spl_residency_finish(struct spl_residency *residency)
{
    if (!residency->gpu)
        return;
    spl_hold_let_go_all(residency);
    for (size_t i = 0; i < residency->dataset_count; i++) {
        drop_dataset(residency, &residency->datasets[i]);
        free(residency->datasets[i].pages);
    }
    spl_io_destroy(residency->io);
    spl_gpu_buffer_destroy(residency->gpu, residency->staging);
    free(residency->datasets);
    free(residency->asked);
    *residency = (struct spl_residency){0};
}

int spl_residency_add(struct spl_residency *residency, const struct spl_dataset *dataset, struct spl_error *err)
{
    if (spl_residency_get(residency, dataset))
        return SPL_OK;
    if (spl_array_reserve(residency->datasets, residency->dataset_capacity, residency->dataset_count + 1, err))
        return SPL_E_NOMEM;
    struct spl_resident_dataset resident = {.dataset = dataset,
                                            .page_count = spl_dataset_get_info(dataset)->pages,
                                            .slot_count = spl_slot_count(dataset),
                                            .device_slots = spl_slot_count_resident(dataset)};
    // a walk through it may ask for all of its slots
    int rc = spl_array_reserve(residency->asked, residency->asked_capacity, resident.slot_count, err);
    resident.pages = rc ? NULL : spl_alloc(resident.slot_count, sizeof *resident.pages, err);
    if (!resident.pages)
        return SPL_E_NOMEM;
    residency->datasets[residency->dataset_count++] = resident;
    return SPL_OK;
}

void spl_residency_remove(struct spl_residency *residency, const struct spl_dataset *dataset)
{
    struct spl_resident_dataset *resident = spl_residency_get(residency, dataset);
    if (!resident)
        return;
    drop_dataset(residency, resident);
    free(resident->pages);
    *resident = residency->datasets[--residency->dataset_count];
}

struct spl_resident_dataset *spl_residency_get(struct spl_residency *residency, const struct spl_dataset *dataset)
{
    for (size_t i = 0; i < residency->dataset_count; i++)
        if (residency->datasets[i].dataset == dataset)
            return &residency->datasets[i];
    return NULL;
}

void spl_residency_begin_walk(struct spl_residency *residency, struct spl_hold *asker)
{
    residency->frame++;
    residency->asker = asker;
    residency->asked_count = 0;
    residency->lacking = 0;
    residency->pending = residency->crowded = residency->stalled = residency->later = false;
    bool any = spl_io_count_hanging(residency->io);
    for (size_t i = 0; i < residency->dataset_count; i++)
        residency->datasets[i].hangs = any && spl_io_hangs(residency->io, residency->datasets[i].dataset);
}

uint64_t spl_residency_get_bytes(const struct spl_resident_dataset *resident)
{
    uint64_t bytes = 0;
    for (uint32_t slot = 0; slot < resident->slot_count; slot++)
        bytes += resident->pages[slot].buffer ? spl_slot_get_bytes(resident->dataset, slot) : 0;
    return bytes;
}

bool spl_residency_begin_read(struct spl_residency *residency, const struct spl_dataset *dataset,
                              struct spl_resident_page *page, uint32_t slot, struct spl_io_rank rank)
{
    const bool remote = spl_dataset_is_remote(dataset);
    struct spl_io_what what = {.read = spl_slot_read,
                               .hold = spl_slot_hold,
                               .let_go = spl_slot_let_go,
                               .source = dataset,
                               .index = slot,
                               .bytes = spl_slot_get_bytes(dataset, slot),
                               .owner = page,
                               .get_moved_ns = remote ? spl_slot_get_moved_ns : NULL,
                               .part = spl_slot_get_part(dataset, slot)};
    what.at_once = !remote ? 1 : what.part ? tile_reads : remote_reads;
    if (page->read)
        spl_io_raise(residency->io, page->read, rank);
    else
        page->read = spl_io_try_begin(residency->io, &what, rank);
    return page->read;
}

static int take_room(struct spl_residency *residency, struct spl_resident_dataset *resident, uint32_t slot,
                     struct spl_error *err)
{
    bool alone = residency->asker && residency->asker->alone;
    if (residency->first_in_line && residency->first_in_line != residency->asker && !alone)
        return SPL_SLOT_CROWDED;
    return slot >= resident->device_slots ? spl_residency_take_host_room(residency, resident, slot, alone, err)
                                          : spl_residency_take_device_room(residency, resident, slot, alone, err);
}

/* Is an error the latest word on a slot? It is for who waits with it already, and for a while for who takes what is
 * there and would never hear of it; whoever comes to wait has it read anew. */
static bool is_told(const struct spl_resident_page *page, bool awaited)
{
    return page->holds || (!awaited && spl_now_ns() - page->read->ended_ns < errors_last_ns);
}

/* Why its read failed. It is forgotten with the last frame that waits for it; where none does, once for all that failed
 * of the dataset. */
static int tell_failure(struct spl_residency *residency, struct spl_resident_dataset *resident,
                        const struct spl_resident_page *page, struct spl_error *err)
{
    int rc = page->read->err.code;
    spl_fail(err, rc, "%s", page->read->err.message);
    for (uint32_t i = 0; i < resident->slot_count; i++)
        if (resident->pages[i].failed && !resident->pages[i].holds)
            spl_residency_drop_slot(residency, &resident->pages[i]);
    return rc;
}

static int ask(struct spl_residency *residency, struct spl_resident_dataset *resident, uint32_t slot, bool awaited,
               struct spl_error *err)
{
    struct spl_resident_page *page = &resident->pages[slot];
    bool first = page->last_frame < residency->frame;
    page->last_frame = residency->frame;
    if (page->failed && is_told(page, awaited))
        return tell_failure(residency, resident, page, err);
    if (page->failed || page->missed)
        spl_residency_drop_slot(residency, page);
    if (residency->crowded && !page->filled) // the walk will be made anew from its start
        return SPL_SLOT_CROWDED;
    if (resident->hangs && !spl_resident_has_room(page) &&
        spl_io_part_hangs(residency->io, resident->dataset, spl_slot_get_part(resident->dataset, slot))) {
        residency->crowded |= awaited;
        residency->stalled |= awaited;
        return awaited ? SPL_SLOT_CROWDED : SPL_SLOT_PENDING;
    }
    int rc = spl_resident_has_room(page) ? SPL_OK : take_room(residency, resident, slot, err);
    if (rc) {
        residency->crowded |= awaited && rc == SPL_SLOT_CROWDED;
        return rc;
    }
    if (awaited && first)
        residency->asked[residency->asked_count++] = slot;
    if (page->filled)
        return SPL_SLOT_READY;
    residency->pending |= awaited;
    struct spl_io_rank rank = {.awaited = awaited, .walk = residency->frame};
    if (!spl_residency_begin_read(residency, resident->dataset, page, slot, rank) && !awaited && !page->holds)
        spl_residency_drop_slot(residency, page); // its room is for those who wait
    return SPL_SLOT_PENDING;
}

int spl_residency_ask(struct spl_residency *residency, struct spl_resident_dataset *resident, uint32_t slot,
                      bool awaited, struct spl_error *err)
{
    int answer = ask(residency, resident, slot, awaited, err);
    residency->later |= !awaited && (answer == SPL_SLOT_PENDING || answer == SPL_SLOT_CROWDED);
    return answer;
}

/* Copies what was read to where kernels see it. */
static int fill(struct spl_residency *residency, struct spl_resident_page *page, const struct spl_io_read *read,
                struct spl_error *err)
{
    size_t bytes = read->what.bytes;
    uint64_t ticket;
    if (page->host_bytes) {
        page->tables = spl_io_take_data(residency->io, page->read);
        return SPL_OK;
    }
    if (spl_gpu_get_device(residency->gpu)->software) {
        memcpy(spl_gpu_buffer_map(page->buffer), read->data, bytes);
        return SPL_OK;
    }
    page->last_frame = residency->frame; // it does not give way to its own staging
    int rc = spl_residency_grow_staging(residency, bytes, err);
    if (!rc)
        rc = spl_gpu_begin(residency->gpu, err);
    if (rc)
        return rc;
    memcpy(spl_gpu_buffer_map(residency->staging), read->data, bytes);
    spl_gpu_copy(residency->gpu, residency->staging, 0, page->buffer, 0, bytes);
    spl_gpu_barrier(residency->gpu);
    rc = spl_gpu_submit(residency->gpu, &ticket, err);
    if (rc)
        return rc;
    return spl_gpu_wait(residency->gpu, ticket, spl_now_ns() + spl_gpu_get_patience_ns(residency->gpu), err);
}

/* The dataset remembers why; the read's place is for others, of which there may be as many as tiles. */
static void miss(struct spl_residency *residency, struct spl_resident_page *page)
{
    if (!page->holds) {
        spl_residency_drop_slot(residency, page);
        return;
    }
    spl_io_end(residency->io, page->read);
    page->read = NULL;
    page->missed = true;
}

int spl_residency_upload(struct spl_residency *residency, struct spl_error *err)
{
    int rc = SPL_OK;
    uint64_t bytes = 0;
    struct spl_io_read *read;
    for (int i = 0; !rc && i < uploads_max && bytes < SPL_IO_BYTES && (read = spl_io_take(residency->io)); i++) {
        struct spl_resident_page *page = read->what.owner;
        bytes += read->what.bytes;
        if (!read->data && spl_slot_may_miss(read->what.source, read->what.index, read->err.code)) {
            miss(residency, page);
            continue;
        }
        if (!read->data) {
            page->failed = true;
            if (residency->failures++ > failures_max && !page->holds)
                spl_residency_drop_slot(residency, page);
            continue;
        }
        struct spl_error why = {0};
        if ((rc = fill(residency, page, read, &why))) {
            if (rc == SPL_E_DEVICE_LOST && !residency->lost_by)
                residency->lost_by = read->what.source;
            spl_residency_drop_slot(residency, page);
            if (rc != SPL_E_LIMIT && rc != SPL_E_NOMEM)
                return spl_fail(err, rc, "%s", why.message);
            rc = SPL_OK; /* no staging: who waits for it sees it gone, and asks again */
            continue;
        }
        spl_io_end(residency->io, read);
        page->read = NULL;
        page->filled = true;
        residency->pages_loaded += page->buffer != NULL;
    }
    return rc;
}
