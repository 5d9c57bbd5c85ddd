/* The two sides of a photograph that was left out: the photograph without its lens, and the renders from its pose with,
 * for each pixel, how wide the splat is that is seen there. Widths are of the splats as they lie in the dataset, not as
 * they are drawn at a share of a chunk. Pages are read through the map of the file: this is for tools. */
#include "measure/left_out.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "dataset/chunk.h"
#include "dataset/dataset.h"
#include "image/load.h"

static void look_up(const struct spl_image *from, const double pixel[2], uint8_t out[4])
{
    double x = pixel[0] - 0.5, y = pixel[1] - 0.5, sum[4] = {0};
    long left = lrint(floor(x)), top = lrint(floor(y));
    memset(out, 0, 4);
    if (left < 0 || top < 0 || left + 1 >= (long)from->width || top + 1 >= (long)from->height)
        return;
    for (int i = 0; i < 4; i++) {
        const uint8_t *p =
            (const uint8_t *)from->pixels + 4 * ((size_t)(top + i / 2) * from->width + (size_t)(left + i % 2));
        double share =
            (i % 2 ? x - (double)left : (double)left + 1 - x) * (i / 2 ? y - (double)top : (double)top + 1 - y);
        for (int c = 0; c < 4; c++)
            sum[c] += share * p[c];
    }
    for (int c = 0; c < 4; c++)
        out[c] = (uint8_t)(sum[c] + 0.5);
}

static int undistort(const struct spl_named_view *view, struct spl_image *image, struct spl_error *err)
{
    const struct spl_camera *camera = &view->camera;
    uint8_t *pixels = spl_alloc((size_t)image->width * image->height, 4, err);
    if (!pixels)
        return SPL_E_NOMEM;
    for (uint32_t y = 0; y < image->height; y++)
        for (uint32_t x = 0; x < image->width; x++) {
            const double ray[3] = {(x + 0.5 - camera->cx) / camera->fx, (y + 0.5 - camera->cy) / camera->fy, 1};
            double pixel[2];
            if (spl_distortion_place(camera, &view->distortion, ray, pixel))
                look_up(image, pixel, pixels + 4 * ((size_t)y * image->width + x));
        }
    free(image->pixels);
    image->pixels = pixels;
    return SPL_OK;
}

int spl_left_out_load(const struct spl_named_view *view, struct spl_image *out, struct spl_error *err)
{
    const struct spl_camera *camera = &view->camera;
    *out = (struct spl_image){0};
    if (!view->photograph)
        return spl_fail_field(err, SPL_E_INPUT, "photograph", "view '%s' names no photograph", view->name);
    int rc = spl_image_load(view->photograph, SPL_LAYER_COLOR, out, err);
    if (!rc && (out->width != camera->width || out->height != camera->height))
        rc = spl_fail_field(err, SPL_E_INPUT, "width",
                            "%s: %u x %u pixels; its camera says %u x %u: scale the photograph or its lens",
                            view->photograph, out->width, out->height, camera->width, camera->height);
    if (!rc && view->distortion.kind != SPL_DISTORTION_NONE)
        rc = undistort(view, out, err);
    if (rc)
        spl_image_finish(out);
    return rc;
}

/* Radii by id; ids lie one after the other, as opening has checked. */
static float *read_radii(const struct spl_dataset *dataset, struct spl_error *err)
{
    uint64_t node_count, chunk_count;
    const struct spl_node *nodes = spl_dataset_get_nodes(dataset, &node_count);
    const struct spl_chunk *chunks = spl_dataset_get_chunks(dataset, &chunk_count);
    float *radii = spl_alloc(spl_dataset_get_info(dataset)->ids, sizeof *radii, err);
    for (uint64_t n = 0; radii && n < node_count; n++) {
        size_t bytes;
        const uint32_t *page = spl_dataset_get_page(dataset, nodes[n].page, &bytes);
        for (uint64_t c = nodes[n].first_chunk; c < nodes[n].first_chunk + nodes[n].chunk_count; c++)
            for (uint32_t i = 0; i < chunks[c].count; i++) {
                struct spl_splat splat;
                spl_chunk_decode(&chunks[c], page, i, &splat);
                radii[chunks[c].first_id + i] = splat.radius;
            }
    }
    return radii;
}

static int find_widths(const struct spl_dataset *dataset, const struct spl_camera *camera, struct spl_frame *frame,
                       float **width_px, struct spl_error *err)
{
    size_t count = (size_t)camera->width * camera->height;
    uint64_t splats = spl_dataset_get_info(dataset)->ids;
    const float *depth = frame->images[SPL_LAYER_DEPTH].pixels, *coverage = frame->images[SPL_LAYER_COVERAGE].pixels;
    const uint32_t *id = frame->images[SPL_LAYER_ID].pixels;
    float *radii = read_radii(dataset, err), *widths = radii ? spl_alloc_raw(count, sizeof *widths, err) : NULL;
    for (size_t i = 0; widths && i < count; i++)
        widths[i] = id[i] < splats && !isnan(depth[i]) && coverage[i] > 0.999f
                        ? 2 * radii[id[i]] * (float)camera->fx / depth[i]
                        : NAN;
    free(radii);
    *width_px = widths;
    return widths ? SPL_OK : SPL_E_NOMEM;
}

/* Maps cut off what a station saw past: there is nothing to compare. */
static void leave_out_trimmed(const struct spl_frame *frame, float *widths)
{
    const struct spl_image *coverage = &frame->images[SPL_LAYER_COVERAGE];
    for (size_t i = 0; i < (size_t)coverage->width * coverage->height; i++)
        widths[i] = ((const float *)coverage->pixels)[i] > 0.999f ? widths[i] : NAN;
}

int spl_left_out_render(struct spl_renderer *renderer, const struct spl_dataset *dataset,
                        const struct spl_named_view *named, double lod, struct spl_image render[SPL_LEFT_OUT_KINDS],
                        float **width_px, struct spl_error *err)
{
    struct spl_frame frame = {0};
    struct spl_view view;
    spl_view_init(&view);
    view.camera = named->camera;
    view.lod = lod;
    view.disc.atoms = 0;
    view.maps = SPL_MAPS_OFF;
    view.layers = 1u << SPL_LAYER_COLOR | 1u << SPL_LAYER_DEPTH | 1u << SPL_LAYER_ID | 1u << SPL_LAYER_COVERAGE;
    *width_px = NULL;
    memset(render, 0, SPL_LEFT_OUT_KINDS * sizeof *render);
    int rc = spl_renderer_render(renderer, dataset, &view, &frame, err);
    if (!rc)
        rc = find_widths(dataset, &view.camera, &frame, width_px, err);
    if (!rc) {
        render[SPL_LEFT_OUT_COLORED] = frame.images[SPL_LAYER_COLOR];
        frame.images[SPL_LAYER_COLOR] = (struct spl_image){0};
        spl_frame_finish(&frame);
        view.disc.atoms = 8;
        view.maps = SPL_MAPS_ON;
        view.layers = 1u << SPL_LAYER_COLOR | 1u << SPL_LAYER_COVERAGE;
        rc = spl_renderer_render(renderer, dataset, &view, &frame, err);
    }
    if (!rc) {
        leave_out_trimmed(&frame, *width_px);
        render[SPL_LEFT_OUT_TEXTURED] = frame.images[SPL_LAYER_COLOR];
        frame.images[SPL_LAYER_COLOR] = (struct spl_image){0};
    }
    spl_frame_finish(&frame);
    if (rc) {
        spl_image_finish(&render[SPL_LEFT_OUT_COLORED]);
        free(*width_px);
        *width_px = NULL;
    }
    return rc;
}
