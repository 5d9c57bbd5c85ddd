/* The pass that makes maps. First every station's ranges, from its splats, also where panels are drawn in their place:
 * they say what each chunk is seen by, and stay in memory, 2 bytes a texel. Then the file is written anew, and as it
 * asks for them the stations' colours are made one after the other, from pictures that are read one at a time. Memory:
 * 16 bytes a texel of one map, a picture, 36 bytes a splat of one station. The caller's thread. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "dataset/rewrite.h"
#include "geom/unit.h"
#include "pack/maps/colors.h"
#include "pack/maps/pass.h"
#include "pack/prune.h"
#include "pack/texture/photo_image.h"

/* Bytes that colours and ranges of a map made from pictures may take together, a texel of colour. */
static const double bytes_a_texel = 0.75;

/* Coarser ranges mistake what is before a wall for the wall; 52 kB. */
static const double least_range_side = 64;

/* The largest side of ranges that leaves a map within its bytes. */
static uint32_t find_range_side(const struct spl_map_row *row)
{
    double words = 0;
    for (uint32_t l = 0; l < row->levels; l++)
        words += (double)spl_map_level_words(row, l);
    double left = bytes_a_texel * 6 * row->side * row->side - 4 * words; /* 2 * 6 (s + 1) (s + 2) */
    double side = left > 24 ? floor(sqrt(left / 12) - 1.5) : 0;
    return (uint32_t)fmin(fmax(side, least_range_side), SPL_MAP_RANGE_SIDE_MAX);
}

/* A station's row and ranges. Sides of the colours are those of its pictures, else the step of its splats. */
static int make_ranges(struct spl_map_pass *p, uint32_t station, struct spl_hits *hits, struct spl_error *err)
{
    struct spl_map_row row = {.side = spl_colors_find_side(&p->stations, p->views, station),
                              .levels = SPL_MAP_LEVELS_MAX};
    struct spl_ranges ranges = {0};
    uint32_t *codes = NULL;
    uint32_t most = row.side ? find_range_side(&row) : SPL_MAP_RANGE_SIDE_MAX / 2;
    int rc = spl_ranges_init(&ranges, hits, most, p->stage->threads, err);
    if (rc)
        return rc;
    memcpy(row.rotation, p->stations.list[station].rotation, sizeof row.rotation);
    memcpy(row.position, p->stations.list[station].position, sizeof row.position);
    if (!row.side)
        row.side = (ranges.side + SPL_MAP_SIDE_STEP - 1) / SPL_MAP_SIDE_STEP * SPL_MAP_SIDE_STEP;
    row.range_side = ranges.side;
    row.near = (float)ranges.near;
    row.slack = (float)p->slack;
    while (row.side > SPL_MAP_SIDE_STEP && spl_map_words(&row) * sizeof(uint32_t) > SPL_MAP_BYTES_MAX)
        row.side -= SPL_MAP_SIDE_STEP;
    const char *fault = spl_map_judge(&row);
    size_t texels = 2 * spl_map_range_words(&row);
    if (fault)
        rc = spl_fail(err, SPL_E_INPUT, "the map of station %u %s", station + 1, fault);
    else if (!(codes = spl_alloc(spl_map_range_words(&row), sizeof *codes, err)))
        rc = SPL_E_NOMEM;
    for (size_t t = 0; !rc && t < texels; t++)
        spl_map_set_code(codes, t, spl_map_code_of_range(&row, (double)ranges.texels[t]));
    spl_ranges_finish(&ranges);
    if (rc)
        return rc;
    p->station_of[p->count] = station;
    p->codes[p->count] = codes;
    p->rows[p->count++] = row;
    p->row_of[station] = (uint16_t)p->count;
    return SPL_OK;
}

static int make_all_ranges(struct spl_map_pass *p, struct spl_error *err)
{
    uint32_t count = p->stations.count;
    p->rows = spl_alloc(count, sizeof *p->rows, err);
    p->codes = spl_alloc(count, sizeof *p->codes, err);
    p->station_of = spl_alloc(count, sizeof *p->station_of, err);
    p->row_of = spl_alloc(count, sizeof *p->row_of, err);
    if (!p->rows || !p->codes || !p->station_of || !p->row_of)
        return SPL_E_NOMEM;
    int rc = spl_hits_find_noise(&p->splats, &p->stations, p->stage->threads, &p->slack, err);
    p->slack *= 3;
    spl_stage_begin(p->stage, "ranges of stations", NULL, count);
    for (uint32_t s = 0; s < count && !rc; s++) {
        struct spl_hits hits;
        if ((rc = spl_hits_init(&hits, &p->splats, &p->stations, s, NULL, p->stage->threads, err)))
            break;
        if (hits.count)
            rc = make_ranges(p, s, &hits, err);
        if (!rc)
            spl_map_check_sight(p, s, hits.count, hits.count ? (double)p->rows[p->count - 1].near : 0);
        spl_hits_finish(&hits);
        spl_stage_add(p->stage, 1, 0);
        if (!rc)
            rc = spl_stage_check(p->stage, err);
    }
    spl_stage_end(p->stage);
    if (!rc && !p->count)
        rc = spl_fail_field(err, SPL_E_INPUT, "panoramas", "no station sees a splat: are the panoramas' poses in the "
                                                           "scan's coordinates?");
    return rc;
}

static int find_chunks(struct spl_map_pass *p, struct spl_error *err)
{
    struct spl_map_sight *maps = spl_alloc(p->count, sizeof *maps, err);
    struct spl_stations drawn = p->stations;
    uint16_t *of = NULL;
    p->chunks = spl_alloc(p->drawn.chunk_count, sizeof *p->chunks, err);
    p->seen = spl_alloc(p->drawn.chunk_count, sizeof *p->seen, err);
    int rc = maps && p->chunks && p->seen ? SPL_OK : SPL_E_NOMEM;
    if (!rc && p->drawn.dataset != p->splats.dataset) {
        rc = spl_stations_place(&p->stations, &p->splats, &p->drawn, p->stage, &of, err);
        drawn.of = of;
    }
    for (uint32_t row = 0; !rc && row < p->count; row++)
        maps[row] = (struct spl_map_sight){&p->rows[row], p->codes[row]};
    if (!rc)
        rc = spl_map_find_chunks(&p->drawn, &drawn, p->row_of, maps, p->stage, p->chunks, p->seen, err);
    free(maps);
    free(of);
    return rc;
}

static int prune(struct spl_map_pass *p, const struct spl_dataset *dataset, uint32_t factor, struct spl_error *err)
{
    const struct spl_prune_options how = {.factor = factor, .seen = p->seen};
    struct spl_prune_report report;
    if (factor <= 1)
        return SPL_OK;
    if (!(p->leaf = spl_alloc(p->drawn.node_count, sizeof *p->leaf, err)))
        return SPL_E_NOMEM;
    return spl_prune_plan(dataset, &how, p->leaf, &report, p->stage, err);
}

int spl_map_pass_refuse(struct spl_map_pass *p, int rc, const struct spl_error *why, struct spl_error *err)
{
    if (rc == SPL_OK)
        return rc;
    if (!p->options->refused || rc == SPL_E_NOMEM || rc == SPL_E_CANCELLED) {
        *err = *why;
        return rc;
    }
    p->options->refused(p->options->context, why);
    p->report->refused++;
    return SPL_OK;
}

static int add_picture(struct spl_map_pass *p, struct spl_atlas *atlas, uint32_t station,
                       const struct spl_inverse_ranges *inverse, const struct spl_named_view *view,
                       struct spl_error *err)
{
    struct spl_image image = {0};
    struct spl_image_info info;
    struct spl_pyramid pixels;
    bool panorama = view->inner && view->inner->is_panorama;
    int rc = spl_photo_image_get_info(view, &info, err);
    if (!rc)
        rc = panorama ? spl_photo_image_load_whole(view, &image, err) : spl_photo_image_load(view, &image, err);
    if (!rc && !panorama && (image.width != view->camera.width || image.height != view->camera.height)) {
        rc = spl_fail_field(err, SPL_E_INPUT, "width", "%s: %u x %u pixels; its camera says %u x %u", view->photograph,
                            image.width, image.height, view->camera.width, view->camera.height);
        spl_image_finish(&image);
    }
    if (!rc && !(rc = spl_pyramid_init(&pixels, &image, err))) {
        spl_colors_add_picture(atlas, &p->stations.list[station], inverse, view, &pixels, p->stage->threads);
        spl_pyramid_finish(&pixels);
    }
    return rc;
}

int spl_map_pass_make_colors(struct spl_map_pass *p, uint32_t row, uint32_t side, struct spl_atlas *atlas,
                             struct spl_error *err)
{
    static const float even[3] = {1, 1, 1};
    uint32_t station = p->station_of[row];
    struct spl_ranges ranges = {.side = p->rows[row].range_side};
    const struct spl_named_view *last = NULL;
    struct spl_inverse_ranges inverse = {0};
    struct spl_hits hits = {0};
    size_t texels = 2 * spl_map_range_words(&p->rows[row]);
    int rc = spl_atlas_init(atlas, side, err);
    if (!rc && !(ranges.texels = spl_alloc_raw(texels, sizeof *ranges.texels, err)))
        rc = SPL_E_NOMEM;
    for (size_t t = 0; !rc && t < texels; t++)
        ranges.texels[t] = (float)spl_map_range_of_code(&p->rows[row], spl_map_get_code(p->codes[row], t));
    if (!rc)
        rc = spl_inverse_ranges_init(&inverse, &ranges, err);
    for (size_t v = 0; v < p->views->count && !rc; v++) {
        struct spl_error why = {0};
        if (p->stations.of_view[v] != station || !p->views->views[v].photograph)
            continue;
        if (spl_map_is_same_picture(last, &p->views->views[v])) {
            spl_stage_add(p->stage, 1, 0);
            continue;
        }
        last = &p->views->views[v];
        if ((rc = add_picture(p, atlas, station, &inverse, last, &why))) {
            for (size_t face = v; face < p->views->count; face++)
                if (face == v || spl_map_is_same_picture(last, &p->views->views[face]))
                    p->stations.of_view[face] = UINT32_MAX;
            rc = spl_map_pass_refuse(p, rc, &why, err);
        }
        spl_stage_add(p->stage, 1, 0);
        if (!rc)
            rc = spl_stage_check(p->stage, err);
    }
    if (!rc && !spl_atlas_is_full(atlas)) {
        const struct spl_map_sight map = {&p->rows[row], p->codes[row]};
        rc = spl_hits_init(&hits, &p->splats, &p->stations, station, &map, p->stage->threads, err);
        if (!rc)
            spl_colors_add_hits(atlas, &hits, &inverse, p->factors ? p->factors[row] : even, p->stage->threads);
        spl_hits_finish(&hits);
    }
    if (!rc)
        rc = spl_atlas_fill(atlas, p->stage->threads, err);
    spl_inverse_ranges_finish(&inverse);
    spl_ranges_finish(&ranges);
    return rc;
}

/* The words of a map: ranges, then each level of the colours, which is halved from the one before. */
static int get_map(void *context, uint32_t index, const uint32_t **words, struct spl_error *err)
{
    struct spl_map_pass *p = context;
    const struct spl_map_row *row = &p->rows[index];
    struct spl_atlas atlas = {0};
    free(p->words);
    p->words = spl_alloc_raw(spl_map_words(row), sizeof *p->words, err);
    int rc = p->words ? spl_map_pass_make_colors(p, index, row->side, &atlas, err) : SPL_E_NOMEM;
    if (!rc)
        spl_atlas_scale(&atlas, p->factors[index]);
    if (!rc)
        memcpy(p->words, p->codes[index], spl_map_range_words(row) * sizeof *p->words);
    if (!rc)
        rc = spl_map_edit(&p->edits, &p->out, index, row, p->words, &atlas, err);
    for (uint32_t level = 0; level < row->levels && !rc; level++) {
        struct spl_atlas half = {0};
        p->errors += spl_atlas_encode(&atlas, p->stage->threads, p->words + spl_map_level_word(row, level));
        p->texels += (double)atlas.width * atlas.height;
        if (level + 1 < row->levels)
            rc = spl_atlas_halve(&atlas, p->stage->threads, &half, err);
        spl_atlas_finish(&atlas);
        atlas = half;
    }
    spl_atlas_finish(&atlas);
    spl_stage_add(p->stage, 1, 0);
    *words = p->words;
    return rc;
}

struct loading {
    const struct spl_map_options *options;
    struct spl_map_report *report;
};

static void refuse_picture(void *context, const struct spl_error *why)
{
    struct loading *loading = context;
    loading->report->refused++;
    loading->options->refused(loading->options->context, why);
}

static int open_files(const struct spl_map_options *options, struct spl_map_edits *edits, struct spl_map_export *out,
                      struct spl_error *err)
{
    int rc = options->edits ? spl_map_edits_init(edits, options->edits, err) : SPL_OK;
    return rc || !options->export_to ? rc : spl_map_export_init(out, options->export_to, err);
}

int spl_maps_check(const struct spl_map_options *options, struct spl_error *err)
{
    struct spl_map_edits edits = {0};
    struct spl_map_export out = {0};
    int rc = open_files(options, &edits, &out, err);
    spl_map_export_finish(&out);
    spl_map_edits_finish(&edits);
    return rc;
}

int spl_maps_load(const struct spl_map_options *options, const struct spl_map_sources *found,
                  struct spl_view_list *list, struct spl_map_report *report, struct spl_error *err)
{
    struct loading loading = {options, report};
    const struct spl_map_picture_options how = {.paths = found->count ? (const char *const *)found->paths
                                                                      : &options->panoramas,
                                                .count = found->count ? found->count : options->panoramas != NULL,
                                                .images = options->images,
                                                .refuse = options->refused ? refuse_picture : NULL,
                                                .context = &loading};
    int rc = how.count ? spl_map_pictures_load(&how, list, err) : SPL_OK;
    report->pictures = report->refused;
    for (size_t v = 0; v < list->count; v++)
        report->pictures += !(v && spl_map_is_same_picture(&list->views[v - 1], &list->views[v]));
    return rc;
}

static void name_nowhere(void *context, const struct spl_named_view *view, double units)
{
    struct spl_map_pass *p = context;
    struct spl_error why = {0};
    spl_fail(&why, SPL_E_INPUT, "%s: stands %.3g m away from the nearest station, beyond half a metre",
             view->photograph ? view->photograph : view->name, units * p->metre);
    p->report->refused++;
    if (p->options->refused)
        p->options->refused(p->options->context, &why);
}

int spl_maps_apply(const struct spl_pack_options *options, const struct spl_view_list *views,
                   const struct spl_dataset *dataset, const struct spl_dataset *points, struct spl_stage *stage,
                   struct spl_map_report *report, struct spl_error *err)
{
    struct spl_map_pass p = {
        .pack = options, .options = options->maps, .views = views, .stage = stage, .report = report};
    uint64_t begin_ns = spl_now_ns();
    json_t *about = NULL;
    if (!spl_unit_parse(spl_dataset_get_info(dataset)->unit, &p.metre) || !(p.metre > 0))
        p.metre = 1;
    int rc = open_files(options->maps, &p.edits, &p.out, err);
    if (rc || (rc = spl_splats_init(&p.drawn, dataset, err)) || (rc = spl_splats_init(&p.splats, points, err)) ||
        (rc = spl_stations_init(&p.stations, &p.splats, views, stage, name_nowhere, &p, err)) ||
        (rc = spl_map_check_any(&p, err)) || (rc = make_all_ranges(&p, err)) || (rc = find_chunks(&p, err)) ||
        (rc = spl_map_check_pictures(&p, err)) || (rc = prune(&p, dataset, options->prune, err)))
        goto done;
    about = json_pack("{s:i}", "pictures", (int)(report->pictures - report->refused));
    const struct spl_rewrite rewrite = {.from = dataset,
                                        .maps = p.rows,
                                        .map_count = p.count,
                                        .stations = p.chunks,
                                        .get_map = get_map,
                                        .context = &p,
                                        .leaf = p.leaf,
                                        .leaf_radius = spl_prune_leaf_radius(dataset),
                                        .about_maps = about};
    spl_stage_begin(stage, "maps", NULL, p.count + spl_map_count_placed(&p));
    rc = spl_dataset_rewrite(&rewrite, options->output, err);
    spl_stage_end(stage);
    if (!rc && p.out.folder)
        rc = spl_map_export_commit(&p.out, err);
    report->stations = p.count;
    report->edits = (uint32_t)json_array_size(p.edits.list);
    report->edited = (uint32_t)p.edits.taken;
    if (!rc && report->edited < report->edits)
        spl_map_warn(&p, "--maps %s: %u of its %u maps are of no station of this dataset, and were not taken",
                     p.edits.folder, report->edits - report->edited, report->edits);
    for (uint32_t row = 0; row < p.count; row++) {
        report->side = p.rows[row].side > report->side ? p.rows[row].side : report->side;
        report->texels += 6ull * p.rows[row].side * p.rows[row].side;
        report->bytes += spl_map_words(&p.rows[row]) * sizeof(uint32_t);
    }
    report->block_psnr = p.errors > 0 ? 10 * log10(255 * 255 * 3 * p.texels / p.errors) : INFINITY;
    report->seconds = (double)(spl_now_ns() - begin_ns) / 1e9;
done:
    for (uint32_t row = 0; row < p.count; row++)
        free(p.codes[row]);
    json_decref(about);
    free(p.codes);
    free(p.rows);
    free(p.station_of);
    free(p.row_of);
    free(p.chunks);
    free(p.seen);
    free(p.factors);
    free(p.leaf);
    free(p.words);
    spl_map_export_finish(&p.out);
    spl_map_edits_finish(&p.edits);
    spl_stations_finish(&p.stations);
    spl_splats_finish(&p.splats);
    spl_splats_finish(&p.drawn);
    return rc;
}
