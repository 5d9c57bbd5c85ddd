/* Records of the sweep's state, by two tables: the measures and the times by name. JSON has no NAN and no infinity: a
 * measure that is missing is null, an infinite PSNR (nothing differs) is the text "equal". Pure; any thread. */
#include "measure/record.h"

#include <inttypes.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "base/array.h"

static const struct member {
    const char *name;
    size_t offset;
} measures[] =
    {
#define MEASURE(name)                                                                                                  \
    {                                                                                                                  \
#name, offsetof(struct spl_metrics, name)                                                                      \
    }
        MEASURE(psnr),  MEASURE(ssim),        MEASURE(depth_rmse), MEASURE(depth_median), MEASURE(depth_beyond),
        MEASURE(holes), MEASURE(see_through), MEASURE(halo),       MEASURE(normal_mean),  MEASURE(normal_median),
#undef MEASURE
},
  stages[] = {
    {"ms", offsetof(struct spl_sweep_time, ms)},
#define STAGE(name) {#name "_ms", offsetof(struct spl_sweep_time, name##_ms)},
#include "render/stages.def"
#undef STAGE
};
enum { MEASURES = sizeof measures / sizeof *measures, STAGES = sizeof stages / sizeof *stages };

static json_t *number(double value)
{
    return isfinite(value) ? json_real(value) : isnan(value) ? json_null() : json_string("equal");
}

static bool take_number(const json_t *value, double *out)
{
    const char *text = json_string_value(value);
    *out = json_is_number(value) ? json_number_value(value) : text ? (double)INFINITY : (double)NAN;
    return json_is_number(value) || json_is_null(value) || (text && !strcmp(text, "equal"));
}

static json_t *members(const void *object, const struct member *list, size_t count)
{
    json_t *out = json_object();
    for (size_t i = 0; out && i < count; i++)
        if (json_object_set_new(out, list[i].name, number(*(const double *)((const char *)object + list[i].offset)))) {
            json_decref(out);
            out = NULL;
        }
    return out;
}

static bool take_members(const json_t *record, void *object, const struct member *list, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (!take_number(json_object_get(record, list[i].name), (double *)((char *)object + list[i].offset)))
            return false;
    return true;
}

json_t *spl_record_metrics(const struct spl_metrics *metrics)
{
    return members(metrics, measures, MEASURES);
}

json_t *spl_record_accuracy(size_t setting, size_t view, const struct spl_sweep_accuracy *a)
{
    return json_pack("{s:I, s:I, s:o, s:o, s:o, s:f, s:b}", "setting", (json_int_t)setting, "view", (json_int_t)view,
                     "accuracy", spl_record_metrics(&a->metrics), "dense", spl_record_metrics(&a->dense), "dense_share",
                     number(a->dense_share), "splats", a->splats, "complete", a->complete);
}

json_t *spl_record_time(size_t setting, size_t view, enum spl_sweep_size size, size_t repeat,
                        const struct spl_sweep_time *time)
{
    return json_pack("{s:I, s:I, s:i, s:I, s:o}", "setting", (json_int_t)setting, "view", (json_int_t)view, "size",
                     (int)size, "repeat", (json_int_t)repeat, "time", members(time, stages, STAGES));
}

json_t *spl_record_calibrator(double ms)
{
    return json_pack("{s:f}", "calibrator_ms", ms);
}

static bool take_index(const json_t *record, const char *key, size_t count, size_t *out)
{
    const json_t *value = json_object_get(record, key);
    json_int_t i = json_integer_value(value);
    *out = (size_t)i;
    return json_is_integer(value) && i >= 0 && (uint64_t)i < count;
}

static bool take_calibrator(struct spl_sweep *sweep, double ms)
{
    size_t wanted = sweep->calibrator_count + 1;
    if (!(ms > 0) || spl_array_reserve(sweep->calibrator, sweep->calibrator_capacity, wanted, NULL))
        return false;
    sweep->calibrator[sweep->calibrator_count++] = ms;
    return true;
}

bool spl_record_take(struct spl_sweep *sweep, const json_t *record)
{
    const struct spl_sweep_options *o = sweep->options;
    const json_t *calibrator = json_object_get(record, "calibrator_ms");
    if (calibrator)
        return take_calibrator(sweep, json_number_value(calibrator));
    size_t setting, view, size, repeat;
    if (!take_index(record, "setting", o->setting_count, &setting) ||
        !take_index(record, "view", o->views->count, &view))
        return false;
    const json_t *metrics = json_object_get(record, "accuracy"), *time = json_object_get(record, "time");
    if (metrics) {
        struct spl_sweep_accuracy *a = spl_sweep_get_accuracy(sweep, setting, view);
        a->complete = json_is_true(json_object_get(record, "complete"));
        a->done = take_number(json_object_get(record, "splats"), &a->splats) && a->splats >= 0 && a->splats <= 1e18 &&
                  take_number(json_object_get(record, "dense_share"), &a->dense_share) &&
                  take_members(metrics, &a->metrics, measures, MEASURES) &&
                  take_members(json_object_get(record, "dense"), &a->dense, measures, MEASURES);
        return a->done;
    }
    if (!take_index(record, "size", SPL_SWEEP_SIZES, &size) || !take_index(record, "repeat", o->repeats, &repeat))
        return false;
    struct spl_sweep_time *t = spl_sweep_get_time(sweep, setting, view, (enum spl_sweep_size)size, repeat);
    t->done = take_members(time, t, stages, STAGES) && t->ms > 0;
    for (size_t i = 0; i < STAGES && t->done; i++) {
        const double ms = *(const double *)((const char *)t + stages[i].offset);
        t->done = ms >= 0 && ms <= 1e12;
    }
    return t->done;
}

static json_t *reals(const double *values, size_t count)
{
    json_t *out = json_array();
    for (size_t i = 0; out && i < count; i++)
        if (json_array_append_new(out, number(values[i]))) {
            json_decref(out);
            out = NULL;
        }
    return out;
}

static json_t *plan_view(const struct spl_named_view *view)
{
    const struct spl_camera *c = &view->camera;
    const double pinhole[] = {c->fx, c->fy, c->cx, c->cy, c->near, c->far};
    return json_pack("{s:s, s:I, s:I, s:o, s:o, s:o}", "name", view->name, "width", (json_int_t)c->width, "height",
                     (json_int_t)c->height, "eye", reals(c->eye, 3), "rotation", reals(c->rotation, 9), "pinhole",
                     reals(pinhole, 6));
}

static json_t *plan_setting(const struct spl_setting *s)
{
    json_t *out = json_pack("{s:s, s:f, s:f, s:i}", "method", spl_method_name(s->method), "lod", s->lod, "supersample",
                            s->supersample, "atoms", (int)s->atoms);
    if (out && s->maps && json_object_set_new(out, "maps", json_string(spl_setting_maps_name(s->maps)))) {
        json_decref(out);
        out = NULL;
    }
    if (out && s->soft && json_object_set_new(out, "soft_model", json_string(spl_setting_soft_name(s->soft)))) {
        json_decref(out);
        out = NULL;
    }
    return out;
}

/* What is soft where something is, and the model of the reference. */
static json_t *plan_soft(const struct spl_soft_params *soft)
{
    char terms[SPL_TERMS_TEXT_MAX + 1];
    if (!soft)
        return NULL;
    spl_soft_print(soft, terms, sizeof terms);
    return json_pack("{s:s, s:s, s:f, s:f, s:f}", "terms", terms, "model", spl_soft_model_name(soft->model), "opacity",
                     soft->opacity, "cover", soft->cover, "blend", soft->blend);
}

json_t *spl_record_plan(const struct spl_sweep *sweep, uint64_t reference_hash, struct spl_error *err)
{
    const struct spl_sweep_options *o = sweep->options;
    const struct spl_dataset_info *info = spl_dataset_get_info(o->dataset);
    char version[17], hash[17];
    snprintf(version, sizeof version, "%016" PRIx64, info->version);
    snprintf(hash, sizeof hash, "%016" PRIx64, reference_hash);
    json_t *views = json_array(), *settings = json_array();
    bool failed = false;
    for (size_t i = 0; i < o->views->count; i++)
        failed |= json_array_append_new(views, plan_view(&o->views->views[i])) != 0;
    for (size_t i = 0; i < o->setting_count; i++)
        failed |= json_array_append_new(settings, plan_setting(&o->settings[i])) != 0;
    json_t *plan = json_pack(
        "{s:i, s:s, s:{s:s, s:s}, s:{s:s, s:s, s:s}, s:{s:s, s:s}, s:o, s:o, s:o*, s:I}", "splatd-bench", 1, "program",
        SPLATD_VERSION, "dataset", "id", info->id, "version", version, "device", "backend", sweep->device.backend,
        "name", sweep->device.name, "driver", sweep->device.driver, "reference", "kind",
        spl_reference_name(o->reference.kind), "hash", hash, "views", views, "settings", settings, "soft",
        plan_soft(o->soft), "repeats", (json_int_t)o->repeats);
    if (plan && !failed)
        return plan;
    json_decref(plan);
    spl_fail(err, SPL_E_INPUT,
             "the plan cannot be written: a view's or the dataset's name is no UTF-8 text, or memory is out");
    return NULL;
}
