/* The order of soft spheres: items that a kernel gathered in the order of their ids are sorted by view depth (stable,
 * so that ties fall to the lower id), listed by the tiles of SPL_SOFT_TILE samples that they reach, and blended front
 * to back over what is solid. Counting sorts throughout: integers, the same order on every driver. Everything belongs
 * to the renderer's thread.
 *
 *   items (ids) ── sort_count, sort_scan, sort_move, a digit of the depth at a time ──► pairs (depth, item) in order
 *         ── soft_list ──► count by tile ── the host: where lists start ──► lists of items ── soft_blend ──► samples
 *
 * GPUs take a sort in place of the second line's count: soft_entries, sort_…, soft_tiles. They have kernels
 * sort_…_many: blocks are short and scans shared by a workgroup.
 */
#ifndef SPL_RENDER_SOFT_ORDER_H
#define SPL_RENDER_SOFT_ORDER_H

#include <splatd/soft.h>

#include "gpu/gpu.h"
#include "render/kernels.h"
#include "shared_soft.h"

enum { SPL_SOFT_STEP_STRIDE = 256, SPL_SOFT_STEPS = 256 };
/* Where many invocations run: pairs a block, bits of a digit. */
enum { SPL_SOFT_MANY_BLOCK = 64, SPL_SOFT_MANY_BITS = 5 };
/* Groups of tiles whose walks are recorded together, at most. */
enum { SPL_SOFT_WALK_GROUPS = 256 };

/* Device memory, of so much that any window of depth that is planned for it fits. */
struct spl_soft_sizes {
    uint32_t items;   /* at once */
    uint32_t entries; /* of lists */
    uint32_t tiles;
    uint32_t slots;   /* that gather */
    uint64_t samples;
    bool walks;       /* for models but express, too */
    uint64_t found;   /* samples of which a sphere is found (of.h); 0 = none are, and items have no details */
};

enum spl_soft_buffer {
    SPL_SOFT_ITEMS,   /* and rectangles */
    SPL_SOFT_PAIRS,   /* of key and item, which sorting moves to and fro; then lists */
    SPL_SOFT_OTHERS,
    SPL_SOFT_TILED,   /* pairs of tile and item, which sorting moves to and fro; NULL but where `many` */
    SPL_SOFT_UNTILED,
    SPL_SOFT_COUNTS,
    SPL_SOFT_SLOTS,   /* what they have, for the host: where `many`, by way of SPL_SOFT_TOLD */
    SPL_SOFT_TOLD,    /* counted there: a GPU's atomics and scattered words are slow in the host's memory; else NULL */
    SPL_SOFT_FIRSTS,  /* their first items, from the host */
    SPL_SOFT_DIGITS,  /* totals of a sort */
    SPL_SOFT_TOTALS,  /* of tiles, for the host; then whether groups of walks are done */
    SPL_SOFT_STARTS,  /* of tiles, from the host */
    SPL_SOFT_LISTS,   /* tiles to blend, from the host */
    SPL_SOFT_STEPS_OF,/* struct spl_soft_step[], from the host */
    SPL_SOFT_STATE,
    SPL_SOFT_WALKS,   /* of models but express */
    SPL_SOFT_FOUND,   /* may be NULL */
    SPL_SOFT_BUFFERS
};

struct spl_soft_memory {
    struct spl_soft_sizes sizes;
    bool many;         /* thousands of invocations walk a little each, as GPUs want it; else few walk much */
    uint32_t counters; /* words of SPL_SOFT_COUNTS */
    uint32_t threads;  /* invocations that walk blocks at most where not `many`: each has counters of its own */
    struct spl_gpu_buffer *buffers[SPL_SOFT_BUFFERS];
};

/* Makes a buffer, as spl_gpu_buffer_create(), of `context`. */
typedef int spl_soft_make(void *context, enum spl_gpu_buffer_kind kind, uint64_t bytes, struct spl_gpu_buffer **out,
                          struct spl_error *err);

/* What the buffers of such sizes take. */
uint64_t spl_soft_memory_bytes(const struct spl_soft_sizes *sizes, bool software);
/* SPL_E_LIMIT, SPL_E_NOMEM, SPL_E_DEVICE_LOST: nothing is kept. */
int spl_soft_memory_init(struct spl_soft_memory *memory, const struct spl_soft_sizes *sizes, bool software,
                         spl_soft_make *make, void *context, struct spl_gpu *gpu, struct spl_error *err);
void spl_soft_memory_finish(struct spl_soft_memory *memory, struct spl_gpu *gpu);

/* Being recorded, for one window of depth of one tile of a frame. */
struct spl_soft_order {
    struct spl_gpu *gpu;
    struct spl_kernels *kernels;
    struct spl_soft_memory *memory;
    struct spl_gpu_binding frame;  /* parameters of the tile of the frame */
    struct spl_gpu_buffer *depth;  /* of what is solid; words of 64 bits where `wide` */
    bool wide;
    uint32_t columns, rows;        /* tiles */
    /* Called before work is recorded, in samples that are looked at: runs what was recorded where that is too much; an
     * error ends the frame. NULL = never. */
    int (*add_work)(void *context, uint64_t work, struct spl_error *err);
    int (*run)(void *context, struct spl_error *err); /* runs what was recorded; NULL = spl_gpu_run() */
    void *context;
    uint32_t steps;                /* of SPL_SOFT_STEPS_OF, used since it last ran */
    enum spl_soft_buffer sorted;   /* PAIRS or OTHERS: where the last sort ended */
    uint32_t entries;              /* of the lists */
    const uint32_t *starts;        /* of the tiles, where the host reads them: mapped memory of the device */
};

/* Puts the parameters of a dispatch where it may bind them. */
int spl_soft_put_step(struct spl_soft_order *order, const struct spl_soft_step *step, struct spl_gpu_binding *binding,
                      struct spl_error *err);
/* Runs what was recorded. */
int spl_soft_run(struct spl_soft_order *order, struct spl_error *err);

/* Sorts `items` pairs in SPL_SOFT_PAIRS whose keys are in [low, high]. */
int spl_soft_sort(struct spl_soft_order *order, uint32_t items, uint32_t low, uint32_t high, struct spl_error *err);

/* list.c: lists the sorted items, which have `entries` entries in all and at most `most` each. Runs what was recorded.
 * SPL_SOFT_CROWDED: they are more than fit, and nothing is listed. */
enum { SPL_SOFT_CROWDED = 1 };
int spl_soft_list(struct spl_soft_order *order, uint32_t items, uint64_t entries, uint32_t most, struct spl_error *err);

struct spl_soft_blend {
    enum spl_soft_model model;
    double opacity; /* at a sphere's centre, 0 to 1 */
    bool border;    /* some items are partly solid */
    bool first;     /* nothing of this tile was blended before: the state is zero */
    /* Of models but express, whose walks are zero before the first window: */
    float reach;    /* the largest radius */
    float until;    /* what begins before this view depth is listed, of what is beyond `from` of plan.h */
    bool ends;      /* there is no window behind this one */
    bool thin;      /* some items are narrower than a sample */
};
/* Blends what was listed. */
int spl_soft_blend(struct spl_soft_order *order, const struct spl_soft_blend *blend, struct spl_error *err);

/* order.c for list.c, walk.c and of.c: a dispatch of one of its kernels. */
struct spl_soft_dispatch {
    struct spl_kernel_key key;
    struct spl_soft_step step;
    enum spl_soft_buffer from, to, totals;
    uint32_t workgroups;
};
int spl_soft_dispatch(struct spl_soft_order *order, const struct spl_soft_dispatch *what, struct spl_error *err);
int spl_soft_add_work(struct spl_soft_order *order, uint64_t work, struct spl_error *err);
/* The other one of two between which pairs are moved. */
enum spl_soft_buffer spl_soft_other(enum spl_soft_buffer buffer);
/* Workgroups of so many invocations that each walk a block. */
uint32_t spl_soft_groups(const struct spl_soft_order *order, uint64_t invocations);
/* Counters become how many of their digit lie in the blocks before, and totals how many there are, or with `starts`
 * where each begins. */
int spl_soft_scan(struct spl_soft_order *order, struct spl_soft_dispatch what, bool starts, struct spl_error *err);
/* Sorts the pairs in *pairs, whose keys are in [low, high], and says where they are then. */
int spl_soft_sort_pairs(struct spl_soft_order *order, enum spl_soft_buffer *pairs, uint32_t count, uint32_t low,
                        uint32_t high, struct spl_error *err);

/* walk.c: spl_soft_blend() of base, concentric and layer. Runs what was recorded. */
int spl_soft_walk(struct spl_soft_order *order, const struct spl_soft_blend *blend, struct spl_error *err);

#endif
