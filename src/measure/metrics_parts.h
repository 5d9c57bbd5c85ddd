/* The parts behind spl_metrics_compare(). Inside src/measure only. Sizes and types were checked; each part fills its
 * fields of `out`, and gives the same bits for any number of threads: whole numbers are summed in any order, others a
 * row at a time and the rows in order. */
#ifndef SPL_MEASURE_METRICS_PARTS_H
#define SPL_MEASURE_METRICS_PARTS_H

#include <stdatomic.h>

#include "measure/metrics.h"

enum { SPL_METRICS_ROWS = 8, SPL_METRICS_BLOCK = 1024 };

/* One level that both pictures are laid over: neither bright nor dark ones gain by being absent. */
enum { SPL_METRICS_BACKGROUND = 128 };

static inline bool spl_metrics_is_color(const struct spl_image *image)
{
    return image->layer == SPL_LAYER_COLOR && image->type == SPL_PIXEL_RGBA8 && image->width && image->height &&
           image->pixels;
}

/* `count` RGBA8 pixels (straight alpha) over the background, as three planes; count <= SPL_METRICS_BLOCK. */
void spl_metrics_flatten(const uint32_t *pixels, size_t count, uint8_t rgb[3][SPL_METRICS_BLOCK]);

int spl_metrics_color(const struct spl_image *image, const struct spl_image *truth, unsigned threads,
                      struct spl_metrics *out, struct spl_error *err);

/* Mean SSIM of two planes of luma, `width` x `height`; NAN when a side is below 11. */
int spl_metrics_ssim(const float *image, const float *truth, size_t width, size_t height, unsigned threads, double *out,
                     struct spl_error *err);

/* `scratch` holds a float a pixel, `rows` a double a row. */
void spl_metrics_depth(const struct spl_picture *image, const struct spl_picture *truth, unsigned threads,
                       float *scratch, double *rows, struct spl_metrics *out);
void spl_metrics_coverage(const struct spl_image *image, const struct spl_image *truth, unsigned threads,
                          struct spl_metrics *out);
void spl_metrics_normal(const struct spl_image *image, const struct spl_image *truth, unsigned threads, float *scratch,
                        double *rows, struct spl_metrics *out);

/* The median of those `values` that are not NAN, none of which is negative: the middle one, or the mean of the two in
 * the middle. NAN where there is none. */
double spl_metrics_median(const float *values, size_t count);

#endif
