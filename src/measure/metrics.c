/* The front of the metrics: checks once, then one part a group of figures.
 *
 * Every part trusts sizes and types, and writes only its own fields; what lacks a layer stays NAN. Scratch is taken
 * here, once for all parts. No state; any thread. */
#include "measure/metrics.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "measure/metrics_parts.h"

struct size {
    uint32_t width, height; /* 0 before the first layer */
};

static int check_layer(const struct spl_image *image, enum spl_layer layer, const char *whose, struct size *size,
                       struct spl_error *err)
{
    static const enum spl_pixel_type types[SPL_LAYER_COUNT] = {
        [SPL_LAYER_COLOR] = SPL_PIXEL_RGBA8,
        [SPL_LAYER_DEPTH] = SPL_PIXEL_F32,
        [SPL_LAYER_NORMAL] = SPL_PIXEL_F32X3,
        [SPL_LAYER_COVERAGE] = SPL_PIXEL_F32,
    };
    const char *name = spl_layer_name(layer);
    if (!image)
        return SPL_OK;
    if (image->layer != layer || image->type != types[layer])
        return spl_fail_field(err, SPL_E_INPUT, name, "%s's %s holds layer %s with pixels of type %d", whose, name,
                              spl_layer_name(image->layer), (int)image->type);
    if (!image->width || !image->height || !image->pixels)
        return spl_fail_field(err, SPL_E_INPUT, name, "%s's %s is empty: %u x %u pixels", whose, name, image->width,
                              image->height);
    if (!size->width)
        *size = (struct size){image->width, image->height};
    if (image->width != size->width || image->height != size->height)
        return spl_fail_field(err, SPL_E_INPUT, name, "%s's %s has %u x %u pixels, not %u x %u; compare one size",
                              whose, name, image->width, image->height, size->width, size->height);
    return SPL_OK;
}

static int check(const struct spl_picture *picture, const char *whose, struct size *size, struct spl_error *err)
{
    int rc = check_layer(picture->color, SPL_LAYER_COLOR, whose, size, err);
    if (!rc)
        rc = check_layer(picture->depth, SPL_LAYER_DEPTH, whose, size, err);
    if (!rc)
        rc = check_layer(picture->normal, SPL_LAYER_NORMAL, whose, size, err);
    if (!rc)
        rc = check_layer(picture->coverage, SPL_LAYER_COVERAGE, whose, size, err);
    if (!rc && !(picture->tolerance >= 0))
        rc = spl_fail_field(err, SPL_E_INPUT, "tolerance", "%s's tolerance of %g is no distance", whose,
                            picture->tolerance);
    return rc;
}

int spl_metrics_compare(const struct spl_picture *image, const struct spl_picture *truth, unsigned threads,
                        struct spl_metrics *out, struct spl_error *err)
{
    struct spl_metrics m = {NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN};
    struct size size = {0};
    float *scratch = NULL;
    double *rows = NULL;
    int rc = check(truth, "the truth", &size, err);
    if (!rc)
        rc = check(image, "the image", &size, err);
    if (rc)
        return rc;
    bool depth = image->depth && truth->depth, normal = image->normal && truth->normal;
    if (depth || normal) {
        scratch = spl_alloc_raw((size_t)size.width * size.height, sizeof *scratch, err);
        rows = spl_alloc_raw(size.height, sizeof *rows, err);
        if (!scratch || !rows) {
            rc = SPL_E_NOMEM;
            goto done;
        }
    }
    if (image->color && truth->color && (rc = spl_metrics_color(image->color, truth->color, threads, &m, err)))
        goto done;
    if (depth)
        spl_metrics_depth(image, truth, threads, scratch, rows, &m);
    if (normal)
        spl_metrics_normal(image->normal, truth->normal, threads, scratch, rows, &m);
    if (image->coverage && truth->coverage)
        spl_metrics_coverage(image->coverage, truth->coverage, threads, &m);
    *out = m;
done:
    free(scratch);
    free(rows);
    return rc;
}
