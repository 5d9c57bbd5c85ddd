/* The amplified difference of two pictures.
 *
 * It composes as the metrics do, so that a map is black exactly where PSNR sees nothing. Channels stay apart: a swapped
 * or a tinted channel shows by its hue. No state; any thread. */
#include "measure/error_map.h"

#include <stdlib.h>

#include "base/memory.h"
#include "measure/metrics_parts.h"

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
