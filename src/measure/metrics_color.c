/* PSNR and the planes of luma that SSIM reads, in one pass over both pictures.
 *
 * Both pictures are laid over one grey first, in sRGB levels with one rounding, so that a pixel which only one of them
 * covers differs as a viewer would see it. Squares are summed as whole numbers: 64 Mi pixels of three channels fit 64
 * bits many times over. Any thread. */
#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "measure/metrics_parts.h"

/* value * alpha + background * (255 - alpha), divided by 255 and rounded: exact for all bytes, in 16 bits. */
static inline uint8_t over(uint16_t value, uint16_t alpha)
{
    uint16_t sum = (uint16_t)(value * alpha + SPL_METRICS_BACKGROUND * (255 - alpha) + 128);
    return (uint8_t)((uint16_t)(sum + (sum >> 8)) >> 8);
}

void spl_metrics_flatten(const uint32_t *pixels, size_t count, uint8_t rgb[3][SPL_METRICS_BLOCK])
{
    for (size_t i = 0; i < count; i++) {
        uint16_t alpha = (uint16_t)(pixels[i] >> 24);
        rgb[0][i] = over(pixels[i] & 255, alpha);
        rgb[1][i] = over(pixels[i] >> 8 & 255, alpha);
        rgb[2][i] = over(pixels[i] >> 16 & 255, alpha);
    }
}

/* BT.601 on the sRGB levels. */
static void luma(uint8_t rgb[3][SPL_METRICS_BLOCK], size_t count, float *out)
{
    for (size_t i = 0; i < count; i++)
        out[i] = 0.299f * rgb[0][i] + 0.587f * rgb[1][i] + 0.114f * rgb[2][i];
}

static uint64_t squares(const uint8_t *a, const uint8_t *b, size_t count)
{
    uint32_t sum = 0; /* 1024 * 255^2 < 2^27 */
    for (size_t i = 0; i < count; i++) {
        int16_t d = (int16_t)(a[i] - b[i]);
        sum += (uint32_t)(d * d);
    }
    return sum;
}

struct color_work {
    const uint32_t *image, *truth;
    float *image_luma, *truth_luma;
    atomic_uint_fast64_t squares;
};

static void compare_blocks(void *context, size_t begin, size_t end, unsigned worker)
{
    struct color_work *w = context;
    uint8_t image[3][SPL_METRICS_BLOCK], truth[3][SPL_METRICS_BLOCK];
    uint64_t sum = 0;
    (void)worker;
    for (size_t at = begin; at < end; at += SPL_METRICS_BLOCK) {
        size_t count = end - at < SPL_METRICS_BLOCK ? end - at : SPL_METRICS_BLOCK;
        spl_metrics_flatten(w->image + at, count, image);
        spl_metrics_flatten(w->truth + at, count, truth);
        luma(image, count, w->image_luma + at);
        luma(truth, count, w->truth_luma + at);
        for (int c = 0; c < 3; c++)
            sum += squares(image[c], truth[c], count);
    }
    atomic_fetch_add_explicit(&w->squares, sum, memory_order_relaxed);
}

int spl_metrics_color(const struct spl_image *image, const struct spl_image *truth, unsigned threads,
                      struct spl_metrics *out, struct spl_error *err)
{
    size_t count = (size_t)image->width * image->height;
    struct color_work w = {.image = image->pixels, .truth = truth->pixels};
    int rc = SPL_E_NOMEM;
    w.image_luma = spl_alloc_raw(count, sizeof(float), err);
    w.truth_luma = spl_alloc_raw(count, sizeof(float), err);
    if (!w.image_luma || !w.truth_luma)
        goto done;
    spl_parallel_for(threads, count, 16 * SPL_METRICS_BLOCK, compare_blocks, &w);
    double mean = (double)w.squares / (3.0 * (double)count);
    out->psnr = mean > 0 ? 10 * log10(255.0 * 255.0 / mean) : INFINITY;
    rc = spl_metrics_ssim(w.image_luma, w.truth_luma, image->width, image->height, threads, &out->ssim, err);
done:
    free(w.image_luma);
    free(w.truth_luma);
    return rc;
}
