/* Recording the dispatches of one tile: parameters, bindings, timestamps, kernels. */
#include <string.h>

#include "render/renderer.h"

/* Every kernel's name and constants. */
static const char *describe(enum spl_kernel_slot slot, bool wide, uint32_t constants[3], size_t *count)
{
    *count = 0;
    memset(constants, 0, 3 * sizeof *constants);
    if (slot <= SPL_KERNEL_SPLAT_DEPTH_CLIPPED) {
        constants[2] = slot - SPL_KERNEL_SPLAT_DEPTH;
        *count = 3;
        return "splat_depth";
    }
    if (slot == SPL_KERNEL_OCCLUSION_TILES)
        return "occlusion_tiles";
    if (slot == SPL_KERNEL_OCCLUSION_CHUNKS)
        return "occlusion_chunks";
    if (slot >= SPL_KERNEL_SPLAT_SUM && slot < SPL_KERNEL_POINTS) {
        *count = 1;
        constants[0] = slot - SPL_KERNEL_SPLAT_SUM + 1;
        return "splat_sum";
    }
    if (slot >= SPL_KERNEL_SPLAT_TEXTURE && slot < SPL_KERNEL_POINTS) {
        *count = 3;
        constants[0] = (slot - SPL_KERNEL_SPLAT_TEXTURE) / 2;
        constants[2] = (slot - SPL_KERNEL_SPLAT_TEXTURE) % 2;
        return wide ? "splat_texture64" : "splat_texture";
    }
    if (slot < SPL_KERNEL_POINTS) {
        constants[0] = (slot - SPL_KERNEL_SPLAT_SHADE) / 2;
        constants[2] = (slot - SPL_KERNEL_SPLAT_SHADE) % 2;
        *count = 3;
        return wide ? "splat_shade64" : "splat_shade";
    }
    if (slot >= SPL_KERNEL_FILL_LINES && slot < SPL_KERNEL_FILL_PULL) {
        *count = 2;
        constants[0] = (slot - SPL_KERNEL_FILL_LINES) / 2;
        constants[1] = (slot - SPL_KERNEL_FILL_LINES) % 2;
        return wide ? "fill_lines64" : "fill_lines";
    }
    if (slot < SPL_KERNEL_FILL_LINES) {
        *count = 3;
        constants[0] = (slot - SPL_KERNEL_POINTS) / 2 % SPL_SUMS_COUNT;
        constants[1] = (slot - SPL_KERNEL_POINTS) % 2;
        constants[2] = slot >= SPL_KERNEL_FILL_POINTS;
        return wide ? "points64" : "points";
    }
    if (slot == SPL_KERNEL_FILL_NORMAL) {
        *count = 1;
        constants[0] = wide;
        return "fill_normal";
    }
    if (slot < SPL_KERNEL_FILL_NORMAL) {
        bool pull = slot < SPL_KERNEL_FILL_VISIBLE;
        *count = 2;
        constants[0] = slot - (pull ? SPL_KERNEL_FILL_PULL : SPL_KERNEL_FILL_VISIBLE);
        constants[1] = wide;
        return pull ? "fill_pull" : "fill_visible";
    }
    if (slot < SPL_KERNEL_RESOLVE) {
        *count = 3;
        constants[0] = (slot - SPL_KERNEL_FILL_GATHER) / 2 % SPL_SUMS_COUNT;
        constants[1] = (slot - SPL_KERNEL_FILL_GATHER) % 2;
        constants[2] = wide;
        return slot < SPL_KERNEL_FILL_PUSH ? "fill_gather" : "fill_push";
    }
    *count = 2;
    constants[0] = (slot - SPL_KERNEL_RESOLVE) / 2;
    constants[1] = (slot - SPL_KERNEL_RESOLVE) % 2;
    return wide && constants[1] ? "resolve64" : "resolve";
}

int spl_renderer_get_kernel(struct spl_renderer *renderer, enum spl_kernel_slot slot, struct spl_gpu_kernel **out,
                            struct spl_error *err)
{
    if (!renderer->kernels[slot]) {
        uint32_t constants[3];
        size_t count;
        const char *name = describe(slot, spl_gpu_get_limits(renderer->gpu)->atomics_64, constants, &count);
        int rc = spl_gpu_kernel_create(renderer->gpu, name, constants, count, &renderer->kernels[slot], err);
        if (rc)
            return rc;
    }
    *out = renderer->kernels[slot];
    return SPL_OK;
}

static int too_many(struct spl_error *err)
{
    return spl_fail_field(err, SPL_E_LIMIT, "lod",
                          "a view takes more than %d dispatches, as of so many pages; raise lod", SPL_PARAMS_SLOTS);
}

static struct spl_gpu_binding put_params(const struct spl_tile *tile, uint32_t slot,
                                         const struct spl_frame_params *params)
{
    struct spl_gpu_buffer *buffer = tile->renderer->scratch.params;
    uint64_t offset = (uint64_t)slot * SPL_PARAMS_STRIDE;
    memcpy((char *)spl_gpu_buffer_map(buffer) + offset, params, sizeof *params);
    return (struct spl_gpu_binding){.buffer = buffer, .offset = offset, .bytes = SPL_PARAMS_STRIDE};
}

static int next_params(struct spl_tile *tile, const struct spl_frame_params *params, struct spl_gpu_binding *binding,
                       struct spl_error *err)
{
    if (tile->slots_used == SPL_PARAMS_SLOTS)
        return too_many(err);
    *binding = put_params(tile, tile->slots_used++, params);
    return SPL_OK;
}

static void bind_scratch(const struct spl_tile *tile, struct spl_gpu_binding bindings[SPL_BIND_COUNT])
{
    const struct spl_scratch *scratch = &tile->renderer->scratch;
    memset(bindings, 0, SPL_BIND_COUNT * sizeof *bindings);
    bindings[SPL_BIND_DRAW].buffer = scratch->entries;
    bindings[SPL_BIND_CHUNKS].buffer = scratch->chunks;
    bindings[SPL_BIND_DEPTH].buffer = scratch->depth;
    bindings[SPL_BIND_SUMS].buffer = scratch->sums;
    bindings[SPL_BIND_ID].buffer = scratch->ids;
    bindings[SPL_BIND_OUTPUT].buffer = scratch->output ? scratch->output : scratch->readback;
}

/* A piece may be as long as the image, so that each has an invocation of its own. */
enum { entries_per_workgroup = SPL_WORKGROUP / SPL_LANES, line_entries_per_workgroup = SPL_WORKGROUP / SPL_RUN_SPLATS };

int spl_tile_take_slots(struct spl_tile *tile, struct spl_error *err)
{
    uint64_t workgroups = spl_gpu_get_limits(tile->renderer->gpu)->workgroups, size = tile->params.texture_size;
    uint64_t words = spl_gpu_buffer_get_bytes(tile->renderer->scratch.ids) / sizeof(uint32_t);
    uint64_t most = workgroups * entries_per_workgroup,
             summed = workgroups * SPL_WORKGROUP / (SPL_RUN_SPLATS * SPL_LANES);
    if (size && summed > words / (SPL_RUN_SPLATS * SPL_SUMMED_WORDS(size)))
        summed = words / (SPL_RUN_SPLATS * SPL_SUMMED_WORDS(size));
    uint64_t slots = spl_draw_list_count_slots(&tile->renderer->list, most, summed,
                                               workgroups * line_entries_per_workgroup);
    if (slots > SPL_PARAMS_SLOTS)
        return too_many(err);
    tile->slots_used = (uint32_t)slots;
    return SPL_OK;
}

/* Sums the textures of as many entries into the id buffer, where `shade` reads them. */
static void dispatch_sums(const struct spl_tile *tile, struct spl_gpu_kernel *kernel,
                          const struct spl_gpu_binding shade[SPL_BIND_COUNT], uint32_t entries)
{
    const struct spl_resident_dataset *resident = tile->resident;
    struct spl_gpu_binding bindings[SPL_BIND_COUNT];
    uint32_t invocations = entries * SPL_RUN_SPLATS * SPL_SUM_LANES(tile->params.texture_size);
    memcpy(bindings, shade, sizeof bindings);
    bindings[SPL_BIND_SUMS].buffer = shade[SPL_BIND_SUMMED].buffer;
    bindings[SPL_BIND_ATOMS].buffer = resident->pages[spl_dictionary_slot(resident)].buffer;
    spl_gpu_barrier(tile->renderer->gpu); /* whoever reads the last sums is done */
    spl_gpu_dispatch(tile->renderer->gpu, kernel, bindings, (invocations + SPL_WORKGROUP - 1) / SPL_WORKGROUP);
    spl_gpu_barrier(tile->renderer->gpu);
}

void spl_tile_dispatch_splats(const struct spl_tile *tile, struct spl_gpu_kernel *kernel,
                              const struct spl_dispatch *what)
{
    const struct spl_draw_list *list = &tile->renderer->list;
    const struct spl_resident_dataset *resident = tile->resident;
    const uint32_t per_workgroup = what->kind == SPL_CHUNK_LINES ? line_entries_per_workgroup : entries_per_workgroup;
    struct spl_gpu_binding bindings[SPL_BIND_COUNT];
    bind_scratch(tile, bindings);
    for (size_t i = 0; i < list->batch_count; i++) {
        const struct spl_draw_batch *batch = &list->batches[i];
        if (!(what->phases & (batch->key.back ? SPL_PHASE_BACK : SPL_PHASE_FRONT)) ||
            what->kind != batch->key.kind ||
            (what->by_texture && (what->planes != batch->key.planes || what->smooth != batch->key.smooth)))
            continue;
        bindings[SPL_BIND_PAGE].buffer = resident->pages[batch->key.page].buffer;
        if (what->planes)
            bindings[SPL_BIND_TEXTURES].buffer = resident->pages[spl_textures_slot(resident, batch->key.page)].buffer;
        if (what->planes && !what->sum)
            bindings[SPL_BIND_ATOMS].buffer = resident->pages[spl_dictionary_slot(resident)].buffer;
        uint32_t slot = batch->first_slot;
        for (uint32_t done = 0; done < batch->entries; done += batch->slot_entries) {
            uint32_t left = batch->entries - done;
            struct spl_frame_params params = tile->params;
            params.first_entry = batch->first_entry + done;
            params.entries = left < batch->slot_entries ? left : batch->slot_entries;
            bindings[SPL_BIND_FRAME] = put_params(tile, slot++, &params);
            if (what->sum)
                dispatch_sums(tile, what->sum, bindings, params.entries);
            spl_gpu_dispatch(tile->renderer->gpu, batch->key.apart && what->clipped ? what->clipped : kernel, bindings,
                             (params.entries + per_workgroup - 1) / per_workgroup);
        }
    }
}

int spl_tile_dispatch_items(struct spl_tile *tile, enum spl_kernel_slot slot, const struct spl_frame_params *params,
                            uint32_t items, struct spl_error *err)
{
    struct spl_gpu_kernel *kernel;
    struct spl_gpu_binding bindings[SPL_BIND_COUNT];
    bind_scratch(tile, bindings);
    bindings[SPL_BIND_BOUNDS].buffer = tile->renderer->scratch.bounds;
    int rc = spl_renderer_get_kernel(tile->renderer, slot, &kernel, err);
    if (!rc)
        rc = next_params(tile, params, &bindings[SPL_BIND_FRAME], err);
    if (!rc)
        spl_gpu_dispatch(tile->renderer->gpu, kernel, bindings, (items + SPL_WORKGROUP - 1) / SPL_WORKGROUP);
    spl_gpu_barrier(tile->renderer->gpu);
    return rc;
}

/* Items of which the kernel sees the first at first_entry. */
static int dispatch_range(struct spl_tile *tile, enum spl_kernel_slot slot, size_t first, size_t count,
                          struct spl_error *err)
{
    struct spl_frame_params params = tile->params;
    params.first_entry = (uint32_t)first;
    params.entries = (uint32_t)count;
    return spl_tile_dispatch_items(tile, slot, &params, (uint32_t)count, err);
}

int spl_tile_dispatch_occlusion(struct spl_tile *tile, size_t first_chunk, struct spl_error *err)
{
    enum { side = SPL_OCCLUSION_TILE };
    size_t most = (size_t)spl_gpu_get_limits(tile->renderer->gpu)->workgroups * SPL_WORKGROUP;
    size_t tiles = (size_t)((tile->camera.width + side - 1) / side) * ((tile->camera.height + side - 1) / side);
    size_t end = tile->renderer->list.chunk_count;
    int rc = dispatch_range(tile, SPL_KERNEL_OCCLUSION_TILES, 0, tiles, err);
    for (size_t first = first_chunk; first < end && !rc; first += most)
        rc = dispatch_range(tile, SPL_KERNEL_OCCLUSION_CHUNKS, first, end - first < most ? end - first : most, err);
    return rc;
}

int spl_tile_dispatch_resolve(struct spl_tile *tile, enum spl_layer layer, uint32_t output_word, struct spl_error *err)
{
    struct spl_gpu_kernel *kernel;
    uint32_t slot = SPL_KERNEL_RESOLVE + 2 * layer + (tile->view->method != SPL_METHOD_SPLAT);
    int rc = spl_renderer_get_kernel(tile->renderer, slot, &kernel, err);
    if (rc)
        return rc;
    struct spl_gpu_binding bindings[SPL_BIND_COUNT];
    bind_scratch(tile, bindings);
    struct spl_frame_params params = tile->params;
    params.output_word = output_word;
    rc = next_params(tile, &params, &bindings[SPL_BIND_FRAME], err);
    if (!rc)
        spl_gpu_dispatch(tile->renderer->gpu, kernel, bindings,
                         (tile->width * tile->height + SPL_WORKGROUP - 1) / SPL_WORKGROUP);
    return rc;
}

void spl_tile_stamp(struct spl_tile *tile, enum spl_stage stage)
{
    if (tile->stamps == SPL_GPU_TIMESTAMPS_MAX)
        return;
    tile->stamp_stage[tile->stamps] = (uint8_t)stage;
    spl_gpu_timestamp(tile->renderer->gpu, tile->stamps++);
}
