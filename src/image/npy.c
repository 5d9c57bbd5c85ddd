/* NPY 1.0 and headerless bytes: the layer's own numbers, untouched.
 *
 * Both promise little-endian numbers, which is how the pixels lie in memory; the assertion below keeps a port honest.
 * The NPY header is padded so that the data starts on a 64 byte boundary, as numpy writes it. Any thread. */
#include <stdio.h>
#include <string.h>

#include "base/memory.h"
#include "image/encode.h"

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "pixels are written as they lie");

enum { NPY_ALIGNMENT = 64, NPY_HEADER_MAX = 128, NPY_PREFIX = 10 };

static size_t make_header(const struct spl_image *image, bool list, char header[NPY_HEADER_MAX])
{
    static const struct {
        const char *type, *channels;
    } rows[] = {
        [SPL_PIXEL_RGBA8] = {"|u1", ", 4"},
        [SPL_PIXEL_F32] = {"<f4", ""},
        [SPL_PIXEL_F32X3] = {"<f4", ", 3"},
        [SPL_PIXEL_U32] = {"<u4", ""},
    };
    const char *channels = rows[image->type].channels;
    char columns[16] = "";
    if (!list)
        snprintf(columns, sizeof columns, ", %u", image->width);
    int written = snprintf(header + NPY_PREFIX, NPY_HEADER_MAX - NPY_PREFIX,
                           "{'descr': '%s', 'fortran_order': False, 'shape': (%u%s%s%s), }", rows[image->type].type,
                           image->height, columns, channels, list && !*channels ? "," : "");
    size_t used = NPY_PREFIX + (size_t)written;
    size_t length = (used + 1 + NPY_ALIGNMENT - 1) / NPY_ALIGNMENT * NPY_ALIGNMENT;
    memset(header + used, ' ', length - used - 1);
    header[length - 1] = '\n';
    memcpy(header, "\x93NUMPY\x01\x00", 8);
    header[8] = (char)((length - NPY_PREFIX) & 255);
    header[9] = (char)((length - NPY_PREFIX) >> 8);
    return length;
}

static int store(const struct spl_image *image, const char *header, size_t header_bytes, struct spl_encoded *out,
                 struct spl_error *err)
{
    size_t count = (size_t)image->width * image->height, pixel_bytes = spl_pixel_bytes(image->type);
    if (count > (SIZE_MAX - header_bytes) / pixel_bytes)
        return spl_fail(err, SPL_E_LIMIT, "%u x %u pixels are more than memory can address", image->width,
                        image->height);
    out->length = header_bytes + count * pixel_bytes;
    out->bytes = spl_alloc_raw(out->length, 1, err);
    if (!out->bytes)
        return SPL_E_NOMEM;
    memcpy(out->bytes, header, header_bytes);
    memcpy(out->bytes + header_bytes, image->pixels, count * pixel_bytes);
    return SPL_OK;
}

int spl_encode_npy(const struct spl_image *image, bool list, struct spl_encoded *out, struct spl_error *err)
{
    char header[NPY_HEADER_MAX];
    return store(image, header, make_header(image, list && image->width == 1, header), out, err);
}

int spl_encode_raw(const struct spl_image *image, struct spl_encoded *out, struct spl_error *err)
{
    return store(image, "", 0, out, err);
}
