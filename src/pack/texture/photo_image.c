/* Where a photograph's pixels come from. A face is cut out of its panorama when it is loaded, bilinearly, so that what
 * follows knows pinholes alone; the panorama stays with the caller for the next face. Any thread; no state. */
#include "pack/texture/photo_image.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

static int check_size(const struct spl_named_view *view, uint32_t width, uint32_t height, struct spl_error *err)
{
    const struct spl_inner_photograph *inner = view->inner;
    if (width == inner->width && height == inner->height)
        return SPL_OK;
    return spl_fail_field(err, SPL_E_INPUT, inner->at ? "imageWidth" : "width", "%s: %u x %u pixels; %s says %u x %u",
                          view->photograph, width, height, inner->at ? "images2D" : "its list", inner->width,
                          inner->height);
}

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
    if (!rc && inner)
        rc = check_size(view, info->width, info->height, err);
    if (!rc && inner && inner->is_panorama) {
        info->width = view->camera.width;
        info->height = view->camera.height;
    }
    return rc;
}

enum { black = 6 };

/* Bilinear at `place` of an image that may close around, colours by their alpha; texels beyond its edges repeat those
 * at the edge. */
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
    const uint8_t *four[4] = {texels[above + left], texels[above + right], texels[below + left], texels[below + right]};
    double weight[4] = {1, 1, 1, 1}, alpha = 1;
    if (four[0][3] != four[1][3] || four[0][3] != four[2][3] || four[0][3] != four[3][3]) {
        for (int i = 0; i < 4; i++)
            weight[i] = four[i][3] / 255.0;
        alpha = (weight[0] * (1 - u) + weight[1] * u) * (1 - v) + (weight[2] * (1 - u) + weight[3] * u) * v;
    }
    for (int k = 0; k < 3; k++) {
        double upper = weight[0] * four[0][k] * (1 - u) + weight[1] * four[1][k] * u,
               lower = weight[2] * four[2][k] * (1 - u) + weight[3] * four[3][k] * u;
        rgba[k] = alpha > 0 ? (uint8_t)((upper * (1 - v) + lower * v) / alpha + 0.5) : 0;
    }
    rgba[3] = weight[0] == 1 && alpha == 1 ? four[0][3] : (uint8_t)(255 * alpha + 0.5);
}

static int cut_face(const struct spl_named_view *view, const struct spl_image *whole, struct spl_image *image,
                    struct spl_error *err)
{
    const struct spl_panorama *panorama = &view->inner->panorama;
    const struct spl_camera *camera = &view->camera;
    bool closed = spl_panorama_is_closed(panorama);
    *image = *whole;
    image->width = camera->width;
    image->height = camera->height;
    image->pixels = spl_alloc((size_t)camera->width * camera->height, 4, err);
    uint8_t(*texels)[4] = image->pixels;
    for (uint32_t y = 0; texels && y < camera->height; y++)
        for (uint32_t x = 0; x < camera->width; x++) {
            double place[2];
            uint8_t *texel = texels[(size_t)y * camera->width + x];
            if (spl_panorama_place(panorama, camera, (double[2]){x + 0.5, y + 0.5}, place))
                sample(whole, closed, place, texel);
            if (texel[0] <= black && texel[1] <= black && texel[2] <= black)
                texel[3] = 0; /* what a panorama's camera did not take is black */
        }
    return texels ? SPL_OK : SPL_E_NOMEM;
}

void spl_photo_whole_finish(struct spl_photo_whole *whole)
{
    spl_image_finish(&whole->image);
    free(whole->path);
    *whole = (struct spl_photo_whole){0};
}

static int load_inner(const struct spl_named_view *view, struct spl_image *out, struct spl_error *err)
{
    FILE *file = NULL;
    int rc = spl_view_open_inner(view, &file, err);
    if (!rc)
        rc = spl_image_load_of(file, view->photograph, SPL_LAYER_COLOR, out, err);
    if (file)
        fclose(file);
    return rc ? rc : check_size(view, out->width, out->height, err);
}

int spl_photo_image_load_of(struct spl_photo_whole *whole, const struct spl_named_view *view, struct spl_image *out,
                            struct spl_error *err)
{
    const struct spl_inner_photograph *inner = view->inner;
    int rc = SPL_OK;
    *out = (struct spl_image){0};
    if (!inner)
        return spl_image_load(view->photograph, SPL_LAYER_COLOR, out, err);
    if (!inner->is_panorama) {
        if ((rc = load_inner(view, out, err)))
            spl_image_finish(out);
        return rc;
    }
    if (!whole->path || whole->at != inner->at || strcmp(whole->path, inner->path)) {
        spl_photo_whole_finish(whole);
        if (!(whole->path = strdup(inner->path)))
            rc = spl_fail(err, SPL_E_NOMEM, "%s: no memory for an image", inner->path);
        whole->at = inner->at;
        if (!rc)
            rc = load_inner(view, &whole->image, err);
    }
    if (!rc)
        rc = cut_face(view, &whole->image, out, err);
    if (rc)
        spl_photo_whole_finish(whole);
    return rc;
}

int spl_photo_image_load(const struct spl_named_view *view, struct spl_image *out, struct spl_error *err)
{
    struct spl_photo_whole whole = {0};
    int rc = spl_photo_image_load_of(&whole, view, out, err);
    spl_photo_whole_finish(&whole);
    return rc;
}

int spl_photo_image_load_whole(const struct spl_named_view *view, struct spl_image *out, struct spl_error *err)
{
    *out = (struct spl_image){0};
    int rc = load_inner(view, out, err);
    if (rc) {
        spl_image_finish(out);
        return rc;
    }
    uint8_t(*texels)[4] = out->pixels;
    for (size_t i = 0; i < (size_t)out->width * out->height; i++)
        if (texels[i][0] <= black && texels[i][1] <= black && texels[i][2] <= black)
            texels[i][3] = 0;
    return SPL_OK;
}
