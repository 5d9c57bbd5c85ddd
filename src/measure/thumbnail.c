/* Thumbnails: box averages by a whole factor, so that no pixel counts more than another. Averages are of sRGB values,
 * as browsers scale pictures too: these are for looking, not for measuring. Pure; any thread. */
#include "measure/thumbnail.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

enum { QUALITY = 82 };

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
    struct spl_encode_options options = {.size = sizeof options, .format = SPL_FORMAT_JPEG, .quality = QUALITY};
    int rc = spl_image_encode(&small, &options, out, err);
    free(pixels);
    return rc;
}
