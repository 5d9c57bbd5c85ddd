/* Method fill: splats as points, with their spacing in the depth's low bits and linear ones joined by lines, then the
 * screen-space filter over what is not linear. Paper: screen-space-filling. */
#include <math.h>

#include "render/fill.h"
#include "render/frame.h"
#include "render/method.h"
#include "render/points.h"

/* 25 x 25 at 1248 x 768 is 0.7e9 looks and 0.8 s of two cores. */
static const double constant_looks = 65000, constant_work = 3e9;

/* The constant operator looks at every sample of the kernel: what a software driver cannot do before the device's
 * deadline, or in the rounds that it allows an invocation, is refused before it costs the device. */
static int check_work(const struct spl_frame_job *job, const struct spl_camera *camera, struct spl_error *err)
{
    double side = 2 * floor(job->tiling.fill.kernel) + 1, guard = 2 * job->tiling.reach.guard;
    double samples = fmin((camera->width + guard) * (camera->height + guard), (double)job->renderer->scratch.samples);
    if (job->view->fill.visibility != SPL_VISIBILITY_CONSTANT)
        return SPL_OK;
    if (side * side > constant_looks ||
        (spl_gpu_get_device(job->renderer->gpu)->software && side * side * samples > constant_work))
        return spl_fail_field(
            err, SPL_E_LIMIT, "kernel",
            "visibility constant with a kernel of %g x %g samples takes too long in this image; ask for a "
            "smaller kernel, or for visibility adaptive",
            side, side);
    return SPL_OK;
}

/* The plan is the whole image's, or tiles would show where they meet. */
static int prepare(struct spl_frame_job *job, struct spl_error *err)
{
    struct spl_camera camera;
    double spacing = 1;
    spl_tiling_get_camera(job->view, &camera);
    int rc = job->view->fill.kernel > 0 ? SPL_OK : spl_frame_find_spacing(job, &camera, &spacing, err);
    if (rc)
        return rc;
    spl_fill_plan_init(&job->tiling.fill, &job->tiling.reach, job->view, spacing);
    return check_work(job, &camera, err);
}

/* The constant operator's looks. */
static uint64_t count_work(const struct spl_tile *tile)
{
    const uint64_t side = 2 * (uint64_t)tile->fill.kernel + 1;
    return tile->view->fill.visibility == SPL_VISIBILITY_CONSTANT ? side * side * tile->samples : 0;
}

static int record(struct spl_tile *tile, uint32_t group, bool first, struct spl_error *err)
{
    int rc = spl_points_record(tile, group, true, err);
    return rc ? rc : spl_fill_record(tile, group, first, err);
}

const struct spl_method_row spl_method_fill = {
    .info = {.name = "fill",
             .help = "one pixel each, hidden ones removed and holes filled in screen space: their depth is a mean of "
                     "what is around them on the image, not measured",
             .params = SPL_PARAMS_OF_ALL | SPL_PARAM_BIT(visibility) | SPL_PARAM_BIT(kernel) |
                       SPL_PARAM_BIT(threshold) | SPL_PARAM_BIT(pyramid),
             .finds_normals = true},
    .lines = true,
    .prepare = prepare,
    .place = spl_fill_set_params,
    .count_work = count_work,
    .record = record,
    .resolve = SPL_RESOLVED_NEAREST,
    .guesses = {{1, 0.25, 5, 31, 22.0}, {1, 0.5, 8, 60, 23.36}, {1, 1, 8, 140, 23.7}},
};
