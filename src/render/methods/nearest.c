/* Method nearest: each sample keeps one disc, the nearest by a depth that is bent into a cone (shaders/nearest.comp),
 * and no sums: with 64 bit atomics one pass instead of two. Resolving smooths colours over the samples around, the
 * farther the larger discs are, so that close ones do not look like scales. Chunks that the nearer half hides are
 * dropped, as of splats that blend. */
#include "render/method.h"
#include "render/renderer.h"

/* Draws the chunks of `phases` by the kernel of `group` and `pass`. */
static int draw(struct spl_tile *tile, uint32_t group, uint32_t pass, enum spl_phase phases, struct spl_error *err)
{
    struct spl_renderer *r = tile->renderer;
    struct spl_disc_kernels kernels;
    const uint32_t paint = spl_tile_get_paint(tile, group);
    struct spl_kernel_key key = {"nearest", true, {group, pass, [SPL_CONSTANT_PAINT] = paint}};
    int rc = spl_tile_get_disc_kernels(tile, key, &kernels, err);
    rc = rc ? rc : spl_tile_dispatch_splats(tile, &kernels, &(struct spl_dispatch){.phases = phases}, err);
    static const struct spl_panel_kernels panels = {.panels = "panel_nearest",
                                                     .meshes = "mesh_nearest",
                                                     .panel_cells = "nearest_cells",
                                                     .mesh_cells = "nearest_mesh_cells"};
    rc = rc ? rc : spl_tile_dispatch_panels(tile, &panels, key, phases, err);
    struct spl_kernel_key lines = {"line_nearest", true, {group, pass, [SPL_CONSTANT_PAINT] = paint}};
    rc = rc ? rc : spl_tile_dispatch_lines(tile, lines, phases, err);
    spl_gpu_barrier(r->gpu);
    return rc;
}

static int record(struct spl_tile *tile, uint32_t group, bool first, struct spl_error *err)
{
    (void)first; /* the payload of another group shares the word with the depth: every group starts anew */
    struct spl_renderer *r = tile->renderer;
    bool wide = spl_gpu_get_limits(r->gpu)->atomics_64, mapped = spl_tile_has_map_colors(tile, group);
    group = mapped ? SPL_SUMS_MAPPED : group;
    spl_gpu_fill(r->gpu, r->scratch.depth, 0, tile->samples * (wide ? 8 : 4), SPL_NOTHING);
    spl_gpu_barrier(r->gpu);
    spl_tile_stamp(tile, SPL_STAGE_CLEAR);
    int rc = draw(tile, group, 0, SPL_PHASE_FRONT, err);
    rc = rc ? rc : spl_tile_dispatch_occlusion(tile, r->list.first_back_chunk, r->list.first_soft_chunk, wide, err);
    rc = rc ? rc : draw(tile, group, 0, SPL_PHASE_BACK, err);
    spl_tile_stamp(tile, SPL_STAGE_DEPTH);
    if (!rc && !wide) {
        rc = spl_tile_dispatch_occlusion(tile, 0, r->list.first_soft_chunk, wide, err);
        spl_gpu_fill(r->gpu, spl_tile_begin_area(tile, SPL_AREA_IDS), 0, tile->samples * 4, SPL_NOTHING);
        spl_gpu_barrier(r->gpu);
        rc = rc ? rc : draw(tile, group, 1, SPL_PHASE_BOTH, err);
    }
    if (!rc && mapped) {
        spl_tile_begin_area(tile, SPL_AREA_SUMS);
        rc = spl_tile_dispatch_maps(tile, err);
    }
    if (!wide || mapped)
        spl_tile_stamp(tile, SPL_STAGE_SHADE);
    return rc;
}

const struct spl_method_row spl_method_nearest = {
    .info = {.name = "nearest",
             .help = "oriented discs, the nearest alone, colours smoothed over the samples around",
             .params = SPL_PARAMS_OF_ALL | SPL_PARAM_BIT(margin) | SPL_PARAM_BIT(maps) | SPL_PARAM_BIT(primitives),
             .needs_surface = true,
             .stand_in = SPL_METHOD_FILL},
    .discs = true,
    .apron = SPL_SMOOTH_REACH,
    .record = record,
    .resolve = SPL_RESOLVED_BENT,
    .guesses = {{2, 0.25, 4, 19, 20.95},
                {1, 0.25, 4, 27, 21.83},
                {2, 0.5, 4, 50, 22.53},
                {1, 0.5, 4, 52, 23.19},
                {2, 1, 4, 90, 23.59},
                {1, 1, 5, 120, 24.23},
                {1, 1.25, 6, 190, 24.65},
                {1, 1.5, 8, 225, 24.85}},
};
