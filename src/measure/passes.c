/* Caps are rendered in turn within each round, so that what else the machine does falls on all of them alike; medians
 * leave single stalls out. */
#include "measure/passes.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "measure/summary.h"

enum { stages = sizeof(struct spl_passes_times) / sizeof(double) };

const uint32_t spl_passes_caps[SPL_PASSES_CAPS] = {0, 1, 4, 8};

static void take_stats(const struct spl_frame_stats *s, double *times, uint32_t rounds, uint32_t round)
{
    const double ms[stages] = {s->select_ms, s->depth_ms, s->shade_ms, s->resolve_ms,
                               s->select_ms + s->upload_ms + s->clear_ms + s->depth_ms + s->shade_ms + s->soft_ms +
                                   s->resolve_ms};
    for (int stage = 0; stage < stages; stage++)
        times[(size_t)stage * rounds + round] = ms[stage];
}

static double covered_share(const struct spl_image *coverage)
{
    size_t pixels = (size_t)coverage->width * coverage->height, covered = 0;
    const float *share = coverage->pixels;
    for (size_t i = 0; i < pixels; i++)
        covered += share[i] >= 0.5f;
    return (double)covered / (double)pixels;
}

static int measure_view(struct spl_renderer *renderer, const struct spl_dataset *dataset,
                        const struct spl_camera *camera, uint32_t rounds, double *times, struct spl_passes_view *out,
                        struct spl_error *err)
{
    size_t each = (size_t)stages * rounds;
    for (uint32_t round = 0; round <= rounds; round++)
        for (int cap = 0; cap < SPL_PASSES_CAPS; cap++) {
            struct spl_view view;
            struct spl_frame frame;
            spl_view_init(&view);
            view.camera = *camera;
            view.disc.atoms = spl_passes_caps[cap];
            view.layers = 1u << SPL_LAYER_COLOR | (round ? 0 : 1u << SPL_LAYER_COVERAGE);
            int rc = spl_renderer_render(renderer, dataset, &view, &frame, err);
            if (rc)
                return rc;
            if (round)
                take_stats(&frame.stats, times + cap * each, rounds, round - 1);
            else
                out->covered = covered_share(&frame.images[SPL_LAYER_COVERAGE]);
            out->splats = frame.stats.splats_drawn;
            spl_frame_finish(&frame);
        }
    for (int cap = 0; cap < SPL_PASSES_CAPS; cap++) {
        double median[stages];
        for (int stage = 0; stage < stages; stage++)
            median[stage] = spl_summarise(times + cap * each + (size_t)stage * rounds, rounds).median;
        out->times[cap] = (struct spl_passes_times){median[0], median[1], median[2], median[3], median[4]};
    }
    return 0;
}

int spl_passes_measure(struct spl_renderer *renderer, const struct spl_dataset *dataset, uint32_t width,
                       uint32_t height, uint32_t rounds, struct spl_passes_view views[SPL_PASSES_VIEWS],
                       struct spl_error *err)
{
    static const double distances[SPL_PASSES_VIEWS] = {1, 0.4, 0.2};
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    if (rounds < 1 || rounds > SPL_PASSES_ROUNDS_MAX)
        return spl_fail_field(err, SPL_E_USAGE, "rounds", "rounds is 1..%d, not %u", SPL_PASSES_ROUNDS_MAX, rounds);
    double *times = spl_alloc((size_t)SPL_PASSES_CAPS * stages * rounds, sizeof *times, err);
    int rc = times ? 0 : SPL_E_NOMEM;
    for (int v = 0; !rc && v < SPL_PASSES_VIEWS; v++) {
        struct spl_camera camera;
        double eye[3];
        views[v] = (struct spl_passes_view){.distance = distances[v]};
        rc = spl_dataset_get_default_camera(dataset, width, height, &camera, err);
        for (int a = 0; a < 3; a++)
            eye[a] = info->default_target[a] + distances[v] * (info->default_eye[a] - info->default_target[a]);
        if (!rc)
            rc = spl_camera_look_at(&camera, eye, info->default_target, info->default_up, err);
        if (!rc)
            rc = measure_view(renderer, dataset, &camera, rounds, times, &views[v], err);
    }
    free(times);
    return rc;
}
