/* Comparison of decoded PNGs channel by channel; a pixel counts once, by its worst channel. */
#include "picture.h"

#include <stdlib.h>
#include <string.h>

#include <spng.h>

bool picture_decode(const uint8_t *bytes, size_t length, struct picture *out)
{
    *out = (struct picture){0};
    spng_ctx *ctx = spng_ctx_new(0);
    uint8_t *raw = NULL;
    struct spng_ihdr header;
    size_t size;
    bool good = ctx && !spng_set_png_buffer(ctx, bytes, length) && !spng_get_ihdr(ctx, &header) &&
                !spng_decoded_image_size(ctx, SPNG_FMT_PNG, &size) && (raw = malloc(size)) &&
                !spng_decode_image(ctx, raw, size, SPNG_FMT_PNG, 0) && header.bit_depth >= 8;
    if (good) {
        size_t count = size / (header.bit_depth / 8);
        *out = (struct picture){header.width, header.height, (uint32_t)(count / header.width / header.height),
                                header.bit_depth, malloc(count * sizeof *out->levels)};
        for (size_t i = 0; i < count; i++)
            out->levels[i] = header.bit_depth == 16 ? ((uint16_t *)(void *)raw)[i] : raw[i];
    }
    free(raw);
    spng_ctx_free(ctx);
    return good;
}

void picture_finish(struct picture *picture)
{
    free(picture->levels);
    *picture = (struct picture){0};
}

static bool same_shape(const struct picture *a, const struct picture *b)
{
    return a->width == b->width && a->height == b->height && a->channels == b->channels && a->bits == b->bits;
}

static unsigned pixel_difference(const struct picture *a, const struct picture *b, size_t pixel)
{
    unsigned largest = 0;
    for (uint32_t c = 0; c < a->channels; c++) {
        int difference = a->levels[pixel * a->channels + c] - b->levels[pixel * a->channels + c];
        unsigned distance = (unsigned)abs(difference);
        largest = distance > largest ? distance : largest;
    }
    return largest;
}

struct difference picture_compare(const struct picture *a, const struct picture *b, struct tolerance tolerance)
{
    struct difference d = {.same_shape = same_shape(a, b), .pixels = (size_t)a->width * a->height};
    for (size_t i = 0; d.same_shape && i < d.pixels; i++) {
        unsigned distance = pixel_difference(a, b, i);
        d.differing += distance > 0;
        d.beyond += distance > tolerance.levels;
        if (distance > d.largest) {
            d.largest = distance;
            d.worst_x = (uint32_t)(i % a->width);
            d.worst_y = (uint32_t)(i / a->width);
        }
    }
    return d;
}

bool picture_within(const struct difference *difference, struct tolerance tolerance)
{
    return difference->same_shape && (double)difference->beyond <= tolerance.share * (double)difference->pixels;
}

bool picture_difference_image(const struct picture *a, const struct picture *b, struct spl_encoded *out)
{
    if (!same_shape(a, b))
        return false;
    size_t pixels = (size_t)a->width * a->height;
    float *bright = malloc(pixels * sizeof *bright);
    for (size_t i = 0; i < pixels; i++)
        bright[i] = (float)pixel_difference(a, b, i) * 16 / 255;
    struct spl_image image = {SPL_LAYER_COVERAGE, SPL_PIXEL_F32, a->width, a->height, bright};
    bool good = !spl_image_encode(&image, &SPL_SIZED(spl_encode_options, .format = SPL_FORMAT_PNG), out, NULL);
    free(bright);
    return good;
}
