/* Method splat: depth, attribute and resolve passes of the sparse-coded-splat-textures paper, section 3.6, as compute
 * kernels. The depth pass runs once a tile, in two halves: what the nearer half hides is dropped from the other, and
 * what both hide from the shade pass, which runs once a group of layers. */
#include "render/renderer.h"

/* The kernel of `slot`, and where chunks are drawn that have clip lines the one of theirs. */
static int get_kernels(struct spl_renderer *r, uint32_t slot, struct spl_gpu_kernel **plain,
                       struct spl_gpu_kernel **clipped, struct spl_error *err)
{
    bool any = false;
    for (size_t i = 0; i < r->list.batch_count; i++)
        any |= r->list.batches[i].key.apart;
    *clipped = NULL;
    int rc = spl_renderer_get_kernel(r, slot, plain, err);
    return rc || !any ? rc : spl_renderer_get_kernel(r, slot + 1, clipped, err);
}

static int record_depth(struct spl_tile *tile, struct spl_error *err)
{
    struct spl_renderer *r = tile->renderer;
    struct spl_gpu_kernel *depth;
    struct spl_dispatch what = {.phases = SPL_PHASE_FRONT};
    int rc = get_kernels(r, SPL_KERNEL_SPLAT_DEPTH, &depth, &what.clipped, err);
    if (rc)
        return rc;
    spl_tile_dispatch_splats(tile, depth, &what);
    spl_gpu_barrier(r->gpu);
    rc = spl_tile_dispatch_occlusion(tile, r->list.first_back_chunk, err);
    what.phases = SPL_PHASE_BACK;
    spl_tile_dispatch_splats(tile, depth, &what);
    spl_gpu_barrier(r->gpu);
    return rc ? rc : spl_tile_dispatch_occlusion(tile, 0, err);
}

/* The kernels of `what`, by its number of planes. */
static int get_texture_kernels(struct spl_renderer *r, struct spl_dispatch *what, struct spl_gpu_kernel **kernel,
                               struct spl_error *err)
{
    what->sum = NULL;
    int rc = what->smooth ? spl_renderer_get_kernel(r, SPL_KERNEL_SPLAT_SUM + what->planes - 1, &what->sum, err) : 0;
    uint32_t slot = SPL_KERNEL_SPLAT_TEXTURE + (what->smooth ? 0 : 2 * what->planes);
    return rc ? rc : get_kernels(r, slot, kernel, &what->clipped, err);
}

/* Colours: chunks with atoms by the kernels of their number of planes, the others by the one that knows none. */
static int shade_colors(struct spl_tile *tile, struct spl_gpu_kernel *plain, struct spl_gpu_kernel *clipped,
                        struct spl_error *err)
{
    const struct spl_draw_list *list = &tile->renderer->list;
    uint64_t seen = 0;
    for (size_t i = 0; i < list->batch_count; i++)
        seen |= 1ull << (2 * list->batches[i].key.planes + list->batches[i].key.smooth);
    struct spl_dispatch what = {.phases = SPL_PHASE_BOTH, .by_texture = true, .clipped = clipped};
    spl_tile_dispatch_splats(tile, plain, &what);
    int rc = SPL_OK;
    for (uint32_t kind = 2; kind < 2 * (SPL_TEXTURE_ATOMS + 1) && !rc; kind++) {
        struct spl_gpu_kernel *kernel;
        if (!(seen >> kind & 1))
            continue;
        what.planes = kind / 2;
        what.smooth = kind % 2;
        rc = get_texture_kernels(tile->renderer, &what, &kernel, err);
        if (!rc)
            spl_tile_dispatch_splats(tile, kernel, &what);
    }
    return rc;
}

static int record(struct spl_tile *tile, uint32_t group, bool first, struct spl_error *err)
{
    struct spl_renderer *r = tile->renderer;
    struct spl_gpu_kernel *shade, *clipped;
    int rc = get_kernels(r, SPL_KERNEL_SPLAT_SHADE + 2 * group, &shade, &clipped, err);
    if (rc)
        return rc;
    if (first)
        spl_gpu_fill(r->gpu, r->scratch.depth, 0, tile->samples * 4, SPL_NOTHING);
    if (group != SPL_SUMS_ID)
        spl_gpu_fill(r->gpu, r->scratch.sums, 0, tile->samples * 16, 0);
    spl_gpu_barrier(r->gpu);
    spl_tile_stamp(tile, SPL_STAGE_CLEAR);
    if (first) {
        rc = record_depth(tile, err);
        spl_tile_stamp(tile, SPL_STAGE_DEPTH);
    }
    if (group == SPL_SUMS_ID) { /* only now: occlusion used the buffer */
        spl_gpu_fill(r->gpu, r->scratch.ids, 0, tile->samples * 4, SPL_NOTHING);
        spl_gpu_barrier(r->gpu);
    }
    if (group == SPL_SUMS_COLOR)
        rc = rc ? rc : shade_colors(tile, shade, clipped, err);
    else
        spl_tile_dispatch_splats(tile, shade, &(struct spl_dispatch){.phases = SPL_PHASE_BOTH, .clipped = clipped});
    spl_gpu_barrier(r->gpu);
    spl_tile_stamp(tile, SPL_STAGE_SHADE);
    return rc;
}

const struct spl_method_ops spl_method_splat = {.name = "splat", .record = record};
