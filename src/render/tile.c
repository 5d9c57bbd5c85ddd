/* Recording the dispatches of one tile: parameters, bindings, timestamps. Much work runs a part at a time, so that a
 * slow device is not taken for a lost one, whatever is drawn, and a frame that nobody waits for ends. */
#include <float.h>
#include <string.h>

#include "base/clock.h"
#include "base/work.h"
#include "render/frame.h"
#include "render/method.h"
#include "render/renderer.h"
#include "render/soft/of.h"
#include "render/soft/pass.h"

/* The words of the one shape that cuts chunks, and the flags of its test; NULL where there are several. */
static const uint32_t *one_shape(const struct spl_draw_list *list, const struct spl_draw_cut *cut, uint32_t *flags)
{
    const uint32_t *words = list->tests + cut->word;
    *flags = words[2];
    return words[0] == 1 ? list->tests + words[1] : NULL;
}

/* As what cuts them chunks are drawn: a box by its sides' signs, which say whether what is asked for is its inside. */
static enum spl_cut_by cut_by(const struct spl_draw_list *list, uint32_t cut)
{
    uint32_t flags;
    const uint32_t *shape = cut ? one_shape(list, spl_draw_list_find_cut(list, cut), &flags) : NULL;
    if (!shape)
        return cut ? SPL_CUT_BY_SHAPES : SPL_CUT_BY_NONE;
    float ends[2];
    memcpy(ends, shape + SPL_SHAPE_LEAST, sizeof ends);
    switch (SPL_SHAPE_KIND(shape[SPL_SHAPE_FLAGS])) {
    case SPL_SHAPE_AXIS:
        return SPL_CUT_BY_AXIS;
    case SPL_SHAPE_PLANE:
        return SPL_CUT_BY_PLANE;
    case SPL_SHAPE_BOX:
        return ends[0] == -FLT_MAX && ends[1] == 0 ? SPL_CUT_BY_BOX : SPL_CUT_BY_SHAPES;
    default:
        return SPL_CUT_BY_SHAPES;
    }
}

static uint32_t ends_of(const struct spl_draw_list *list, const struct spl_draw_key *key)
{
    return (key->apart ? SPL_ENDS_CLIPPED : 0) | (key->trims ? SPL_ENDS_TRIMMED : 0) |
           (key->marked ? SPL_ENDS_MARKED : 0) | (uint32_t)cut_by(list, key->cut) << SPL_ENDS_CUT;
}

/* The constant of kernels with `ends` that says what cuts. */
static uint32_t cut_constant(const struct spl_draw_list *list, uint32_t ends)
{
    switch (ends >> SPL_ENDS_CUT) {
    case SPL_CUT_BY_NONE:
        return 0;
    case SPL_CUT_BY_SHAPES:
        return list->cut_kinds;
    default:
        return SPL_CUT_ONE + SPL_SHAPE_AXIS + (ends >> SPL_ENDS_CUT) - SPL_CUT_BY_AXIS;
    }
}

/* Is a batch what is asked for? */
static bool is_of(const struct spl_dispatch *what, const struct spl_draw_key *key)
{
    return what->kind == key->kind && what->role == key->role && (!what->by_cells || what->cells == key->cells) &&
           (!what->by_texture || (what->planes == key->planes && what->smooth == key->smooth));
}

/* Those of each bit of `needed`, a set of chunks' ends; `clips`: they are told which they cut. */
static int get_kernels(struct spl_tile *tile, struct spl_kernel_key *key, uint64_t needed, bool clips,
                       struct spl_disc_kernels *out, struct spl_error *err)
{
    enum { clipped_constant = 2 };
    struct spl_renderer *r = tile->renderer;
    int rc = SPL_OK;
    for (uint32_t ends = 0; ends < SPL_ENDS_COUNT && !rc; ends++) {
        if (clips)
            key->constants[clipped_constant] = ends & SPL_ENDS_CLIPPED;
        key->constants[SPL_CONSTANT_MARKED] = ends & SPL_ENDS_MARKED ? 1 : 0;
        key->constants[SPL_CONSTANT_CUT] = cut_constant(&r->list, ends);
        key->trims = ends & SPL_ENDS_TRIMMED;
        if (needed >> ends & 1)
            rc = spl_kernels_get(&r->kernels, r->gpu, key, &out->of[ends], err);
    }
    return rc;
}

int spl_tile_get_disc_kernels(struct spl_tile *tile, struct spl_kernel_key key, struct spl_disc_kernels *out,
                              struct spl_error *err)
{
    struct spl_renderer *r = tile->renderer;
    uint64_t needed = 1;
    for (size_t i = 0; i < r->list.batch_count; i++)
        if (r->list.batches[i].key.role == SPL_ROLE_SOLID)
            needed |= UINT64_C(1) << ends_of(&r->list, &r->list.batches[i].key);
    *out = (struct spl_disc_kernels){.lanes = r->shares ? SPL_WORKGROUP : 0};
    key.shared = r->shares;
    return get_kernels(tile, &key, needed, true, out, err);
}

int spl_tile_get_plain_kernels(struct spl_tile *tile, struct spl_kernel_key key, const struct spl_dispatch *what,
                               struct spl_disc_kernels *out, struct spl_error *err)
{
    struct spl_renderer *r = tile->renderer;
    uint64_t needed = 0;
    for (size_t i = 0; i < r->list.batch_count; i++)
        if (is_of(what, &r->list.batches[i].key))
            needed |= UINT64_C(1) << (ends_of(&r->list, &r->list.batches[i].key) & ~(uint32_t)SPL_ENDS_CLIPPED);
    *out = (struct spl_disc_kernels){0};
    return get_kernels(tile, &key, needed, false, out, err);
}

/* The kernel of chunks with `ends`: one that looks for fewer of them does, but never one without their marks or
 * cuts. */
static struct spl_gpu_kernel *kernel_of(const struct spl_disc_kernels *kernels, uint32_t ends)
{
    if (!kernels->of[ends])
        ends &= ~(uint32_t)SPL_ENDS_CLIPPED;
    if (!kernels->of[ends])
        ends &= ~(uint32_t)(SPL_ENDS_CLIPPED | SPL_ENDS_TRIMMED);
    spl_assert(kernels->of[ends]);
    return kernels->of[ends];
}

/* What cuts chunks: where it is among the tests; of one shape what it is. */
static void put_cut(const struct spl_draw_list *list, uint32_t cut, struct spl_frame_params *params)
{
    const struct spl_draw_cut *found = spl_draw_list_find_cut(list, cut);
    const uint32_t *shape = one_shape(list, found, &params->cut_flags);
    params->fill_from = found->word;
    if (!shape)
        return;
    memcpy(params->cut_rows, shape, sizeof params->cut_rows);
    memcpy(params->cut_half, shape + SPL_SHAPE_HALF, sizeof params->cut_half);
    memcpy(&params->cut_least, shape + SPL_SHAPE_LEAST, sizeof params->cut_least);
    memcpy(&params->cut_most, shape + SPL_SHAPE_MOST, sizeof params->cut_most);
    params->cut_flags |= shape[SPL_SHAPE_FLAGS];
}

static int too_many(struct spl_error *err)
{
    return spl_fail_field(err, SPL_E_LIMIT, "lod",
                          "a view takes more than %d dispatches, as of so many pages or of discs so large; raise lod",
                          SPL_PARAMS_MAX);
}

static struct spl_gpu_binding put_params(const struct spl_tile *tile, uint32_t index,
                                         const struct spl_frame_params *params)
{
    struct spl_gpu_buffer *buffer = tile->renderer->scratch.params;
    uint64_t offset = (uint64_t)index * SPL_PARAMS_STRIDE;
    memcpy((char *)spl_gpu_buffer_map(buffer) + offset, params, sizeof *params);
    return (struct spl_gpu_binding){.buffer = buffer, .offset = offset, .bytes = SPL_PARAMS_STRIDE};
}

int spl_tile_put_params(struct spl_tile *tile, const struct spl_frame_params *params, struct spl_gpu_binding *binding,
                        struct spl_error *err)
{
    if (tile->params_used == SPL_PARAMS_MAX)
        return too_many(err);
    *binding = put_params(tile, tile->params_used++, params);
    return SPL_OK;
}

/* Invocations that share an entry. A piece may be as long as the image, so that each has one of its own; a panel has
 * SPL_LANES, the discs of its cells four times as many. */
static uint32_t lanes_of(const struct spl_dispatch *what)
{
    return what->lanes ? what->lanes : what->kind == SPL_CHUNK_LINES ? SPL_RUN_SPLATS : SPL_LANES;
}

int spl_tile_run(struct spl_tile *tile, struct spl_error *err)
{
    tile->work = 0;
    if (spl_is_cancelled(tile->cancelled))
        return spl_fail(err, SPL_E_CANCELLED, "the frame was cancelled");
    if (spl_now_ns() >= tile->view->deadline_ns)
        return spl_fail(err, SPL_E_TIMEOUT, SPL_FRAME_LATE);
    return spl_gpu_run(tile->renderer->gpu, err);
}

int spl_tile_add_work(struct spl_tile *tile, uint64_t work, struct spl_error *err)
{
    bool runs = tile->work && work > 0 && tile->work + work > tile->renderer->work_at_once;
    int rc = runs ? spl_tile_run(tile, err) : SPL_OK;
    if (!rc && runs && spl_now_ns() > tile->until_ns)
        rc = SPL_FRAME_TOO_MUCH;
    tile->work += work;
    return rc;
}

int spl_tile_take_rounds(struct spl_tile *tile, struct spl_error *err)
{
    uint64_t workgroups = spl_gpu_get_limits(tile->renderer->gpu)->workgroups, size = tile->params.texture_size;
    uint64_t words = spl_gpu_buffer_get_bytes(tile->renderer->scratch.small) / sizeof(uint32_t);
    uint64_t invocations = workgroups * SPL_WORKGROUP, summed = invocations / (SPL_RUN_SPLATS * SPL_LANES);
    if (size && summed > words / (SPL_RUN_SPLATS * SPL_SUMMED_WORDS(size)))
        summed = words / (SPL_RUN_SPLATS * SPL_SUMMED_WORDS(size));
    uint64_t splats = tile->renderer->shares ? workgroups : invocations / SPL_LANES;
    const struct spl_draw_rounds most = {.splats = splats,
                                         .summed = summed,
                                         .lines = invocations / SPL_RUN_SPLATS,
                                         .panels = invocations / SPL_CELL_DISC_LANES};
    uint64_t rounds = spl_draw_list_count_rounds(&tile->renderer->list, &most);
    if (rounds > SPL_PARAMS_MAX)
        return too_many(err);
    tile->params_used = (uint32_t)rounds;
    return SPL_OK;
}

/* Sums the textures of as many entries, for the dispatch behind to read. */
static void dispatch_sums(const struct spl_tile *tile, struct spl_gpu_kernel *kernel,
                          const struct spl_gpu_binding bindings[SPL_RESOURCE_COUNT], uint32_t entries)
{
    uint32_t invocations = entries * SPL_RUN_SPLATS * SPL_SUM_LANES(tile->params.texture_size);
    spl_gpu_barrier(tile->renderer->gpu); /* whoever reads the last sums is done */
    spl_gpu_dispatch(tile->renderer->gpu, kernel, bindings, (invocations + SPL_WORKGROUP - 1) / SPL_WORKGROUP);
    spl_gpu_barrier(tile->renderer->gpu);
}

int spl_tile_dispatch_splats(struct spl_tile *tile, const struct spl_disc_kernels *kernels,
                             const struct spl_dispatch *what, struct spl_error *err)
{
    const struct spl_draw_list *list = &tile->renderer->list;
    const struct spl_resident_dataset *resident = tile->resident;
    const uint32_t lanes = kernels->lanes ? kernels->lanes : lanes_of(what);
    struct spl_gpu_binding bindings[SPL_RESOURCE_COUNT];
    int rc = SPL_OK;
    spl_tile_bind(tile, bindings);
    for (int i = 0; what->with && i < SPL_RESOURCE_COUNT; i++)
        if (what->with[i].buffer)
            bindings[i] = what->with[i];
    for (size_t i = 0; i < list->batch_count && !rc; i++) {
        const struct spl_draw_batch *batch = &list->batches[i];
        if (!(what->phases & (batch->key.back ? SPL_PHASE_BACK : SPL_PHASE_FRONT)) || !is_of(what, &batch->key))
            continue;
        bindings[SPL_RESOURCE_PAGE].buffer = resident->pages[batch->key.page].buffer;
        if (what->planes) {
            uint32_t textures = spl_textures_slot(resident, batch->key.page);
            bindings[SPL_RESOURCE_TEXTURES].buffer = resident->pages[textures].buffer;
            bindings[SPL_RESOURCE_ATOMS].buffer = resident->pages[spl_dictionary_slot(resident)].buffer;
        }
        if (batch->key.trims) {
            spl_tile_set_map(tile, batch->key.trims - 1u);
            bindings[SPL_RESOURCE_MAP].buffer = tile->map;
        }
        struct spl_gpu_kernel *kernel = kernel_of(kernels, ends_of(list, &batch->key));
        uint32_t round = batch->first_round;
        rc = spl_tile_add_work(tile, batch->work, err);
        for (uint32_t done = 0; done < batch->entries && !rc; done += batch->round_entries) {
            uint32_t left = batch->entries - done;
            struct spl_frame_params params = tile->params;
            params.first_entry = batch->first_entry + done;
            if (batch->key.cut)
                put_cut(list, batch->key.cut, &params);
            params.entries = left < batch->round_entries ? left : batch->round_entries;
            bindings[SPL_RESOURCE_FRAME] = put_params(tile, round++, &params);
            uint64_t sums = what->sum ? spl_tile_get_sum_work(tile, what->planes, params.entries) : 0;
            if (what->sum && (rc = spl_tile_add_work(tile, sums, err)))
                break;
            if (what->sum)
                dispatch_sums(tile, what->sum, bindings, params.entries);
            spl_gpu_dispatch(tile->renderer->gpu, kernel, bindings,
                             (uint32_t)(((uint64_t)params.entries * lanes + SPL_WORKGROUP - 1) / SPL_WORKGROUP));
        }
    }
    return rc;
}

int spl_tile_dispatch_lines(struct spl_tile *tile, struct spl_kernel_key key, enum spl_phase phases,
                            struct spl_error *err)
{
    struct spl_disc_kernels kernels = {0};
    const struct spl_dispatch what = {.phases = phases, .kind = SPL_CHUNK_LINES};
    if (!spl_draw_list_has(&tile->renderer->list, SPL_CHUNK_LINES, SPL_ROLE_SOLID))
        return SPL_OK;
    int rc = spl_tile_get_plain_kernels(tile, key, &what, &kernels, err);
    return rc ? rc : spl_tile_dispatch_splats(tile, &kernels, &what, err);
}

int spl_tile_dispatch_items(struct spl_tile *tile, const struct spl_kernel_key *key,
                            const struct spl_frame_params *params, uint32_t items, struct spl_error *err)
{
    struct spl_renderer *r = tile->renderer;
    struct spl_gpu_kernel *kernel;
    struct spl_gpu_binding bindings[SPL_RESOURCE_COUNT];
    spl_tile_bind(tile, bindings);
    int rc = spl_kernels_get(&r->kernels, r->gpu, key, &kernel, err);
    if (!rc)
        rc = spl_tile_put_params(tile, params, &bindings[SPL_RESOURCE_FRAME], err);
    if (!rc)
        spl_gpu_dispatch(r->gpu, kernel, bindings, (items + SPL_WORKGROUP - 1) / SPL_WORKGROUP);
    spl_gpu_barrier(r->gpu);
    return rc;
}

/* Items of which the kernel sees the first at first_entry; as many dispatches as the device needs. */
static int dispatch_range(struct spl_tile *tile, const struct spl_kernel_key *key, size_t first, size_t end,
                          struct spl_error *err)
{
    size_t most = (size_t)spl_gpu_get_limits(tile->renderer->gpu)->workgroups * SPL_WORKGROUP;
    int rc = SPL_OK;
    for (; first < end && !rc; first += most) {
        struct spl_frame_params params = tile->params;
        params.first_entry = (uint32_t)first;
        params.entries = (uint32_t)(end - first < most ? end - first : most);
        rc = spl_tile_dispatch_items(tile, key, &params, params.entries, err);
    }
    return rc;
}

/* Looks at the occlusion tiles of the chunk, each of which costs more than a sample that most discs miss. */
static uint64_t occlusion_work(const struct spl_chunk_bounds *bounds)
{
    enum { tile_work = 4 };
    uint64_t columns = (bounds->last & 0xffffu) - (bounds->first & 0xffffu) + 1;
    uint64_t rows = (bounds->last >> 16) - (bounds->first >> 16) + 1;
    return bounds->near > 0 ? tile_work * columns * rows : 1;
}

/* Chunks [first, last), as many at a time as are not too much work. */
static int dispatch_chunks(struct spl_tile *tile, size_t first, size_t last, struct spl_error *err)
{
    const struct spl_draw_list *list = &tile->renderer->list;
    int rc = SPL_OK;
    for (size_t end = first; first < last && !rc; first = end) {
        uint64_t work = 0;
        while (end < last && work < SPL_BATCH_WORK)
            work += occlusion_work(&list->bounds[end++]);
        rc = spl_tile_add_work(tile, work, err);
        rc = rc ? rc : dispatch_range(tile, &(struct spl_kernel_key){.name = "occlusion_chunks"}, first, end, err);
    }
    return rc;
}

int spl_tile_dispatch_occlusion(struct spl_tile *tile, size_t first_chunk, size_t end_chunk, bool wide,
                                struct spl_error *err)
{
    enum { side = SPL_OCCLUSION_TILE };
    size_t tiles = (size_t)((tile->camera.width + side - 1) / side) * ((tile->camera.height + side - 1) / side);
    spl_tile_begin_area(tile, SPL_AREA_OCCLUDERS);
    int rc = dispatch_range(tile, &(struct spl_kernel_key){"occlusion_tiles", false, {wide}}, 0, tiles, err);
    rc = rc ? rc : dispatch_chunks(tile, first_chunk, end_chunk, err);
    spl_tile_end_area(tile, SPL_AREA_OCCLUDERS);
    return rc;
}

_Static_assert((int)SPL_LAYER_PRIMITIVE == SPL_RESOLVE_PRIMITIVE && SPL_LAYER_COUNT == SPL_RESOLVE_PRIMITIVE + 1,
               "the kernel knows each layer by its number");
_Static_assert((int)SPL_SHAPE_SPLAT == SPL_DRAWN_SPLAT && (int)SPL_SHAPE_LINE == SPL_DRAWN_LINE &&
                   (int)SPL_SHAPE_PANEL == SPL_DRAWN_PANEL && (int)SPL_SHAPE_MESH == SPL_DRAWN_MESH,
               "what kernels draw is told apart by the same numbers");

int spl_tile_dispatch_resolve(struct spl_tile *tile, enum spl_layer layer, uint32_t output_word, struct spl_error *err)
{
    const struct spl_method_row *method = spl_method_row(tile->view->method);
    bool mapped = layer == SPL_LAYER_COLOR && spl_tile_has_map_colors(tile, SPL_SUMS_COLOR);
    uint32_t resolved = !mapped ? method->resolve : method->sums ? SPL_RESOLVED_MAPPED : SPL_RESOLVED_MAPPED_BENT;
    bool blended = layer == SPL_LAYER_COLOR || layer == SPL_LAYER_COVERAGE;
    uint32_t soft = !spl_soft_is_drawn(tile) ? 0 : blended ? 1 : spl_soft_is_found(tile->view) ? 2 : 0;
    const uint32_t shaded = layer == SPL_LAYER_COLOR && spl_tile_get_shades(tile);
    struct spl_kernel_key key = {"resolve", !method->sums, {layer, resolved, soft, shaded}};
    struct spl_frame_params params = tile->params;
    params.output_word = output_word;
    params.map_near = (float)tile->view->soft.cover; /* no other word of its slot is free */
    return spl_tile_dispatch_items(tile, &key, &params, tile->width * tile->height, err);
}

void spl_tile_stamp(struct spl_tile *tile, enum spl_stage stage)
{
    if (tile->stamps == SPL_GPU_TIMESTAMPS_MAX)
        return;
    tile->stamp_stage[tile->stamps] = (uint8_t)stage;
    spl_gpu_timestamp(tile->renderer->gpu, tile->stamps++);
}
