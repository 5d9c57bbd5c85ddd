/* The pyramid of a photograph. Levels are averages in sRGB as stored, weighted by alpha, so that a transparent sky does
 * not bleed into what stands before it; edges are repeated. Sampling is that of a texture unit: bilinear within a
 * level, linear between two, of which the finer is chosen by the footprint's logarithm. */
#include "image/pyramid.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"

static int make_levels(struct spl_pyramid *pyramid, struct spl_error *err)
{
    for (uint32_t l = 1; l < SPL_PYRAMID_LEVELS_MAX && (pyramid->width[l - 1] > 1 || pyramid->height[l - 1] > 1); l++) {
        uint32_t w = pyramid->width[l - 1], h = pyramid->height[l - 1];
        uint32_t width = pyramid->width[l] = (w + 1) / 2, height = pyramid->height[l] = (h + 1) / 2;
        uint8_t *out = pyramid->texels[l] = spl_alloc_raw((size_t)width * height, 4, err);
        if (!out)
            return SPL_E_NOMEM;
        pyramid->levels = l + 1;
        for (uint32_t y = 0; y < height; y++)
            for (uint32_t x = 0; x < width; x++, out += 4) {
                unsigned sum[4] = {0};
                for (int i = 0; i < 4; i++) {
                    uint32_t sx = 2 * x + (uint32_t)(i % 2), sy = 2 * y + (uint32_t)(i / 2);
                    const uint8_t *in =
                        pyramid->texels[l - 1] + 4 * ((size_t)(sy < h ? sy : h - 1) * w + (sx < w ? sx : w - 1));
                    for (int c = 0; c < 3; c++)
                        sum[c] += (unsigned)in[c] * in[3];
                    sum[3] += in[3];
                }
                for (int c = 0; c < 3; c++)
                    out[c] = (uint8_t)(sum[3] ? (sum[c] + sum[3] / 2) / sum[3] : 0);
                out[3] = (uint8_t)((sum[3] + 2) / 4);
            }
    }
    return SPL_OK;
}

int spl_pyramid_init(struct spl_pyramid *pyramid, struct spl_image *pixels, struct spl_error *err)
{
    *pyramid = (struct spl_pyramid){.levels = 1};
    pyramid->texels[0] = pixels->pixels;
    pyramid->width[0] = pixels->width;
    pyramid->height[0] = pixels->height;
    *pixels = (struct spl_image){0};
    int rc = make_levels(pyramid, err);
    if (rc)
        spl_pyramid_finish(pyramid);
    return rc;
}

void spl_pyramid_finish(struct spl_pyramid *pyramid)
{
    for (uint32_t l = 0; l < SPL_PYRAMID_LEVELS_MAX; l++)
        free(pyramid->texels[l]);
    *pyramid = (struct spl_pyramid){0};
}

/* Adds `share` of the bilinear colour of a level to sum[4], premultiplied. */
static void add_bilinear(const struct spl_pyramid *pyramid, uint32_t level, const double pixel[2], float share,
                         float sum[4])
{
    int w = (int)pyramid->width[level], h = (int)pyramid->height[level];
    double x = ldexp(pixel[0], -(int)level) - 0.5, y = ldexp(pixel[1], -(int)level) - 0.5;
    int x0 = (int)floor(x), y0 = (int)floor(y);
    float fx = (float)(x - x0), fy = (float)(y - y0);
    for (int i = 0; i < 4; i++) {
        int sx = x0 + i % 2, sy = y0 + i / 2;
        sx = sx < 0 ? 0 : sx < w ? sx : w - 1;
        sy = sy < 0 ? 0 : sy < h ? sy : h - 1;
        const uint8_t *p = pyramid->texels[level] + 4 * ((size_t)sy * (size_t)w + (size_t)sx);
        float weight = share * (i % 2 ? fx : 1 - fx) * (i / 2 ? fy : 1 - fy) * (float)p[3];
        for (int c = 0; c < 3; c++)
            sum[c] += weight * (float)p[c];
        sum[3] += weight;
    }
}

bool spl_pyramid_sample(const struct spl_pyramid *pyramid, const double pixel[2], double footprint, float rgb[3])
{
    if (!(pixel[0] >= 0 && pixel[0] <= pyramid->width[0] && pixel[1] >= 0 && pixel[1] <= pyramid->height[0]))
        return false;
    double level = footprint > 1 ? log2(footprint) : 0;
    level = fmin(level, pyramid->levels - 1);
    uint32_t l = (uint32_t)level;
    float sum[4] = {0}, rest = (float)(level - l);
    add_bilinear(pyramid, l, pixel, 1 - rest, sum);
    if (rest > 0 && l + 1 < pyramid->levels)
        add_bilinear(pyramid, l + 1, pixel, rest, sum);
    if (sum[3] < 128)
        return false;
    for (int c = 0; c < 3; c++)
        rgb[c] = sum[c] / sum[3];
    return true;
}
