/* The sweep. Of a view only one reference and one frame are in memory at a time; results are some hundred bytes each,
 * kept as they come, so that a run that was stopped goes on. Owned by one thread, which owns the renderer. */
#include "measure/sweep.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/clock.h"
#include "base/memory.h"
#include "geom/size.h"
#include "measure/calibrator.h"
#include "measure/record.h"
#include "measure/state.h"
#include "measure/steady.h"
#include "measure/sweep_pictures.h"
#include "measure/tolerance.h"
#include "measure/truth.h"

enum { COMPARE_SAMPLES = 1 << 21 };           /* of one frame */
#define CALIBRATE_EVERY_NS (2 * SPL_NS_PER_S) /* of rendering: a calibrator takes about 0.1 s */

struct job {
    struct spl_sweep *sweep;
    const struct spl_sweep_options *options;
    struct spl_steady device;
    struct spl_calibrator *calibrator;
    struct spl_tolerance *tolerance;
    struct spl_state *state;
    uint64_t calibrated_ns; /* device.rendering_ns when the calibrator last ran */
    uint64_t done, total;   /* frames of this stage */
};

struct spl_sweep_accuracy *spl_sweep_get_accuracy(const struct spl_sweep *s, size_t setting, size_t view)
{
    return &s->accuracy[setting * s->options->views->count + view];
}

struct spl_sweep_time *spl_sweep_get_time(const struct spl_sweep *s, size_t setting, size_t view,
                                          enum spl_sweep_size size, size_t repeat)
{
    size_t pair = setting * s->options->views->count + view;
    return &s->times[(pair * SPL_SWEEP_SIZES + size) * s->options->repeats + repeat];
}

static void fill_view(const struct spl_sweep_options *o, size_t setting, size_t view, enum spl_sweep_size size,
                      struct spl_view *out)
{
    spl_view_init(out);
    out->camera = o->views->views[view].camera;
    spl_setting_apply_soft(&o->settings[setting], o->soft, out);
    if (size != SPL_SWEEP_FULL)
        spl_camera_resize(&out->camera, (out->camera.width + 1) / 2, (out->camera.height + 1) / 2);
}

static int get_reference(struct job *job, size_t view, bool soft, struct spl_image images[SPL_LAYER_COUNT],
                         struct spl_error *err)
{
    const struct spl_sweep_options *o = job->options;
    struct spl_reference reference = o->reference;
    reference.soft = soft ? o->soft : NULL;
    for (int losses = 0;; losses++) {
        struct spl_error why = {0};
        uint64_t begin = spl_now_ns();
        int rc = spl_reference_get(&reference, view, job->device.renderer, o->dataset, images, &why);
        if (o->reference.kind == SPL_REFERENCE_SELF)
            job->device.rendering_ns += spl_now_ns() - begin;
        if (!rc)
            return SPL_OK;
        if (!spl_steady_recover(&job->device, &why, losses))
            return spl_fail_field(err, rc, why.field, "%s", why.message);
    }
}

static void advance(struct job *job, const char *stage)
{
    job->done++;
    if (job->options->progress)
        job->options->progress(job->options->progress_context, stage, job->done, job->total);
}

/* -------------------------------------------------------------------------------------------------------- accuracy */

/* Marks where every point, one pixel each, shows the true surface. */
static int mark_dense(struct job *job, size_t v, struct spl_truth *t, struct spl_error *err)
{
    struct spl_view view;
    struct spl_frame frame;
    double ms;
    fill_view(job->options, 0, v, SPL_SWEEP_FULL, &view);
    view.method = SPL_METHOD_RAW;
    view.lod = 0;
    view.supersample = 1;
    view.layers = 1u << SPL_LAYER_DEPTH;
    int rc = spl_steady_render(&job->device, &view, &frame, &ms, err);
    if (rc)
        return rc;
    rc = spl_truth_mark_dense(t, &frame.images[SPL_LAYER_DEPTH], err);
    spl_frame_finish(&frame);
    return rc;
}

static int get_truth(struct job *job, size_t v, bool soft, struct spl_truth *t, struct spl_error *err)
{
    const struct spl_sweep_options *o = job->options;
    const struct spl_camera *camera = &o->views->views[v].camera;
    int rc = spl_truth_init(t, camera->width, camera->height, err);
    if (!rc)
        rc = get_reference(job, v, soft, t->images, err);
    if (!rc && o->reference.kind == SPL_REFERENCE_EXACT && t->images[SPL_LAYER_DEPTH].pixels)
        rc = mark_dense(job, v, t, err);
    return rc;
}

static int compare(struct job *job, size_t setting, size_t v, const struct spl_truth *t, struct spl_error *err)
{
    const struct spl_sweep_options *o = job->options;
    struct spl_sweep_accuracy *a = spl_sweep_get_accuracy(job->sweep, setting, v);
    struct spl_view view;
    fill_view(o, setting, v, SPL_SWEEP_FULL, &view);
    view.background[3] = 0;
    view.layers = 1u << SPL_LAYER_COLOR | 1u << SPL_LAYER_DEPTH | 1u << SPL_LAYER_NORMAL | 1u << SPL_LAYER_ID |
                  1u << SPL_LAYER_COVERAGE;
    if (!spl_method_has_normals(view.method, spl_dataset_get_info(o->dataset)))
        view.layers &= ~(1u << SPL_LAYER_NORMAL);
    struct spl_frame frame;
    double ms;
    int rc = spl_steady_render(&job->device, &view, &frame, &ms, err);
    if (rc)
        return rc;
    spl_tolerance_fill(job->tolerance, &view, &frame.images[SPL_LAYER_ID], &frame.images[SPL_LAYER_DEPTH], 0,
                       t->tolerance);
    a->splats = (double)frame.stats.splats_drawn;
    a->complete = frame.stats.complete;
    a->dense_share = t->dense_share;
    if (spl_sweep_has_pictures(o->views->count, v))
        rc = spl_sweep_save_pictures(o, v, setting, &frame.images[SPL_LAYER_COLOR], &t->images[SPL_LAYER_COLOR], err);
    if (!rc)
        rc = spl_truth_compare(t, frame.images, &a->metrics, &a->dense, err);
    spl_frame_finish(&frame);
    if (!rc)
        rc = spl_state_add(job->state, spl_record_accuracy(setting, v, a), err);
    a->done = !rc;
    return rc;
}

/* Is the setting one of those, all solid or not, that this view has yet to be compared under? */
static bool is_missing(const struct job *job, size_t setting, size_t v, bool soft)
{
    return (job->options->settings[setting].soft > 0) == soft && !spl_sweep_get_accuracy(job->sweep, setting, v)->done;
}

/* Under the settings where all is solid, or under those with something soft: each have a reference. */
static int compare_view(struct job *job, size_t v, bool soft, struct spl_error *err)
{
    const struct spl_sweep_options *o = job->options;
    size_t first = 0;
    while (first < o->setting_count && !is_missing(job, first, v, soft))
        first++;
    if (first == o->setting_count)
        return SPL_OK;
    struct spl_truth t;
    int rc = get_truth(job, v, soft, &t, err);
    if (!rc && spl_sweep_has_pictures(o->views->count, v))
        rc = spl_sweep_save_picture(o, SPL_SWEEP_REFERENCE, v, first, &t.images[SPL_LAYER_COLOR], err);
    for (size_t s = first; !rc && s < o->setting_count; s++) {
        if (!is_missing(job, s, v, soft))
            continue;
        rc = compare(job, s, v, &t, err);
        advance(job, "accuracy");
    }
    spl_truth_finish(&t);
    return rc;
}

static int compare_all(struct job *job, struct spl_error *err)
{
    const struct spl_sweep_options *o = job->options;
    job->done = job->total = 0;
    for (size_t s = 0; s < o->setting_count; s++)
        for (size_t v = 0; v < o->views->count; v++)
            job->total += !spl_sweep_get_accuracy(job->sweep, s, v)->done;
    int rc = SPL_OK;
    for (size_t v = 0; !rc && v < o->views->count; v++) {
        rc = compare_view(job, v, false, err);
        if (!rc)
            rc = compare_view(job, v, true, err);
    }
    return rc;
}

/* ----------------------------------------------------------------------------------------------------------- times */

static int calibrate(struct job *job, struct spl_error *err)
{
    if (job->calibrated_ns && job->device.rendering_ns - job->calibrated_ns < CALIBRATE_EVERY_NS)
        return SPL_OK;
    json_t *record = spl_record_calibrator(spl_calibrator_run(job->calibrator));
    if (record && !spl_record_take(job->sweep, record))
        return spl_fail(err, SPL_E_NOMEM, "out of memory: the calibrator's time could not be kept");
    job->calibrated_ns = job->device.rendering_ns ? job->device.rendering_ns : 1;
    return spl_state_add(job->state, record, err);
}

static int time_frame(struct job *job, size_t setting, size_t v, enum spl_sweep_size size, struct spl_sweep_time *t,
                      struct spl_error *err)
{
    struct spl_view view;
    struct spl_frame frame;
    fill_view(job->options, setting, v, size, &view);
    int rc = spl_steady_render(&job->device, &view, &frame, &t->ms, err);
    if (rc)
        return rc;
    const struct spl_frame_stats *s = &frame.stats;
#define STAGE(name) t->name##_ms = s->name##_ms;
#include "render/stages.def"
#undef STAGE
    spl_frame_finish(&frame);
    return SPL_OK;
}

/* One frame a setting that does not count: kernels are made, pages come in. */
static int warm_up(struct job *job, struct spl_error *err)
{
    struct spl_sweep_time ignored;
    int rc = SPL_OK;
    for (size_t s = 0; !rc && s < job->options->setting_count; s++)
        rc = time_frame(job, s, 0, SPL_SWEEP_FULL, &ignored, err);
    return rc;
}

static int time_view(struct job *job, size_t repeat, size_t v, struct spl_error *err)
{
    int rc = SPL_OK;
    for (size_t i = 0; !rc && i < job->options->setting_count * SPL_SWEEP_SIZES; i++) {
        size_t setting = i / SPL_SWEEP_SIZES;
        enum spl_sweep_size size = i % SPL_SWEEP_SIZES;
        struct spl_sweep_time *t = spl_sweep_get_time(job->sweep, setting, v, size, repeat);
        if (t->done)
            continue;
        rc = calibrate(job, err);
        if (!rc)
            rc = time_frame(job, setting, v, size, t, err);
        if (!rc)
            rc = spl_state_add(job->state, spl_record_time(setting, v, size, repeat, t), err);
        t->done = !rc;
        advance(job, "times");
    }
    return rc;
}

static int time_all(struct job *job, struct spl_error *err)
{
    const struct spl_sweep_options *o = job->options;
    size_t count = o->setting_count * o->views->count * SPL_SWEEP_SIZES * o->repeats;
    job->done = job->total = 0;
    for (size_t i = 0; i < count; i++)
        job->total += !job->sweep->times[i].done;
    if (!job->total)
        return SPL_OK;
    spl_steady_close(&job->device);
    job->device.scratch_samples = o->renderer.scratch_samples;
    int rc = spl_steady_open(&job->device, err);
    if (!rc)
        rc = warm_up(job, err);
    for (size_t repeat = 0; !rc && repeat < o->repeats; repeat++)
        for (size_t v = 0; !rc && v < o->views->count; v++)
            rc = time_view(job, repeat, v, err);
    return rc;
}

/* --------------------------------------------------------------------------------------------------------- the run */

/* A link to a folder is one. */
static int make_folder(const char *path, struct spl_error *err)
{
    return mkdir(path, 0777) && errno != EEXIST ? spl_fail_errno(err, errno, "cannot make the folder %s", path)
                                                : SPL_OK;
}

static bool take_record(void *context, const json_t *record)
{
    return spl_record_take(context, record);
}

static int open_state(struct job *job, uint64_t reference_hash, struct spl_error *err)
{
    const struct spl_sweep_options *o = job->options;
    struct stat status;
    char path[4096];
    if ((size_t)snprintf(path, sizeof path, "%s/pictures/view18446744073709551615-setting1024-error.jpg", o->folder) >=
        sizeof path)
        return spl_fail(err, SPL_E_USAGE, "the path '%.100s…' is too long", o->folder);
    int rc = make_folder(o->folder, err);
    snprintf(path, sizeof path, "%s/pictures", o->folder);
    if (!rc)
        rc = make_folder(path, err);
    if (!rc && (lstat(path, &status) || !S_ISDIR(status.st_mode)))
        rc = spl_fail(err, SPL_E_INPUT, "%s: no folder, which a measurement's pictures lie in; name another folder",
                      path);
    json_t *plan = rc ? NULL : spl_record_plan(job->sweep, reference_hash, err);
    if (!plan)
        return rc ? rc : SPL_E_INPUT;
    snprintf(path, sizeof path, "%s/state.jsonl", o->folder);
    rc = spl_state_open(path, plan, o->restart, take_record, job->sweep, &job->state, &job->sweep->resumed, err);
    json_decref(plan);
    return rc;
}

static int allocate(struct spl_sweep *sweep, struct spl_error *err)
{
    const struct spl_sweep_options *o = sweep->options;
    if (o->setting_count > SPL_PROFILE_POINTS_MAX || o->repeats > SPL_SWEEP_REPEATS_MAX)
        return spl_fail(err, SPL_E_LIMIT, "%zu settings and %u repeats are more than %d and %d", o->setting_count,
                        o->repeats, SPL_PROFILE_POINTS_MAX, SPL_SWEEP_REPEATS_MAX);
    size_t pairs = o->setting_count * o->views->count;
    sweep->accuracy = spl_alloc(pairs, sizeof *sweep->accuracy, err);
    sweep->times = spl_alloc(pairs * SPL_SWEEP_SIZES * o->repeats, sizeof *sweep->times, err);
    return sweep->accuracy && sweep->times ? SPL_OK : SPL_E_NOMEM;
}

int spl_sweep_run(const struct spl_sweep_options *options, struct spl_sweep *sweep, struct spl_error *err)
{
    spl_assert(options->setting_count && options->views->count && options->repeats);
    uint64_t begin = spl_now_ns(), reference_hash;
    *sweep = (struct spl_sweep){.options = options};
    /* A frame of all layers, or of 16 samples a pixel, is many times the work of what is timed: in small tiles none of
     * it keeps the device beyond its deadline. */
    struct job job = {
        .sweep = sweep,
        .options = options,
        .device = {.options = &options->renderer, .dataset = options->dataset, .scratch_samples = COMPARE_SAMPLES}};
    int rc = spl_reference_check(&options->reference, &reference_hash, err);
    if (!rc)
        rc = allocate(sweep, err);
    if (!rc)
        rc = spl_steady_open(&job.device, err);
    if (!rc)
        sweep->device = *spl_renderer_get_device(job.device.renderer);
    if (!rc)
        rc = open_state(&job, reference_hash, err);
    if (!rc)
        rc = spl_calibrator_create(&job.calibrator, err);
    if (!rc)
        rc = spl_tolerance_create(options->dataset, &job.tolerance, err);
    if (!rc)
        rc = compare_all(&job, err);
    if (!rc)
        rc = time_all(&job, err);
    spl_steady_close(&job.device);
    spl_calibrator_destroy(job.calibrator);
    spl_tolerance_destroy(job.tolerance);
    spl_state_close(job.state);
    sweep->rendering_s = (double)job.device.rendering_ns / SPL_NS_PER_S;
    sweep->seconds = (double)(spl_now_ns() - begin) / SPL_NS_PER_S;
    if (rc)
        spl_sweep_finish(sweep);
    return rc;
}

void spl_sweep_finish(struct spl_sweep *sweep)
{
    free(sweep->accuracy);
    free(sweep->times);
    free(sweep->calibrator);
    memset(sweep, 0, sizeof *sweep);
}
