/* WebP by libwebp, lossy: colour with its alpha, the other layers as the pictures that JPEG makes of them.
 *
 * Method 2 of 6: about as slow as JPEG allows a reply to be, and within a few percent of the bytes of the default. The
 * encoder allocates and is deleted in this call; it uses this thread alone, so bytes do not depend on the machine's
 * load. */
#include <stdlib.h>
#include <string.h>

#include <webp/encode.h>

#include "base/memory.h"
#include "image/encode.h"

const bool spl_webp_is_built = true;
enum { method = 2 };

static int fail_import(struct spl_error *err)
{
    return spl_fail(err, SPL_E_NOMEM, "out of memory while a WebP was encoded");
}

/* RGBA for color, RGB for everything else. */
static int import(WebPPicture *picture, const struct spl_image *image, struct spl_encoded *out, struct spl_error *err)
{
    int width = (int)image->width;
    if (image->layer == SPL_LAYER_COLOR)
        return WebPPictureImportRGBA(picture, image->pixels, 4 * width) ? SPL_OK : fail_import(err);
    uint8_t *shown = NULL, *rgb = NULL;
    size_t count = (size_t)image->width * image->height;
    int rc = spl_convert_picture(image, &shown, out, err);
    if (!rc && image->layer == SPL_LAYER_COVERAGE) {
        if (!(rgb = spl_alloc_raw(count, 3, err)))
            rc = SPL_E_NOMEM;
        for (size_t i = 0; !rc && i < count; i++)
            memset(rgb + 3 * i, shown[i], 3);
    }
    if (!rc && !WebPPictureImportRGB(picture, rgb ? rgb : shown, 3 * width))
        rc = fail_import(err);
    free(shown);
    free(rgb);
    return rc;
}

int spl_encode_webp(const struct spl_image *image, int quality, struct spl_encoded *out, struct spl_error *err)
{
    if (image->width > WEBP_MAX_DIMENSION || image->height > WEBP_MAX_DIMENSION)
        return spl_fail_field(err, SPL_E_LIMIT, image->width > WEBP_MAX_DIMENSION ? "width" : "height",
                              "%u x %u pixels: a WebP has at most %d on a side; ask for PNG", image->width,
                              image->height, WEBP_MAX_DIMENSION);
    WebPConfig config;
    WebPPicture picture;
    WebPMemoryWriter writer;
    if (!WebPConfigPreset(&config, WEBP_PRESET_DEFAULT, (float)quality) || !WebPPictureInit(&picture))
        return spl_fail(err, SPL_E_INTERNAL, "libwebp is of another version than its header");
    config.method = method;
    WebPMemoryWriterInit(&writer);
    picture.width = (int)image->width;
    picture.height = (int)image->height;
    picture.writer = WebPMemoryWrite;
    picture.custom_ptr = &writer;
    int rc = import(&picture, image, out, err);
    if (!rc && !WebPEncode(&config, &picture))
        rc = spl_fail(err, picture.error_code == VP8_ENC_ERROR_OUT_OF_MEMORY ? SPL_E_NOMEM : SPL_E_INTERNAL,
                      "WebP encoding failed with code %d", (int)picture.error_code);
    if (!rc) {
        out->bytes = writer.mem; // malloc'd by libwebp
        out->length = writer.size;
    } else {
        WebPMemoryWriterClear(&writer);
    }
    WebPPictureFree(&picture);
    return rc;
}
