/* A sweep: every view under every setting, how accurate and how fast. First each pair is rendered once with all layers
 * and compared with the view's reference; then all pairs are timed, repeat after repeat, with the calibrator beside
 * them, so that a machine's bad minute hits all settings alike. Every result is kept in FOLDER/state.jsonl at once. */
#ifndef SPL_MEASURE_SWEEP_H
#define SPL_MEASURE_SWEEP_H

#include <splatd/render.h>

#include "base/error.h"
#include "measure/metrics.h"
#include "measure/profile.h"
#include "measure/reference.h"

enum { SPL_SWEEP_REPEATS_MAX = 1000, SPL_SWEEP_PAGE_VIEWS = 4, SPL_SWEEP_PICTURE_SIDE = 640 };

/* Each setting is timed at the views' size and at half their width and height: two sizes make the profile's time model.
 */
enum spl_sweep_size { SPL_SWEEP_FULL, SPL_SWEEP_HALF, SPL_SWEEP_SIZES };

struct spl_sweep_options {
    const struct spl_dataset *dataset;
    const struct spl_view_list *views; /* checked poses; see spl_reference_check_poses() */
    struct spl_reference reference;
    const struct spl_setting *settings; /* 1 … SPL_PROFILE_POINTS_MAX; members as spl_view */
    size_t setting_count;
    const struct spl_soft_params *soft; /* terms of the settings that have a soft model, compared with the same view
                                           drawn at its best by this model; NULL where none has */
    uint32_t repeats;
    struct spl_renderer_options renderer;
    const char *folder; /* made where it is missing */
    bool restart;       /* forget what the folder's state holds */
    void (*progress)(void *context, const char *stage, uint64_t done, uint64_t total); /* may be NULL */
    void *progress_context;
};

struct spl_sweep_time { /* one frame, colour only */
    double ms;          /* the whole call on the host's clock, readback included */
#define STAGE(name) double name##_ms;
#include "render/stages.def"
#undef STAGE
    bool done;
};

struct spl_sweep_accuracy {
    struct spl_metrics metrics;
    struct spl_metrics dense; /* over pixels where the scan has a point a pixel (measure/dense.h); NAN without exact
                                 depth; never SSIM and halo */
    double dense_share;       /* of the pixels with a true depth, 0..1; NAN as above */
    double splats;            /* drawn */
    bool complete;            /* no coarser nodes stood in */
    bool done;
};

struct spl_sweep {
    const struct spl_sweep_options *options; /* borrowed */
    struct spl_device_info device;
    struct spl_sweep_accuracy *accuracy; /* [setting][view] */
    struct spl_sweep_time *times;        /* [setting][view][size][repeat] */
    double *calibrator;                  /* milliseconds; at least one */
    size_t calibrator_count, calibrator_capacity;
    size_t resumed;              /* results that the state had */
    double rendering_s, seconds; /* of this run: inside render calls; altogether */
};

/* Runs what the state does not hold yet. SPL_E_USAGE when it is of another plan. Blocks for as long as it takes; one
 * thread renders, comparing uses all cores. On success the caller owns what *sweep points to, on failure it is zeroed
 * and the state holds what was done. */
int spl_sweep_run(const struct spl_sweep_options *options, struct spl_sweep *sweep, struct spl_error *err);
void spl_sweep_finish(struct spl_sweep *sweep);

struct spl_sweep_accuracy *spl_sweep_get_accuracy(const struct spl_sweep *sweep, size_t setting, size_t view);
struct spl_sweep_time *spl_sweep_get_time(const struct spl_sweep *sweep, size_t setting, size_t view,
                                          enum spl_sweep_size size, size_t repeat);

/* Pictures are kept of at most SPL_SWEEP_PAGE_VIEWS views, evenly chosen: their number, and the i-th one's index. */
size_t spl_sweep_page_views(size_t views);
size_t spl_sweep_page_view(size_t views, size_t i);

enum spl_sweep_picture { SPL_SWEEP_REFERENCE, SPL_SWEEP_RENDER, SPL_SWEEP_ERROR };
/* Where a picture lies: FOLDER/pictures/…, into `path` of 4096 bytes. References are one for all settings, and one more
 * for those with something soft. */
void spl_sweep_picture_path(const struct spl_sweep_options *options, enum spl_sweep_picture kind, size_t view,
                            size_t setting, char path[4096]);

#endif
