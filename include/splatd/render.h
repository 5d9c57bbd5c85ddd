/* Frames from datasets, on one GPU device. A renderer and everything made from it belongs to one thread. */
#ifndef SPLATD_RENDER_H
#define SPLATD_RENDER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <splatd/api.h>
#include <splatd/camera.h>
#include <splatd/cancel.h>
#include <splatd/color.h>
#include <splatd/dataset.h>
#include <splatd/error.h>
#include <splatd/image.h>
#include <splatd/method.h>
#include <splatd/soft.h>
#include <splatd/terms.h>

SPL_BEGIN_DECLARATIONS

struct spl_renderer;

struct spl_view {
    size_t size;                /* spl_view_init() */
    struct spl_camera camera;
    enum spl_method method;
    uint32_t layers;            /* bit per enum spl_layer, at least one */
    double lod;                 /* wanted spacing of splats, samples; 1 = one splat a sample, 0 = every leaf splat */
    double supersample;         /* samples per pixel side: 1, 2 or 4; 1/4, 1/2, 5/4 or 3/2 = rendered at so many times
                                   the size and resampled */
    uint8_t background[4];      /* RGBA; alpha 0 = transparent where nothing is */
    struct spl_disc_params disc; /* of methods that draw discs, as SPL_METHOD_PARAMS says */
    struct spl_fill_params fill; /* of those that fill */
    bool partial;               /* draws what is on the device now, coarser where pages are still to come; else waits
                                   for them. A dataset's first page is waited for in any case */
    uint64_t deadline_ns;       /* of CLOCK_MONOTONIC; UINT64_MAX = as long as it takes */
    enum spl_maps maps;         /* of methods that draw them, as SPL_METHOD_PARAMS says */
    enum spl_shapes shapes;     /* the same */
    struct spl_soft_params soft; /* what is soft, of every method */
    struct spl_terms clip;      /* conditions, all of which hold for what is drawn, solid or soft; none: all is drawn */
    struct spl_shade_params shade; /* of colours: how what is solid is shaded, the same */
    struct spl_color_params color; /* what they show, the same */
    bool surrounded;            /* a piece of something larger, as a map's tile is: what lies beyond the borders acts on
                                   pixels at them as in the middle (eye-dome lighting, smoothing, specks that close) */
    const struct spl_rays *rays; // may be NULL: of projection RAYS alone; borrowed while the view is rendered
    bool without_late_tiles;    /* a tile of a collection whose server does not answer, or that spl_frame_stop_waiting()
                                   waits for no longer, is drawn as it is from afar, as one that cannot be read is; else
                                   why it does not come is an error */
};

/* Fills everything with defaults, of the camera near (0.01) and far (infinite) alone: the first method, color, lod 1,
 * supersample 1, opaque black, and each method's parameters as their table says. */
SPL_API void spl_view_init_sized(struct spl_view *view, size_t size);
static inline void spl_view_init(struct spl_view *view)
{
    spl_view_init_sized(view, sizeof *view);
}

/* A method's parameter by its place in the table, of a view that spl_view_init() has made whole; whole numbers and
 * choices as doubles (what is none becomes one that spl_view_check() refuses). */
SPL_API double spl_view_get_param(const struct spl_view *view, enum spl_method_param param);
SPL_API void spl_view_set_param(struct spl_view *view, enum spl_method_param param, double value);

/* What a view costs, whatever it shows: width times height times supersample squared. Below one sample a pixel it is
 * the pixels, which are enlarged, encoded and sent all the same. */
SPL_API uint64_t spl_view_get_samples(const struct spl_view *view);
/* What the images of its layers take in memory. */
SPL_API uint64_t spl_view_get_frame_bytes(const struct spl_view *view);

/* Checks ranges; the field at fault is named as in the HTTP interface. */
SPL_API int spl_view_check(const struct spl_view *view, struct spl_error *err);

/* Has a dataset the layers that the view asks for? SPL_E_INPUT (field "layer") of normals where it has no surface and
 * the method makes none, and of ids where it has more splats than 32 bits number. Every renderer asks. */
SPL_API int spl_view_check_layers(const struct spl_view *view, const struct spl_dataset_info *info,
                                  struct spl_error *err);

struct spl_frame_stats {
    uint64_t splats_drawn, chunks_drawn, nodes_drawn; /* of all tiles together; splats alone, without primitives. Of a
                                   tile that several devices drew: by one, of all pages that any of its pieces had */
    uint64_t pages_loaded;      /* that the frame has waited for */
    uint32_t tiles;
    bool complete;              /* every chosen page was drawn; else coarser nodes stood in, as the memory limit or
                                   spl_view.partial demanded, or for a tile of a collection that cannot be read */
    double select_ms, upload_ms, clear_ms, depth_ms, shade_ms, resolve_ms, readback_ms, total_ms; /* device times where
                                   the device has timestamps, else host times */
    bool pending;               /* not complete, and more of it is on its way: the same view gets more later. Else the
                                   memory limit has no room for it, or it is of a tile that cannot be read */
    uint64_t panels_drawn, meshes_drawn, lines_drawn; /* as whole ones or cell by cell; straight pieces of lines */
    uint64_t soft_drawn;        /* soft spheres, in every window that they are drawn in */
    double soft_ms;             /* of their stage, as the others */
    double kernels_ms;          /* making kernels that were not there yet, host time, which is in total_ms and may be in
                                   any stage; of views that several devices draw 0 */
};

struct spl_frame {
    struct spl_image images[SPL_LAYER_COUNT];  /* pixels NULL for layers that were not asked for */
    struct spl_frame_stats stats;
};
SPL_API void spl_frame_finish(struct spl_frame *frame);

enum { SPL_DEVICE_NAME_MAX = 256 };

struct spl_device_info {
    char backend[16];           /* "vulkan", "egl" */
    uint32_t index;             /* within the backend */
    char name[SPL_DEVICE_NAME_MAX];
    char driver[SPL_DEVICE_NAME_MAX];
    uint8_t uuid[16];           /* zero when the driver has none */
    bool software;
    char unusable[SPL_DEVICE_NAME_MAX]; /* why it cannot be used; "" = usable */
};

/* Lists devices of every backend built in, unusable ones with their reason. Writes at most `capacity`, returns how many
 * there are. */
SPL_API size_t spl_device_list(struct spl_device_info *devices, size_t capacity);

struct spl_renderer_options {
    size_t size;                /* spl_renderer_options_init() */
    const char *device;         /* NULL or "auto"; "vulkan", "egl", "vulkan:1", a UUID, or part of a name */
    bool require_gpu;           /* refuse software devices */
    bool debug;                 /* validation layers, GL debug output */
    uint64_t memory_limit;      /* bytes of device memory, 0 = 3/4 of what the device reports */
    uint64_t scratch_samples;   /* largest tile in samples, 0 = SPL_TILE_SAMPLES */
    uint64_t first_page_bytes;  /* largest first page of datasets to come, for the least limit; 0 = unknown */
    uint32_t first_page_chunks; /* most chunks in one of these pages: the draw list has room for them from the start */
    void (*wake)(void *context); /* by threads of the renderer's, several at once, when a page was read; may be NULL */
    void *wake_context;
    unsigned sharers; /* renderers that take of the same device memory: what memory_limit 0 gives is divided; 0 = 1 */
};
#define SPL_TILE_SAMPLES (4ull << 20)

static inline void spl_renderer_options_init(struct spl_renderer_options *options)
{
    spl_sized_init(options, sizeof *options);
}

/* SPL_E_LIMIT with field memory-limit, and the least limit that works, where the working memory alone exceeds it. */
SPL_API int spl_renderer_create(const struct spl_renderer_options *options, struct spl_renderer **out,
                                struct spl_error *err);
/* NULL-safe; datasets that were not removed are let go. Waits for the device, and for no page: a read that does not end
 * is left behind with its thread, which ends with it. */
SPL_API void spl_renderer_destroy(struct spl_renderer *renderer);
SPL_API const struct spl_device_info *spl_renderer_get_device(const struct spl_renderer *renderer);

/* Makes `dataset` (borrowed; must outlive its removal) renderable: pages are loaded as views need them, within the
 * memory limit. Refuses with both sizes when not even one frame's worth fits. */
SPL_API int spl_renderer_add(struct spl_renderer *renderer, const struct spl_dataset *dataset, struct spl_error *err);
/* Lets go of it, and of frames' waits for it; never blocks. A page that is being read is dropped when it has come:
 * until then the dataset can be closed, and stays (spl_dataset_close()). */
SPL_API void spl_renderer_remove(struct spl_renderer *renderer, const struct spl_dataset *dataset);

/* Pages are read on threads of the renderer's own and put on the device between tiles: by every step of a frame, and by
 * upload(), for those who have no step to make: some at a time, so that nobody waits long for them. Errors as of
 * spl_renderer_render(), the device's only. wait() blocks until there is something to put there: false where nothing is
 * being read, or nothing came within a second at most or until `deadline_ns` (0 = it only looks whether some are
 * left). */
SPL_API int spl_renderer_upload(struct spl_renderer *renderer, struct spl_error *err);
SPL_API bool spl_renderer_wait(struct spl_renderer *renderer, uint64_t deadline_ns);

/* Loads every page that fits, so that the first frame is as fast as the others. Only the first page, which views cannot
 * do without, takes the place of others that were not drawn for longest. SPL_E_LIMIT with numbers when not. */
SPL_API int spl_renderer_preload(struct spl_renderer *renderer, const struct spl_dataset *dataset,
                                 struct spl_error *err);

/* The same in steps that never block, for a renderer that has frames to make in between: *page (0 at first; textures
 * follow) moves over those that are there, the next ones are asked for. *more: to be called again, where *page has not
 * moved once a page has been read. SPL_E_TIMEOUT when a page of this dataset has been waited for 10 s. */
SPL_API int spl_renderer_preload_page(struct spl_renderer *renderer, const struct spl_dataset *dataset, uint32_t *page,
                                      bool *more, struct spl_error *err);

/* What is on the device: pages of `dataset` (NULL: none) and everything there. */
struct spl_residency_info {
    uint64_t bytes;         /* pages of `dataset` */
    uint64_t limit_bytes;   /* the memory limit */
    uint64_t taken_bytes;   /* of it; spl_renderer_get_memory() */
    uint64_t pages_loaded;  /* of all datasets, since the renderer was made */
    uint64_t pages_evicted; /* the same, to make room for others */
    uint64_t pages_pending; /* of all datasets, on their way */
};
SPL_API void spl_renderer_get_residency(struct spl_renderer *renderer, const struct spl_dataset *dataset,
                                        struct spl_residency_info *info);

/* Renders one frame; blocks at most until the view's deadline, for pages too, which other frames that wait for theirs
 * give up where there is no room for both; SPL_E_TIMEOUT when it passes, or no page of the dataset has come for 10 s. A
 * dataset without surface is drawn by what stands in for a method that needs one; where that finds no normals
 * SPL_E_INPUT (field "layer") refuses them. On success the caller owns `frame` (spl_frame_finish), on failure it is
 * zeroed. SPL_E_DEVICE_LOST: the renderer is dead, destroy it and make a new one. */
SPL_API int spl_renderer_render(struct spl_renderer *renderer, const struct spl_dataset *dataset,
                                const struct spl_view *view, struct spl_frame *frame, struct spl_error *err);

/* How a frame is made, beyond what it shows. */
struct spl_render_options {
    size_t size;                    /* spl_render_options_init() */
    const struct spl_image *images; /* the caller's, at most one a layer of the view; their pixels are written */
    size_t image_count;
    const struct spl_cancel *cancel; // may be NULL; polled before each tile and page, every second of waiting or work
};

static inline void spl_render_options_init(struct spl_render_options *options)
{
    spl_sized_init(options, sizeof *options);
}

/* The same as spl_renderer_render(), with options. An image of theirs has the layer, its type, the view's width and
 * height, and pixels and row_bytes in multiples of 4 (0 = packed): SPL_E_USAGE (field "images") where not. `frame` has
 * the layers that no image was given for, NULL pixels for the others, and the stats; it may be NULL where every layer
 * has an image. What lies between the rows is not touched; after a failure the caller's pixels are anything. All
 * pointers are borrowed until it returns. */
SPL_API int spl_renderer_render_with(struct spl_renderer *renderer, const struct spl_dataset *dataset,
                                     const struct spl_view *view, const struct spl_render_options *options,
                                     struct spl_frame *frame, struct spl_error *err);

/* The plane that a panel lies on. */
struct spl_pick_plane {
    double point[3];   /* of it, world */
    double normal[3];  /* unit, world axes, away from the surface */
    double error_mean; /* distance of the points to it that it was found in: root of the mean square, and the most */
    double error_most;
    uint64_t points;   /* that its panels stand for in their part of the dataset */
};

/* What lies under one point of a view. */
struct spl_pick {
    bool hit;            /* false: the rest is zero */
    double position[3];  /* world, on the ray through the point */
    double depth;        /* along the viewing axis */
    double distance;     /* from the eye */
    double normal[3];    /* unit, world axes; (0,0,0) = none is known; of a panel its plane's */
    uint8_t color[4];    /* of the splats, without textures */
    int32_t classification; /* of the nearest splat; -1 = the dataset has none */
    int64_t splat;       /* its index in the dataset, or that of a panel, mesh or vertex of a line; -1 =
                            none is known */
    enum spl_shape primitive;    /* as what it is drawn; SPL_SHAPE_NONE where `splat` is -1 */
    struct spl_pick_plane plane; /* of a panel; zero of others */
};

/* Picks point (x, y) of the view's image, pixels from its left upper corner, so that a pixel's middle is at .5. One
 * pixel is rendered as the view renders it, whatever its layers; SPL_E_USAGE names "x" or "y" outside the image. Blocks
 * and fails as spl_renderer_render(). */
SPL_API int spl_renderer_pick(struct spl_renderer *renderer, const struct spl_dataset *dataset,
                              const struct spl_view *view, double x, double y, struct spl_pick *pick,
                              struct spl_error *err);

/* The same frame in steps of a tile at most, for a renderer that has others to make in between: any number may be
 * under way, pages and versions of other datasets may come and go, and each gets the bytes that it has alone. `dataset`
 * is borrowed and stays added until the end. begin() checks the view; on success the caller ends the steps. */
struct spl_frame_steps;
SPL_API int spl_frame_begin(struct spl_renderer *renderer, const struct spl_dataset *dataset,
                            const struct spl_view *view, struct spl_frame_steps **out, struct spl_error *err);

/* The steps to come fail with SPL_E_CANCELLED soon after `cancel` was set, also in the middle of a tile that takes
 * long. It is borrowed until the end; NULL = nothing cancels them. */
SPL_API void spl_frame_set_cancel(struct spl_frame_steps *steps, const struct spl_cancel *cancel);

/* Makes the next tile, unless `deadline_ns` has passed (the view's own does not count) or the frame waits: then it
 * makes nothing and does not block. *more: there are others. Times in the frame's stats are those of its own steps.
 * Fails as spl_renderer_render() does; then the steps can only be ended. */
SPL_API int spl_frame_step(struct spl_frame_steps *steps, uint64_t deadline_ns, bool *more, struct spl_error *err);

/* Does it wait for pages? A step has nothing to do then; others may have come, or room, after each
 * spl_renderer_upload() and step of another frame. Who renders another frame to its end instead lets it wait again. */
SPL_API bool spl_frame_is_waiting(struct spl_frame_steps *steps);

/* Its deadline is near: tiles that it waits for are drawn as they are from afar where the view is without_late_tiles;
 * other pages are waited for. Returns which tile it waits for still, counted from 1 in the order of the collection's
 * file, the one that says nothing before others; 0: none. Idempotent. */
SPL_API uint32_t spl_frame_stop_waiting(struct spl_frame_steps *steps);

/* Of spl_view_get_samples(), what is still to be made: a guess for whoever shares out turns. */
SPL_API uint64_t spl_frame_get_samples_left(const struct spl_frame_steps *steps);

/* Frees the steps; NULL-safe, also after the renderer has gone. `frame`, if not NULL, takes what was made: the whole
 * frame after the last step, else all zero. */
SPL_API void spl_frame_end(struct spl_frame_steps *steps, struct spl_frame *frame);

SPL_API uint64_t spl_renderer_get_memory(const struct spl_renderer *renderer); /* device bytes held */

SPL_END_DECLARATIONS

#endif
