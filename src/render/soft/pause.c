/* Keeping walks while others have the device; see pause.h. They go by the memory that a tile is read back through, and
 * come by that of its parameters, behind which nothing else is recorded at that moment: so nothing is taken for it on
 * the device. */
#include "render/soft/pause.h"

#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "render/renderer.h"

enum { kept_words = SPL_SOFT_STATE_WORDS + SPL_SOFT_WALK_WORDS };
_Static_assert(sizeof(uint32_t) * SPL_SOFT_KEPT_SAMPLES * kept_words <= SPL_PARAMS_STRIDE * SPL_PARAMS_MAX,
               "walks come by the memory of parameters");

void spl_soft_pause_begin(struct spl_soft_pause *pause)
{
    pause->began_ns = spl_now_ns();
    pause->walks_ns = 0;
    pause->runs = 0;
}

void spl_soft_pause_walk(struct spl_soft_pause *pause)
{
    if (!pause->walks_ns)
        pause->walks_ns = spl_now_ns();
}

static bool can_keep(const struct spl_tile *tile)
{
    const uint64_t room = spl_gpu_buffer_get_bytes(tile->renderer->scratch.readback);
    return tile->samples <= SPL_SOFT_KEPT_SAMPLES && sizeof(uint32_t) * kept_words * tile->samples <= room;
}

/* The first run may have had nothing but what came before the walks. */
bool spl_soft_pause_is_due(struct spl_soft_pause *pause, const struct spl_tile *tile)
{
    enum { runs_at_least = 2 };
    const bool cuts = (uint64_t)tile->width * tile->height > 1;
    if (!pause->asked || ++pause->runs < runs_at_least || (!can_keep(tile) && !cuts))
        return false;
    return pause->asked(pause->context, spl_now_ns() - pause->walks_ns, pause->walks_ns - pause->began_ns);
}

void spl_soft_pause_drop(struct spl_soft_pause *pause)
{
    free(pause->words);
    pause->words = NULL;
}

int spl_soft_pause_keep(struct spl_soft_pause *pause, struct spl_tile *tile, const struct spl_soft_walked *of,
                        float from, struct spl_error *err)
{
    const struct spl_scratch *scratch = &tile->renderer->scratch;
    const uint64_t state = sizeof(uint32_t) * SPL_SOFT_STATE_WORDS * tile->samples;
    const uint64_t walks = sizeof(uint32_t) * SPL_SOFT_WALK_WORDS * tile->samples;
    struct spl_gpu *gpu = tile->renderer->gpu;
    spl_soft_pause_drop(pause);
    if (!can_keep(tile))
        return SPL_OK;
    uint32_t *words = spl_alloc_raw(tile->samples, sizeof(uint32_t) * kept_words, err);
    if (!words)
        return SPL_E_NOMEM;
    spl_gpu_barrier(gpu);
    spl_gpu_copy(gpu, scratch->soft.buffers[SPL_SOFT_STATE], 0, scratch->readback, 0, state);
    spl_gpu_copy(gpu, scratch->soft.buffers[SPL_SOFT_WALKS], 0, scratch->readback, state, walks);
    spl_gpu_barrier(gpu);
    int rc = spl_tile_run(tile, err);
    if (rc) {
        free(words);
        return rc;
    }
    memcpy(words, spl_gpu_buffer_map(scratch->readback), state + walks);
    pause->words = words;
    pause->of = *of;
    pause->from = from;
    return SPL_OK;
}

int spl_soft_pause_give_back(struct spl_soft_pause *pause, struct spl_tile *tile, const struct spl_soft_walked *of,
                             bool *kept, struct spl_error *err)
{
    const struct spl_scratch *scratch = &tile->renderer->scratch;
    const uint64_t state = sizeof(uint32_t) * SPL_SOFT_STATE_WORDS * tile->samples;
    const uint64_t walks = sizeof(uint32_t) * SPL_SOFT_WALK_WORDS * tile->samples;
    struct spl_gpu *gpu = tile->renderer->gpu;
    *kept = pause->words && !memcmp(&pause->of, of, sizeof *of);
    if (!*kept) {
        spl_soft_pause_drop(pause);
        return SPL_OK;
    }
    int rc = spl_tile_run(tile, err); /* what was recorded has parameters there */
    if (rc)
        return rc;
    memcpy(spl_gpu_buffer_map(scratch->params), pause->words, state + walks);
    spl_gpu_copy(gpu, scratch->params, 0, scratch->soft.buffers[SPL_SOFT_STATE], 0, state);
    spl_gpu_copy(gpu, scratch->params, state, scratch->soft.buffers[SPL_SOFT_WALKS], 0, walks);
    spl_gpu_barrier(gpu);
    rc = spl_tile_run(tile, err);
    spl_soft_pause_drop(pause);
    return rc;
}
