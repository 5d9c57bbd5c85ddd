/* Textures of the splats that chose a photograph. Each photograph is read again, for those that chose it; their
 * textures lie in an unlinked file (textures.h) until a dictionary is trained on them and they are coded; then the
 * container is written anew with other colours and with codes (rewrite.h). */
#include "pack/texture/pass_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "dataset/rewrite.h"
#include "pack/texture/presets.h"

enum { splats_compared = 4000 };

/* Resampling may lose this much more than a texture is coded to: the limit of eight atoms keeps coding below its aim,
 * and texels that are four times as many cost more bytes than they show. */
static const double resampling_slack = 2; /* dB */

/* Texels a pixel of the photograph from which on finer ones hold nothing that it shows: what they still gain in
 * resampling is lost again by eight atoms that have four times as much to say. */
static const double texels_enough = 1.25;

/* Leaves are what is looked at closely; those of the photograph that most splats chose stand for all. The smallest
 * size whose resampling loses hardly more than coding will, or that has texels enough; the largest where there is no
 * pixel to tell by. */
static int choose_size(struct spl_photo_pass *pass, const struct spl_dataset *dataset, struct spl_error *err)
{
    const struct spl_texture_settings settings = spl_texture_settings_get(pass->options);
    struct spl_resample_error error[3] = {0};
    struct spl_photo_whole whole = {0};
    struct spl_photo photo;
    uint32_t best = 0;
    for (uint32_t i = 0; i < pass->report->photographs; i++)
        best = pass->uses[i] > pass->uses[best] ? i : best;
    int rc = spl_photo_open(&photo, &pass->list->views[best], &whole, pass->renderer, dataset, err);
    spl_photo_whole_finish(&whole);
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
        double side = error[k].sides / fmax((double)error[k].splats, 1);
        if (pass->report->resampling_psnr > settings.quality - resampling_slack ||
            pass->report->texture_size >= settings.texels_max ||
            (error[k].values && pass->report->texture_size >= texels_enough * side))
            break;
    }
    return SPL_OK;
}

static int take_textures(struct spl_photo_pass *pass, const struct spl_dataset *dataset, struct spl_textures *textures,
                         struct spl_error *err)
{
    struct spl_photo_whole whole = {0};
    int rc = SPL_OK;
    spl_stage_begin(pass->stage, "resampling", NULL, (uint64_t)pass->report->photographs * pass->splats.chunk_count);
    for (uint32_t i = 0; !rc && i < pass->report->photographs; i++) {
        struct spl_photo photo;
        if (!pass->uses[i]) {
            spl_stage_add(pass->stage, pass->splats.chunk_count, 0);
            continue;
        }
        rc = spl_photo_open(&photo, &pass->list->views[i], &whole, pass->renderer, dataset, err);
        if (rc)
            break;
        rc = spl_textures_take(textures, &pass->splats, &pass->candidates, &pass->chosen, pass->gains, &photo,
                               (uint16_t)i, pass->stage, err);
        spl_photo_close(&photo);
        if (!rc)
            rc = spl_stage_check(pass->stage, err);
    }
    spl_photo_whole_finish(&whole);
    spl_stage_end(pass->stage);
    return rc ? rc : spl_textures_list(textures, pass->splats.count, err);
}

static int keep_textures(const struct spl_photo_pass *pass, const struct spl_textures *textures, struct spl_error *err)
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
static json_t *describe(const struct spl_photo_pass *pass, const struct spl_coded *coded)
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

int spl_photo_pass_write_textured(struct spl_photo_pass *pass, const struct spl_dataset *dataset, const char *output,
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
    if (rc || (rc = choose_size(pass, dataset, err)))
        goto done;
    spl_photos_plan(pass->options, pass->stage, pass->report->photographs, pass->splats.count,
                    pass->report->texture_size);
    if ((rc = spl_textures_init(&textures, output, pass->splats.count, pass->report->texture_size, err)) ||
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
    const struct spl_rewrite what = {.from = dataset,
                                       .colors = (const uint8_t(*)[3])pass->chosen.color,
                                       .first_cell = pass->splats.first_cell,
                                       .dictionary = &coded.dictionary,
                                       .code_chunk = spl_coded_get,
                                       .context = &chunks,
                                       .color_source = pass->color_source,
                                       .textures = description};
    rc = spl_dataset_rewrite(&what, output, err);
done:
    json_decref(description);
    spl_coded_finish(&coded);
    spl_textures_finish(&textures);
    return rc;
}
