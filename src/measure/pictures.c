/* Pictures for people: thumbnails and error maps.
 *
 * A thumbnail averages boxes of whole pixels, so that no pixel counts more than another; averages are of sRGB values,
 * as browsers scale pictures too: these are for looking, not for measuring. An error map composes as the metrics do, so
 * that it is black exactly where PSNR sees nothing; channels stay apart: a swapped or a tinted one shows by its hue.
 * Pure; any thread. */
#include "measure/pictures.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "measure/metrics_parts.h"

enum { thumbnail_quality = 82 };

/* The mean of the pixels of `image` in the box from (x0, y0) on, cut off at the image's edge. */
static void box_mean(const struct spl_image *image, uint32_t x0, uint32_t y0, uint32_t side, uint8_t out[4])
{
    uint64_t sum[3] = {0}, count = 0;
    for (uint32_t y = y0; y < y0 + side && y < image->height; y++)
        for (uint32_t x = x0; x < x0 + side && x < image->width; x++, count++) {
            const uint8_t *pixel = (const uint8_t *)image->pixels + 4 * ((size_t)y * image->width + x);
            for (int c = 0; c < 3; c++)
                sum[c] += (pixel[c] * pixel[3] + 127u) / 255;
        }
    for (int c = 0; c < 3; c++)
        out[c] = (uint8_t)((sum[c] + count / 2) / count);
    out[3] = 255;
}

int spl_thumbnail(const struct spl_image *color, uint32_t side, struct spl_encoded *out, struct spl_error *err)
{
    spl_assert(color->type == SPL_PIXEL_RGBA8 && side);
    memset(out, 0, sizeof *out);
    uint32_t factor = color->width / side + (color->width % side != 0);
    struct spl_image small = {.layer = SPL_LAYER_COLOR,
                              .type = SPL_PIXEL_RGBA8,
                              .width = (color->width + factor - 1) / factor,
                              .height = (color->height + factor - 1) / factor};
    uint8_t *pixels = spl_alloc((size_t)small.width * small.height, 4, err);
    if (!pixels)
        return SPL_E_NOMEM;
    small.pixels = pixels;
    for (uint32_t y = 0; y < small.height; y++)
        for (uint32_t x = 0; x < small.width; x++)
            box_mean(color, x * factor, y * factor, factor, pixels + 4 * ((size_t)y * small.width + x));
    struct spl_encode_options options = {
        .size = sizeof options, .format = SPL_FORMAT_JPEG, .quality = thumbnail_quality};
    int rc = spl_image_encode(&small, &options, out, err);
    free(pixels);
    return rc;
}

int spl_error_map(const struct spl_image *image, const struct spl_image *truth, struct spl_image *out,
                  struct spl_error *err)
{
    *out = (struct spl_image){0};
    if (!spl_metrics_is_color(image) || !spl_metrics_is_color(truth))
        return spl_fail_field(err, SPL_E_INPUT, "color", "%s has no colour",
                              spl_metrics_is_color(image) ? "the truth" : "the image");
    if (image->width != truth->width || image->height != truth->height)
        return spl_fail_field(err, SPL_E_INPUT, "color",
                              "the image has %u x %u pixels, the truth %u x %u; compare one size", image->width,
                              image->height, truth->width, truth->height);
    size_t count = (size_t)image->width * image->height;
    const uint32_t *from = image->pixels, *with = truth->pixels;
    uint32_t *map = spl_alloc_raw(count, sizeof *map, err);
    if (!map)
        return SPL_E_NOMEM;
    uint8_t a[3][SPL_METRICS_BLOCK], b[3][SPL_METRICS_BLOCK];
    for (size_t at = 0; at < count; at += SPL_METRICS_BLOCK) {
        size_t block = count - at < SPL_METRICS_BLOCK ? count - at : SPL_METRICS_BLOCK;
        spl_metrics_flatten(from + at, block, a);
        spl_metrics_flatten(with + at, block, b);
        for (size_t i = 0; i < block; i++) {
            uint32_t pixel = 0xff000000;
            for (int c = 0; c < 3; c++) {
                int error = SPL_ERROR_MAP_GAIN * abs(a[c][i] - b[c][i]);
                pixel |= (uint32_t)(error < 255 ? error : 255) << 8 * c;
            }
            map[at + i] = pixel;
        }
    }
    *out = (struct spl_image){SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, image->width, image->height, map};
    return SPL_OK;
}
