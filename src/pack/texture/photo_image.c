/* Where a photograph's pixels come from. A face is cut out of its panorama when it is loaded, bilinearly, so that what
 * follows knows pinholes alone. Any thread; no state. */
#include "pack/texture/photo_image.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

int spl_photo_image_get_info(const struct spl_named_view *view, struct spl_image_info *info, struct spl_error *err)
{
    const struct spl_inner_photograph *inner = view->inner;
    FILE *file = NULL;
    int rc = inner ? spl_view_open_inner(view, &file, err) : spl_image_get_info(view->photograph, info, err);
    if (!rc && file)
        rc = spl_image_get_info_of(file, view->photograph, info, err);
    if (file)
        fclose(file);
    if (!rc && (info->bits != 8 || info->cmyk))
        rc = spl_fail(err, SPL_E_UNSUPPORTED, "%s: %s; photographs are 8 bit sRGB: convert it", view->photograph,
                      info->cmyk         ? "a CMYK image"
                      : info->bits == 16 ? "16 bit channels"
                                         : "channels below 8 bit");
    if (!rc && inner && (info->width != inner->width || info->height != inner->height))
        rc = spl_fail_field(err, SPL_E_INPUT, "imageWidth", "%s: %u x %u pixels; images2D says %u x %u",
                            view->photograph, info->width, info->height, inner->width, inner->height);
    if (!rc && inner && inner->is_panorama) {
        info->width = view->camera.width;
        info->height = view->camera.height;
    }
    return rc;
}

enum { black = 6 };

/* Bilinear at `place` of an image that may close around; texels beyond its edges repeat those at the edge. */
static void sample(const struct spl_image *from, bool closed, const double place[2], uint8_t rgba[4])
{
    const uint8_t(*texels)[4] = from->pixels;
    double x = place[0] - 0.5, y = fmin(fmax(place[1] - 0.5, 0), from->height - 1.0);
    if (!closed)
        x = fmin(fmax(x, 0), from->width - 1.0);
    int64_t column = (int64_t)floor(x), row = (int64_t)y, width = from->width;
    double u = x - (double)column, v = y - (double)row;
    size_t left = (size_t)((column + width) % width),
           right = (size_t)(closed || column + 1 < width ? (column + 1 + width) % width : column),
           above = (size_t)row * from->width, below = (size_t)(row + 1 < from->height ? row + 1 : row) * from->width;
    for (int k = 0; k < 4; k++) {
        double upper = texels[above + left][k] * (1 - u) + texels[above + right][k] * u,
               lower = texels[below + left][k] * (1 - u) + texels[below + right][k] * u;
        rgba[k] = (uint8_t)(upper * (1 - v) + lower * v + 0.5);
    }
}

static int cut_face(const struct spl_named_view *view, struct spl_image *image, struct spl_error *err)
{
    const struct spl_panorama *panorama = &view->inner->panorama;
    const struct spl_camera *camera = &view->camera;
    struct spl_image whole = *image;
    bool closed = spl_panorama_is_closed(panorama);
    image->width = camera->width;
    image->height = camera->height;
    image->pixels = spl_alloc((size_t)camera->width * camera->height, 4, err);
    uint8_t(*texels)[4] = image->pixels;
    for (uint32_t y = 0; texels && y < camera->height; y++)
        for (uint32_t x = 0; x < camera->width; x++) {
            double place[2];
            uint8_t *texel = texels[(size_t)y * camera->width + x];
            if (spl_panorama_place(panorama, camera, (double[2]){x + 0.5, y + 0.5}, place))
                sample(&whole, closed, place, texel);
            if (texel[0] <= black && texel[1] <= black && texel[2] <= black)
                texel[3] = 0; /* what a panorama's camera did not take is black */
        }
    spl_image_finish(&whole);
    return texels ? SPL_OK : SPL_E_NOMEM;
}

int spl_photo_image_load(const struct spl_named_view *view, struct spl_image *out, struct spl_error *err)
{
    FILE *file = NULL;
    if (!view->inner)
        return spl_image_load(view->photograph, SPL_LAYER_COLOR, out, err);
    *out = (struct spl_image){0};
    int rc = spl_view_open_inner(view, &file, err);
    if (!rc)
        rc = spl_image_load_of(file, view->photograph, SPL_LAYER_COLOR, out, err);
    if (file)
        fclose(file);
    if (!rc && (out->width != view->inner->width || out->height != view->inner->height))
        rc = spl_fail_field(err, SPL_E_INPUT, "imageWidth", "%s: %u x %u pixels; images2D says %u x %u",
                            view->photograph, out->width, out->height, view->inner->width, view->inner->height);
    if (!rc && view->inner->is_panorama)
        rc = cut_face(view, out, err);
    if (rc)
        spl_image_finish(out);
    return rc;
}
