/* Statistics over a sweep's results. The profile has what a planner and a chart want; JSON adds each view's figures and
 * the stages. Pure but for allocation; any thread. */
#include "measure/report.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "measure/record.h"
#include "shared.h"

void spl_report_setting_name(const struct spl_setting *s, char name[64])
{
    int used = snprintf(name, 64, "%s lod=%g", spl_method_name(s->method), s->lod);
    if (s->supersample != 1)
        used += snprintf(name + used, 64 - (size_t)used, " %g×%g", s->supersample, s->supersample);
    if (s->atoms < SPL_TEXTURE_ATOMS)
        used += snprintf(name + used, 64 - (size_t)used, " atoms=%u", s->atoms);
    if (s->maps)
        used += snprintf(name + used, 64 - (size_t)used, " maps=%s", spl_setting_maps_name(s->maps));
    if (s->soft)
        snprintf(name + used, 64 - (size_t)used, " soft=%s", spl_setting_soft_name(s->soft));
}

/* Times of one setting, view and size over the repeats, through `pick`. */
static struct spl_summary over_repeats(const struct spl_sweep *sweep, size_t setting, size_t view,
                                       enum spl_sweep_size size, double (*pick)(const struct spl_sweep_time *))
{
    double values[SPL_SWEEP_REPEATS_MAX];
    for (uint32_t r = 0; r < sweep->options->repeats; r++)
        values[r] = pick(spl_sweep_get_time(sweep, setting, view, size, r));
    return spl_summarise(values, sweep->options->repeats);
}

static double pick_ms(const struct spl_sweep_time *t)
{
    return t->ms;
}

static double pick_device(const struct spl_sweep_time *t)
{
    return t->clear_ms + t->depth_ms + t->shade_ms + t->soft_ms + t->resolve_ms;
}

#define STAGE(name)                                                                                                    \
    static double pick_##name(const struct spl_sweep_time *t)                                                          \
    {                                                                                                                  \
        return t->name##_ms;                                                                                           \
    }
#include "render/stages.def"
#undef STAGE

static const struct {
    const char *name;
    double (*pick)(const struct spl_sweep_time *);
} stages[] = {
#define STAGE(name) {#name, pick_##name},
#include "render/stages.def"
#undef STAGE
};
enum { STAGES = sizeof stages / sizeof *stages };

/* Median over the views of the median over the repeats; `values` is scratch, one a view, and left sorted. */
static double over_views(const struct spl_sweep *sweep, size_t setting, enum spl_sweep_size size,
                         double (*pick)(const struct spl_sweep_time *), double *values)
{
    size_t views = sweep->options->views->count;
    for (size_t v = 0; v < views; v++)
        values[v] = over_repeats(sweep, setting, v, size, pick).median;
    return spl_summarise(values, views).median;
}

static double megapixels(const struct spl_camera *c, enum spl_sweep_size size)
{
    uint32_t half = size == SPL_SWEEP_HALF;
    return 1e-6 * ((c->width + half) >> half) * ((c->height + half) >> half);
}

static void fill_times(struct spl_report *report, size_t setting, double *values)
{
    const struct spl_sweep *sweep = report->sweep;
    size_t views = sweep->options->views->count;
    struct spl_profile_point *p = &report->profile.points[setting];
    p->ms = over_views(sweep, setting, SPL_SWEEP_FULL, pick_ms, values);
    p->ms_q90 = fmax(spl_quantile(values, views, 0.9), p->ms);
    double ms[SPL_SWEEP_SIZES] = {p->ms, over_views(sweep, setting, SPL_SWEEP_HALF, pick_ms, values)},
           mpx[SPL_SWEEP_SIZES];
    for (int size = 0; size < SPL_SWEEP_SIZES; size++) {
        for (size_t v = 0; v < views; v++)
            values[v] = megapixels(&sweep->options->views->views[v].camera, (enum spl_sweep_size)size);
        mpx[size] = spl_summarise(values, views).median;
    }
    spl_profile_fit_time(mpx, ms, SPL_SWEEP_SIZES, &p->fixed_ms, &p->ms_per_mpx);
    p->soft_ms = p->setting.soft ? fmin(over_views(sweep, setting, SPL_SWEEP_FULL, pick_soft, values), p->ms)
                                 : (double)NAN;
}

/* Mean over the views of `power` of what lies at `offset` of their metrics, without NANs; NAN where there is none. */
static double mean_of(const struct spl_sweep *sweep, size_t setting, size_t offset, double power)
{
    double sum = 0;
    size_t count = 0;
    for (size_t v = 0; v < sweep->options->views->count; v++) {
        const char *metrics = (const char *)&spl_sweep_get_accuracy(sweep, setting, v)->metrics;
        double value = *(const double *)(metrics + offset);
        if (isnan(value))
            continue;
        sum += pow(value, power);
        count++;
    }
    return count ? sum / (double)count : (double)NAN;
}

static void fill_accuracy(struct spl_report *report, size_t setting, double *values)
{
    const struct spl_sweep *sweep = report->sweep;
    struct spl_profile_point *p = &report->profile.points[setting];
    size_t views = sweep->options->views->count, count = 0;
    double sum = 0, squares = 0;
    for (size_t v = 0; v < views; v++) {
        double psnr = spl_sweep_get_accuracy(sweep, setting, v)->metrics.psnr;
        if (isnan(psnr))
            continue;
        psnr = fmin(psnr, SPL_PROFILE_PSNR_MAX);
        values[count++] = psnr;
        sum += psnr;
    }
    for (size_t i = 0; i < count; i++)
        squares += pow(values[i] - sum / (double)count, 2);
    spl_summarise(values, count);
    p->psnr = count ? sum / (double)count : (double)NAN;
    p->psnr_sd = count > 1 ? sqrt(squares / (double)(count - 1)) : (double)NAN;
    p->psnr_q05 = count ? spl_quantile(values, count, 0.05) : (double)NAN;
    p->ssim = mean_of(sweep, setting, offsetof(struct spl_metrics, ssim), 1);
    p->depth_rmse = sqrt(mean_of(sweep, setting, offsetof(struct spl_metrics, depth_rmse), 2));
    p->depth_beyond = mean_of(sweep, setting, offsetof(struct spl_metrics, depth_beyond), 1);
    p->holes = mean_of(sweep, setting, offsetof(struct spl_metrics, holes), 1);
    p->see_through = mean_of(sweep, setting, offsetof(struct spl_metrics, see_through), 1);
    p->halo = mean_of(sweep, setting, offsetof(struct spl_metrics, halo), 1);
    p->normal_mean = mean_of(sweep, setting, offsetof(struct spl_metrics, normal_mean), 1);
    for (size_t v = 0; v < views; v++)
        values[v] = spl_sweep_get_accuracy(sweep, setting, v)->splats;
    p->splats = spl_summarise(values, views).median;
}

/* PSNR of all views' pixels together. */
static double psnr_overall(const struct spl_sweep *sweep, size_t setting)
{
    double error = 0;
    size_t count = 0;
    for (size_t v = 0; v < sweep->options->views->count; v++) {
        double psnr = spl_sweep_get_accuracy(sweep, setting, v)->metrics.psnr;
        if (isnan(psnr))
            continue;
        error += pow(10, -fmin(psnr, SPL_PROFILE_PSNR_MAX) / 10);
        count++;
    }
    return count ? -10 * log10(error / (double)count) : (double)NAN;
}

struct spl_report_dense spl_report_get_dense(const struct spl_sweep *sweep, size_t setting)
{
    double weight = 0, error = 0;
    struct spl_report_dense d = {0};
    size_t views = sweep->options->views->count;
    for (size_t v = 0; v < views; v++) {
        const struct spl_sweep_accuracy *a = spl_sweep_get_accuracy(sweep, setting, v);
        if (!(a->dense_share > 0) || isnan(a->dense.psnr))
            continue;
        weight += a->dense_share;
        error += a->dense_share * pow(10, -fmin(a->dense.psnr, SPL_PROFILE_PSNR_MAX) / 10);
        d.depth_beyond += a->dense_share * a->dense.depth_beyond;
        d.holes += a->dense_share * a->dense.holes;
        d.see_through += a->dense_share * a->dense.see_through;
    }
    if (!weight)
        return (struct spl_report_dense){NAN, NAN, NAN, NAN, NAN};
    return (struct spl_report_dense){.share = weight / (double)views,
                                     .psnr = -10 * log10(error / weight),
                                     .depth_beyond = d.depth_beyond / weight,
                                     .holes = d.holes / weight,
                                     .see_through = d.see_through / weight};
}

int spl_report_init(struct spl_report *report, const struct spl_sweep *sweep, struct spl_error *err)
{
    const struct spl_sweep_options *o = sweep->options;
    *report = (struct spl_report){.sweep = sweep};
    size_t room = o->views->count > sweep->calibrator_count ? o->views->count : sweep->calibrator_count;
    double *values = spl_alloc(room, sizeof *values, err);
    int rc = values ? SPL_OK : SPL_E_NOMEM;
    if (!rc)
        rc =
            spl_profile_init(&report->profile, spl_dataset_get_info(o->dataset), &sweep->device, o->setting_count, err);
    if (!rc) {
        struct spl_profile *profile = &report->profile;
        snprintf(profile->reference, sizeof profile->reference, "%s", spl_reference_name(o->reference.kind));
        profile->views = (uint32_t)o->views->count;
        profile->width = o->views->views[0].camera.width;
        profile->height = o->views->views[0].camera.height;
        if (o->soft)
            profile->soft = *o->soft;
        for (size_t s = 0; s < o->setting_count; s++) {
            profile->points[s].setting = o->settings[s];
            fill_times(report, s, values);
            fill_accuracy(report, s, values);
        }
        spl_profile_mark_front(profile);
        memcpy(values, sweep->calibrator, sweep->calibrator_count * sizeof *values);
        report->calibrator = spl_summarise(values, sweep->calibrator_count);
    }
    free(values);
    return rc;
}

void spl_report_finish(struct spl_report *report)
{
    spl_profile_finish(&report->profile);
    memset(report, 0, sizeof *report);
}

/* ------------------------------------------------------------------------------------------------------------- JSON */

/* JSON has no NAN. */
static json_t *real(double value)
{
    return isfinite(value) ? json_real(value) : json_null();
}

static json_t *view_json(const struct spl_sweep *sweep, size_t setting, size_t view)
{
    struct spl_summary ms = over_repeats(sweep, setting, view, SPL_SWEEP_FULL, pick_ms);
    const struct spl_sweep_accuracy *a = spl_sweep_get_accuracy(sweep, setting, view);
    return json_pack("{s:s, s:{s:f, s:f, s:f, s:f, s:f}, s:f, s:o, s:o, s:o, s:f, s:b}", "view",
                     sweep->options->views->views[view].name, "ms", "min", ms.min, "q1", ms.q1, "median", ms.median,
                     "q3", ms.q3, "max", ms.max, "device_ms",
                     over_repeats(sweep, setting, view, SPL_SWEEP_FULL, pick_device).median, "accuracy",
                     spl_record_metrics(&a->metrics), "dense", spl_record_metrics(&a->dense), "dense_share",
                     real(a->dense_share), "splats", a->splats, "complete", a->complete);
}

/* What the profile does not have of a setting: the spread, the device's part, the stages and each view. */
static int add_details(json_t *row, const struct spl_sweep *sweep, size_t setting, double *values)
{
    size_t views = sweep->options->views->count;
    double device = over_views(sweep, setting, SPL_SWEEP_FULL, pick_device, values);
    json_t *list = json_array(), *passes = json_object();
    int failed = 0;
    for (size_t i = 0; i < STAGES; i++)
        failed |= json_object_set_new(passes, stages[i].name,
                                      json_real(over_views(sweep, setting, SPL_SWEEP_FULL, stages[i].pick, values)));
    for (size_t v = 0; v < views; v++) {
        struct spl_summary ms = over_repeats(sweep, setting, v, SPL_SWEEP_FULL, pick_ms);
        values[v] = (ms.q3 - ms.q1) / ms.median;
        failed |= json_array_append_new(list, view_json(sweep, setting, v));
    }
    failed |= json_object_set_new(row, "spread", json_real(spl_summarise(values, views).median));
    double overall = psnr_overall(sweep, setting);
    failed |= json_object_set_new(row, "psnr_overall", real(overall));
    struct spl_report_dense d = spl_report_get_dense(sweep, setting);
    if (!isnan(d.share))
        failed |= json_object_set_new(row, "dense",
                                      json_pack("{s:o, s:o, s:o, s:o, s:o}", "share", real(d.share), "psnr",
                                                real(d.psnr), "depth_beyond", real(d.depth_beyond), "holes",
                                                real(d.holes), "see_through", real(d.see_through)));
    failed |= json_object_set_new(row, "device_ms", json_real(device));
    failed |= json_object_set_new(row, "stages_ms", passes);
    failed |= json_object_set_new(row, "views", list);
    return failed;
}

static json_t *peers_json(const struct spl_peers *peers)
{
    json_t *list = json_array();
    for (size_t i = 0; peers && i < peers->count; i++)
        json_array_append_new(list,
                              json_pack("{s:s%, s:f, s:f}", "name", peers->rows[i].name, strlen(peers->rows[i].name),
                                        "ms", peers->rows[i].ms, "psnr", peers->rows[i].psnr));
    return list;
}

json_t *spl_report_to_json(const struct spl_report *report, const struct spl_peers *peers)
{
    const struct spl_sweep *sweep = report->sweep;
    const struct spl_dataset_info *info = spl_dataset_get_info(sweep->options->dataset);
    json_t *root = spl_profile_to_json(&report->profile), *points = json_object_get(root, "points");
    double *values = spl_alloc(sweep->options->views->count, sizeof *values, NULL);
    int failed = !root || !values;
    for (size_t s = 0; !failed && s < report->profile.count; s++)
        failed |= add_details(json_array_get(points, s), sweep, s, values);
    const struct spl_summary *c = &report->calibrator;
    if (!failed) {
        failed |= json_object_set_new(root, "format", json_string("splatd-bench"));
        failed |= json_object_set_new(root, "leaf_splats", json_integer((json_int_t)info->leaf_splats));
        failed |= json_object_set_new(root, "repeats", json_integer(sweep->options->repeats));
        failed |= json_object_set_new(root, "calibrator_ms",
                                      json_pack("{s:f, s:f, s:f, s:f, s:f}", "min", c->min, "q1", c->q1, "median",
                                                c->median, "q3", c->q3, "max", c->max));
        failed |= json_object_set_new(root, "peers", peers_json(peers));
    }
    free(values);
    if (failed) {
        json_decref(root);
        return NULL;
    }
    return root;
}

/* -------------------------------------------------------------------------------------------------------------- CSV */

/* A number, nothing where there is none. */
static void put(FILE *out, double value)
{
    if (isnan(value))
        fputs(",", out);
    else
        fprintf(out, ",%.6g", value);
}

int spl_report_to_csv(const struct spl_report *report, char **csv, size_t *length, struct spl_error *err)
{
    const struct spl_sweep *sweep = report->sweep;
    *csv = NULL;
    *length = 0;
    double *values = spl_alloc(sweep->options->views->count, sizeof *values, err);
    FILE *out = values ? open_memstream(csv, length) : NULL;
    if (!out) {
        free(values);
        return spl_fail(err, SPL_E_NOMEM, "out of memory: the table could not be written");
    }
    fputs("method,lod,supersample,atoms,front,ms,ms_q90,device_ms,splats,psnr,psnr_overall,psnr_sd,psnr_q05,ssim,"
          "depth_rmse,depth_beyond,"
          "holes,see_through,halo,normal_mean,dense_share,dense_psnr,dense_depth_beyond,dense_holes,"
          "dense_see_through,maps,soft_model,soft_ms\n",
          out);
    for (size_t s = 0; s < report->profile.count; s++) {
        const struct spl_profile_point *p = &report->profile.points[s];
        fprintf(out, "%s,%g,%g,%u,%d", spl_method_name(p->setting.method), p->setting.lod, p->setting.supersample,
                p->setting.atoms, p->front);
        struct spl_report_dense d = spl_report_get_dense(sweep, s);
        const double numbers[] = {
            p->ms,          p->ms_q90,       over_views(sweep, s, SPL_SWEEP_FULL, pick_device, values),
            p->splats,      p->psnr,         psnr_overall(sweep, s),
            p->psnr_sd,     p->psnr_q05,     p->ssim,
            p->depth_rmse,  p->depth_beyond, p->holes,
            p->see_through, p->halo,         p->normal_mean,
            d.share,        d.psnr,          d.depth_beyond,
            d.holes,        d.see_through};
        for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
            put(out, numbers[i]);
        fprintf(out, ",%s,%s", spl_setting_maps_name(p->setting.maps), spl_setting_soft_name(p->setting.soft));
        put(out, p->soft_ms);
        fputc('\n', out);
    }
    free(values);
    if (fclose(out)) {
        free(*csv);
        *csv = NULL;
        return spl_fail(err, SPL_E_NOMEM, "out of memory: the table could not be written");
    }
    return SPL_OK;
}
