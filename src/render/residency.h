/* Which slots of which datasets are on the device, or of tables on the host. They are read when a view asks for them,
 * on the io thread (io.h), and evicted, least recently drawn first, when the device's memory limit refuses another.
 *
 * Asking for a slot that is not there takes its room at once, in the order that a walk asks in, and begins its read;
 * for one that has no room nothing is evicted. So what has no room depends on what the walk asks for, and not on what
 * has come by then, and a walk that is made again finds what it has waited for. A frame that waits holds what it asked
 * for (hold.h).
 *
 * A disk that has not answered for a second (io.h) costs its own dataset's views only: what it is to bring gives way
 * before all else, held or not, and whatever else is asked of it takes no room until it answers; the read goes on,
 * unwanted. Bookkeeping of the renderer's thread. */
#ifndef SPL_RENDER_RESIDENCY_H
#define SPL_RENDER_RESIDENCY_H

#include <stdbool.h>
#include <stdint.h>
#include <sys/queue.h>

#include "base/error.h"
#include "dataset/dataset.h"
#include "gpu/gpu.h"
#include "render/io.h"

struct spl_hold;

struct spl_resident_page {
    struct spl_gpu_buffer *buffer; /* NULL = neither there nor on its way, or tables */
    size_t host_bytes;             /* of tables that are there or on their way; else 0 */
    struct spl_tables *tables;     // that have come; may be NULL
    struct spl_io_read *read;      /* that is to fill it, or has failed; may be NULL */
    uint64_t last_frame;           /* when it was last asked for */
    uint32_t holds;                /* frames that wait with it */
    bool filled, failed;
    bool missed;                   /* of a tile that cannot be read: nothing comes, and frames go on without */
};

/* Is it there, or on its way? */
static inline bool spl_resident_has_room(const struct spl_resident_page *page)
{
    return page->buffer || page->host_bytes;
}

/* A dataset's slots; see slot.h. Each comes and goes on its own. */
struct spl_resident_dataset {
    const struct spl_dataset *dataset;  /* borrowed */
    struct spl_resident_page *pages;    /* slot_count of them */
    uint32_t page_count, slot_count;
    uint32_t device_slots;              /* those before tables */
    bool hangs;                         /* its disk does, as the walk under way began */
};

/* Does a frame that waits keep it? Not what a disk that hangs is to bring. */
static inline bool spl_resident_is_kept(const struct spl_resident_dataset *resident,
                                        const struct spl_resident_page *page)
{
    return page->holds && (page->filled || !resident->hangs);
}

/* What gives way first: the least of what a disk that hangs is to bring, what nobody keeps, the rest; then the one that
 * was asked for longest ago. */
static inline bool spl_resident_gives_way_before(const struct spl_resident_dataset *of_a,
                                                 const struct spl_resident_page *a,
                                                 const struct spl_resident_dataset *of_b,
                                                 const struct spl_resident_page *b)
{
    int worth_a = (a->filled || !of_a->hangs) + spl_resident_is_kept(of_a, a);
    int worth_b = (b->filled || !of_b->hangs) + spl_resident_is_kept(of_b, b);
    return worth_a != worth_b ? worth_a < worth_b : a->last_frame < b->last_frame;
}

static inline uint32_t spl_textures_slot(const struct spl_resident_dataset *resident, uint32_t page)
{
    return resident->page_count + page;
}

static inline uint32_t spl_dictionary_slot(const struct spl_resident_dataset *resident)
{
    return 2 * resident->page_count;
}

struct spl_residency {
    struct spl_gpu *gpu;
    struct spl_io *io;
    struct spl_gpu_buffer *staging;     /* hardware only: software draws from mapped memory */
    struct spl_resident_dataset *datasets;
    size_t dataset_count, dataset_capacity;
    LIST_HEAD(, spl_hold) holds;
    struct spl_hold *first_in_line; /* that others take no room before; may be NULL */
    uint64_t releases;              /* of what was held, so far */
    uint32_t failures;              /* slots whose read has failed and that nobody has asked for since */
    uint64_t pages_loaded, pages_evicted; /* since init */
    const struct spl_dataset *lost_by; /* in whose page the device was lost; compared, not looked at; NULL = in none */

    /* The walk under way. */
    uint64_t frame;          /* what it has asked for is not evicted */
    struct spl_hold *asker;  /* may be NULL */
    uint32_t *asked;         /* slots that it waits for or draws, in its order; room for those of any dataset */
    size_t asked_count, asked_capacity;
    bool pending, crowded;   /* some of them are on their way; have no room before another frame lets go */
    bool stalled;            /* crowded, since their disk hangs */
    bool later;              /* some that it does without are on their way, or will have room */
    uint64_t lacking;        /* the least that one of those without room lacked, bytes; 0 = all had room */
};

/* `wake` as spl_io_create(). */
int spl_residency_init(struct spl_residency *residency, struct spl_gpu *gpu, void (*wake)(void *context),
                       void *wake_context, struct spl_error *err);
/* Holds are let go of; the read under way is left to end by itself. */
void spl_residency_finish(struct spl_residency *residency);

int spl_residency_add(struct spl_residency *residency, const struct spl_dataset *dataset, struct spl_error *err);

/* Lets go of the dataset. A page of it that is being read holds it until it has come, and is dropped. */
void spl_residency_remove(struct spl_residency *residency, const struct spl_dataset *dataset);

/* NULL when `dataset` was not added. Valid until the next add or remove. */
struct spl_resident_dataset *spl_residency_get(struct spl_residency *residency, const struct spl_dataset *dataset);

/* Is slot `slot` resident or on its way, or does it fit without evicting another? */
bool spl_residency_has_room(const struct spl_residency *residency, const struct spl_resident_dataset *resident,
                            uint32_t slot);

/* Bytes of the slots of `resident` that are on the device, or have their room there. */
uint64_t spl_residency_get_bytes(const struct spl_resident_dataset *resident);

/* Starts a walk, by a frame (or NULL): what was asked for before may be evicted again. */
void spl_residency_begin_walk(struct spl_residency *residency, struct spl_hold *asker);

/* A buffer of `bytes` for the renderer itself, evicting pages that this walk has not asked for as the limit demands,
 * those last that frames wait with.
 */
int spl_residency_make_buffer(struct spl_residency *residency, enum spl_gpu_buffer_kind kind, uint64_t bytes,
                              struct spl_gpu_buffer **out, struct spl_error *err);

/* What the largest first page takes, on its way too: without it a dataset has no picture at all. */
uint64_t spl_residency_get_reserve(const struct spl_residency *residency);

/* What spl_residency_ask() says beside errors. */
enum spl_slot_answer {
    SPL_SLOT_READY,   /* it is there */
    SPL_SLOT_PENDING, /* it has its room and is on its way */
    SPL_SLOT_CROWDED, /* its room is held by frames that wait, or its disk hangs; later */
};

/* Asks for a slot of `resident` in the walk under way; `awaited`: the walk is good for nothing without it, its frame
 * waits. Never blocks. SPL_E_LIMIT when the memory limit leaves no room even if nobody else had anything; why its read
 * failed, after which it is read anew. */
int spl_residency_ask(struct spl_residency *residency, struct spl_resident_dataset *resident, uint32_t slot,
                      bool awaited, struct spl_error *err);

/* Begins the read of a slot that has its room, unless it has begun; false when no more can be under way. */
bool spl_residency_begin_read(struct spl_residency *residency, const struct spl_dataset *dataset,
                              struct spl_resident_page *page, uint32_t slot, struct spl_io_rank rank);

/* device_room.c: makes a slot's buffer, evicting others, those of frames that wait where `evict_held`; none where that
 * would not do. SPL_SLOT_CROWDED, SPL_E_LIMIT, SPL_E_NOMEM. */
int spl_residency_take_device_room(struct spl_residency *residency, struct spl_resident_dataset *resident,
                                   uint32_t slot, bool evict_held, struct spl_error *err);

/* The same of what uploads go through; what it takes is never given back. */
int spl_residency_grow_staging(struct spl_residency *residency, size_t bytes, struct spl_error *err);

/* host_room.c: the same for a slot of tables, which is counted in, among those of the dataset. */
int spl_residency_take_host_room(struct spl_residency *residency, struct spl_resident_dataset *resident, uint32_t slot,
                                 bool evict_held, struct spl_error *err);

/* Gives up what has room and did not come. */
void spl_residency_drop_slot(struct spl_residency *residency, struct spl_resident_page *page);

/* Puts on the device what has been read since, as much as holds up nobody; spl_io_wait() says whether that was all.
 * Device errors only: a read that failed is told to who asks for it. */
int spl_residency_upload(struct spl_residency *residency, struct spl_error *err);

#endif
