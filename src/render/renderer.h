/* The renderer's inside, shared by renderer.c (life), frame.c (tiles), scratch.c (buffers) and the methods. Everything
 * belongs to the renderer's thread. */
#ifndef SPL_RENDER_RENDERER_H
#define SPL_RENDER_RENDERER_H

#include <splatd/render.h>

#include "gpu/gpu.h"
#include "render/fill.h"
#include "render/residency.h"
#include "render/select.h"

/* Kernels are made when first used and kept: one slot per kernel and set of constants. */
enum spl_kernel_slot {
    SPL_KERNEL_SPLAT_DEPTH, /* + 1 for chunks with clip lines, as of the shade pass */
    SPL_KERNEL_SPLAT_DEPTH_CLIPPED,
    SPL_KERNEL_OCCLUSION_TILES,
    SPL_KERNEL_OCCLUSION_CHUNKS,
    SPL_KERNEL_SPLAT_SHADE,                                          /* + 2 SPL_SUMS_* */
    SPL_KERNEL_SPLAT_TEXTURE = SPL_KERNEL_SPLAT_SHADE + 2 * SPL_SUMS_COUNT, /* + 2 planes, 0: interpolated sums */
    SPL_KERNEL_SPLAT_SUM = SPL_KERNEL_SPLAT_TEXTURE + 2 * (SPL_TEXTURE_ATOMS + 1), /* + planes - 1 */
    SPL_KERNEL_POINTS = SPL_KERNEL_SPLAT_SUM + SPL_TEXTURE_ATOMS,    /* + 2 SPL_SUMS_* + pass */
    SPL_KERNEL_FILL_POINTS = SPL_KERNEL_POINTS + 2 * SPL_SUMS_COUNT, /* the same */
    SPL_KERNEL_FILL_LINES = SPL_KERNEL_FILL_POINTS + 2 * SPL_SUMS_COUNT, /* the same */
    SPL_KERNEL_FILL_PULL = SPL_KERNEL_FILL_LINES + 2 * SPL_SUMS_COUNT, /* + first */
    SPL_KERNEL_FILL_VISIBLE = SPL_KERNEL_FILL_PULL + 2,              /* + adaptive */
    SPL_KERNEL_FILL_NORMAL = SPL_KERNEL_FILL_VISIBLE + 2,
    SPL_KERNEL_FILL_GATHER,                                          /* + 2 SPL_SUMS_* + first */
    SPL_KERNEL_FILL_PUSH = SPL_KERNEL_FILL_GATHER + 2 * SPL_SUMS_COUNT, /* + 2 SPL_SUMS_* + last */
    SPL_KERNEL_RESOLVE = SPL_KERNEL_FILL_PUSH + 2 * SPL_SUMS_COUNT,  /* + 2 layer + (method splat ? 0 : 1) */
    SPL_KERNEL_COUNT = SPL_KERNEL_RESOLVE + 2 * SPL_LAYER_COUNT
};

/* Fixed, pre-sized device memory of one tile. */
struct spl_scratch {
    uint64_t samples;                /* capacity */
    uint64_t taken_bytes;            /* by all buffers below */
    struct spl_gpu_buffer *depth;    /* 4 bytes a sample; 8 with 64 bit atomics (method points) */
    struct spl_gpu_buffer *sums;     /* 16 bytes a sample */
    struct spl_gpu_buffer *ids;      /* 4 bytes a sample, and room for the summed textures of a run */
    struct spl_gpu_buffer *output; /* 4 bytes a sample: pixels of the requested layers; NULL on software devices, which
                                      write where the host reads */
    struct spl_gpu_buffer *readback; /* 4 bytes a sample */
    struct spl_gpu_buffer *params;   /* slots of SPL_PARAMS_STRIDE: the batches', then one a dispatch */
    struct spl_gpu_buffer *chunks;   /* struct spl_draw_chunk[], grown on demand */
    struct spl_gpu_buffer *bounds;   /* struct spl_chunk_bounds[], grown on demand */
    struct spl_gpu_buffer *entries;  /* uint[], grown on demand */
};

enum { SPL_PARAMS_STRIDE = 256, SPL_PARAMS_SLOTS = 8192 };

struct spl_renderer {
    struct spl_gpu *gpu;
    struct spl_residency residency;
    struct spl_scratch scratch;
    struct spl_gpu_kernel *kernels[SPL_KERNEL_COUNT];
    struct spl_draw_list list;       /* reused from tile to tile */
};

/* One tile being recorded. */
struct spl_tile {
    struct spl_renderer *renderer;
    const struct spl_resident_dataset *resident;
    const struct spl_view *view;
    struct spl_camera camera;        /* of the tile and what is drawn around it, in samples */
    struct spl_fill_plan fill;       /* method fill */
    uint32_t x, y, width, height;    /* in the image, pixels */
    uint64_t samples;
    struct spl_frame_params params;  /* common to all dispatches of the tile */
    uint32_t slots_used;             /* of scratch.params; first those of the draw list's batches */
    uint32_t stamps;                 /* timestamps written */
    uint8_t stamp_stage[SPL_GPU_TIMESTAMPS_MAX]; /* enum spl_stage that ended at each */
};

enum spl_stage { SPL_STAGE_BEGIN, SPL_STAGE_CLEAR, SPL_STAGE_DEPTH, SPL_STAGE_SHADE, SPL_STAGE_RESOLVE };

int spl_scratch_init(struct spl_scratch *scratch, struct spl_gpu *gpu, uint64_t samples,
                     const struct spl_renderer_options *options, struct spl_error *err);
void spl_scratch_finish(struct spl_scratch *scratch, struct spl_gpu *gpu);
/* Copies the draw list into the mapped buffers, growing them where it does not fit, at the cost of pages that the frame
 * has not asked for. SPL_E_LIMIT where there are too few of these, or only a first page is left to take. */
int spl_scratch_upload(struct spl_scratch *scratch, struct spl_residency *residency, const struct spl_draw_list *list,
                       struct spl_error *err);

/* Gets or makes the kernel of `slot`. */
int spl_renderer_get_kernel(struct spl_renderer *renderer, enum spl_kernel_slot slot, struct spl_gpu_kernel **out,
                            struct spl_error *err);

/* Gives the draw list's batches their slots of parameters, before anything else of the tile takes one. SPL_E_LIMIT. */
int spl_tile_take_slots(struct spl_tile *tile, struct spl_error *err);

enum spl_phase { SPL_PHASE_FRONT = 1, SPL_PHASE_BACK = 2, SPL_PHASE_BOTH = 3 };
/* Records `kernel` once per page of the draw list (and per the device's largest dispatch), for the given phases and
 * chunks. */
struct spl_dispatch {
    enum spl_phase phases;
    uint32_t kind;     /* enum spl_chunk_kind */
    bool by_texture;   /* only chunks drawn with `planes` planes of atoms, interpolated or not */
    uint32_t planes;
    bool smooth;
    struct spl_gpu_kernel *clipped; /* for chunks with clip lines; NULL = as the others */
    struct spl_gpu_kernel *sum;     /* runs before, to sum textures; NULL = none */
};
void spl_tile_dispatch_splats(const struct spl_tile *tile, struct spl_gpu_kernel *kernel,
                              const struct spl_dispatch *what);
/* Records the dropping of chunks from `first_chunk` on that the depth drawn so far hides. Clobbers the id buffer. */
int spl_tile_dispatch_occlusion(struct spl_tile *tile, size_t first_chunk, struct spl_error *err);
/* Records the kernel of `slot`, one invocation for each of `items`, and a barrier. */
int spl_tile_dispatch_items(struct spl_tile *tile, enum spl_kernel_slot slot, const struct spl_frame_params *params,
                              uint32_t items, struct spl_error *err);
/* Records the resolve pass of `layer`, whose pixels start at `output_word`. */
int spl_tile_dispatch_resolve(struct spl_tile *tile, enum spl_layer layer, uint32_t output_word, struct spl_error *err);
/* Marks the end of `stage` on the device's clock. */
void spl_tile_stamp(struct spl_tile *tile, enum spl_stage stage);

/* A method is one row of this table: it records everything from the cleared scratch to the resolved layers. */
struct spl_method_ops {
    const char *name;
    /* The group of layers that one run of `record` serves is all layers with the same SPL_SUMS_*. `first` is true for
     * the frame's first group. */
    int (*record)(struct spl_tile *tile, uint32_t group, bool first, struct spl_error *err);
};
extern const struct spl_method_ops spl_method_splat, spl_method_points, spl_method_fill;

/* Records the points of `group` into cleared depths and payloads, by the kernels from `slot` on. */
int spl_points_record(struct spl_tile *tile, uint32_t group, uint32_t slot, struct spl_error *err);

#endif
