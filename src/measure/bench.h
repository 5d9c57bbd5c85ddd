/* Frame times of datasets on this machine: every combination of dataset, device, method and level of detail renders the
 * same camera path, all of them in turn at each place of it, with the calibrator beside them. */
#ifndef SPL_MEASURE_BENCH_H
#define SPL_MEASURE_BENCH_H

#include <splatd/render.h>

#include "measure/path.h"
#include "measure/profile.h"
#include "measure/summary.h"

struct spl_bench_options {
    struct spl_dataset *const *datasets; /* borrowed */
    size_t dataset_count;
    const char *const *devices;          /* as spl_renderer_options.device */
    size_t device_count;
    const enum spl_method *methods;
    size_t method_count;
    const double *lods;
    size_t lod_count;
    enum spl_setting_maps maps;          /* of datasets with maps; NO_MAPS = as views have it */
    const struct spl_soft_params *softs; /* what is soft and how; without terms everything is solid */
    size_t soft_count;                   /* at least 1 */
    struct spl_terms clip;               /* what is drawn of all */
    uint32_t width, height;
    uint32_t frames;                     /* places on the path, at least 2 */
    const struct spl_path *path;         /* NULL = each dataset's own orbit */
    uint64_t memory_limit;               /* as spl_renderer_options.memory_limit */
    void (*progress)(void *context, uint32_t frame, uint32_t frames); /* may be NULL */
    void *progress_context;
};

/* One combination. Times are milliseconds; `frame` is the whole render call, readback included, on the host's clock. */
struct spl_bench_row {
    const struct spl_dataset *dataset;
    struct spl_device_info device;
    enum spl_method method;
    double lod;
    const struct spl_soft_params *drawn_soft; /* of the options */
    struct spl_summary frame;
    double processor;                    /* median: processor time of all threads, a software device's with them */
    struct spl_summary units;            /* frame / calibrator of the same place on the path */
    double floor;                        /* median: the calibrator's time for as many points as splats were drawn */
#define STAGE(name) double name; /* median */
#include "render/stages.def"
#undef STAGE
    double splats, chunks;               /* drawn, medians */
    double panels, meshes, lines;        /* likewise; lines by their straight pieces */
    double spheres;                      /* likewise */
    uint32_t incomplete;                 /* frames in which coarser nodes stood in for pages that were not resident */
    uint64_t memory;                     /* device bytes held, all datasets together */
};

struct spl_bench_report {
    struct spl_summary calibrator;       /* milliseconds */
    struct spl_bench_row *rows;          /* datasets outermost, then devices, methods, lods, softs; owned by the
                                            holder */
    size_t row_count;
};

/* Blocks. On failure the report is zeroed. */
int spl_bench(const struct spl_bench_options *options, struct spl_bench_report *report, struct spl_error *err);
void spl_bench_report_finish(struct spl_bench_report *report);

#endif
