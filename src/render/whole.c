/* Frames in one call, on the renderer's thread: all steps of one, and a point of one. */
#include <string.h>

#include "base/sized.h"
#include "render/method.h"
#include "render/pick.h"
#include "render/steps.h"

int spl_renderer_render(struct spl_renderer *renderer, const struct spl_dataset *dataset, const struct spl_view *view,
                        struct spl_frame *frame, struct spl_error *err)
{
    const struct spl_render_options none = {.size = sizeof none};
    return spl_renderer_render_with(renderer, dataset, view, &none, frame, err);
}

int spl_renderer_render_with(struct spl_renderer *renderer, const struct spl_dataset *dataset,
                             const struct spl_view *view, const struct spl_render_options *options,
                             struct spl_frame *frame, struct spl_error *err)
{
    struct spl_frame_steps *steps = NULL;
    struct spl_render_options known = {0};
    bool more = true;
    int rc = spl_sized_read(options, &known, sizeof known, "spl_render_options", err);
    if (!rc)
        rc = spl_steps_begin(renderer, dataset, view, &known, frame, NULL, 0, &steps, err);
    while (!rc && more) {
        rc = spl_frame_step(steps, steps->wanted.deadline_ns, &more, err);
        if (!rc && more && spl_frame_is_waiting(steps))
            spl_renderer_wait(renderer, steps->wanted.deadline_ns);
    }
    spl_frame_end(steps, rc ? NULL : frame);
    if (rc && frame)
        memset(frame, 0, sizeof *frame);
    return rc;
}

int spl_renderer_pick(struct spl_renderer *renderer, const struct spl_dataset *dataset, const struct spl_view *view,
                      double x, double y, struct spl_pick *pick, struct spl_error *err)
{
    struct spl_frame frame;
    struct spl_view known, pixel;
    *pick = (struct spl_pick){0};
    int rc = spl_view_read(view, &known, err);
    if (rc)
        return rc;
    view = &known;
    if (!(x >= 0 && x <= view->camera.width))
        return spl_fail_field(err, SPL_E_USAGE, "x", "x %g is outside the image, 0 to %u", x, view->camera.width);
    if (!(y >= 0 && y <= view->camera.height))
        return spl_fail_field(err, SPL_E_USAGE, "y", "y %g is outside the image, 0 to %u", y, view->camera.height);
    if ((rc = spl_pick_view(view, x, y, &pixel, err)))
        return rc;
    if (!spl_method_has_normals(view->method, spl_dataset_get_info(dataset)))
        pixel.layers &= ~(1u << SPL_LAYER_NORMAL);
    rc = spl_renderer_render(renderer, dataset, &pixel, &frame, err);
    if (!rc)
        spl_pick_read(&view->camera, x, y, &frame, dataset, pick);
    spl_frame_finish(&frame);
    return rc;
}
