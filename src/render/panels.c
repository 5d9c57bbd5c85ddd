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

/* Records the chunks of `kind` by the kernel of `key`: as such, where `whole`, or their cells. With `by_cells` only
 * those that are listed so. */
static int dispatch(struct spl_tile *tile, uint32_t kind, bool whole, bool by_cells, struct spl_kernel_key key,
                    enum spl_phase phases, struct spl_error *err)
{
    struct spl_disc_kernels kernels = {0};
    const bool discs = spl_method_row(tile->view->method)->discs;
    const struct spl_dispatch what = {.phases = phases,
                                      .kind = kind,
                                      .lanes = lanes_of(kind, whole, discs),
                                      .by_cells = by_cells,
                                      .cells = !whole};
    key.shared = tile->renderer->shares && discs && !whole;
    int rc = spl_tile_get_plain_kernels(tile, key, &what, &kernels, err);
    return rc ? rc : spl_tile_dispatch_splats(tile, &kernels, &what, err);
}

/* All chunks of `kind`: by the kernel `names[0]` as such, where it is not NULL, but those that are to be drawn cell by
 * cell in any case; these and, where it is, all by `names[1]`. */
static int dispatch_kind(struct spl_tile *tile, uint32_t kind, const char *const names[2], struct spl_kernel_key key,
                         enum spl_phase phases, struct spl_error *err)
{
    int rc = SPL_OK;
    if (!spl_draw_list_has(&tile->renderer->list, kind, SPL_ROLE_SOLID))
        return SPL_OK;
    key.name = names[0];
    if (names[0])
        rc = dispatch(tile, kind, true, true, key, phases, err);
    key.name = names[1];
    return rc ? rc : dispatch(tile, kind, false, names[0], key, phases, err);
}

int spl_tile_dispatch_panels(struct spl_tile *tile, const struct spl_panel_kernels *names, struct spl_kernel_key key,
                             enum spl_phase phases, struct spl_error *err)
{
    bool panels = names->panels && spl_view_draws_panels(tile->view);
    bool meshes = names->meshes && spl_view_draws_meshes(tile->view);
    int rc = dispatch_kind(tile, SPL_CHUNK_PANELS,
                           (const char *const[2]){panels ? names->panels : NULL, names->panel_cells}, key, phases, err);
    return rc ? rc
              : dispatch_kind(tile, SPL_CHUNK_MESHES,
                              (const char *const[2]){meshes ? names->meshes : NULL, names->mesh_cells}, key, phases,
                              err);
}
