/* splatd bench -o: views and settings put together, one sweep, its files written. Everything that can be refused
 * without a device is refused before one is opened. */
#include "cmd/bench.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "cmd/output.h"
#include "cmd/progress.h"
#include "geom/size.h"
#include "measure/peers.h"
#include "measure/report.h"
#include "shared.h"

struct progress {
    struct spl_cmd_progress line;
    uint64_t begin_ns;
    const char *stage;
};

static void show_progress(void *context, const char *stage, uint64_t done, uint64_t total)
{
    struct progress *p = context;
    if (p->stage != stage) {
        p->stage = stage;
        p->begin_ns = spl_now_ns();
    }
    double seconds = (double)(spl_now_ns() - p->begin_ns) / SPL_NS_PER_S;
    struct spl_progress now = {
        .stage = stage, .done = done, .total = total, .rate = seconds > 0 ? (double)done / seconds : 0};
    spl_cmd_progress(&p->line, &now);
}

/* ------------------------------------------------------------------------------------------------- views and settings
 */

static int views_of_path(const struct spl_cmd_bench_sweep *o, const struct spl_dataset *dataset,
                         struct spl_view_list *list, struct spl_error *err)
{
    struct spl_path orbit;
    int rc = o->path ? SPL_OK : spl_path_orbit(&orbit, dataset, err);
    if (rc)
        return rc;
    const struct spl_path *path = o->path ? o->path : &orbit;
    double size[2] = {o->width, o->height};
    spl_size_follow(size, (const double[]){SPL_WIDTH_DEFAULT, SPL_HEIGHT_DEFAULT});
    list->views = spl_alloc(o->places, sizeof *list->views, err);
    if (!list->views)
        return SPL_E_NOMEM;
    for (uint32_t i = 0; !rc && i < o->places; i++) {
        struct spl_named_view *view = &list->views[list->count++];
        /* A path that turns all the way round would see its first place twice. */
        double share = o->places > 1 ? (double)i / (path->turn != 0 ? o->places : o->places - 1) : 0;
        if (asprintf(&view->name, "place-%u", i + 1) < 0) {
            view->name = NULL;
            return spl_fail(err, SPL_E_NOMEM, "out of memory: a view's name");
        }
        rc = spl_path_get_camera(path, share, (uint32_t)size[0], (uint32_t)size[1], &view->camera, err);
    }
    return rc;
}

/* Views from a file at another size: the same field of view. */
static void resize(struct spl_view_list *list, uint32_t width, uint32_t height)
{
    for (size_t i = 0; i < list->count; i++) {
        struct spl_camera *c = &list->views[i].camera;
        double size[2] = {width, height};
        spl_size_follow(size, (const double[]){c->width, c->height});
        spl_camera_resize(c, (uint32_t)fmin(size[0], UINT32_MAX), (uint32_t)fmin(size[1], UINT32_MAX));
    }
}

static int make_views(const struct spl_cmd_bench_sweep *o, const struct spl_dataset *dataset,
                      struct spl_view_list *list, struct spl_error *err)
{
    int rc = o->views ? spl_view_list_load(list, o->views, err) : views_of_path(o, dataset, list, err);
    if (!rc && o->views && (o->width || o->height))
        resize(list, o->width, o->height);
    struct spl_view view;
    spl_view_init(&view);
    for (size_t i = 0; !rc && i < list->count; i++) {
        struct spl_error why = {0};
        view.camera = list->views[i].camera;
        rc = spl_view_check(&view, &why);
        if (rc)
            spl_fail_field(err, rc, why.field, "view '%s': %s", list->views[i].name, why.message);
    }
    if (!rc)
        rc = spl_reference_check_poses(list, spl_dataset_get_info(dataset), err);
    return rc;
}

static int add_setting(struct spl_setting *settings, size_t *count, const struct spl_setting *s, struct spl_error *err)
{
    char name[64];
    spl_report_setting_name(s, name);
    for (size_t i = 0; i < *count; i++)
        if (spl_setting_equal(&settings[i], s))
            return spl_fail(err, SPL_E_USAGE, "the setting %s is asked for twice", name);
    settings[(*count)++] = *s;
    return SPL_OK;
}

/* The settings that are `s` but for maps and atoms: with maps, which textures give way to, then without. */
static int add_colors(const struct spl_cmd_bench_sweep *o, const struct spl_dataset_info *info, struct spl_setting s,
                      struct spl_setting *settings, size_t *count, struct spl_error *err)
{
    bool mapped = info->maps && spl_setting_has_maps(s.method);
    bool textured = info->atoms && spl_method_has_textures(s.method);
    int rc = SPL_OK;
    s.atoms = SPL_TEXTURE_ATOMS;
    s.maps = SPL_SETTING_MAPS_ON;
    if (mapped && o->maps != SPL_SETTING_MAPS_OFF)
        rc = add_setting(settings, count, &s, err);
    if (mapped && o->maps == SPL_SETTING_MAPS_ON)
        return rc;
    s.maps = mapped ? SPL_SETTING_MAPS_OFF : SPL_SETTING_NO_MAPS;
    for (size_t i = 0; !rc && i < (textured ? o->atom_count : 1); i++) {
        s.atoms = textured ? o->atoms[i] : SPL_TEXTURE_ATOMS;
        rc = add_setting(settings, count, &s, err);
    }
    return rc;
}

/* Every combination; where maps or textures make no difference there is one. */
static int make_settings(const struct spl_cmd_bench_sweep *o, const struct spl_dataset_info *info,
                         struct spl_setting **out, size_t *count, struct spl_error *err)
{
    *count = 0;
    if (o->atoms_listed && !info->atoms)
        return spl_fail(err, SPL_E_USAGE, "--atoms is about textures, and dataset '%s' has none", info->id);
    *out = spl_alloc(o->method_count * o->lod_count * o->supersample_count * (o->atom_count + 1) * o->soft_count,
                     sizeof **out, err);
    if (!*out)
        return SPL_E_NOMEM;
    const size_t each = o->method_count * o->lod_count * o->supersample_count;
    int rc = SPL_OK;
    for (size_t i = 0; !rc && i < each * o->soft_count; i++) {
        const struct spl_soft_params *soft = &o->softs[i / each];
        struct spl_setting s = {.method = o->methods[i % each / o->supersample_count / o->lod_count],
                                .lod = o->lods[i / o->supersample_count % o->lod_count],
                                .supersample = o->supersamples[i % o->supersample_count],
                                .soft = soft->what.count ? 1 + (uint32_t)soft->model : 0};
        rc = add_colors(o, info, s, *out, count, err);
    }
    if (!rc && *count > SPL_PROFILE_POINTS_MAX)
        rc = spl_fail(err, SPL_E_USAGE,
                      "%zu settings are more than the %d that are compared at once: fewer of --method, --lod, "
                      "--supersample or --soft-model",
                      *count, (int)SPL_PROFILE_POINTS_MAX);
    return rc;
}

/* ------------------------------------------------------------------------------------------------------------- output
 */

static int write_file(const char *folder, const char *name, const void *bytes, size_t length, struct spl_error *err)
{
    char path[4096];
    if ((size_t)snprintf(path, sizeof path, "%s/%s", folder, name) >= sizeof path)
        return spl_fail(err, SPL_E_USAGE, "the path '%.100s…' is too long", folder);
    return spl_cmd_write_output(path, bytes, length, err);
}

static int write_report(const struct spl_cmd_bench_sweep *o, const struct spl_report *report,
                        const struct spl_peers *peers, struct spl_error *err)
{
    char *svg = NULL, *html = NULL, *csv = NULL, *json = NULL;
    size_t svg_length = 0, html_length = 0, csv_length = 0;
    json_t *root = spl_report_to_json(report, peers);
    json = root ? json_dumps(root, JSON_INDENT(1) | JSON_REAL_PRECISION(6)) : NULL;
    json_decref(root);
    int rc = json ? SPL_OK : spl_fail(err, SPL_E_NOMEM, "out of memory: the report could not be written");
    if (!rc)
        rc = write_file(o->output, "bench.json", json, strlen(json), err);
    if (!rc)
        rc = spl_report_to_csv(report, &csv, &csv_length, err);
    if (!rc)
        rc = write_file(o->output, "bench.csv", csv, csv_length, err);
    if (!rc)
        rc = spl_report_chart(&report->profile, spl_dataset_get_info(report->sweep->options->dataset)->leaf_splats,
                              report->calibrator.median, peers, &svg, &svg_length, err);
    if (!rc)
        rc = write_file(o->output, "chart.svg", svg, svg_length, err);
    if (!rc)
        rc = spl_page_write(report, peers, svg, &html, &html_length, err);
    if (!rc)
        rc = write_file(o->output, "index.html", html, html_length, err);
    free(svg);
    free(html);
    free(csv);
    free(json);
    return rc;
}

static int write_profile(const struct spl_cmd_bench_sweep *o, const struct spl_profile *profile, struct spl_error *err)
{
    if (o->no_profile)
        return SPL_OK;
    char *path = o->profile ? strdup(o->profile) : spl_profile_path(o->dataset_path, err);
    int rc =
        path ? spl_profile_save(path, profile, err) : spl_fail(err, SPL_E_NOMEM, "out of memory: the profile's path");
    if (!rc)
        fprintf(stderr, "profile: %s\n", path);
    free(path);
    return rc;
}

static void print_table(const struct spl_report *r)
{
    printf("%-28s %9s %9s %8s %8s %8s %9s %11s %9s\n", "setting", "ms", "ms 90 %", "PSNR dB", "worst", "SSIM",
           "holes %", "see-thr. %", "beyond %");
    for (size_t i = 0; i < r->profile.count; i++) {
        const struct spl_profile_point *p = &r->profile.points[i];
        char name[64];
        spl_report_setting_name(&p->setting, name);
        int shown = p->setting.supersample == 1 ? 26 : 27; /* × is two bytes */
        printf("%s %-*s %9.2f %9.2f %8.2f %8.2f %8.4f %9.3f %11.3f %9.3f\n", p->front ? "*" : " ", shown, name, p->ms,
               p->ms_q90, p->psnr, p->psnr_q05, p->ssim, 100 * p->holes, 100 * p->see_through, 100 * p->depth_beyond);
    }
    struct spl_report_dense first = spl_report_get_dense(r->sweep, 0);
    for (size_t i = 0; i < r->profile.count && first.share > 0; i++) {
        char name[64];
        struct spl_report_dense d = spl_report_get_dense(r->sweep, i);
        if (!i)
            printf("\nwhere the scan has a point a pixel or more, %.1f %% of what is seen:\n", 100 * first.share);
        spl_report_setting_name(&r->profile.points[i].setting, name);
        int shown = r->profile.points[i].setting.supersample == 1 ? 25 : 26;
        printf("  %-*s PSNR %6.2f dB  holes %.3f %%  see-through %.3f %%  depth beyond a radius %.3f %%\n", shown, name,
               d.psnr, 100 * d.holes, 100 * d.see_through, 100 * d.depth_beyond);
    }
    printf("\n*: on the front, none is both faster and more accurate; calibrator %.1f ms (quartiles %.1f to %.1f)\n",
           r->calibrator.median, r->calibrator.q1, r->calibrator.q3);
}

int spl_cmd_bench_sweep(struct spl_cmd_bench_sweep *o, const struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_view_list views = {0};
    struct spl_setting *settings = NULL;
    struct spl_peers peers = {0};
    struct spl_sweep sweep = {0};
    struct spl_report report = {0};
    struct progress progress = {0};
    int rc = make_views(o, dataset, &views, err);
    if (!rc)
        rc = make_settings(o, spl_dataset_get_info(dataset), &settings, &o->sweep.setting_count, err);
    if (!rc && o->peers)
        rc = spl_peers_load(&peers, o->peers, err);
    if (rc)
        goto done;
    o->sweep.dataset = dataset;
    o->sweep.views = o->sweep.reference.views = &views;
    o->sweep.settings = settings;
    o->sweep.soft = o->soft_count > 1 ? &o->softs[1] : NULL;
    o->sweep.folder = o->output;
    o->sweep.progress = show_progress;
    o->sweep.progress_context = &progress;
    uint64_t begin = spl_now_ns();
    rc = spl_sweep_run(&o->sweep, &sweep, err);
    spl_cmd_progress_finish(&progress.line);
    if (rc) {
        fprintf(stderr, "splatd: what was measured so far is in %s; the same command goes on from there\n", o->output);
        goto done;
    }
    rc = spl_report_init(&report, &sweep, err);
    if (!rc)
        rc = write_report(o, &report, &peers, err);
    if (!rc)
        rc = write_profile(o, &report.profile, err);
    if (rc)
        goto done;
    double seconds = (double)(spl_now_ns() - begin) / SPL_NS_PER_S;
    if (sweep.resumed)
        fprintf(stderr, "went on from %zu results in %s/state.jsonl\n", sweep.resumed, o->output);
    fprintf(stderr, "%.1f s, %.0f %% of it rendering; open %s/index.html\n", seconds, 100 * sweep.rendering_s / seconds,
            o->output);
    print_table(&report);
done:
    spl_report_finish(&report);
    spl_sweep_finish(&sweep);
    spl_peers_finish(&peers);
    free(settings);
    spl_view_list_finish(&views);
    return rc;
}
