/* What is drawn into is held against the view before anything is drawn, since readback trusts it. Pure; any thread. */
#include "render/borrowed.h"

#include "base/error.h"
#include "image/rows.h"
#include "render/readback.h"

static int check_image(const struct spl_image *image, const struct spl_view *view, struct spl_error *err)
{
    const uint32_t unit = sizeof(uint32_t); /* pixels are stored as words */
    if ((unsigned)image->layer >= SPL_LAYER_COUNT || !(view->layers >> image->layer & 1))
        return spl_fail_field(err, SPL_E_USAGE, "images", "an image is of layer %d, which the view does not have",
                              (int)image->layer);
    if (image->type != spl_readback_type(image->layer) || image->width != view->camera.width ||
        image->height != view->camera.height)
        return spl_fail_field(err, SPL_E_USAGE, "images",
                              "the image of layer %s has another type or size than the view",
                              spl_layer_name(image->layer));
    if (!image->pixels || (uintptr_t)image->pixels % unit || image->row_bytes % unit ||
        spl_image_row_bytes(image) < (size_t)image->width * spl_pixel_bytes(image->type) ||
        image->row_bytes > SIZE_MAX / 2 / image->height)
        return spl_fail_field(err, SPL_E_USAGE, "images",
                              "the image of layer %s has no pixels, or pixels or row_bytes that are no multiple of %u, "
                              "or rows that overlap or do not fit into memory",
                              spl_layer_name(image->layer), unit);
    return SPL_OK;
}

int spl_frame_borrow_images(struct spl_frame *frame, const struct spl_view *view,
                            const struct spl_render_options *options, uint32_t *layers, struct spl_error *err)
{
    *layers = 0;
    if (options->image_count && !options->images)
        return spl_fail_field(err, SPL_E_USAGE, "images", "there are %zu images, but images is NULL",
                              options->image_count);
    for (size_t i = 0; i < options->image_count; i++) {
        const struct spl_image *image = &options->images[i];
        int rc = check_image(image, view, err);
        if (rc)
            return rc;
        if (*layers >> image->layer & 1)
            return spl_fail_field(err, SPL_E_USAGE, "images", "there are two images of layer %s",
                                  spl_layer_name(image->layer));
        frame->images[image->layer] = *image;
        *layers |= 1u << image->layer;
    }
    return SPL_OK;
}

void spl_frame_give_images_back(struct spl_frame *frame, uint32_t layers)
{
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++)
        if (layers >> layer & 1)
            frame->images[layer] = (struct spl_image){0};
}
