/* The beginning of a frame in steps: the view checked, what it reads of the dataset set up, its tiles planned. Belongs
 * to the renderer's thread. */
#include "render/steps.h"

#include "base/memory.h"
#include "render/advance.h"
#include "render/borrowed.h"
#include "render/method.h"

/* Of a tile where maps are drawn: a software driver takes some microseconds a sample for them, and a tile has 10 s. */
enum { mapped_samples = 1 << 19 };

int spl_steps_find_resident(struct spl_frame_steps *steps, struct spl_error *err)
{
    steps->job.resident = spl_residency_get(&steps->job.renderer->residency, steps->dataset);
    return steps->job.resident ? SPL_OK : spl_fail(err, SPL_E_NOT_FOUND, "the dataset was not added to this renderer");
}

int spl_steps_prepare(struct spl_frame_steps *steps, struct spl_error *err)
{
    struct spl_frame_job *job = &steps->job;
    const struct spl_view *view = &steps->view;
    const struct spl_method_row *method = spl_method_row(view->method);
    bool mapped = spl_dataset_get_info(steps->dataset)->maps && spl_view_get_maps(view) & SPL_MAP_COLORS;
    uint64_t samples = job->renderer->scratch.samples;
    uint32_t apron = method->apron + (mapped ? 1 : 0); // normals look so far
    struct spl_reach *reach = &job->tiling.reach;
    *reach = (struct spl_reach){.align = 1, .apron = apron};
    int rc = spl_steps_find_resident(steps, err);
    job->counts = steps->spread; // all of them plan the same
    if (!rc && method->prepare)
        rc = method->prepare(job, err);
    job->counts = false;
    const uint32_t shade = spl_shade_get_reach(view, spl_dataset_get_info(steps->dataset));
    if (view->surrounded)
        reach->guard += (apron + shade + 3) / 4 * 4; // as guards are: whole groups of lanes
    reach->apron += shade + reach->align - 1;
    reach->apron -= reach->apron % reach->align;
    if (!rc)
        rc = spl_tiling_init(&job->tiling, view, mapped && samples > mapped_samples ? mapped_samples : samples, err);
    steps->prepared = !rc;
    return rc;
}

int spl_steps_begin(struct spl_renderer *renderer, const struct spl_dataset *dataset, const struct spl_view *view,
                    const struct spl_render_options *options, bool handed_out, struct spl_spread *spread,
                    unsigned number, struct spl_frame_steps **out, struct spl_error *err)
{
    uint64_t clock = spl_now_ns();
    struct spl_view known;
    *out = NULL;
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    int rc = spl_view_read(view, &known, err);
    if (!rc)
        rc = spl_view_check_layers(&known, info, err);
    if (rc)
        return rc;
    view = &known;
    struct spl_frame_steps *steps = spl_alloc(1, sizeof *steps, err);
    if (!steps)
        return SPL_E_NOMEM;
    steps->dataset = dataset;
    steps->spread = spread;
    steps->number = number;
    steps->wanted = *view;
    steps->wanted.method = spl_method_for(view->method, info);
    steps->view = steps->wanted;
    spl_view_resize(&steps->view);
    if (spl_camera_is_bent(&view->camera))
        rc = spl_around_create(&steps->view, &steps->around, err);
    double advance = spl_camera_advance(&steps->view.camera, info);
    steps->job =
        (struct spl_frame_job){.renderer = renderer, .view = &steps->view, .frame = &steps->frame, .advance = advance};
    steps->job.cancelled = options ? spl_cancel_get_flag(options->cancel) : NULL;
    steps->job.hold.alone = options;
    steps->frame.stats.complete = true;
    if (!rc && steps->around && spl_around_is_empty(steps->around))
        steps->y = steps->view.camera.height; // there is nothing to draw
    if (!rc && options)
        rc = spl_frame_borrow_images(spl_steps_get_made(steps), &steps->wanted, options, &steps->borrowed, err);
    if (!rc && !handed_out && steps->borrowed != steps->wanted.layers)
        rc = spl_fail_field(err, SPL_E_USAGE, "images", "layers %#x have neither an image nor a frame",
                            steps->wanted.layers & ~steps->borrowed);
    if (!rc)
        rc = spl_marks_init(&steps->job.marks, &view->soft, dataset, err);
    if (!rc)
        rc = spl_marks_init_clip(&steps->job.clip, &view->clip, dataset, err);
    if (!rc)
        rc = spl_paint_init(&steps->job.paint, &view->color, info, err);
    if (!rc)
        spl_paint_set_stream(&steps->job.paint, spl_dataset_get_streams(dataset, &(uint32_t){0}));
    if (!rc)
        rc = spl_residency_upload(&renderer->residency, err);
    if (rc || (rc = spl_steps_prepare(steps, err)) < 0) {
        spl_frame_end(steps, NULL);
        return rc;
    }
    steps->frame.stats.total_ms = spl_since_ms(&clock);
    *out = steps;
    return SPL_OK;
}

int spl_frame_begin(struct spl_renderer *renderer, const struct spl_dataset *dataset, const struct spl_view *view,
                    struct spl_frame_steps **out, struct spl_error *err)
{
    return spl_steps_begin(renderer, dataset, view, NULL, true, NULL, 0, out, err);
}

int spl_frame_begin_spread(struct spl_renderer *renderer, const struct spl_dataset *dataset,
                           const struct spl_view *view, struct spl_spread *spread, unsigned number,
                           struct spl_frame_steps **out, struct spl_error *err)
{
    return spl_steps_begin(renderer, dataset, view, NULL, true, spread, number, out, err);
}
