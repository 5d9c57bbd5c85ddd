/* What a sweep comes to: the profile, and the same with everything behind it as JSON, CSV and a chart. */
#ifndef SPL_MEASURE_REPORT_H
#define SPL_MEASURE_REPORT_H

#include <jansson.h>

#include "measure/peers.h"
#include "measure/profile.h"
#include "measure/summary.h"
#include "measure/sweep.h"

struct spl_report {
    const struct spl_sweep *sweep; /* borrowed */
    struct spl_profile profile;    /* point i is the sweep's setting i */
    struct spl_summary calibrator; /* milliseconds */
};

/* Times of a setting: median over the repeats of each view, then median (ms) and 90 % quantile (ms_q90) over the views.
 * psnr, psnr_sd, psnr_q05: of the views' own PSNR (psnr_overall, in JSON and CSV: of the mean of their square errors,
 * which is lower the more the views differ). Other measures: means over the views that have them, depth_rmse the root
 * of the mean of squares. Equal images count as SPL_PROFILE_PSNR_MAX. On failure *report is zeroed. */
int spl_report_init(struct spl_report *report, const struct spl_sweep *sweep, struct spl_error *err);
void spl_report_finish(struct spl_report *report);

/* Over the pixels of all views where the scan has a point a pixel, each counted once; NAN where the reference has no
 * exact depth. `share` is of the pixels with a true depth, a mean over the views. */
struct spl_report_dense {
    double share, psnr, depth_beyond, holes, see_through;
};
struct spl_report_dense spl_report_get_dense(const struct spl_sweep *sweep, size_t setting);

/* The whole of it; a new reference, NULL without memory. */
json_t *spl_report_to_json(const struct spl_report *report, const struct spl_peers *peers);

/* One row a setting with a header row: api/profile.md has the columns' meaning. *csv is released with free(). */
int spl_report_to_csv(const struct spl_report *report, char **csv, size_t *length, struct spl_error *err);

/* The chart of a profile, whoever measured it: a colour a method, another with maps, a dash pattern a soft model, a
 * curve each, supersampling and cap of atoms (the fewer the paler), labels are the levels of detail. The dataset's
 * `splats` and `calibrator_ms` are told where they are above 0; `peers` may be NULL. data-index of a point is its index
 * in the profile. *svg is released with free(). */
int spl_report_chart(const struct spl_profile *profile, uint64_t splats, double calibrator_ms,
                     const struct spl_peers *peers, char **svg, size_t *length, struct spl_error *err);

/* The page of a sweep (page.c): chart, pictures with their error maps, tables; one HTML file that needs nothing else.
 * Reads the sweep's pictures from its folder. `svg` is the chart's text, without any outside markup. *html is released
 * with free(). Errors: SPL_E_IO names a picture that is gone. Blocks on disk. */
int spl_page_write(const struct spl_report *report, const struct spl_peers *peers, const char *svg, char **html,
                   size_t *length, struct spl_error *err);

/* "splat lod=1", "points lod=2 2×2", "splat lod=1 atoms=2" where not all are drawn, "splat lod=4 maps=on" of
 * datasets with maps, "splat lod=1 soft=express" with something soft. */
void spl_report_setting_name(const struct spl_setting *setting, char name[64]);

#endif
