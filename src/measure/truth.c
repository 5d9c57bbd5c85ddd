/* A view's truth, whole and where the scan is dense. Holes below a tripod or behind a column are the scan's; the dense
 * part shows what is the renderer's. Both figures come from the same metrics: outside of the dense part image and truth
 * are emptied alike. Pure but for allocation; any thread. */
#include "measure/truth.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "measure/dense.h"

static struct spl_picture picture(const struct spl_image images[SPL_LAYER_COUNT])
{
    const struct spl_image *layer[SPL_LAYER_COUNT];
    for (int i = 0; i < SPL_LAYER_COUNT; i++)
        layer[i] = images[i].pixels ? &images[i] : NULL;
    return (struct spl_picture){.color = layer[SPL_LAYER_COLOR],
                                .depth = layer[SPL_LAYER_DEPTH],
                                .normal = layer[SPL_LAYER_NORMAL],
                                .coverage = layer[SPL_LAYER_COVERAGE]};
}

int spl_truth_init(struct spl_truth *truth, uint32_t width, uint32_t height, struct spl_error *err)
{
    *truth = (struct spl_truth){.dense_share = NAN};
    truth->tolerance = spl_alloc_raw((size_t)width * height, sizeof *truth->tolerance, err);
    return truth->tolerance ? SPL_OK : SPL_E_NOMEM;
}

void spl_truth_finish(struct spl_truth *truth)
{
    for (int i = 0; i < SPL_LAYER_COUNT; i++) {
        spl_image_finish(&truth->images[i]);
        spl_image_finish(&truth->dense_images[i]);
    }
    free(truth->tolerance);
    free(truth->dense);
}

static int copy_dense(struct spl_truth *truth, struct spl_error *err)
{
    for (int i = 0; i < SPL_LAYER_COUNT; i++) {
        const struct spl_image *from = &truth->images[i];
        struct spl_image *copy = &truth->dense_images[i];
        if (!from->pixels)
            continue;
        size_t pixels = (size_t)from->width * from->height, bytes = spl_pixel_bytes(from->type);
        *copy = *from;
        copy->pixels = spl_alloc_raw(pixels, bytes, err);
        if (!copy->pixels)
            return SPL_E_NOMEM;
        memcpy(copy->pixels, from->pixels, pixels * bytes);
        spl_dense_blank(copy, truth->dense);
    }
    return SPL_OK;
}

int spl_truth_mark_dense(struct spl_truth *truth, const struct spl_image *points, struct spl_error *err)
{
    const struct spl_image *depth = &truth->images[SPL_LAYER_DEPTH];
    const float *z = depth->pixels;
    size_t pixels = (size_t)depth->width * depth->height, covered = 0;
    truth->dense = spl_alloc_raw(pixels, 1, err);
    if (!truth->dense)
        return SPL_E_NOMEM;
    int64_t marked = spl_dense_mark(points, depth, truth->dense, err);
    if (marked < 0)
        return (int)marked;
    for (size_t i = 0; i < pixels; i++)
        covered += isfinite(z[i]);
    truth->dense_share = covered ? (double)marked / (double)covered : 0;
    truth->dense_of_all = (double)marked / (double)pixels;
    return copy_dense(truth, err);
}

static int compare_dense(const struct spl_truth *truth, struct spl_image images[SPL_LAYER_COUNT],
                         struct spl_metrics *out, struct spl_error *err)
{
    *out = (struct spl_metrics){NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN};
    if (!(truth->dense_of_all > 0))
        return SPL_OK;
    for (int i = 0; i < SPL_LAYER_COUNT; i++)
        spl_dense_blank(&images[i], truth->dense);
    struct spl_picture image = picture(images), reference = picture(truth->dense_images);
    reference.tolerance_m = truth->tolerance;
    int rc = spl_metrics_compare(&image, &reference, 0, out, err);
    out->psnr += 10 * log10(truth->dense_of_all); /* the empty pixels do not differ */
    out->ssim = out->halo = NAN;
    return rc;
}

int spl_truth_compare(const struct spl_truth *truth, struct spl_image images[SPL_LAYER_COUNT], struct spl_metrics *all,
                      struct spl_metrics *dense, struct spl_error *err)
{
    struct spl_picture image = picture(images), reference = picture(truth->images);
    reference.tolerance_m = truth->tolerance;
    int rc = spl_metrics_compare(&image, &reference, 0, all, err);
    return rc ? rc : compare_dense(truth, images, dense, err);
}
