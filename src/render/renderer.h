/* The renderer's inside, shared by renderer.c (life), frame.c (tiles), scratch.c (buffers), tile.c (recording) and the
 * methods. Everything belongs to the renderer's thread. */
#ifndef SPL_RENDER_RENDERER_H
#define SPL_RENDER_RENDERER_H

#include <stdatomic.h>

#include <splatd/render.h>

#include "gpu/gpu.h"
#include "render/fill.h"
#include "render/kernels.h"
#include "render/paint.h"
#include "render/residency.h"
#include "render/select.h"
#include "render/soft/order.h"

/* Device memory of one tile: pre-sized, but for what is said to grow or to be made on demand, which
 * spl_scratch_give_back() gives back. */
struct spl_scratch {
    uint64_t samples;              /* capacity */
    uint64_t first_chunks;         /* the same of chunks, before they grow */
    uint64_t taken_bytes;          /* by all buffers below */
    struct spl_gpu_buffer *depth;  /* 4 bytes a sample; 8 with 64 bit atomics (where the nearest wins) */
    struct spl_gpu_buffer *large;  /* 16 bytes a sample; see enum spl_area */
    struct spl_gpu_buffer *small;  /* 4 bytes a sample, and room for the summed textures of a run; the same */
    struct spl_gpu_buffer *output; /* 4 bytes a sample: pixels of the requested layers; NULL on software devices, which
                                      write where the host reads */
    struct spl_gpu_buffer *readback; /* 4 bytes a sample */
    struct spl_gpu_buffer *params;   /* in steps of SPL_PARAMS_STRIDE: the batches' rounds, then one a dispatch */
    struct spl_gpu_buffer *chunks;   /* struct spl_draw_chunk[], grown on demand */
    struct spl_gpu_buffer *bounds;   /* struct spl_chunk_bounds[], grown on demand */
    struct spl_gpu_buffer *entries;  /* uint[], grown on demand */
    struct spl_gpu_buffer *tests;    /* uint[], grown on demand */
    struct spl_gpu_buffer *marks;    /* bytes, grown on demand; what is in use is written in every tile */
    struct spl_gpu_buffer *palette;  /* SPL_PALETTE_WORDS, written in every tile whose colours show something else */
    struct spl_gpu_buffer *shades;   /* 4 bytes a sample, made with the first tile that is shaded; may be NULL */
    struct spl_soft_memory soft;     /* of soft spheres, from when there are any: soft/pass.h */
    uint64_t soft_bytes;             /* that it takes */
};

/* What the two blocks of scratch memory hold in turns. An area is begun, which asserts that its block is free, and
 * holds until its end; a dispatch binds those that hold. */
enum spl_area {
    SPL_AREA_SUMS,      /* large, until the group's layers are resolved */
    SPL_AREA_PLANES,    /* large, until the tile's end: visible samples serve all groups */
    SPL_AREA_IDS,       /* small, until the group's layers are resolved */
    SPL_AREA_OCCLUDERS, /* small, between two dispatches */
    SPL_AREA_SUMMED,    /* small, between two dispatches */
    SPL_AREA_SURFACE,   /* small, between two dispatches */
    SPL_AREA_COUNT
};

enum { SPL_PARAMS_STRIDE = 512, SPL_PARAMS_MAX = 8192 };

struct spl_renderer {
    struct spl_gpu *gpu;
    struct spl_residency residency;
    struct spl_scratch scratch;
    struct spl_kernels kernels;
    struct spl_draw_list list; /* reused from tile to tile */
    uint64_t work_at_once;     /* that the device is given, see draw_list.h */
    uint32_t soft_items_most;  /* soft spheres that are held at once; 0 = as memory has room (fault.h sets it) */
    uint64_t work_a_step;      /* that a step of a frame has, unless its piece is small; see work.c */
    uint64_t step_ns;          /* steps have more where work is known to take less than this; 0 = never */
    double work_ns[SPL_METHOD_COUNT]; /* what a unit of it took of late; 0 = not known */
    bool shares;               /* discs are drawn by the kernels for hardware: shaders/common/walk.glsl */
    uint64_t least_piece;      /* samples of a piece, at least */
};

struct spl_soft_pause;

/* One tile being recorded. */
struct spl_tile {
    struct spl_renderer *renderer;
    const struct spl_resident_dataset *resident;
    const struct spl_view *view;
    struct spl_camera camera;     /* of the tile and what is drawn around it, in samples */
    struct spl_fill_plan fill;    /* of methods that fill */
    uint32_t x, y, width, height; /* in the image, pixels */
    uint64_t samples;
    struct spl_frame_params params;              /* common to all dispatches of the tile, but for map_* */
    struct spl_gpu_buffer *map;                  /* that map_* are of; NULL = none so far */
    const struct spl_paint *paint;               /* what colours show; may be NULL: the splats' own */
    const atomic_bool *cancelled;                // may be NULL; borrowed
    struct spl_soft_pause *pause;                // the frame's
    uint64_t work;                               /* of what is recorded and does not run yet, see draw_list.h */
    uint64_t until_ns;                           /* if it takes longer it is given up, and is to be cut */
    uint32_t params_used;                        /* of scratch.params; first those of the batches' rounds */
    uint32_t areas;                              /* bit per enum spl_area: those that hold */
    uint64_t soft_drawn;                         /* spheres */
    double advance;                              /* what depths of the view are more by than those that are drawn */
    uint32_t stamps;                             /* timestamps written */
    uint8_t stamp_stage[SPL_GPU_TIMESTAMPS_MAX]; /* enum spl_stage that ended at each */
};

enum spl_stage {
    SPL_STAGE_BEGIN,
    SPL_STAGE_CLEAR,
    SPL_STAGE_DEPTH,
    SPL_STAGE_SHADE,
    SPL_STAGE_SOFT,
    SPL_STAGE_RESOLVE
};

int spl_scratch_init(struct spl_scratch *scratch, struct spl_gpu *gpu, uint64_t samples,
                     const struct spl_renderer_options *options, struct spl_error *err);
void spl_scratch_finish(struct spl_scratch *scratch, struct spl_gpu *gpu);
/* Copies the draw list into the mapped buffers, growing them, and that of its marks, where it does not fit, at the cost
 * of pages that the frame has not asked for. SPL_E_LIMIT where there are too few of these, or only a first page is left
 * to take. */
int spl_scratch_upload(struct spl_scratch *scratch, struct spl_residency *residency, const struct spl_draw_list *list,
                       struct spl_error *err);
/* Makes room for the factors of a shaded tile of so many samples; 0 needs none. Errors as of upload. */
int spl_scratch_make_shades(struct spl_scratch *scratch, struct spl_residency *residency, uint64_t samples,
                            struct spl_error *err);

/* What of its memory on demand is needed just now. */
struct spl_scratch_needs {
    bool soft, shades;
    const struct spl_draw_list *list; // may be NULL: whatever buffers have room for
};
/* Between a tile's walk and its upload, or between tiles: gives back what is not needed where that is `least` bytes,
 * and buffers of a list that is four times as long, so that views in turns do not grow them each time. Says whether. */
bool spl_scratch_give_back(struct spl_scratch *scratch, struct spl_residency *residency,
                           const struct spl_scratch_needs *needs, uint64_t least);

/* Begins an area and returns its memory, for who clears it. What holds between dispatches is ended by who began it. */
bool spl_tile_may_begin(const struct spl_tile *tile, enum spl_area area); /* is its block free? */
struct spl_gpu_buffer *spl_tile_begin_area(struct spl_tile *tile, enum spl_area area);
void spl_tile_end_area(struct spl_tile *tile, enum spl_area area);
void spl_tile_end_group(struct spl_tile *tile); /* ends what holds until a group's layers are resolved */

/* What every dispatch of the tile may see: the draw list, and the areas that hold. */
void spl_tile_bind(const struct spl_tile *tile, struct spl_gpu_binding bindings[SPL_RESOURCE_COUNT]);

/* To be called before dispatches of `work` are recorded: where they would be too much for the device's patience
 * together with those before, these are run first. SPL_E_DEVICE_LOST; SPL_E_TIMEOUT and SPL_E_CANCELLED where nobody
 * waits for the tile any more; SPL_FRAME_TOO_MUCH (frame.h) where the tile is to be cut. */
int spl_tile_add_work(struct spl_tile *tile, uint64_t work, struct spl_error *err);
/* Runs what was recorded, for the host to read; errors as of spl_tile_add_work(). */
int spl_tile_run(struct spl_tile *tile, struct spl_error *err);
/* Takes parameters for dispatches to bind. SPL_E_LIMIT. */
int spl_tile_put_params(struct spl_tile *tile, const struct spl_frame_params *params, struct spl_gpu_binding *binding,
                        struct spl_error *err);

/* work.c: upper bounds of work, known from the draw list: of the tile, drawn for so many groups of layers; of textures
 * of `entries` runs that are summed; of cells of maps. */
uint64_t spl_tile_count_work(const struct spl_tile *tile, uint32_t groups);
uint64_t spl_tile_get_sum_work(const struct spl_tile *tile, uint32_t planes, uint32_t entries);
uint64_t spl_tile_get_map_work(uint32_t cells);

/* Cuts the draw list's batches into rounds and takes their parameters, before anything else of the tile takes some.
 * SPL_E_LIMIT. */
int spl_tile_take_rounds(struct spl_tile *tile, struct spl_error *err);

/* Kernels of chunks that have clip lines (common/clip.glsl), that a map trims (common/trim.glsl), of which some splats
 * are soft (common/marks.glsl), that shapes cut (common/cut.glsl), or several of these; NULL = as those that have none,
 * but for marks and cuts. */
enum { SPL_ENDS_CLIPPED = 1, SPL_ENDS_TRIMMED = 2, SPL_ENDS_MARKED = 4 };
/* From bit SPL_ENDS_CUT on: what cuts them; one shape alone has kernels of its own, as SPL_SHAPE_*. */
enum spl_cut_by { SPL_CUT_BY_NONE, SPL_CUT_BY_SHAPES, SPL_CUT_BY_AXIS, SPL_CUT_BY_PLANE, SPL_CUT_BY_BOX,
                  SPL_CUT_BY_COUNT };
enum { SPL_ENDS_CUT = 3, SPL_ENDS_COUNT = SPL_CUT_BY_COUNT << SPL_ENDS_CUT };
/* The constants that say whether a kernel looks at marks, what colours show (SPL_PAINT_*), and at shapes of which
 * kinds. */
enum { SPL_CONSTANT_MARKED = 3, SPL_CONSTANT_PAINT = 4, SPL_CONSTANT_CUT = 5 };
struct spl_disc_kernels {
    struct spl_gpu_kernel *of[SPL_ENDS_COUNT];
    uint32_t lanes; /* of SPL_WORKGROUP invocations, that share an entry; 0 = as the dispatch has it */
};

/* Those of `key` that the tile's chunks need, and the first. */
int spl_tile_get_disc_kernels(struct spl_tile *tile, struct spl_kernel_key key, struct spl_disc_kernels *out,
                              struct spl_error *err);

/* The same of the tile's solid chunks of `what`, whose kernels know no clip lines. */
struct spl_dispatch;
int spl_tile_get_plain_kernels(struct spl_tile *tile, struct spl_kernel_key key, const struct spl_dispatch *what,
                               struct spl_disc_kernels *out, struct spl_error *err);

enum spl_phase { SPL_PHASE_FRONT = 1, SPL_PHASE_BACK = 2, SPL_PHASE_BOTH = 3 };
/* Records the kernel of each chunk once per page of the draw list (and per the device's largest dispatch), for the
 * given phases and chunks. */
struct spl_dispatch {
    enum spl_phase phases;
    uint32_t kind;   /* enum spl_chunk_kind */
    uint32_t lanes;  /* invocations that share an entry; 0 = as of its kind */
    bool by_texture; /* only chunks drawn with `planes` planes of atoms, interpolated or not */
    uint32_t planes;
    bool smooth;
    uint32_t role;   /* enum spl_draw_role */
    bool by_cells;   /* only panels or meshes whose cells are drawn in any case, or only the others */
    bool cells;
    const struct spl_gpu_binding *with; /* SPL_RESOURCE_COUNT: what it binds besides; NULL = nothing */
    struct spl_gpu_kernel *sum; /* runs before, to sum textures into SPL_AREA_SUMMED; NULL = none */
};
int spl_tile_dispatch_splats(struct spl_tile *tile, const struct spl_disc_kernels *kernels,
                             const struct spl_dispatch *what, struct spl_error *err);
/* The same by the kernel of `key`, which is made where the tile has chunks of lines alone. */
int spl_tile_dispatch_lines(struct spl_tile *tile, struct spl_kernel_key key, enum spl_phase phases,
                            struct spl_error *err);
/* panels.c: records panels and meshes of the given phases, as such where the view draws them so and `names` has a
 * kernel, else their cells; by kernels with the constants of `key`, whose own name does not matter. Nothing where there
 * are none.
 */
enum { SPL_CELL_POINT_LANES = SPL_RUN_PANELS * SPL_LANES, SPL_CELL_DISC_LANES = SPL_RUN_PANELS * 32 };
struct spl_panel_kernels {
    const char *panels, *meshes; /* NULL = none */
    const char *panel_cells, *mesh_cells;
};
int spl_tile_dispatch_panels(struct spl_tile *tile, const struct spl_panel_kernels *names, struct spl_kernel_key key,
                             enum spl_phase phases, struct spl_error *err);
/* tile_marks.c: records the marks of the tile's chunks of which some splats are soft. Before anything else of them. */
int spl_tile_dispatch_marks(struct spl_tile *tile, struct spl_error *err);
/* Records the dropping of those of the chunks [first_chunk, end_chunk) that the depth drawn so far hides; `wide`: of
 * words of 64 bits. */
int spl_tile_dispatch_occlusion(struct spl_tile *tile, size_t first_chunk, size_t end_chunk, bool wide,
                                struct spl_error *err);
/* Records a kernel, one invocation for each of `items`, and a barrier. */
int spl_tile_dispatch_items(struct spl_tile *tile, const struct spl_kernel_key *key,
                            const struct spl_frame_params *params, uint32_t items, struct spl_error *err);
/* The same for each sample of the tile, of which frame.entries says how many there are. */
int spl_tile_dispatch_samples(struct spl_tile *tile, const struct spl_kernel_key *key, struct spl_error *err);
/* tile_maps.c: tells dispatches to come of a station's map, which must be on the device. */
void spl_tile_set_map(struct spl_tile *tile, uint32_t station);
/* Do layers of `group` take colours from maps? */
bool spl_tile_has_map_colors(const struct spl_tile *tile, uint32_t group);
/* Records them, and a barrier: the group's sums (of method nearest payloads) become sums of floats. */
int spl_tile_dispatch_maps(struct spl_tile *tile, struct spl_error *err);
/* What colours show where they are of `group`; 0 = the splats' own, SPL_PAINT_NONE. */
static inline uint32_t spl_tile_get_paint(const struct spl_tile *tile, uint32_t group)
{
    return group == SPL_SUMS_COLOR && tile->paint ? tile->paint->kind : SPL_PAINT_NONE;
}
/* tile_shade.c: the kinds that colours of the tile are shaded by (SPL_SHADE_*), 0 where it has none; samples that
 * shading looks away. light() records what of it comes from normals, which it draws for it, before the group of colours
 * (`first` as of a method's record()); deepen() what comes from depths, behind it. */
uint32_t spl_tile_get_shades(const struct spl_tile *tile);
uint32_t spl_shade_get_kinds(const struct spl_view *view, const struct spl_dataset_info *info); /* the same of a view */
uint32_t spl_shade_get_reach(const struct spl_view *view, const struct spl_dataset_info *info);
int spl_tile_light(struct spl_tile *tile, bool *first, struct spl_error *err);
int spl_tile_deepen(struct spl_tile *tile, struct spl_error *err);
/* Records the resolve pass of `layer`, whose pixels start at `output_word`. */
int spl_tile_dispatch_resolve(struct spl_tile *tile, enum spl_layer layer, uint32_t output_word, struct spl_error *err);
/* Marks the end of `stage` on the device's clock. */
void spl_tile_stamp(struct spl_tile *tile, enum spl_stage stage);

#endif
