/* Method points: the nearest splat centre of every sample. One pass with 64 bit atomics, two without. */
#include "render/renderer.h"

int spl_points_record(struct spl_tile *tile, uint32_t group, uint32_t slot, struct spl_error *err)
{
    struct spl_renderer *r = tile->renderer;
    bool wide = spl_gpu_get_limits(r->gpu)->atomics_64;
    spl_gpu_fill(r->gpu, r->scratch.depth, 0, tile->samples * (wide ? 8 : 4), SPL_NOTHING);
    if (!wide)
        spl_gpu_fill(r->gpu, r->scratch.ids, 0, tile->samples * 4, SPL_NOTHING);
    spl_gpu_barrier(r->gpu);
    spl_tile_stamp(tile, SPL_STAGE_CLEAR);
    for (uint32_t pass = 0; pass < (wide ? 1u : 2u); pass++) {
        struct spl_gpu_kernel *kernel;
        int rc = spl_renderer_get_kernel(r, slot + 2 * group + pass, &kernel, err);
        if (rc)
            return rc;
        spl_tile_dispatch_splats(tile, kernel, &(struct spl_dispatch){.phases = SPL_PHASE_BOTH});
        if (slot == SPL_KERNEL_FILL_POINTS) {
            rc = spl_renderer_get_kernel(r, SPL_KERNEL_FILL_LINES + 2 * group + pass, &kernel, err);
            if (rc)
                return rc;
            spl_tile_dispatch_splats(
                tile, kernel, &(struct spl_dispatch){.phases = SPL_PHASE_BOTH, .kind = SPL_CHUNK_LINES});
        }
        spl_gpu_barrier(r->gpu);
        spl_tile_stamp(tile, pass ? SPL_STAGE_SHADE : SPL_STAGE_DEPTH);
    }
    return SPL_OK;
}

static int record(struct spl_tile *tile, uint32_t group, bool first, struct spl_error *err)
{
    (void)first; /* the payload of another group shares the word with the depth: every group starts anew */
    return spl_points_record(tile, group, SPL_KERNEL_POINTS, err);
}

const struct spl_method_ops spl_method_points = {.name = "points", .record = record};
