/* JPEG by TurboJPEG. Colour goes in as it lies (alpha is a padding byte: the frame is composed over its background
 * already); the other layers become a picture for people first.
 *
 * One compressor per call: making one costs microseconds against milliseconds of encoding, and leaves no state that a
 * thread would have to own. The output buffer is ours and large enough for the worst case, so TurboJPEG allocates no
 * pixels; untouched pages of it cost nothing, and it is trimmed at the end. */
#include <stdlib.h>

#include <turbojpeg.h>

#include "base/memory.h"
#include "image/encode.h"

enum { JPEG_SIDE_MAX = 65535 };

static int compress(const uint8_t *pixels, int pixel_format, const struct spl_image *image, int quality, int chroma,
                    struct spl_encoded *out, struct spl_error *err)
{
    int width = (int)image->width, height = (int)image->height;
    int sampling = pixel_format == TJPF_GRAY ? TJSAMP_GRAY : chroma == 444 ? TJSAMP_444 : TJSAMP_420;
    unsigned long length = tjBufSize(width, height, sampling);
    if (length == (unsigned long)-1)
        return spl_fail(err, SPL_E_LIMIT, "a JPEG of %d x %d pixels is larger than memory can address", width, height);
    int rc = SPL_OK;
    tjhandle compressor = NULL;
    uint8_t *bytes = spl_alloc_raw(length, 1, err);
    if (!bytes) {
        rc = SPL_E_NOMEM;
        goto done;
    }
    compressor = tjInitCompress();
    if (!compressor) {
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory: no JPEG compressor could be made");
        goto done;
    }
    if (tjCompress2(compressor, pixels, width, 0, height, pixel_format, &bytes, &length, sampling, quality,
                    TJFLAG_NOREALLOC | TJFLAG_ACCURATEDCT)) {
        rc = spl_fail(err, SPL_E_INTERNAL, "JPEG encoding failed: %s", tjGetErrorStr2(compressor));
        goto done;
    }
    uint8_t *trimmed = realloc(bytes, length);
    out->bytes = trimmed ? trimmed : bytes;
    out->length = length;
    bytes = NULL;
done:
    if (compressor)
        tjDestroy(compressor);
    free(bytes);
    return rc;
}

int spl_encode_jpeg(const struct spl_image *image, int quality, int chroma, struct spl_encoded *out,
                    struct spl_error *err)
{
    if (image->width > JPEG_SIDE_MAX || image->height > JPEG_SIDE_MAX)
        return spl_fail_field(err, SPL_E_LIMIT, image->width > JPEG_SIDE_MAX ? "width" : "height",
                              "%u x %u pixels: a JPEG has at most %d on a side; ask for PNG", image->width,
                              image->height, JPEG_SIDE_MAX);
    if (image->layer == SPL_LAYER_COLOR)
        return compress(image->pixels, TJPF_RGBX, image, quality, chroma, out, err);

    uint8_t *picture = NULL;
    int rc = spl_convert_picture(image, &picture, out, err);
    if (!rc)
        rc = compress(picture, image->layer == SPL_LAYER_COVERAGE ? TJPF_GRAY : TJPF_RGB, image, quality, chroma, out,
                      err);
    free(picture);
    return rc;
}
