/* PNG by libspng and JPEG by TurboJPEG, in.
 *
 * Both libraries parse the header first; the limit on pixels is held before either decodes. A reference that is damaged
 * is worth nothing, so a JPEG that the decoder would only warn about is refused. Any thread. */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include <spng.h>
#include <turbojpeg.h>

#include "base/memory.h"
#include "image/decode.h"

enum { chunk_bytes_max = 16 << 20, jpeg_bytes_max = 1 << 30 };

static int fail_png(const char *path, int status, struct spl_error *err)
{
    return status == SPNG_EMEM ? spl_fail(err, SPL_E_NOMEM, "%s: out of memory while the PNG was decoded", path)
                               : spl_fail(err, SPL_E_INPUT, "%s: PNG: %s", path, spng_strerror(status));
}

/* Steps per unit from our note, 0 without one. */
static double noted_scale(spng_ctx *ctx)
{
    double scale = 0;
    uint32_t count = 0;
    if (spng_get_text(ctx, NULL, &count) || !count)
        return 0;
    struct spng_text *texts = spl_alloc(count, sizeof *texts, NULL);
    if (texts && !spng_get_text(ctx, texts, &count))
        for (uint32_t i = 0; i < count; i++)
            if (!strcmp(texts[i].keyword, "Depth-Scale"))
                scale = strtod(texts[i].text, NULL);
    free(texts);
    return isfinite(scale) && scale > 0 ? scale : 0;
}

static int decode_depth(spng_ctx *ctx, const char *path, struct spl_image *out, struct spl_error *err)
{
    size_t count = (size_t)out->width * out->height;
    uint16_t *steps = spl_alloc_raw(count, sizeof *steps, err);
    if (!steps)
        return SPL_E_NOMEM;
    double noted = noted_scale(ctx), scale = noted > 0 ? noted : 1000;
    float *values = out->pixels;
    int status = spng_decode_image(ctx, steps, count * sizeof *steps, SPNG_FMT_PNG, 0); /* 16 bit in host order */
    for (size_t i = 0; !status && i < count; i++)
        values[i] = !steps[i] || (noted > 0 && steps[i] == UINT16_MAX) ? NAN : (float)(steps[i] / scale);
    free(steps);
    return status ? fail_png(path, status, err) : SPL_OK;
}

int spl_decode_png(FILE *file, const char *path, struct spl_image *out, struct spl_error *err)
{
    spng_ctx *ctx = spng_ctx_new(0);
    if (!ctx)
        return fail_png(path, SPNG_EMEM, err);
    struct spng_ihdr header;
    int status = spng_set_png_file(ctx, file), rc;
    if (!status)
        status = spng_set_chunk_limits(ctx, chunk_bytes_max, 2 * chunk_bytes_max);
    if (!status)
        status = spng_get_ihdr(ctx, &header);
    rc = status ? fail_png(path, status, err) : SPL_OK;
    if (!rc && out->layer != SPL_LAYER_COLOR &&
        (header.bit_depth != 16 || header.color_type != SPNG_COLOR_TYPE_GRAYSCALE))
        rc = spl_fail_field(err, SPL_E_INPUT, "layer", "%s: a PNG of %s is 16 bit grey, not %d bit of colour type %d",
                            path, spl_layer_name(out->layer), header.bit_depth, header.color_type);
    if (!rc)
        rc = spl_decode_begin(path, header.width, header.height, out, err);
    if (!rc && out->layer != SPL_LAYER_COLOR) {
        rc = decode_depth(ctx, path, out, err);
    } else if (!rc) {
        size_t bytes = (size_t)out->width * out->height * 4;
        status = spng_decode_image(ctx, out->pixels, bytes, SPNG_FMT_RGBA8, SPNG_DECODE_TRNS);
        rc = status ? fail_png(path, status, err) : SPL_OK;
    }
    spng_ctx_free(ctx);
    return rc;
}

int spl_inspect_png(FILE *file, const char *path, struct spl_image_info *out, struct spl_error *err)
{
    spng_ctx *ctx = spng_ctx_new(0);
    if (!ctx)
        return fail_png(path, SPNG_EMEM, err);
    struct spng_ihdr header;
    int status = spng_set_png_file(ctx, file);
    if (!status)
        status = spng_get_ihdr(ctx, &header);
    if (!status)
        *out = (struct spl_image_info){.width = header.width, .height = header.height, .bits = header.bit_depth};
    if (!status && header.color_type == SPNG_COLOR_TYPE_INDEXED)
        out->bits = 8; /* of what the indices stand for */
    spng_ctx_free(ctx);
    return status ? fail_png(path, status, err) : SPL_OK;
}

static int decompress(tjhandle handle, const uint8_t *bytes, size_t length, const char *path, struct spl_image *out,
                      struct spl_error *err)
{
    int width = 0, height = 0, sampling, colorspace;
    if (tjDecompressHeader3(handle, bytes, length, &width, &height, &sampling, &colorspace))
        return spl_fail(err, SPL_E_INPUT, "%s: JPEG: %s", path, tjGetErrorStr2(handle));
    int rc = spl_decode_begin(path, (uint64_t)width, (uint64_t)height, out, err);
    if (rc)
        return rc;
    if (tjDecompress2(handle, bytes, length, out->pixels, width, 0, height, TJPF_RGBA,
                      TJFLAG_ACCURATEDCT | TJFLAG_STOPONWARNING | TJFLAG_LIMITSCANS))
        return spl_fail(err, SPL_E_INPUT, "%s: JPEG: %s", path, tjGetErrorStr2(handle));
    return SPL_OK;
}

static int inspect(tjhandle handle, const uint8_t *bytes, size_t length, const char *path, struct spl_image_info *out,
                   struct spl_error *err)
{
    int width = 0, height = 0, sampling, colorspace = 0;
    if (tjDecompressHeader3(handle, bytes, length, &width, &height, &sampling, &colorspace))
        return spl_fail(err, SPL_E_INPUT, "%s: JPEG: %s", path, tjGetErrorStr2(handle));
    if (width <= 0 || height <= 0) /* it ends within its header, which is no error to the decoder */
        return spl_fail(err, SPL_E_INPUT, "%s: JPEG: ends within its header", path);
    *out = (struct spl_image_info){.width = (uint32_t)width,
                                   .height = (uint32_t)height,
                                   .bits = 8,
                                   .cmyk = colorspace == TJCS_CMYK || colorspace == TJCS_YCCK};
    return SPL_OK;
}

/* Either what the file is, or its pixels. */
static int read_jpeg(FILE *file, const char *path, struct spl_image *out, struct spl_image_info *info,
                     struct spl_error *err)
{
    struct stat status;
    if (fstat(fileno(file), &status))
        return spl_fail_errno(err, errno, "%s: cannot be read", path);
    if (status.st_size > jpeg_bytes_max)
        return spl_fail(err, SPL_E_LIMIT, "%s: %lld bytes; a JPEG has at most %d", path, (long long)status.st_size,
                        jpeg_bytes_max);
    size_t length = (size_t)status.st_size;
    uint8_t *bytes = spl_alloc_raw(length, 1, err);
    if (!bytes)
        return SPL_E_NOMEM;
    int rc = SPL_OK;
    tjhandle handle = NULL;
    if (fread(bytes, 1, length, file) != length)
        rc = spl_fail(err, SPL_E_IO, "%s: cannot be read to its end", path);
    else if (!(handle = tjInitDecompress()))
        rc = spl_fail(err, SPL_E_NOMEM, "%s: out of memory: no JPEG decoder could be made", path);
    else
        rc = info ? inspect(handle, bytes, length, path, info, err) : decompress(handle, bytes, length, path, out, err);
    if (handle)
        tjDestroy(handle);
    free(bytes);
    return rc;
}

int spl_decode_jpeg(FILE *file, const char *path, struct spl_image *out, struct spl_error *err)
{
    return read_jpeg(file, path, out, NULL, err);
}

int spl_inspect_jpeg(FILE *file, const char *path, struct spl_image_info *out, struct spl_error *err)
{
    return read_jpeg(file, path, NULL, out, err);
}
