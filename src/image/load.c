/* The front of the decoders: which format a file is, by its first bytes, and which formats hold a layer.
 *
 * No decoder allocates pixels but through spl_decode_begin(), which holds the limit on their number. A failure leaves
 * the image zeroed. No state; any thread. */
#include "image/load.h"

#include <errno.h>
#include <string.h>
#include <sys/stat.h>

#include "base/memory.h"
#include "base/reading.h"
#include "image/decode.h"

static const enum spl_pixel_type types[SPL_LAYER_COUNT] = {
    [SPL_LAYER_COLOR] = SPL_PIXEL_RGBA8,  [SPL_LAYER_DEPTH] = SPL_PIXEL_F32, [SPL_LAYER_RANGE] = SPL_PIXEL_F32,
    [SPL_LAYER_NORMAL] = SPL_PIXEL_F32X3, [SPL_LAYER_ID] = SPL_PIXEL_U32,    [SPL_LAYER_COVERAGE] = SPL_PIXEL_F32,
    [SPL_LAYER_PRIMITIVE] = SPL_PIXEL_U32,
};

static const struct {
    const char *name, *magic;
    size_t magic_bytes;
    unsigned layers; /* bit per enum spl_layer */
    int (*decode)(FILE *file, const char *path, struct spl_image *out, struct spl_error *err);
    int (*inspect)(FILE *file, const char *path, struct spl_image_info *out, struct spl_error *err); /* may be NULL */
} formats[] = {
    {"PNG", "\x89PNG\r\n\x1a\n", 8, 1 << SPL_LAYER_COLOR | 1 << SPL_LAYER_DEPTH | 1 << SPL_LAYER_RANGE, spl_decode_png,
     spl_inspect_png},
    {"JPEG", "\xff\xd8\xff", 3, 1 << SPL_LAYER_COLOR, spl_decode_jpeg, spl_inspect_jpeg},
    {"NPY", "\x93NUMPY", 6, (1 << SPL_LAYER_COUNT) - 1, spl_decode_npy, NULL},
};
enum { FORMATS = sizeof formats / sizeof *formats };

int spl_decode_begin(const char *path, uint64_t width, uint64_t height, struct spl_image *out, struct spl_error *err)
{
    if (!width || !height)
        return spl_fail_field(err, SPL_E_INPUT, width ? "height" : "width", "%s: %llu x %llu pixels are no image", path,
                              (unsigned long long)width, (unsigned long long)height);
    if (width > SPL_IMAGE_PIXELS_MAX || height > SPL_IMAGE_PIXELS_MAX || width * height > SPL_IMAGE_PIXELS_MAX)
        return spl_fail_field(err, SPL_E_LIMIT, width > height ? "width" : "height",
                              "%s: %llu x %llu pixels; the limit is %d", path, (unsigned long long)width,
                              (unsigned long long)height, SPL_IMAGE_PIXELS_MAX);
    out->width = (uint32_t)width;
    out->height = (uint32_t)height;
    out->pixels = spl_alloc_raw((size_t)(width * height), spl_pixel_bytes(out->type), err);
    return out->pixels ? SPL_OK : SPL_E_NOMEM;
}

/* Which of the formats an open file has; negative on failure. */
static int find_format(FILE *file, const char *path, struct spl_error *err)
{
    struct stat status;
    unsigned char magic[8] = {0};
    int format = 0;
    if (fstat(fileno(file), &status) || !S_ISREG(status.st_mode))
        return spl_fail(err, SPL_E_INPUT, "%s: is not a regular file", path);
    size_t length = fread(magic, 1, sizeof magic, file);
    if (ferror(file))
        return spl_fail_errno(err, errno, "%s: cannot be read", path);
    while (format < FORMATS &&
           (length < formats[format].magic_bytes || memcmp(magic, formats[format].magic, formats[format].magic_bytes)))
        format++;
    rewind(file);
    return format < FORMATS ? format : spl_fail(err, SPL_E_INPUT, "%s: is neither PNG nor JPEG nor NPY", path);
}

static int load(FILE *file, const char *path, struct spl_image *out, struct spl_error *err)
{
    int format = find_format(file, path, err);
    if (format < 0)
        return format;
    if (!(formats[format].layers & 1u << out->layer))
        return spl_fail_field(err, SPL_E_UNSUPPORTED, "layer", "%s: a %s does not hold layer %s; write it as NPY", path,
                              formats[format].name, spl_layer_name(out->layer));
    return formats[format].decode(file, path, out, err);
}

int spl_image_get_info_of(FILE *file, const char *path, struct spl_image_info *out, struct spl_error *err)
{
    *out = (struct spl_image_info){0};
    int format = find_format(file, path, err);
    if (format >= 0 && !formats[format].inspect)
        format = spl_fail(err, SPL_E_UNSUPPORTED, "%s: a %s is no photograph", path, formats[format].name);
    return format < 0 ? format : formats[format].inspect(file, path, out, err);
}

int spl_image_get_info(const char *path, struct spl_image_info *out, struct spl_error *err)
{
    FILE *file;
    *out = (struct spl_image_info){0};
    int rc = spl_open_for_reading(path, &file, err);
    if (!rc)
        rc = spl_image_get_info_of(file, path, out, err);
    if (file)
        fclose(file);
    return rc;
}

int spl_image_get_size(const char *path, uint32_t *width, uint32_t *height, struct spl_error *err)
{
    struct spl_image_info info = {0};
    int rc = spl_image_get_info(path, &info, err);
    *width = info.width;
    *height = info.height;
    return rc;
}

int spl_image_load_of(FILE *file, const char *path, enum spl_layer layer, struct spl_image *out, struct spl_error *err)
{
    spl_assert((unsigned)layer < SPL_LAYER_COUNT);
    *out = (struct spl_image){.layer = layer, .type = types[layer]};
    int rc = load(file, path, out, err);
    if (rc)
        spl_image_finish(out);
    return rc;
}

int spl_image_load(const char *path, enum spl_layer layer, struct spl_image *out, struct spl_error *err)
{
    FILE *file;
    *out = (struct spl_image){0};
    int rc = spl_open_for_reading(path, &file, err);
    if (!rc)
        rc = spl_image_load_of(file, path, layer, out, err);
    if (file)
        fclose(file);
    return rc;
}
