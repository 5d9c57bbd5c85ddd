/* Recording the marks of a tile: once, before anything is drawn, for all passes and groups of layers. Nothing is
 * recorded where no chunk is to be marked. Belongs to the renderer's thread. */
#include "render/renderer.h"

static int make_marks(struct spl_tile *tile, uint32_t kind, const char *name, struct spl_error *err)
{
    struct spl_renderer *r = tile->renderer;
    struct spl_disc_kernels kernels = {0};
    if (!spl_draw_list_has(&r->list, kind, SPL_ROLE_MARK))
        return SPL_OK;
    const struct spl_dispatch what = {.phases = SPL_PHASE_BOTH,
                                      .kind = kind,
                                      .role = SPL_ROLE_MARK,
                                      .lanes = spl_kind_has_panels(kind) ? SPL_CELL_DISC_LANES : SPL_LANES};
    struct spl_kernel_key key = {.name = name, .constants = {r->list.test_kinds}};
    int rc = spl_kernels_get(&r->kernels, r->gpu, &key, &kernels.of[SPL_ENDS_MARKED], err);
    return rc ? rc : spl_tile_dispatch_splats(tile, &kernels, &what, err);
}

int spl_tile_dispatch_marks(struct spl_tile *tile, struct spl_error *err)
{
    if (tile->renderer->list.first_mark_chunk == tile->renderer->list.chunk_count)
        return SPL_OK;
    int rc = make_marks(tile, SPL_CHUNK_DISCS, "soft_mark", err);
    rc = rc ? rc : make_marks(tile, SPL_CHUNK_PANELS, "soft_mark_cells", err);
    rc = rc ? rc : make_marks(tile, SPL_CHUNK_MESHES, "soft_mark_mesh_cells", err);
    spl_gpu_barrier(tile->renderer->gpu);
    return rc;
}
