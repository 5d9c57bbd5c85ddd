/* The second pass of packing with photographs.
 *
 * Every photograph is read once, one at a time, to find which splats it shows (candidates.h); then exposures are evened
 * out and each splat chooses. For textures each is read again, for those that chose it; they are coded (textures.h),
 * and the container is written anew with other colours and with codes (retexture.h). Memory: one photograph and some 40
 * bytes a splat. A fault of a photograph fails the packing, or is handed out and the photograph left out, as the
 * options say. The caller's thread owns the renderer. */
#include "pack/texture/pass.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <splatd/render.h>

#include "base/clock.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "dataset/retexture.h"
#include "image/load.h"
#include "pack/texture/textures.h"

enum { depth_side = 1600, splats_compared = 4000 };
static const uint64_t memory_default = 2ull << 30;

/* The fault of one photograph: *err, or handed out. */
static int refuse(const struct spl_photo_options *options, struct spl_photo_report *report, int rc,
                  const struct spl_error *why, struct spl_error *err)
{
    if (!options->refused || rc == SPL_E_NOMEM || rc == SPL_E_DEVICE_LOST)
        return spl_fail_field(err, rc, why->field, "%s", why->message);
    report->refused++;
    options->refused(options->context, why);
    return SPL_OK;
}

struct reading {
    const struct spl_photo_options *options;
    struct spl_photo_report *report;
};

static void refuse_pose(void *context, const struct spl_error *why)
{
    const struct reading *reading = context;
    reading->report->refused++;
    reading->options->refused(reading->options->context, why);
}

static int get_size(const char *path, uint32_t *width, uint32_t *height, struct spl_error *err)
{
    struct spl_image_info info;
    int rc = spl_image_get_info(path, &info, err);
    *width = info.width;
    *height = info.height;
    return rc;
}

static int check_file(const struct spl_named_view *view, struct spl_error *err)
{
    struct spl_image_info info;
    const struct spl_camera *camera = &view->camera;
    int rc = spl_image_get_info(view->photograph, &info, err);
    if (rc)
        return rc;
    if (info.cmyk || info.bits != 8)
        return spl_fail(err, SPL_E_UNSUPPORTED, "%s: %s; photographs are 8 bit sRGB: convert it", view->photograph,
                        info.cmyk         ? "a CMYK image"
                        : info.bits == 16 ? "16 bit channels"
                                          : "channels below 8 bit");
    if (info.width != camera->width || info.height != camera->height)
        return spl_fail_field(err, SPL_E_INPUT, "width",
                              "%s: %u x %u pixels; its camera says %u x %u: scale the photograph or its lens",
                              view->photograph, info.width, info.height, camera->width, camera->height);
    return SPL_OK;
}

int spl_photos_load(const struct spl_photo_options *options, struct spl_view_list *list,
                    struct spl_photo_report *report, struct spl_error *err)
{
    struct reading reading = {options, report};
    const struct spl_photograph_options how = {
        .images = options->images,
        .get_size = get_size,
        .refuse = options->refused ? refuse_pose : NULL,
        .context = &reading,
    };
    size_t kept = 0;
    int rc = spl_view_list_load_photographs(list, options->cameras, &how, err);
    if (rc)
        return rc;
    for (size_t i = 0; !rc && i < list->count; i++) {
        struct spl_error why = {0};
        struct spl_named_view view = list->views[i];
        if ((rc = check_file(&view, &why)) && (rc = refuse(options, report, rc, &why, err)))
            break;
        list->views[i] = list->views[kept];
        list->views[kept] = view;
        kept += why.code == 0;
    }
    if (!rc && (!kept || kept > SPL_PHOTOS_TAKEN_MAX))
        rc = kept ? spl_fail_field(err, SPL_E_LIMIT, "images", "%zu photographs; at most %d are taken", kept,
                                   SPL_PHOTOS_TAKEN_MAX)
                  : spl_fail_field(err, SPL_E_INPUT, "images", "%s: none of %zu photographs can be used",
                                   options->cameras, list->count);
    report->photographs = (uint32_t)kept;
    if (rc)
        spl_view_list_finish(list);
    return rc;
}

struct pass {
    const struct spl_photo_options *options;
    const struct spl_view_list *list;
    struct spl_photo_report *report;
    struct spl_stage *stage;
    struct spl_splats splats;
    struct spl_candidates candidates;
    struct spl_chosen chosen;
    struct spl_gain *gains;
    uint8_t (*own)[3];    /* NULL: the scan has no colours */
    uint8_t (*judged)[3]; /* own, beside which photographs are judged; NULL: all of it is grey, as infrared is */
    struct spl_renderer *renderer;
    bool *dropped;  /* by photograph */
    uint64_t *uses; /* the same: splats that chose it */
};

static void get_own(void *context, size_t begin, size_t end, unsigned worker)
{
    struct pass *pass = context;
    struct spl_world_splat splats[SPL_CHUNK_SPLATS];
    (void)worker;
    for (uint32_t chunk = (uint32_t)begin; chunk < end; chunk++) {
        uint32_t count = spl_splats_get(&pass->splats, chunk, splats);
        for (uint32_t i = 0; i < count; i++)
            memcpy(pass->own[pass->splats.chunks[chunk].first_id + i], splats[i].splat.color, 3);
    }
}

/* As many candidates a splat as the memory has room for beside the largest photograph. */
static int allocate(struct pass *pass, const struct spl_dataset *dataset, struct spl_error *err)
{
    uint64_t memory = pass->options->memory_bytes ? pass->options->memory_bytes : memory_default, largest = 0;
    bool colored = spl_dataset_get_info(dataset)->has_color;
    for (uint32_t i = 0; i < pass->report->photographs; i++) {
        uint64_t bytes = spl_photo_bytes(&pass->list->views[i], depth_side);
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
        pass->own = spl_alloc_raw(pass->splats.count, sizeof *pass->own, err);
    if (rc || !pass->gains || !pass->dropped || (colored && !pass->own))
        return SPL_E_NOMEM;
    if (colored)
        spl_parallel_for(pass->stage->threads, pass->splats.chunk_count, 16, get_own, pass);
    for (uint64_t id = 0; colored && id < pass->splats.count && !pass->judged; id++)
        if (pass->own[id][0] != pass->own[id][1] || pass->own[id][1] != pass->own[id][2])
            pass->judged = pass->own;
    return SPL_OK;
}

static int look(struct pass *pass, const struct spl_dataset *dataset, struct spl_error *err)
{
    uint32_t usable = 0;
    int rc = SPL_OK;
    spl_stage_begin(pass->stage, "photographs", (uint64_t)pass->report->photographs * pass->splats.chunk_count);
    for (uint32_t i = 0; !rc && i < pass->report->photographs; i++) {
        const struct spl_named_view *view = &pass->list->views[i];
        struct spl_photo photo;
        struct spl_error why = {0};
        if (!(rc = spl_photo_open(&photo, view, pass->renderer, dataset, depth_side, &why))) {
            uint64_t seen = spl_candidates_look(&pass->candidates, &pass->splats, &photo, (uint16_t)i, pass->stage);
            spl_photo_close(&photo);
            if (!seen)
                rc = spl_fail(&why, SPL_E_INPUT, "%s: its pose sees no splat; is the model in the scan's coordinates?",
                              view->photograph);
        }
        pass->dropped[i] = rc != 0;
        usable += !rc;
        rc = rc ? refuse(pass->options, pass->report, rc, &why, err) : SPL_OK;
    }
    spl_stage_end(pass->stage);
    if (!rc && !usable)
        rc = spl_fail_field(err, SPL_E_INPUT, "images", "%s: no photograph shows a splat", pass->options->cameras);
    return rc;
}

static void drop(struct pass *pass, uint16_t photo)
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
static int even_out(struct pass *pass, struct spl_error *err)
{
    uint32_t photos = pass->report->photographs;
    for (bool first = true;; first = false) {
        uint32_t contradicting = 0, doubtful = 0, compared = 0, worst = 0;
        int rc = spl_gains_find(&pass->candidates, (const uint8_t(*)[3])pass->judged, photos, pass->gains, err);
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
        if ((rc = refuse(pass->options, pass->report, SPL_E_INPUT, &why, err)))
            return rc;
        drop(pass, (uint16_t)worst);
    }
}

/* Resampling may lose this much more than a texture is coded to: the limit of eight atoms keeps coding below its aim,
 * and texels that are four times as many cost more bytes than they show. */
static const double resampling_slack = 2; /* dB */

/* Leaves are what is looked at closely; those of the photograph that most splats chose stand for all. The smallest
 * size whose resampling loses hardly more than coding will; the largest where there is no pixel to tell by. */
static int choose_size(struct pass *pass, const struct spl_dataset *dataset, struct spl_error *err)
{
    double quality = pass->options->texture_quality > 0 ? pass->options->texture_quality : 40;
    struct spl_resample_error error[3] = {0};
    struct spl_photo photo;
    uint32_t best = 0;
    for (uint32_t i = 0; i < pass->report->photographs; i++)
        best = pass->uses[i] > pass->uses[best] ? i : best;
    int rc = spl_photo_open(&photo, &pass->list->views[best], pass->renderer, dataset, depth_side, err);
    if (rc)
        return rc;
    uint32_t stride = (uint32_t)(pass->uses[best] / splats_compared + 1);
    spl_textures_compare(&pass->splats, &pass->candidates, &pass->chosen, pass->gains, &photo, (uint16_t)best, stride,
                         error);
    spl_photo_close(&photo);
    for (uint32_t k = 0; k < 3; k++) {
        double mean = error[k].squared / fmax((double)error[k].values, 1);
        pass->report->texture_size = 8u << k;
        pass->report->resampling_psnr = !error[k].values ? NAN : mean > 0 ? 10 * log10(255.0 * 255.0 / mean) : 99;
        if (pass->report->resampling_psnr > quality - resampling_slack)
            break;
    }
    return SPL_OK;
}

static int take_textures(struct pass *pass, const struct spl_dataset *dataset, struct spl_textures *textures,
                         struct spl_error *err)
{
    int rc = SPL_OK;
    spl_stage_begin(pass->stage, "resampling", (uint64_t)pass->report->photographs * pass->splats.chunk_count);
    for (uint32_t i = 0; !rc && i < pass->report->photographs; i++) {
        struct spl_photo photo;
        if (!pass->uses[i]) {
            spl_stage_add(pass->stage, pass->splats.chunk_count, 0);
            continue;
        }
        rc = spl_photo_open(&photo, &pass->list->views[i], pass->renderer, dataset, depth_side, err);
        if (rc)
            break;
        rc = spl_textures_take(textures, &pass->splats, &pass->candidates, &pass->chosen, pass->gains, &photo,
                               (uint16_t)i, pass->stage, err);
        spl_photo_close(&photo);
    }
    spl_stage_end(pass->stage);
    return rc ? rc : spl_textures_list(textures, pass->splats.count, err);
}

static int keep_textures(const struct pass *pass, const struct spl_textures *textures, struct spl_error *err)
{
    const char *path = pass->options->keep_textures;
    uint32_t photographs = pass->report->photographs;
    if (!path)
        return SPL_OK;
    const char **names = spl_alloc(photographs, sizeof *names, err);
    if (!names)
        return SPL_E_NOMEM;
    struct spl_texture_origin origin = {
        .splats = pass->splats.count, .photographs = photographs, .photo = pass->chosen.photo, .names = names};
    for (uint32_t i = 0; i < photographs; i++) {
        const struct spl_named_view *view = &pass->list->views[i];
        names[i] = pass->dropped[i] ? "" : view->name;
        origin.pixels += pass->dropped[i] ? 0 : (uint64_t)view->camera.width * view->camera.height;
    }
    int rc = spl_textures_keep(textures, path, &origin, err);
    free(names);
    return rc;
}

/* What META says of the textures. */
static json_t *describe(const struct pass *pass, const struct spl_coded *coded)
{
    static const char *const names[SPL_TEXTURES_COUNT] = {"none", "adaptive", "D8W4", "D12W4", "D16W8"};
    const struct spl_photo_report *r = pass->report;
    json_t *histogram = json_array();
    for (int i = 0; i <= SPL_ATOMS_MAX; i++)
        json_array_append_new(histogram, json_integer((json_int_t)r->histogram[i]));
    return json_pack("{s:s, s:i, s:i, s:o*, s:f, s:I, s:o, s:O}", "coding", names[pass->options->textures], "size",
                     (int)r->texture_size, "atoms", (int)r->atoms, "resampling_psnr", json_real(r->resampling_psnr),
                     "psnr", r->texture_psnr, "splats", (json_int_t)r->textured, "histogram", histogram, "training",
                     coded->epochs);
}

static void report_codes(struct spl_photo_report *report, const struct spl_coded *coded)
{
    const struct spl_code_sums *sums = &coded->sums;
    double mean = sums->squared_error / fmax((double)sums->values, 1);
    report->textured = sums->splats;
    report->atoms = coded->dictionary.count;
    report->texture_psnr = mean > 0 ? fmin(-10 * log10(mean), 99) : 99;
    memcpy(report->histogram, sums->histogram, sizeof report->histogram);
}

static int write_textured(struct pass *pass, const struct spl_dataset *dataset, const char *output,
                          struct spl_error *err)
{
    struct spl_textures textures = {.fd = -1};
    struct spl_coded coded = {0};
    json_t *description = NULL;
    pass->uses = spl_alloc(pass->report->photographs, sizeof *pass->uses, err);
    int rc = pass->uses ? SPL_OK : SPL_E_NOMEM;
    for (uint64_t id = 0; !rc && id < pass->splats.count; id++)
        if (pass->chosen.photo[id] != SPL_NO_PHOTO)
            pass->uses[pass->chosen.photo[id]]++;
    if (rc || (rc = choose_size(pass, dataset, err)) ||
        (rc = spl_textures_init(&textures, output, pass->splats.count, pass->report->texture_size, err)) ||
        (rc = take_textures(pass, dataset, &textures, err)) || (rc = keep_textures(pass, &textures, err)))
        goto done;
    spl_candidates_finish(&pass->candidates); /* training may hold as much as they did */
    rc = spl_coded_init(&coded, &textures, &pass->splats, pass->options, &pass->chosen, pass->stage, err);
    if (rc)
        goto done;
    report_codes(pass->report, &coded);
    if (!(description = describe(pass, &coded))) {
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory while describing textures");
        goto done;
    }
    struct spl_coded_chunks chunks = {&coded, &pass->splats};
    const struct spl_retexture what = {.from = dataset,
                                       .colors = (const uint8_t(*)[3])pass->chosen.color,
                                       .dictionary = &coded.dictionary,
                                       .code_chunk = spl_coded_get,
                                       .context = &chunks,
                                       .textures = description};
    rc = spl_dataset_retexture(&what, output, err);
done:
    json_decref(description);
    spl_coded_finish(&coded);
    spl_textures_finish(&textures);
    return rc;
}

int spl_photos_apply(const struct spl_photo_options *options, const struct spl_view_list *list,
                     const struct spl_dataset *dataset, const char *output, struct spl_stage *stage,
                     struct spl_photo_report *report, struct spl_error *err)
{
    struct pass pass = {.options = options, .list = list, .report = report, .stage = stage};
    const struct spl_renderer_options how = {.device = options->device};
    uint64_t begin_ns = spl_now_ns();
    int rc = spl_splats_init(&pass.splats, dataset, err);
    if (rc || (rc = allocate(&pass, dataset, err)) || (rc = spl_renderer_create(&how, &pass.renderer, err)) ||
        (rc = spl_renderer_add(pass.renderer, dataset, err)))
        goto done;
    if ((rc = look(&pass, dataset, err)) || (rc = even_out(&pass, err)))
        goto done;
    spl_stage_begin(stage, "colours", pass.splats.chunk_count);
    rc = spl_chosen_init(&pass.chosen, &pass.splats, &pass.candidates, pass.gains, report->photographs,
                         (const uint8_t(*)[3])pass.own, stage, err);
    if (rc)
        goto done;
    spl_stage_end(stage);
    report->unseen = pass.chosen.unseen;
    const struct spl_retexture plain = {.from = dataset, .colors = (const uint8_t(*)[3])pass.chosen.color};
    rc = options->textures == SPL_TEXTURES_NONE ? spl_dataset_retexture(&plain, output, err)
                                                : write_textured(&pass, dataset, output, err);
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
    return rc;
}
