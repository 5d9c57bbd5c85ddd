/* Device memory of the renderer: taken once, sized by the largest tile. The draw list's buffers grow with it, and what
 * few views draw takes its own when first drawn; both are given back when another view lacks room. What may share a
 * block, and for how long each holds it, stands in one table. */
#include "render/renderer.h"

#include <inttypes.h>
#include <string.h>

enum {
    chunks_at_start = 16384,
    tests_at_start = 4096, // bytes
    marks_at_start = 4096,
    chunk_entries_at_start = 16, // 128 splats in runs of 32 are 4; near ones are listed once a window
    run_texels = SPL_RUN_SPLATS * SPL_SUMMED_WORDS(SPL_TEXTURE_SIZE_MAX)
};

enum lifetime { LIFE_DISPATCHES, LIFE_GROUP, LIFE_TILE };
static const struct {
    bool large; /* of the two blocks */
    enum lifetime life;
    enum spl_resource resource;
} areas[SPL_AREA_COUNT] = {
    [SPL_AREA_SUMS] = {true, LIFE_GROUP, SPL_RESOURCE_SUMS},
    [SPL_AREA_PLANES] = {true, LIFE_TILE, SPL_RESOURCE_PLANES},
    [SPL_AREA_IDS] = {false, LIFE_GROUP, SPL_RESOURCE_IDS},
    [SPL_AREA_OCCLUDERS] = {false, LIFE_DISPATCHES, SPL_RESOURCE_OCCLUDERS},
    [SPL_AREA_SUMMED] = {false, LIFE_DISPATCHES, SPL_RESOURCE_SUMMED},
    [SPL_AREA_SURFACE] = {false, LIFE_DISPATCHES, SPL_RESOURCE_SURFACE},
};

bool spl_tile_may_begin(const struct spl_tile *tile, enum spl_area area)
{
    for (int other = 0; other < SPL_AREA_COUNT; other++)
        if (tile->areas >> other & 1 && areas[other].large == areas[area].large)
            return false;
    return true;
}

struct spl_gpu_buffer *spl_tile_begin_area(struct spl_tile *tile, enum spl_area area)
{
    struct spl_scratch *scratch = &tile->renderer->scratch;
    spl_assert(spl_tile_may_begin(tile, area));
    tile->areas |= 1u << area;
    return areas[area].large ? scratch->large : scratch->small;
}

void spl_tile_end_area(struct spl_tile *tile, enum spl_area area)
{
    spl_assert(tile->areas >> area & 1);
    tile->areas &= ~(1u << area);
}

void spl_tile_bind(const struct spl_tile *tile, struct spl_gpu_binding bindings[SPL_RESOURCE_COUNT])
{
    const struct spl_scratch *scratch = &tile->renderer->scratch;
    memset(bindings, 0, SPL_RESOURCE_COUNT * sizeof *bindings);
    bindings[SPL_RESOURCE_ENTRIES].buffer = scratch->entries;
    bindings[SPL_RESOURCE_CHUNKS].buffer = scratch->chunks;
    bindings[SPL_RESOURCE_BOUNDS].buffer = scratch->bounds;
    bindings[SPL_RESOURCE_TESTS].buffer = scratch->tests;
    bindings[SPL_RESOURCE_MARKS].buffer = scratch->marks;
    bindings[SPL_RESOURCE_SOFT].buffer = scratch->soft.buffers[SPL_SOFT_STATE];
    bindings[SPL_RESOURCE_FOUND].buffer = scratch->soft.buffers[SPL_SOFT_FOUND];
    bindings[SPL_RESOURCE_PALETTE].buffer = scratch->palette;
    bindings[SPL_RESOURCE_SHADES].buffer = scratch->shades;
    bindings[SPL_RESOURCE_DEPTH].buffer = scratch->depth;
    bindings[SPL_RESOURCE_MAP].buffer = tile->map;
    bindings[SPL_RESOURCE_OUTPUT].buffer = scratch->output ? scratch->output : scratch->readback;
    for (int area = 0; area < SPL_AREA_COUNT; area++)
        if (tile->areas >> area & 1)
            bindings[areas[area].resource].buffer = areas[area].large ? scratch->large : scratch->small;
}

void spl_tile_end_group(struct spl_tile *tile)
{
    for (int area = 0; area < SPL_AREA_COUNT; area++) {
        bool holds = tile->areas >> area & 1;
        spl_assert(!holds || areas[area].life != LIFE_DISPATCHES);
        if (holds && areas[area].life == LIFE_GROUP)
            spl_tile_end_area(tile, (enum spl_area)area);
    }
}

/* What the account of device memory takes for a buffer. */
static uint64_t taken(uint64_t bytes)
{
    return (bytes + 15) / 16 * 16;
}

int spl_scratch_init(struct spl_scratch *scratch, struct spl_gpu *gpu, uint64_t samples,
                     const struct spl_renderer_options *options, struct spl_error *err)
{
    const struct spl_gpu_limits *limits = spl_gpu_get_limits(gpu);
    if (samples * 16 > limits->binding_bytes)
        samples = limits->binding_bytes / 16;
    if (samples > (uint64_t)limits->workgroups * SPL_WORKGROUP) /* the resolve pass is one dispatch */
        samples = (uint64_t)limits->workgroups * SPL_WORKGROUP;
    uint64_t chunks = options->first_page_chunks + options->first_page_chunks / 4; // near ones, in several windows
    if (chunks < chunks_at_start)
        chunks = chunks_at_start;
    if (chunks > limits->binding_bytes / sizeof(struct spl_draw_chunk))
        chunks = limits->binding_bytes / sizeof(struct spl_draw_chunk);
    *scratch = (struct spl_scratch){.samples = samples, .first_chunks = chunks};
    bool software = spl_gpu_get_device(gpu)->software;
    const struct {
        struct spl_gpu_buffer **buffer;
        enum spl_gpu_buffer_kind kind;
        uint64_t bytes;
    } wanted[] = {
        {&scratch->depth, SPL_GPU_DEVICE, samples * (limits->atomics_64 ? 8 : 4)},
        {&scratch->large, SPL_GPU_DEVICE, samples * 16},
        {&scratch->small, SPL_GPU_DEVICE, 4 * (samples > run_texels ? samples : run_texels)},
        {&scratch->output, SPL_GPU_DEVICE, software ? 0 : samples * 4},
        {&scratch->readback, SPL_GPU_READBACK, samples * 4},
        {&scratch->params, SPL_GPU_UPLOAD, (uint64_t)SPL_PARAMS_STRIDE * SPL_PARAMS_MAX},
        {&scratch->chunks, SPL_GPU_UPLOAD, chunks * sizeof(struct spl_draw_chunk)},
        {&scratch->bounds, SPL_GPU_UPLOAD, chunks * sizeof(struct spl_chunk_bounds)},
        {&scratch->entries, SPL_GPU_UPLOAD, chunks * chunk_entries_at_start * sizeof(uint32_t)},
        {&scratch->tests, SPL_GPU_UPLOAD, tests_at_start},
        {&scratch->marks, SPL_GPU_DEVICE, marks_at_start},
        {&scratch->palette, SPL_GPU_UPLOAD, SPL_PALETTE_WORDS * sizeof(uint32_t)},
    };
    uint64_t working = 0, mib = 1 << 20;
    uint64_t page = taken(options->first_page_bytes) * (software ? 1 : 2); // a GPU's goes through as much of staging
    for (size_t i = 0; i < sizeof wanted / sizeof *wanted; i++)
        working += taken(wanted[i].bytes);
    if (working > limits->memory_bytes) // a page that has no room is its dataset's business
        return spl_fail_field(err, SPL_E_LIMIT, "memory-limit",
                              "memory-limit, %" PRIu64 " bytes of device memory, is too little: working memory takes %"
                              PRIu64 ", and the largest dataset's first page %" PRIu64 "; it takes at least %" PRIu64
                              ", say %" PRIu64 "M",
                              limits->memory_bytes, working, page, working + page, (working + page + mib - 1) / mib);
    for (size_t i = 0; i < sizeof wanted / sizeof *wanted; i++) {
        int rc = wanted[i].bytes ? spl_gpu_buffer_create(gpu, wanted[i].kind, wanted[i].bytes, wanted[i].buffer, err)
                                 : SPL_OK;
        if (rc) {
            spl_scratch_finish(scratch, gpu);
            return rc;
        }
    }
    scratch->taken_bytes = working;
    return SPL_OK;
}

void spl_scratch_finish(struct spl_scratch *scratch, struct spl_gpu *gpu)
{
    struct spl_gpu_buffer *all[] = {scratch->depth,    scratch->large,  scratch->small,  scratch->output,
                                    scratch->readback, scratch->params, scratch->chunks, scratch->bounds,
                                    scratch->entries,  scratch->tests,  scratch->marks,  scratch->palette,
                                    scratch->shades};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        spl_gpu_buffer_destroy(gpu, all[i]);
    spl_soft_memory_finish(&scratch->soft, gpu);
    *scratch = (struct spl_scratch){0};
}

/* What the buffers may still take. They do not give way to pages, so they leave every dataset the room of its first. */
static uint64_t room(const struct spl_scratch *scratch, const struct spl_residency *residency)
{
    uint64_t limit = spl_gpu_get_limits(residency->gpu)->memory_bytes;
    uint64_t kept = scratch->taken_bytes + spl_residency_get_reserve(residency);
    return limit > kept ? limit - kept : 0;
}

/* Has a buffer, which may be NULL, hold so many bytes; what it held is lost where it grows. */
static int make_room(struct spl_scratch *scratch, struct spl_residency *residency, struct spl_gpu_buffer **buffer,
                     enum spl_gpu_buffer_kind kind, uint64_t bytes, struct spl_error *err)
{
    struct spl_gpu *gpu = residency->gpu;
    const uint64_t have = *buffer ? spl_gpu_buffer_get_bytes(*buffer) : 0;
    if (have < bytes) {
        uint64_t larger = have ? have : bytes, left = room(scratch, residency);
        uint64_t most = spl_gpu_get_limits(gpu)->binding_bytes;
        if (bytes > most)
            return spl_fail_field(err, SPL_E_LIMIT, "lod",
                                  "a draw list of %" PRIu64 " bytes is more than the device binds at once, %" PRIu64
                                  "; raise lod", bytes, most);
        while (larger < bytes)
            larger *= 2;
        if (larger > most)
            larger = most;
        larger = taken(larger <= left ? larger : bytes);
        if (larger > left) // both are there for a moment
            return spl_fail(err, SPL_E_LIMIT,
                            "a draw list of %" PRIu64 " bytes has no room beside working memory and the largest "
                            "dataset's first page; raise lod, or memory-limit above %" PRIu64, bytes,
                            spl_gpu_get_limits(gpu)->memory_bytes);
        struct spl_gpu_buffer *replacement;
        int rc = spl_residency_make_buffer(residency, kind, larger, &replacement, err);
        if (rc)
            return rc;
        spl_gpu_buffer_destroy(gpu, *buffer);
        *buffer = replacement;
        scratch->taken_bytes += larger - taken(have);
    }
    return SPL_OK;
}

int spl_scratch_make_shades(struct spl_scratch *scratch, struct spl_residency *residency, uint64_t samples,
                            struct spl_error *err)
{
    const uint64_t bytes = samples * sizeof(uint32_t);
    return bytes ? make_room(scratch, residency, &scratch->shades, SPL_GPU_DEVICE, bytes, err) : SPL_OK;
}

/* A buffer of the draw list. */
struct list_part {
    struct spl_gpu_buffer **buffer;
    enum spl_gpu_buffer_kind kind;
    const void *from;
    uint64_t bytes, first; /* of the list; at the start */
};
enum { LIST_PARTS = 5 };

static void find_parts(struct spl_scratch *scratch, const struct spl_draw_list *list, struct list_part out[LIST_PARTS])
{
    const uint64_t chunks = scratch->first_chunks, word = sizeof(uint32_t);
    const struct list_part parts[LIST_PARTS] = {
        {&scratch->marks, SPL_GPU_DEVICE, NULL, list->mark_words * word, marks_at_start},
        {&scratch->chunks, SPL_GPU_UPLOAD, list->chunks, list->chunk_count * sizeof *list->chunks,
         chunks * sizeof *list->chunks},
        {&scratch->bounds, SPL_GPU_UPLOAD, list->bounds, list->chunk_count * sizeof *list->bounds,
         chunks * sizeof *list->bounds},
        {&scratch->entries, SPL_GPU_UPLOAD, list->entries, list->entry_count * word,
         chunks * chunk_entries_at_start * word},
        {&scratch->tests, SPL_GPU_UPLOAD, list->tests, list->test_count * word, tests_at_start},
    };
    memcpy(out, parts, sizeof parts);
}

int spl_scratch_upload(struct spl_scratch *scratch, struct spl_residency *residency, const struct spl_draw_list *list,
                       struct spl_error *err)
{
    struct list_part parts[LIST_PARTS];
    find_parts(scratch, list, parts);
    int rc = SPL_OK;
    for (size_t i = 0; i < LIST_PARTS && !rc; i++) {
        const struct list_part *part = &parts[i];
        const uint64_t bytes = *part->buffer || part->bytes > part->first ? part->bytes : part->first;
        rc = make_room(scratch, residency, part->buffer, part->kind, bytes, err);
        if (!rc && part->kind == SPL_GPU_UPLOAD && part->bytes)
            memcpy(spl_gpu_buffer_map(*part->buffer), part->from, part->bytes);
    }
    return rc;
}

static void drop(struct spl_scratch *scratch, struct spl_gpu *gpu, struct spl_gpu_buffer **buffer)
{
    scratch->taken_bytes -= *buffer ? taken(spl_gpu_buffer_get_bytes(*buffer)) : 0;
    spl_gpu_buffer_destroy(gpu, *buffer);
    *buffer = NULL;
}

/* What a part is to be cut to, as it would have grown; 0: it is no larger than twice that, as lists of one view are. */
static uint64_t cut_to(const struct list_part *part)
{
    uint64_t grown = part->first;
    while (grown < part->bytes)
        grown *= 2;
    return *part->buffer && spl_gpu_buffer_get_bytes(*part->buffer) > 2 * grown ? grown : 0;
}

bool spl_scratch_give_back(struct spl_scratch *scratch, struct spl_residency *residency,
                           const struct spl_scratch_needs *needs, uint64_t least)
{
    struct spl_gpu *gpu = residency->gpu;
    struct list_part parts[LIST_PARTS];
    size_t count = 0;
    uint64_t spare = needs->soft ? 0 : scratch->soft_bytes;
    spare += needs->shades || !scratch->shades ? 0 : taken(spl_gpu_buffer_get_bytes(scratch->shades));
    if (needs->list)
        find_parts(scratch, needs->list, parts);
    for (size_t i = 0; i < LIST_PARTS && needs->list; i++)
        if (cut_to(&parts[i])) {
            spare += taken(spl_gpu_buffer_get_bytes(*parts[i].buffer)) - taken(cut_to(&parts[i]));
            parts[count++] = parts[i];
        }
    if (!spare || spare < least)
        return false;
    if (!needs->soft) {
        spl_soft_memory_finish(&scratch->soft, gpu);
        scratch->taken_bytes -= scratch->soft_bytes;
        scratch->soft_bytes = 0;
    }
    if (!needs->shades)
        drop(scratch, gpu, &scratch->shades);
    for (size_t i = 0; i < count; i++) {
        const uint64_t left = cut_to(&parts[i]);
        drop(scratch, gpu, parts[i].buffer);
        make_room(scratch, residency, parts[i].buffer, parts[i].kind, left, NULL);
    } /* where that fails, spl_scratch_upload() tries again */
    return true;
}
