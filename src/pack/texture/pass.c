/* The second pass of packing with photographs.
 *
 * Every photograph is read once, one at a time, to find which splats it shows (candidates.h); then exposures are evened
 * out and each splat chooses, and the container is written anew with other colours, or with textures (textured.c).
 * Memory: one photograph and some 40 bytes a splat. A fault of a photograph fails the packing, or is handed out and the
 * photograph left out, as the options say. The caller's thread owns the renderer. */
#include "pack/texture/pass.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "dataset/rewrite.h"
#include "pack/texture/pass_parts.h"
#include "pack/texture/photographs.h"
#include "pack/texture/presets.h"

static const uint64_t memory_default = 2ull << 30;

static void get_own(void *context, size_t begin, size_t end, unsigned worker)
{
    struct spl_photo_pass *pass = context;
    struct spl_world_splat splats[SPL_CHUNK_SPLATS];
    (void)worker;
    for (uint32_t chunk = (uint32_t)begin; chunk < end; chunk++) {
        uint32_t count = spl_splats_get(&pass->splats, chunk, splats);
        for (uint32_t i = 0; i < count; i++)
            memcpy(pass->own[pass->splats.chunks[chunk].first_id + i], splats[i].splat.color, 3);
    }
}

/* As many candidates a splat as the memory has room for beside the largest photograph. */
static int allocate(struct spl_photo_pass *pass, const struct spl_dataset *dataset, struct spl_error *err)
{
    uint64_t memory = pass->options->memory_bytes ? pass->options->memory_bytes : memory_default, largest = 0;
    bool colored = spl_dataset_get_info(dataset)->has_color;
    for (uint32_t i = 0; i < pass->report->photographs; i++) {
        uint64_t bytes = spl_photo_bytes(&pass->list->views[i]);
        largest = bytes > largest ? bytes : largest;
    }
    uint64_t each = sizeof *pass->chosen.photo + 3 + (colored ? 3 : 0), depth = SPL_CANDIDATES_MAX;
    while (depth > 1 && largest + pass->splats.count * (each + depth * sizeof(struct spl_candidate)) > memory)
        depth--;
    uint64_t needed = largest + pass->splats.count * (each + depth * sizeof(struct spl_candidate));
    if (needed > memory)
        return spl_fail_field(err, SPL_E_LIMIT, "memory",
                              "%llu splats and the largest photograph need %llu MiB; the limit is %llu",
                              (unsigned long long)pass->splats.count, (unsigned long long)(needed >> 20),
                              (unsigned long long)(memory >> 20));
    int rc = spl_candidates_init(&pass->candidates, pass->splats.count, (uint32_t)depth, err);
    pass->gains = spl_alloc(pass->report->photographs + 1, sizeof *pass->gains, err);
    pass->dropped = spl_alloc(pass->report->photographs, sizeof *pass->dropped, err);
    if (colored)
        pass->own = spl_alloc(pass->splats.count, sizeof *pass->own, err);
    if (rc || !pass->gains || !pass->dropped || (colored && !pass->own))
        return SPL_E_NOMEM;
    if (colored)
        spl_parallel_for(pass->stage->threads, pass->splats.chunk_count, 16, get_own, pass);
    for (uint64_t id = 0; colored && id < pass->splats.count && !pass->judged; id++)
        if (pass->own[id][0] != pass->own[id][1] || pass->own[id][1] != pass->own[id][2])
            pass->judged = pass->own;
    return SPL_OK;
}

static int look(struct spl_photo_pass *pass, const struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_photo_whole whole = {0};
    uint32_t usable = 0;
    int rc = SPL_OK;
    spl_stage_begin(pass->stage, "photographs", NULL, (uint64_t)pass->report->photographs * pass->splats.chunk_count);
    for (uint32_t i = 0; !rc && i < pass->report->photographs; i++) {
        const struct spl_named_view *view = &pass->list->views[i];
        struct spl_photo photo;
        struct spl_error why = {0};
        if (!(rc = spl_photo_open(&photo, view, &whole, pass->renderer, dataset, &why))) {
            uint64_t seen = spl_candidates_look(&pass->candidates, &pass->splats, &photo, (uint16_t)i, pass->stage);
            spl_photo_close(&photo);
            if (!seen && spl_photo_is_face(view))
                rc = SPL_PHOTO_EMPTY;
            else if (!seen)
                rc = spl_fail(&why, SPL_E_INPUT, "%s: its pose sees no splat; is the model in the scan's coordinates?",
                              view->photograph);
        }
        pass->dropped[i] = rc != 0;
        usable += !rc;
        rc = rc < 0 ? spl_photos_refuse(pass->options, pass->report, rc, &why, err) : SPL_OK;
        if (!rc)
            rc = spl_stage_check(pass->stage, err);
    }
    spl_photo_whole_finish(&whole);
    spl_stage_end(pass->stage);
    if (!rc && !usable)
        rc = spl_fail_field(err, SPL_E_INPUT, "images", "%s: no photograph shows a splat", pass->options->cameras);
    return rc;
}

static void drop(struct spl_photo_pass *pass, uint16_t photo)
{
    uint32_t depth = pass->candidates.depth;
    pass->dropped[photo] = true;
    for (uint64_t s = 0; s < pass->candidates.splats; s++) {
        struct spl_candidate *list = pass->candidates.list + s * depth;
        uint32_t kept = 0;
        for (uint32_t k = 0; k < depth; k++)
            if (list[k].photo != photo)
                list[kept++] = list[k];
        for (; kept < depth; kept++)
            list[kept] = (struct spl_candidate){.photo = SPL_NO_PHOTO};
    }
}

/* Gains, without the photographs that contradict the others. Where most do, or most of the rest are doubtful, there is
 * no telling which. */
static int even_out(struct spl_photo_pass *pass, struct spl_error *err)
{
    uint32_t photos = pass->report->photographs;
    for (bool first = true;; first = false) {
        uint32_t contradicting = 0, doubtful = 0, compared = 0, worst = 0;
        int rc = spl_gains_find(&pass->candidates, (const uint8_t(*)[3])pass->judged, photos, pass->gains,
                                pass->stage->threads, err);
        if (rc)
            return rc;
        for (uint32_t i = 0; i < photos; i++) {
            if (pass->dropped[i] || !pass->gains[i].shared)
                continue;
            compared++;
            doubtful += spl_gain_doubtful(&pass->gains[i]);
            if (!spl_gain_contradicts(&pass->gains[i]))
                continue;
            worst = !contradicting || pass->gains[i].agreement < pass->gains[worst].agreement ? i : worst;
            contradicting++;
        }
        bool settled = !contradicting || (first && contradicting > compared / 2);
        if (settled && doubtful > 1 && doubtful > compared / 2)
            return spl_fail_field(err, SPL_E_INPUT, "cameras",
                                  "%s: %u of %u photographs contradict each other on what they show: is the model "
                                  "mirrored, scaled, or of another scan?",
                                  pass->options->cameras, doubtful, compared);
        if (!contradicting)
            return SPL_OK;
        const struct spl_gain *gain = &pass->gains[worst];
        struct spl_error why = {0};
        spl_fail(&why, SPL_E_INPUT,
                 "%s: contradicts the others on %llu splats (correlation %.2f): its pose is not where it was taken",
                 pass->list->views[worst].photograph, (unsigned long long)gain->shared, gain->agreement);
        if ((rc = spl_photos_refuse(pass->options, pass->report, SPL_E_INPUT, &why, err)))
            return rc;
        drop(pass, (uint16_t)worst);
    }
}

/* Points, not splats: coarser levels have their colours from the same photographs. Of those that panels stand for as
 * large a share as of their cells. */
static uint64_t count_points(const struct spl_photo_pass *pass)
{
    uint64_t points = 0, cells = 0, all_cells = 0;
    for (uint32_t chunk = 0; chunk < pass->splats.chunk_count; chunk++) {
        const struct spl_chunk *header = &pass->splats.chunks[chunk];
        uint32_t kind = spl_chunk_kind(header), seen = 0;
        if (pass->splats.nodes[pass->splats.node_of[chunk]].child_count || kind == SPL_CHUNK_LINES)
            continue;
        for (uint64_t id = header->first_id; id < header->first_id + header->count; id++)
            seen += pass->chosen.photo[id] != SPL_NO_PHOTO;
        points += spl_kind_has_panels(kind) ? 0 : seen;
        cells += spl_kind_has_panels(kind) ? seen : 0;
        all_cells += spl_kind_has_panels(kind) ? header->count : 0;
    }
    double share = all_cells ? (double)cells / (double)all_cells : 0;
    return points + (uint64_t)(share * (double)spl_dataset_get_info(pass->splats.dataset)->panel_points + 0.5);
}

/* NULL when memory is refused. */
static json_t *describe_source(const struct spl_photo_pass *pass)
{
    const char *cameras = pass->options->cameras, *end = cameras + strlen(cameras), *name;
    json_int_t points = (json_int_t)count_points(pass);
    while (end > cameras + 1 && end[-1] == '/')
        end--;
    /* two names of the path: a COLMAP model's folder is mostly called "0" */
    int slashes = 0;
    for (name = end; name > cameras && (name[-1] != '/' || ++slashes < 2);)
        name--;
    return json_pack("{s:o, s:s, s:I}", "source", json_stringn_nocheck(name, (size_t)(end - name)), "from",
                     "photographs", "points", points);
}

/* Seconds on two cores, of Sceaux: a million splats, times photographs where each is asked, times epochs and atoms
 * where there are. Finer textures cost training and coding less than their texels are more, since few main axes hold
 * most of them. */
void spl_photos_plan(const struct spl_photo_options *options, struct spl_stage *stage, uint32_t photographs,
                     uint64_t splats, uint32_t size)
{
    const struct spl_texture_settings settings = spl_texture_settings_get(options);
    double millions = (double)splats * 1e-6, pairs = millions * photographs, finer = size > 8 ? size / 8 : 1;
    double share = settings.sample && settings.sample < splats ? (double)settings.sample / (double)splats : 1;
    double atoms = settings.dictionary / 4096.0, epochs = settings.epochs ? settings.epochs : 5;
    if (!size) {
        spl_stage_plan(stage, "photographs", 1.2 * pairs, 0);
        spl_stage_plan(stage, "colours", 0.9 * millions, 0);
    }
    if (options->textures == SPL_TEXTURES_NONE)
        return;
    if (!size)
        spl_stage_plan(stage, "resampling", 0.7 * pairs, 0);
    spl_stage_plan(stage, "training", 11 * millions * share * epochs * atoms * pow(finer, 1.3), 0);
    spl_stage_plan(stage, "coding textures", 42 * millions * atoms * pow(finer, 1.3), 0);
}

int spl_photos_apply(const struct spl_photo_options *options, const struct spl_view_list *list,
                     const struct spl_dataset *dataset, const char *output, struct spl_stage *stage,
                     struct spl_photo_report *report, struct spl_error *err)
{
    struct spl_photo_pass pass = {.options = options, .list = list, .report = report, .stage = stage};
    const struct spl_renderer_options how = {.size = sizeof how, .device = options->device};
    uint64_t begin_ns = spl_now_ns();
    int rc = spl_splats_init_with_cells(&pass.splats, dataset, err);
    if (rc || (rc = allocate(&pass, dataset, err)) || (rc = spl_renderer_create(&how, &pass.renderer, err)) ||
        (rc = spl_renderer_add(pass.renderer, dataset, err)))
        goto done;
    if ((rc = look(&pass, dataset, err)) || (rc = even_out(&pass, err)))
        goto done;
    spl_stage_begin(stage, "colours", NULL, pass.splats.chunk_count);
    rc = spl_chosen_init(&pass.chosen, &pass.splats, &pass.candidates, pass.gains, report->photographs,
                         (const uint8_t(*)[3])pass.own, stage, err);
    if (rc)
        goto done;
    spl_stage_end(stage);
    report->unseen = pass.chosen.unseen;
    if (pass.splats.own_chunks) /* among them are cells, of which there are no splats */
        report->unseen = (uint64_t)((double)report->unseen / (double)pass.splats.count *
                                    (double)spl_dataset_get_info(dataset)->splats);
    if (!(pass.color_source = describe_source(&pass))) {
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory while describing colours");
        goto done;
    }
    const struct spl_rewrite plain = {
        .from = dataset, .colors = (const uint8_t(*)[3])pass.chosen.color, .first_cell = pass.splats.first_cell,
        .color_source = pass.color_source};
    rc = options->textures == SPL_TEXTURES_NONE ? spl_dataset_rewrite(&plain, output, err)
                                                : spl_photo_pass_write_textured(&pass, dataset, output, err);
    report->seconds = (double)(spl_now_ns() - begin_ns) / 1e9;
done:
    spl_renderer_destroy(pass.renderer);
    spl_chosen_finish(&pass.chosen);
    spl_candidates_finish(&pass.candidates);
    spl_splats_finish(&pass.splats);
    free(pass.gains);
    free(pass.own);
    free(pass.dropped);
    free(pass.uses);
    json_decref(pass.color_source);
    return rc;
}
