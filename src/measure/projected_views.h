/* The views that the baseline of splat textures is compared in: what the dataset's own frames and the photograph show
 * in each, pixel by pixel, and sums of squared error by tile. */
#ifndef SPL_MEASURE_PROJECTED_VIEWS_H
#define SPL_MEASURE_PROJECTED_VIEWS_H

#include "measure/projected.h"

/* What frames are compared: the projections, then the dataset's own. */
enum { SPL_FRAME_COLORED = SPL_PROJECTED_COUNT, SPL_FRAME_TEXTURED, SPL_FRAME_COUNT };

struct spl_compared_tile {
    double error[SPL_FRAME_COUNT]; /* squared, of 255 */
    uint32_t pixels;
};

struct spl_compared_view {
    const struct spl_named_view *view;
    bool left_out;
    struct spl_compared_tile *tiles; /* rows of them */
    uint32_t across, down;
    uint16_t *photo; /* by pixel: SPL_TEXTURE_NO_PHOTO where there is nothing to look up */
    float *depth;
    uint8_t (*truth)[3], (*colored)[3];
};

struct spl_compared_views {
    struct spl_compared_view *views;
    size_t count;
};

/* Of the views of either kind every so-manieth, options->views at most; nothing is loaded. `source_bytes` a pixel of
 * the largest photograph, and its pyramid, are counted with them. SPL_E_LIMIT names memory; SPL_E_NOMEM. */
int spl_compared_views_choose(const struct spl_projected_options *options, uint64_t source_bytes,
                              struct spl_compared_views *out, struct spl_error *err);

/* Renders the view, loads its photograph, and sums up what needs no look-up. Blocks; the renderer's thread. */
int spl_compared_view_take(const struct spl_projected_options *options, struct spl_compared_view *view,
                           struct spl_error *err);

/* A view's photograph, of the size that its camera says. SPL_E_INPUT names width. */
int spl_compared_load(const struct spl_named_view *view, struct spl_image *out, struct spl_error *err);

/* The tile that a pixel lies in. */
struct spl_compared_tile *spl_compared_tile_at(const struct spl_compared_view *view, size_t pixel);

/* Sums and medians of the views that were left out, or of the others. SPL_E_NOMEM. */
int spl_compared_views_summarise(const struct spl_compared_views *views, bool left_out, struct spl_projected_views *out,
                                 struct spl_error *err);
void spl_compared_views_finish(struct spl_compared_views *views);

/* dB of a sum of squared errors of `values` values of 255. */
double spl_compared_psnr(double sum, uint64_t values);

/* Squared distance of two colours of 255. */
double spl_compared_error(const float rgb[3], const uint8_t truth[3]);
double spl_compared_error_bytes(const uint8_t rgb[3], const uint8_t truth[3]);

#endif
