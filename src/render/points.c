/* One pass with 64 bit atomics, two without: then the first finds the depth, the second the payload. */
#include "render/points.h"

int spl_points_record(struct spl_tile *tile, uint32_t group, bool filled, struct spl_error *err)
{
    struct spl_renderer *r = tile->renderer;
    const uint32_t paint = spl_tile_get_paint(tile, group);
    bool wide = spl_gpu_get_limits(r->gpu)->atomics_64;
    spl_gpu_fill(r->gpu, r->scratch.depth, 0, tile->samples * (wide ? 8 : 4), SPL_NOTHING);
    if (!wide)
        spl_gpu_fill(r->gpu, spl_tile_begin_area(tile, SPL_AREA_IDS), 0, tile->samples * 4, SPL_NOTHING);
    spl_gpu_barrier(r->gpu);
    spl_tile_stamp(tile, SPL_STAGE_CLEAR);
    for (uint32_t pass = 0; pass < (wide ? 1u : 2u); pass++) {
        struct spl_disc_kernels kernel = {0};
        struct spl_kernel_key key = {"points", true, {group, pass, filled, [SPL_CONSTANT_PAINT] = paint}};
        const struct spl_dispatch discs = {.phases = SPL_PHASE_BOTH};
        int rc = spl_tile_get_plain_kernels(tile, key, &discs, &kernel, err);
        if (rc)
            return rc;
        rc = spl_tile_dispatch_splats(tile, &kernel, &discs, err);
        if (rc)
            return rc;
        rc = spl_tile_dispatch_panels(
            tile, &(struct spl_panel_kernels){.panel_cells = "points_cells", .mesh_cells = "points_mesh_cells"}, key,
            SPL_PHASE_BOTH, err);
        if (rc)
            return rc;
        struct spl_kernel_key lines = {"fill_lines", true, {group, pass, [SPL_CONSTANT_PAINT] = paint}};
        if (filled && (rc = spl_tile_dispatch_lines(tile, lines, SPL_PHASE_BOTH, err)))
            return rc;
        spl_gpu_barrier(r->gpu);
        spl_tile_stamp(tile, pass ? SPL_STAGE_SHADE : SPL_STAGE_DEPTH);
    }
    return SPL_OK;
}
