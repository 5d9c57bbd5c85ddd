/* Method splat: depth, attribute and resolve passes of the sparse-coded-splat-textures paper, section 3.6, as compute
 * kernels. The depth pass runs once a tile, in two halves: what the nearer half hides is dropped from the other, and
 * what both hide from the shade pass, which runs once a group of layers. */
#include "render/method.h"
#include "render/renderer.h"

/* Depths of discs, panels, meshes and lines of a phase. */
static int draw_depth(struct spl_tile *tile, const struct spl_disc_kernels *depth, enum spl_phase phase,
                      struct spl_error *err)
{
    int rc = spl_tile_dispatch_splats(tile, depth, &(struct spl_dispatch){.phases = phase}, err);
    static const struct spl_panel_kernels panels = {.panels = "panel_depth",
                                                     .meshes = "mesh_depth",
                                                     .panel_cells = "splat_depth_cells",
                                                     .mesh_cells = "splat_depth_mesh_cells"};
    rc = rc ? rc : spl_tile_dispatch_panels(tile, &panels, (struct spl_kernel_key){0}, phase, err);
    rc = rc ? rc : spl_tile_dispatch_lines(tile, (struct spl_kernel_key){.name = "line_depth"}, phase, err);
    spl_gpu_barrier(tile->renderer->gpu);
    return rc;
}

static int record_depth(struct spl_tile *tile, struct spl_error *err)
{
    struct spl_renderer *r = tile->renderer;
    struct spl_disc_kernels depth;
    int rc = spl_tile_get_disc_kernels(tile, (struct spl_kernel_key){.name = "splat_depth"}, &depth, err);
    rc = rc ? rc : draw_depth(tile, &depth, SPL_PHASE_FRONT, err);
    rc = rc ? rc : spl_tile_dispatch_occlusion(tile, r->list.first_back_chunk, r->list.first_soft_chunk, false, err);
    rc = rc ? rc : draw_depth(tile, &depth, SPL_PHASE_BACK, err);
    return rc ? rc : spl_tile_dispatch_occlusion(tile, 0, r->list.first_soft_chunk, false, err);
}

static int shade_panels(struct spl_tile *tile, uint32_t group, struct spl_error *err)
{
    static const struct spl_panel_kernels panels = {.panels = "panel_shade",
                                                     .meshes = "mesh_shade",
                                                     .panel_cells = "splat_shade_cells",
                                                     .mesh_cells = "splat_shade_mesh_cells"};
    const struct spl_kernel_key key = {NULL, true, {group, [SPL_CONSTANT_PAINT] = spl_tile_get_paint(tile, group)}};
    return spl_tile_dispatch_panels(tile, &panels, key, SPL_PHASE_BOTH, err);
}

/* The kernels of `what`, by its number of planes. */
static int get_texture_kernels(struct spl_tile *tile, struct spl_dispatch *what, struct spl_disc_kernels *kernels,
                               struct spl_error *err)
{
    struct spl_renderer *r = tile->renderer;
    what->sum = NULL;
    struct spl_kernel_key key = {"splat_texture", true, {what->planes}}, sum = {"splat_sum", false, {what->planes}};
    struct spl_kernel_key summed = {.name = "splat_summed", .wide = true};
    if (!what->smooth)
        return spl_tile_get_disc_kernels(tile, key, kernels, err);
    int rc = spl_kernels_get(&r->kernels, r->gpu, &sum, &what->sum, err);
    return rc ? rc : spl_tile_get_disc_kernels(tile, summed, kernels, err);
}

/* Colours: chunks with atoms by the kernels of their number of planes, the others by the one that knows none. */
static int shade_colors(struct spl_tile *tile, const struct spl_disc_kernels *plain, struct spl_error *err)
{
    const struct spl_draw_list *list = &tile->renderer->list;
    uint64_t seen = 0;
    for (size_t i = 0; i < list->batch_count; i++)
        seen |= 1ull << (2 * list->batches[i].key.planes + list->batches[i].key.smooth);
    struct spl_dispatch what = {.phases = SPL_PHASE_BOTH, .by_texture = true};
    int rc = spl_tile_dispatch_splats(tile, plain, &what, err);
    for (uint32_t kind = 2; kind < 2 * (SPL_TEXTURE_ATOMS + 1) && !rc; kind++) {
        struct spl_disc_kernels kernels;
        if (!(seen >> kind & 1))
            continue;
        what.planes = kind / 2;
        what.smooth = kind % 2;
        if ((rc = get_texture_kernels(tile, &what, &kernels, err)))
            break;
        if (what.smooth)
            spl_tile_begin_area(tile, SPL_AREA_SUMMED);
        rc = spl_tile_dispatch_splats(tile, &kernels, &what, err);
        if (what.smooth)
            spl_tile_end_area(tile, SPL_AREA_SUMMED);
    }
    return rc;
}

/* Records the shade pass of a group of layers. */
static int shade(struct spl_tile *tile, uint32_t group, const struct spl_disc_kernels *kernels, struct spl_error *err)
{
    int rc = group == SPL_SUMS_COLOR
                 ? shade_colors(tile, kernels, err)
                 : spl_tile_dispatch_splats(tile, kernels, &(struct spl_dispatch){.phases = SPL_PHASE_BOTH}, err);
    rc = rc ? rc : shade_panels(tile, group, err);
    struct spl_kernel_key lines = {"line_shade", true, {group, [SPL_CONSTANT_PAINT] = spl_tile_get_paint(tile, group)}};
    return rc ? rc : spl_tile_dispatch_lines(tile, lines, SPL_PHASE_BOTH, err);
}

/* Sums of depths become the surface that maps are asked for; the sums are cleared for colours. */
static int find_surface(struct spl_tile *tile, struct spl_error *err)
{
    struct spl_gpu *gpu = tile->renderer->gpu;
    struct spl_disc_kernels kernels;
    struct spl_kernel_key key = {"splat_shade", true, {SPL_SUMS_DEPTH}};
    int rc = spl_tile_get_disc_kernels(tile, key, &kernels, err);
    rc = rc ? rc : shade(tile, SPL_SUMS_DEPTH, &kernels, err);
    if (rc)
        return rc;
    spl_gpu_barrier(gpu);
    rc = spl_tile_dispatch_samples(tile, &(struct spl_kernel_key){.name = "map_surface"}, err);
    spl_gpu_fill(gpu, tile->renderer->scratch.large, 0, tile->samples * 16, 0);
    spl_gpu_barrier(gpu);
    return rc;
}

static int record(struct spl_tile *tile, uint32_t group, bool first, struct spl_error *err)
{
    struct spl_renderer *r = tile->renderer;
    struct spl_disc_kernels kernels;
    bool mapped = spl_tile_has_map_colors(tile, group);
    const struct spl_kernel_key key = {
        "splat_shade", true, {group, [SPL_CONSTANT_PAINT] = spl_tile_get_paint(tile, group)}};
    int rc = spl_tile_get_disc_kernels(tile, key, &kernels, err);
    if (rc)
        return rc;
    if (first)
        spl_gpu_fill(r->gpu, r->scratch.depth, 0, tile->samples * 4, SPL_NOTHING);
    bool identifies = group == SPL_SUMS_ID || group == SPL_SUMS_PRIMITIVE;
    if (!identifies)
        spl_gpu_fill(r->gpu, spl_tile_begin_area(tile, SPL_AREA_SUMS), 0, tile->samples * 16, 0);
    spl_gpu_barrier(r->gpu);
    spl_tile_stamp(tile, SPL_STAGE_CLEAR);
    if (first) {
        rc = record_depth(tile, err);
        spl_tile_stamp(tile, SPL_STAGE_DEPTH);
    }
    if (identifies) { /* only now: occlusion used the memory */
        spl_gpu_fill(r->gpu, spl_tile_begin_area(tile, SPL_AREA_IDS), 0, tile->samples * 4, SPL_NOTHING);
        spl_gpu_barrier(r->gpu);
    }
    if (mapped)
        spl_tile_begin_area(tile, SPL_AREA_SURFACE);
    if (!rc && mapped)
        rc = find_surface(tile, err);
    rc = rc ? rc : shade(tile, group, &kernels, err);
    spl_gpu_barrier(r->gpu);
    if (!rc && mapped)
        rc = spl_tile_dispatch_maps(tile, err);
    if (mapped)
        spl_tile_end_area(tile, SPL_AREA_SURFACE);
    spl_tile_stamp(tile, SPL_STAGE_SHADE);
    return rc;
}

const struct spl_method_row spl_method_splat = {
    .info = {.name = "splat",
             .help = "oriented discs, blended within a margin behind the first surface; specks closed",
             .params = SPL_PARAMS_OF_ALL | SPL_PARAM_BIT(margin) | SPL_PARAM_BIT(atoms) | SPL_PARAM_BIT(maps) |
                       SPL_PARAM_BIT(primitives),
             .textures = true,
             .needs_surface = true,
             .stand_in = SPL_METHOD_FILL},
    .discs = true,
    .sums = true,
    .apron = 1, /* specks look at the samples beside them */
    .record = record,
    .resolve = SPL_RESOLVED_SUMS,
    .guesses = {{2, 0.25, 5, 30, 21.1},
                {1, 0.25, 5, 42, 22.1},
                {2, 0.5, 6, 72, 22.6},
                {1, 0.5, 8, 90, 23.42},
                {2, 1, 8, 180, 23.6},
                {1, 1, 10, 250, 24.4},
                {1, 2, 20, 900, 25.1}},
};
