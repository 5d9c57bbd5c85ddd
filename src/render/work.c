/* How much work a tile is, from its draw list alone, before anything of it is recorded: what one step of a frame may
 * have is bounded by it, so that nobody waits long for one tile of another's. In the units of draw_list.h: about a
 * nanosecond of two cores where it was scanned, up to ten where each thing hides the one before. */
#include "render/method.h"
#include "render/renderer.h"

enum {
    map_sample_work = 128, /* a sample of a map */
    own_sample_work = 16   /* of a sample that nothing falls on: clearing, filling, resolving */
};

/* A texel that an atom is added to costs an eighth of a sample that is looked at. */
uint64_t spl_tile_get_sum_work(const struct spl_tile *tile, uint32_t planes, uint32_t entries)
{
    const uint64_t size = tile->params.texture_size;
    return entries * SPL_RUN_SPLATS * size * size * planes / 8;
}

uint64_t spl_tile_get_map_work(uint32_t cells)
{
    return (uint64_t)cells * SPL_WORKGROUP * map_sample_work;
}

/* A file may make it any sum. */
static uint64_t plus(uint64_t a, uint64_t b)
{
    return a < UINT64_MAX - b ? a + b : UINT64_MAX;
}

uint64_t spl_tile_count_work(const struct spl_tile *tile, uint32_t groups)
{
    const struct spl_renderer *r = tile->renderer;
    const struct spl_method_row *method = spl_method_row(tile->view->method);
    const struct spl_draw_list *list = &r->list;
    const bool wide = spl_gpu_get_limits(r->gpu)->atomics_64;
    uint64_t pass = 0, once = groups * tile->samples * own_sample_work;
    for (size_t i = 0; i < list->batch_count; i++) {
        const struct spl_draw_batch *batch = &list->batches[i];
        pass = plus(pass, batch->work);
        if (batch->key.smooth)
            once += spl_tile_get_sum_work(tile, batch->key.planes, batch->entries);
    }
    for (size_t i = 0; i < list->map_count; i++)
        once += spl_tile_get_map_work(list->maps[i].cells);
    if (method->count_work)
        once += method->count_work(tile);
    /* depths once, then each group; those of the surface that maps are asked for */
    const uint32_t passes = method->sums ? groups + 1 + (list->map_count > 0) : groups * (wide ? 1 : 2);
    for (uint32_t i = 0; i < passes; i++)
        once = plus(once, pass);
    return once;
}
