/* Recording of panels and meshes: by kernels of their own, or cell by cell by those of discs and points, which are
 * compiled once more for it, and again for meshes (shaders/meson.build). They have neither clip lines nor textures, but
 * maps trim them, by other kernels for the chunks that it is said of. Belongs to the renderer's thread. */
#include "render/method.h"
#include "render/renderer.h"

/* Invocations that share an entry of a kind's own kernels, or of those of cells. */
static uint32_t lanes_of(uint32_t kind, bool whole, bool discs)
{
    if (whole)
        return SPL_RUN_PANELS * (kind == SPL_CHUNK_MESHES ? SPL_MESH_LANES : SPL_LANES);
    return discs ? SPL_CELL_DISC_LANES : SPL_CELL_POINT_LANES;
}

/* Records the chunks of `kind` by the kernel of `key`: as such, where `whole`, or their cells. */
static int dispatch(struct spl_tile *tile, uint32_t kind, bool whole, struct spl_kernel_key key, enum spl_phase phases,
                    struct spl_error *err)
{
    struct spl_renderer *r = tile->renderer;
    struct spl_disc_kernels kernels = {0};
    bool discs = spl_method_row(tile->view->method)->discs;
    if (!spl_draw_list_has(&r->list, kind))
        return SPL_OK;
    int rc = spl_kernels_get(&r->kernels, r->gpu, &key, &kernels.of[0], err);
    key.trims = true;
    if (!rc && spl_draw_list_trims(&r->list, kind))
        rc = spl_kernels_get(&r->kernels, r->gpu, &key, &kernels.of[SPL_ENDS_TRIMMED], err);
    if (rc)
        return rc;
    return spl_tile_dispatch_splats(tile, &kernels,
                                    &(struct spl_dispatch){.phases = phases,
                                                           .kind = kind,
                                                           .lanes = lanes_of(kind, whole, discs)},
                                    err);
}

int spl_tile_dispatch_panels(struct spl_tile *tile, const struct spl_panel_kernels *names, struct spl_kernel_key key,
                             enum spl_phase phases, struct spl_error *err)
{
    bool panels = names->panels && spl_view_draws_panels(tile->view);
    bool meshes = names->meshes && spl_view_draws_meshes(tile->view);
    key.name = panels ? names->panels : names->panel_cells;
    int rc = dispatch(tile, SPL_CHUNK_PANELS, panels, key, phases, err);
    key.name = meshes ? names->meshes : names->mesh_cells;
    return rc ? rc : dispatch(tile, SPL_CHUNK_MESHES, meshes, key, phases, err);
}
