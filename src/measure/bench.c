/* Measures frames so that the figures can be compared on a machine whose speed wanders: nothing is measured in a block
 * of its own. At each place of the path the calibrator runs, then every row renders one frame; a row's units are
 * quotients of neighbours in time. Pages are preloaded and two frames a row rendered before anything counts. Owned by
 * one thread, which owns all renderers. */
#include "measure/bench.h"

#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "measure/calibrator.h"
#include "shared.h"

struct sample {
    double frame, processor, calibrator;
    struct spl_frame_stats stats;
};

struct bench {
    const struct spl_bench_options *options;
    struct spl_renderer **renderers;   /* one a device */
    struct spl_path *paths;            /* one a dataset */
    struct spl_calibrator *calibrator;
    struct sample *samples;            /* [row][frame] */
    double *values;                    /* scratch, one a frame */
    struct spl_bench_report *report;
};

static int open_renderers(struct bench *b, struct spl_error *err)
{
    const struct spl_bench_options *o = b->options;
    for (size_t i = 0; i < o->device_count; i++) {
        struct spl_renderer_options options = {
            .size = sizeof options, .device = o->devices[i], .memory_limit = o->memory_limit};
        int status = spl_renderer_create(&options, &b->renderers[i], err);
        for (size_t d = 0; !status && d < o->dataset_count; d++) {
            status = spl_renderer_add(b->renderers[i], o->datasets[d], err);
            if (!status)
                status = spl_renderer_preload(b->renderers[i], o->datasets[d], err);
        }
        if (status)
            return status;
    }
    return 0;
}

static void close_renderers(struct bench *b)
{
    const struct spl_bench_options *o = b->options;
    for (size_t i = 0; b->renderers && i < o->device_count; i++) {
        for (size_t d = 0; b->renderers[i] && d < o->dataset_count; d++)
            spl_renderer_remove(b->renderers[i], o->datasets[d]);
        spl_renderer_destroy(b->renderers[i]);
    }
}

static size_t row_device(const struct spl_bench_options *o, size_t row)
{
    return row / (o->soft_count * o->lod_count * o->method_count) % o->device_count;
}

static size_t row_dataset(const struct spl_bench_options *o, size_t row)
{
    return row / (o->soft_count * o->lod_count * o->method_count * o->device_count);
}

static void init_rows(struct bench *b)
{
    const struct spl_bench_options *o = b->options;
    for (size_t i = 0; i < b->report->row_count; i++) {
        struct spl_bench_row *row = &b->report->rows[i];
        row->dataset = o->datasets[row_dataset(o, i)];
        row->device = *spl_renderer_get_device(b->renderers[row_device(o, i)]);
        row->method = o->methods[i / o->soft_count / o->lod_count % o->method_count];
        row->lod = o->lods[i / o->soft_count % o->lod_count];
        row->drawn_soft = &o->softs[i % o->soft_count];
    }
}

static int render(struct bench *b, size_t row, uint32_t frame, struct sample *sample, struct spl_error *err)
{
    const struct spl_bench_options *o = b->options;
    struct spl_view view;
    spl_view_init(&view);
    spl_setting_apply(&(struct spl_setting){b->report->rows[row].method, b->report->rows[row].lod, 1,
                                            SPL_TEXTURE_ATOMS, o->maps},
                      &view);
    view.soft = *b->report->rows[row].drawn_soft;
    view.clip = o->clip;
    double share = (double)frame / (o->frames - 1);
    int status = spl_path_get_camera(&b->paths[row_dataset(o, row)], share, o->width, o->height, &view.camera, err);
    if (status)
        return status;
    struct spl_frame image;
    uint64_t begin = spl_now_ns(), worked = spl_processor_ns();
    status = spl_renderer_render(b->renderers[row_device(o, row)], b->report->rows[row].dataset, &view, &image, err);
    sample->frame = (double)(spl_now_ns() - begin) / SPL_NS_PER_MS;
    sample->processor = (double)(spl_processor_ns() - worked) / SPL_NS_PER_MS;
    if (status)
        return status;
    sample->stats = image.stats;
    spl_frame_finish(&image);
    return 0;
}

static int measure(struct bench *b, struct spl_error *err)
{
    const struct spl_bench_options *o = b->options;
    struct sample ignored;
    int status = 0;
    for (size_t row = 0; !status && row < b->report->row_count; row++) {
        status = render(b, row, 0, &ignored, err);
        if (!status)
            status = render(b, row, o->frames - 1, &ignored, err);
        /* a collection's tiles are read by the views that need them: no frame counts that waited for one */
        bool tiled = spl_dataset_get_info(b->report->rows[row].dataset)->tiles;
        for (uint32_t frame = 1; !status && tiled && frame + 1 < o->frames; frame++)
            status = render(b, row, frame, &ignored, err);
    }
    for (uint32_t frame = 0; !status && frame < o->frames; frame++) {
        if (o->progress)
            o->progress(o->progress_context, frame, o->frames);
        double unit = spl_calibrator_run(b->calibrator);
        b->values[frame] = unit;
        for (size_t row = 0; !status && row < b->report->row_count; row++) {
            struct sample *sample = &b->samples[row * o->frames + frame];
            sample->calibrator = unit;
            status = render(b, row, frame, sample, err);
        }
    }
    if (!status)
        b->report->calibrator = spl_summarise(b->values, o->frames);
    return status;
}

/* Summary of `expression` of each of a row's samples `s`. */
#define SUMMARY(expression)                                                                                            \
    __extension__({                                                                                                    \
        for (uint32_t f = 0; f < frames; f++) {                                                                        \
            const struct sample *s = &samples[f];                                                                      \
            b->values[f] = (double)(expression);                                                                       \
        }                                                                                                              \
        spl_summarise(b->values, frames);                                                                              \
    })

static void summarise_row(struct bench *b, size_t index)
{
    struct spl_bench_row *row = &b->report->rows[index];
    const uint32_t frames = b->options->frames;
    const struct sample *samples = &b->samples[index * frames];
    row->frame = SUMMARY(s->frame);
    row->processor = SUMMARY(s->processor).median;
    row->units = SUMMARY(s->frame / s->calibrator);
    row->floor = SUMMARY(s->calibrator * (double)s->stats.splats_drawn / SPL_CALIBRATOR_POINTS).median;
#define STAGE(name) row->name = SUMMARY(s->stats.name##_ms).median;
#include "render/stages.def"
#undef STAGE
    row->splats = SUMMARY(s->stats.splats_drawn).median;
    row->panels = SUMMARY(s->stats.panels_drawn).median;
    row->meshes = SUMMARY(s->stats.meshes_drawn).median;
    row->lines = SUMMARY(s->stats.lines_drawn).median;
    row->spheres = SUMMARY(s->stats.soft_drawn).median;
    row->chunks = SUMMARY(s->stats.chunks_drawn).median;
    row->memory = spl_renderer_get_memory(b->renderers[row_device(b->options, index)]);
    for (uint32_t f = 0; f < frames; f++)
        row->incomplete += !samples[f].stats.complete;
}

int spl_bench(const struct spl_bench_options *o, struct spl_bench_report *report, struct spl_error *err)
{
    spl_assert(o->frames >= 2 && o->dataset_count && o->device_count && o->method_count && o->lod_count &&
               o->soft_count);
    memset(report, 0, sizeof *report);
    struct bench b = {.options = o, .report = report};
    int status = SPL_E_NOMEM;
    report->row_count = o->dataset_count * o->device_count * o->method_count * o->lod_count * o->soft_count;
    report->rows = spl_alloc(report->row_count, sizeof *report->rows, err);
    b.renderers = spl_alloc(o->device_count, sizeof *b.renderers, err);
    b.paths = spl_alloc(o->dataset_count, sizeof *b.paths, err);
    b.samples = spl_alloc(report->row_count * o->frames, sizeof *b.samples, err);
    b.values = spl_alloc(o->frames, sizeof *b.values, err);
    if (!report->rows || !b.renderers || !b.paths || !b.samples || !b.values)
        goto done;
    status = 0;
    for (size_t d = 0; !status && d < o->dataset_count; d++) {
        if (o->path)
            b.paths[d] = *o->path;
        else
            status = spl_path_orbit(&b.paths[d], o->datasets[d], err);
    }
    if (!status)
        status = spl_calibrator_create(&b.calibrator, err);
    if (!status)
        status = open_renderers(&b, err);
    if (status)
        goto done;
    init_rows(&b);
    status = measure(&b, err);
    for (size_t row = 0; !status && row < report->row_count; row++)
        summarise_row(&b, row);
done:
    close_renderers(&b);
    spl_calibrator_destroy(b.calibrator);
    free(b.renderers);
    free(b.paths);
    free(b.samples);
    free(b.values);
    if (status)
        spl_bench_report_finish(report);
    return status;
}

void spl_bench_report_finish(struct spl_bench_report *report)
{
    free(report->rows);
    memset(report, 0, sizeof *report);
}
