/* Thumbnails: box averages by a whole factor, so that no pixel counts more than another. Averages are of sRGB values,
 * as browsers scale pictures too: these are for looking, not for measuring. Pure; any thread. */
#include "measure/thumbnail.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

enum { QUALITY = 82, ERROR_FULL = 64 };

/* Over black. */
static int channel(const uint8_t *pixel, int c)
{
    return (pixel[c] * pixel[3] + 127) / 255;
}

static void color_pixel(const uint8_t *image, const uint8_t *truth, uint32_t sum[3])
{
    (void)truth;
    for (int c = 0; c < 3; c++)
        sum[c] += (uint32_t)channel(image, c);
}

static void error_pixel(const uint8_t *image, const uint8_t *truth, uint32_t sum[3])
{
    int largest = 0;
    for (int c = 0; c < 3; c++) {
        int d = abs(channel(image, c) - channel(truth, c));
        largest = d > largest ? d : largest;
    }
    sum[0] += (uint32_t)largest;
}

static void error_color(const uint32_t sum[3], uint32_t count, uint8_t out[3])
{
    static const uint8_t anchors[][3] = {{0, 0, 0}, {66, 20, 110}, {187, 55, 84}, {249, 142, 8}, {255, 250, 220}};
    enum { STEPS = sizeof anchors / sizeof *anchors - 1 };
    double t = (double)sum[0] / count / ERROR_FULL * STEPS;
    int left = t < STEPS - 1 ? (int)t : STEPS - 1;
    double part = t - left < 1 ? t - left : 1;
    for (int c = 0; c < 3; c++)
        out[c] = (uint8_t)(anchors[left][c] + (anchors[left + 1][c] - anchors[left][c]) * part + 0.5);
}

static void mean_color(const uint32_t sum[3], uint32_t count, uint8_t out[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = (uint8_t)((sum[c] + count / 2) / count);
}

static int shrink(const struct spl_image *image, const struct spl_image *truth, uint32_t side,
                  void (*add)(const uint8_t *, const uint8_t *, uint32_t *),
                  void (*finish)(const uint32_t *, uint32_t, uint8_t *), struct spl_encoded *out, struct spl_error *err)
{
    memset(out, 0, sizeof *out);
    uint32_t factor = (image->width + side - 1) / side;
    struct spl_image small = {.layer = SPL_LAYER_COLOR,
                              .type = SPL_PIXEL_RGBA8,
                              .width = (image->width + factor - 1) / factor,
                              .height = (image->height + factor - 1) / factor};
    uint8_t *pixels = spl_alloc((size_t)small.width * small.height, 4, err);
    if (!pixels)
        return SPL_E_NOMEM;
    small.pixels = pixels;
    for (uint32_t y = 0; y < small.height; y++)
        for (uint32_t x = 0; x < small.width; x++) {
            uint32_t sum[3] = {0}, count = 0;
            for (uint32_t v = y * factor; v < (y + 1) * factor && v < image->height; v++)
                for (uint32_t u = x * factor; u < (x + 1) * factor && u < image->width; u++, count++) {
                    size_t at = 4 * ((size_t)v * image->width + u);
                    add((const uint8_t *)image->pixels + at, (const uint8_t *)truth->pixels + at, sum);
                }
            uint8_t *pixel = pixels + 4 * ((size_t)y * small.width + x);
            finish(sum, count, pixel);
            pixel[3] = 255;
        }
    struct spl_encode_options options = {.format = SPL_FORMAT_JPEG, .quality = QUALITY};
    int rc = spl_image_encode(&small, &options, out, err);
    free(pixels);
    return rc;
}

int spl_thumbnail_color(const struct spl_image *color, uint32_t side, struct spl_encoded *out, struct spl_error *err)
{
    spl_assert(color->type == SPL_PIXEL_RGBA8 && side);
    return shrink(color, color, side, color_pixel, mean_color, out, err);
}

int spl_thumbnail_error(const struct spl_image *image, const struct spl_image *truth, uint32_t side,
                        struct spl_encoded *out, struct spl_error *err)
{
    spl_assert(image->type == SPL_PIXEL_RGBA8 && truth->type == SPL_PIXEL_RGBA8 && side);
    if (image->width != truth->width || image->height != truth->height)
        return spl_fail(err, SPL_E_USAGE, "pictures of %ux%u and %ux%u pixels have no difference", image->width,
                        image->height, truth->width, truth->height);
    return shrink(image, truth, side, error_pixel, error_color, out, err);
}
