/* PNG by libspng, fast rather than small: a frame is encoded while a client waits.
 *
 * libspng and zlib allocate through our checked allocator, so that a refusal is an error like any other. Any thread. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <spng.h>

#include "base/array.h"
#include "base/memory.h"
#include "image/encode.h"

struct shape {
    uint8_t color_type, bit_depth;
    const void *pixels;
    size_t pixel_bytes;
};

static void *allocate(size_t size)
{
    return spl_alloc_raw(size, 1, NULL);
}

static void *reallocate(void *old, size_t size)
{
    return spl_realloc(old, size, 1, NULL);
}

static void *allocate_zeroed(size_t count, size_t size)
{
    return spl_alloc(count, size, NULL);
}

/* libspng's own output buffer leaks when it cannot grow (0.7.3), so the bytes go to ours. */
struct sink {
    uint8_t *bytes;
    size_t length, capacity;
    bool refused; /* libspng forgets why a write failed */
};

static int append(spng_ctx *ctx, void *user, void *bytes, size_t length)
{
    (void)ctx;
    struct sink *sink = user;
    if (spl_array_reserve(sink->bytes, sink->capacity, sink->length + length, NULL)) {
        sink->refused = true;
        return SPNG_IO_ERROR;
    }
    memcpy(sink->bytes + sink->length, bytes, length);
    sink->length += length;
    return SPNG_OK;
}

static int fail(const struct spl_image *image, int status, struct spl_error *err)
{
    if (status == SPNG_EMEM || status == SPNG_EZLIB_INIT)
        return spl_fail(err, SPL_E_NOMEM, "out of memory while a PNG of %u x %u pixels was encoded", image->width,
                        image->height);
    if (status == SPNG_EWIDTH || status == SPNG_EHEIGHT || status == SPNG_EOVERFLOW)
        return spl_fail_field(err, SPL_E_LIMIT, status == SPNG_EHEIGHT ? "height" : "width",
                              "%u x %u pixels are more than a PNG holds", image->width, image->height);
    return spl_fail(err, SPL_E_INTERNAL, "PNG encoding failed: %s", spng_strerror(status));
}

static int compress(const struct spl_image *image, const struct shape *shape, const struct spl_encode_options *options,
                    struct spl_encoded *out, struct spl_error *err)
{
    struct spng_alloc allocator = {allocate, reallocate, allocate_zeroed, free};
    spng_ctx *ctx = spng_ctx_new2(&allocator, SPNG_CTX_ENCODER);
    if (!ctx)
        return fail(image, SPNG_EMEM, err);
    struct sink sink = {0};
    struct spng_ihdr header = {
        .width = image->width, .height = image->height, .bit_depth = shape->bit_depth, .color_type = shape->color_type};
    size_t bytes = (size_t)image->width * image->height * shape->pixel_bytes;
    /* what the numbers of a depth image mean travels with the file; libspng borrows the text until it is encoded */
    char text[128];
    int length = snprintf(text, sizeof text, "%.17g steps per %.*s, 0 = nothing, 65535 = that far or farther",
                          options->depth_scale, (int)sizeof options->unit, *options->unit ? options->unit : "unit");
    struct spng_text note = {.keyword = "Depth-Scale", .type = SPNG_TEXT, .length = (size_t)length, .text = text};

    int status = spng_set_png_stream(ctx, append, &sink);
    if (!status)
        status = spng_set_option(ctx, SPNG_IMG_COMPRESSION_LEVEL, 1);
    if (!status)
        status = spng_set_option(ctx, SPNG_FILTER_CHOICE, SPNG_FILTER_CHOICE_SUB);
    if (!status)
        status = spng_set_ihdr(ctx, &header);
    if (!status && image->layer == SPL_LAYER_COLOR)
        status = spng_set_srgb(ctx, 0);
    if (!status && shape->bit_depth == 16)
        status = spng_set_text(ctx, &note, 1);
    if (!status)
        status = spng_encode_image(ctx, shape->pixels, bytes, SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE);
    spng_ctx_free(ctx);
    out->bytes = sink.bytes;
    out->length = sink.length;
    return status ? fail(image, sink.refused ? SPNG_EMEM : status, err) : SPL_OK;
}

int spl_encode_png(const struct spl_image *image, const struct spl_encode_options *options, struct spl_encoded *out,
                   struct spl_error *err)
{
    struct shape shape = {SPNG_COLOR_TYPE_TRUECOLOR_ALPHA, 8, image->pixels, 4};
    if (image->layer == SPL_LAYER_COLOR || image->layer == SPL_LAYER_ID)
        return compress(image, &shape, options, out, err);

    size_t count = (size_t)image->width * image->height;
    bool colored = image->layer == SPL_LAYER_NORMAL || image->layer == SPL_LAYER_PRIMITIVE;
    shape.color_type = colored ? SPNG_COLOR_TYPE_TRUECOLOR : SPNG_COLOR_TYPE_GRAYSCALE;
    shape.pixel_bytes = colored ? 3 : image->layer == SPL_LAYER_COVERAGE ? 1 : 2;
    void *picture = spl_alloc_raw(count, shape.pixel_bytes, err);
    if (!picture)
        return SPL_E_NOMEM;
    if (image->layer == SPL_LAYER_NORMAL) {
        spl_convert_normal(image->pixels, count, picture);
    } else if (image->layer == SPL_LAYER_PRIMITIVE) {
        spl_convert_primitive(image->pixels, count, picture);
    } else if (image->layer == SPL_LAYER_COVERAGE) {
        spl_convert_coverage(image->pixels, count, picture);
    } else {
        shape.bit_depth = 16;
        out->saturated = spl_convert_depth16(image->pixels, count, options->depth_scale, picture);
    }
    shape.pixels = picture;
    int rc = compress(image, &shape, options, out, err);
    free(picture);
    return rc;
}
