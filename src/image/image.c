/* The front of the encoders: names, checks, and one switch over formats.
 *
 * Every image passes check() first, so the encoders trust type, size and pointer. Options that are out of range are the
 * caller's error and carry the field's name of the HTTP interface. No state; any thread. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/sized.h"
#include "image/encode.h"
#include "image/rows.h"

enum { DEFAULT_QUALITY = 90 };
static const double default_depth_scale = 1000;

static const struct {
    const char *name;
    enum spl_pixel_type type;
} layers[SPL_LAYER_COUNT] = {
    [SPL_LAYER_COLOR] = {"color", SPL_PIXEL_RGBA8}, [SPL_LAYER_DEPTH] = {"depth", SPL_PIXEL_F32},
    [SPL_LAYER_RANGE] = {"range", SPL_PIXEL_F32},   [SPL_LAYER_NORMAL] = {"normal", SPL_PIXEL_F32X3},
    [SPL_LAYER_ID] = {"id", SPL_PIXEL_U32},         [SPL_LAYER_COVERAGE] = {"coverage", SPL_PIXEL_F32},
    [SPL_LAYER_PRIMITIVE] = {"primitive", SPL_PIXEL_U32},
};

/* Colours of Okabe and Ito, which colour-blind people tell apart; the lightest is for lines, which are thin. */
static const struct {
    const char *name;
    uint8_t color[3];
} shapes[SPL_SHAPE_COUNT] = {
    [SPL_SHAPE_NONE] = {"none", {0, 0, 0}},          [SPL_SHAPE_SPLAT] = {"splat", {86, 180, 233}},
    [SPL_SHAPE_LINE] = {"line", {240, 228, 66}},     [SPL_SHAPE_PANEL] = {"panel", {213, 94, 0}},
    [SPL_SHAPE_MESH] = {"mesh", {0, 158, 115}},
};

static const struct {
    const char *name, *media_type;
} formats[SPL_FORMAT_COUNT] = {
    [SPL_FORMAT_JPEG] = {"jpeg", "image/jpeg"},      [SPL_FORMAT_PNG] = {"png", "image/png"},
    [SPL_FORMAT_NPY] = {"npy", "application/x-npy"}, [SPL_FORMAT_RAW] = {"raw", "application/octet-stream"},
    [SPL_FORMAT_WEBP] = {"webp", "image/webp"},     [SPL_FORMAT_TIFF] = {"tiff", "image/tiff"},
};

const char *spl_layer_name(enum spl_layer layer)
{
    return (unsigned)layer < SPL_LAYER_COUNT ? layers[layer].name : "unknown";
}

int spl_layer_from_name(const char *name)
{
    for (int i = 0; name && i < SPL_LAYER_COUNT; i++)
        if (!strcmp(name, layers[i].name))
            return i;
    return -1;
}

const char *spl_shape_name(enum spl_shape shape)
{
    return (unsigned)shape < SPL_SHAPE_COUNT ? shapes[shape].name : "unknown";
}

void spl_shape_color(enum spl_shape shape, uint8_t rgb[3])
{
    static const uint8_t unknown[3] = {255, 255, 255};
    memcpy(rgb, (unsigned)shape < SPL_SHAPE_COUNT ? shapes[shape].color : unknown, sizeof unknown);
}

const char *spl_format_name(enum spl_format format)
{
    return (unsigned)format < SPL_FORMAT_COUNT ? formats[format].name : "unknown";
}

int spl_format_from_name(const char *name)
{
    for (int i = 0; name && i < SPL_FORMAT_COUNT; i++)
        if (!strcmp(name, formats[i].name))
            return i;
    return !name ? -1 : !strcmp(name, "jpg") ? SPL_FORMAT_JPEG : !strcmp(name, "tif") ? SPL_FORMAT_TIFF : -1;
}

const char *spl_format_media_type(enum spl_format format)
{
    return (unsigned)format < SPL_FORMAT_COUNT ? formats[format].media_type : formats[SPL_FORMAT_RAW].media_type;
}

bool spl_format_is_built(enum spl_format format)
{
    return format == SPL_FORMAT_WEBP   ? spl_webp_is_built
           : format == SPL_FORMAT_TIFF ? spl_tiff_is_built
                                       : (unsigned)format < SPL_FORMAT_COUNT;
}

int spl_encode_chroma(const struct spl_encode_options *options)
{
    enum { full_chroma_quality = 95 };
    if (options->chroma)
        return options->chroma;
    return options->quality >= full_chroma_quality ? 444 : 420;
}

uint32_t spl_pixel_bytes(enum spl_pixel_type type)
{
    return type == SPL_PIXEL_F32X3 ? 12 : 4;
}

void spl_image_finish(struct spl_image *image)
{
    if (!image)
        return;
    free(image->pixels);
    memset(image, 0, sizeof *image);
}

void spl_encoded_finish(struct spl_encoded *encoded)
{
    if (!encoded)
        return;
    free(encoded->bytes);
    memset(encoded, 0, sizeof *encoded);
}

static int check(const struct spl_image *image, const struct spl_encode_options *options, struct spl_error *err)
{
    if ((unsigned)options->format >= SPL_FORMAT_COUNT)
        return spl_fail_field(err, SPL_E_UNSUPPORTED, "format", "image format %d does not exist", (int)options->format);
    if (options->quality < 0 || options->quality > 100)
        return spl_fail_field(err, SPL_E_USAGE, "quality", "quality %d is not in 1..100", options->quality);
    if (options->chroma != 0 && options->chroma != 420 && options->chroma != 444)
        return spl_fail_field(err, SPL_E_USAGE, "chroma", "chroma %d is neither 420 nor 444", options->chroma);
    if (!isfinite(options->depth_scale) || options->depth_scale < 0)
        return spl_fail_field(err, SPL_E_USAGE, "depth_scale", "%g is not a positive number of steps per unit",
                              options->depth_scale);
    if ((unsigned)image->layer >= SPL_LAYER_COUNT || image->type != layers[image->layer].type)
        return spl_fail_field(err, SPL_E_UNSUPPORTED, "layer", "layer %s does not have pixels of type %d",
                              spl_layer_name(image->layer), (int)image->type);
    if (!image->width || !image->height || !image->pixels)
        return spl_fail(err, SPL_E_USAGE, "an image of %u x %u pixels has nothing to encode", image->width,
                        image->height);
    if (image->row_bytes && image->row_bytes < (size_t)image->width * spl_pixel_bytes(image->type))
        return spl_fail(err, SPL_E_USAGE, "rows of %u pixels do not fit row_bytes %zu", image->width,
                        image->row_bytes);
    if (image->row_bytes > SIZE_MAX / 2 / image->height)
        return spl_fail(err, SPL_E_USAGE, "%u rows of %zu bytes are more than memory can hold", image->height,
                        image->row_bytes);
    return SPL_OK;
}

static int encode(const struct spl_image *image, const struct spl_encode_options *options, struct spl_encoded *out,
                  struct spl_error *err)
{
    int rc;
    switch (options->format) {
    case SPL_FORMAT_JPEG:
        rc = spl_encode_jpeg(image, options->quality ? options->quality : DEFAULT_QUALITY, spl_encode_chroma(options),
                             out, err);
        break;
    case SPL_FORMAT_PNG:
        rc = spl_encode_png(image, options, out, err);
        break;
    case SPL_FORMAT_WEBP:
        rc = spl_encode_webp(image, options->quality ? options->quality : DEFAULT_QUALITY, out, err);
        break;
    case SPL_FORMAT_TIFF:
        rc = spl_encode_tiff(image, options, out, err);
        break;
    case SPL_FORMAT_NPY:
        rc = spl_encode_npy(image, options->list, out, err);
        break;
    default:
        rc = spl_encode_raw(image, out, err);
    }
    out->media_type = spl_format_media_type(options->format);
    if (rc)
        spl_encoded_finish(out);
    return rc;
}

/* Encoders take packed rows. */
static int pack_rows(const struct spl_image *image, struct spl_image *packed, struct spl_error *err)
{
    size_t bytes = (size_t)image->width * spl_pixel_bytes(image->type);
    *packed = *image;
    packed->row_bytes = 0;
    packed->pixels = spl_alloc_raw(image->height, bytes, err);
    for (uint32_t y = 0; packed->pixels && y < image->height; y++)
        memcpy((char *)packed->pixels + y * bytes, spl_image_row(image, y), bytes);
    return packed->pixels ? SPL_OK : SPL_E_NOMEM;
}

int spl_image_encode(const struct spl_image *image, const struct spl_encode_options *options, struct spl_encoded *out,
                     struct spl_error *err)
{
    struct spl_encode_options known = {0};
    memset(out, 0, sizeof *out);
    int rc = spl_sized_read(options, &known, sizeof known, "spl_encode_options", err);
    if (!rc)
        rc = check(image, &known, err);
    if (rc)
        return rc;
    if (known.depth_scale == 0)
        known.depth_scale = default_depth_scale;
    if (!image->row_bytes)
        return encode(image, &known, out, err);
    struct spl_image packed;
    rc = pack_rows(image, &packed, err);
    if (!rc)
        rc = encode(&packed, &known, out, err);
    spl_image_finish(&packed);
    return rc;
}
