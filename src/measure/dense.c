/* Counts of hits and of covered pixels in a sliding 9×9, as sums over columns that move down and a sum along the row.
 * Pure; any thread. */
#include "measure/dense.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

enum { reach = 4 };
static const double share_hit = 1 - 0.36787944117144233; /* 1 - 1/e */
static const float near_truth = 0.02f;

struct counts {
    uint32_t hits, covered;
};

static struct counts at_pixel(const float *points, const float *truth, size_t i)
{
    bool covered = truth[i] > 0 && isfinite(truth[i]);
    return (struct counts){.hits = covered && fabsf(points[i] - truth[i]) <= near_truth * truth[i], .covered = covered};
}

/* Adds (sign 1) or takes away (sign -1, modulo 2^32) a row of pixels in all columns. */
static void add_row(struct counts *columns, const float *points, const float *truth, size_t width, size_t y,
                    uint32_t sign)
{
    for (size_t x = 0; x < width; x++) {
        struct counts c = at_pixel(points, truth, y * width + x);
        columns[x].hits += sign * c.hits;
        columns[x].covered += sign * c.covered;
    }
}

static int64_t mark_row(const struct counts *columns, const float *truth, size_t width, uint8_t *dense)
{
    struct counts sum = {0};
    int64_t marked = 0;
    for (size_t x = 0; x < reach && x < width; x++) {
        sum.hits += columns[x].hits;
        sum.covered += columns[x].covered;
    }
    for (size_t x = 0; x < width; x++) {
        if (x + reach < width) {
            sum.hits += columns[x + reach].hits;
            sum.covered += columns[x + reach].covered;
        }
        if (x > reach) {
            sum.hits -= columns[x - reach - 1].hits;
            sum.covered -= columns[x - reach - 1].covered;
        }
        dense[x] = truth[x] > 0 && isfinite(truth[x]) && sum.hits >= share_hit * sum.covered;
        marked += dense[x];
    }
    return marked;
}

int64_t spl_dense_mark(const struct spl_image *points, const struct spl_image *truth, uint8_t *dense,
                       struct spl_error *err)
{
    if (points->type != SPL_PIXEL_F32 || truth->type != SPL_PIXEL_F32 || points->width != truth->width ||
        points->height != truth->height)
        return spl_fail_field(err, SPL_E_INPUT, "depth", "the points' depth has %u x %u pixels, the truth's %u x %u",
                              points->width, points->height, truth->width, truth->height);
    size_t width = truth->width, height = truth->height;
    const float *p = points->pixels, *t = truth->pixels;
    struct counts *columns = spl_alloc(width, sizeof *columns, err);
    if (!columns)
        return SPL_E_NOMEM;
    int64_t marked = 0;
    for (size_t y = 0; y < reach && y < height; y++)
        add_row(columns, p, t, width, y, 1);
    for (size_t y = 0; y < height; y++) {
        if (y + reach < height)
            add_row(columns, p, t, width, y + reach, 1);
        if (y > reach)
            add_row(columns, p, t, width, y - reach - 1, UINT32_MAX);
        marked += mark_row(columns, t + y * width, width, dense + y * width);
    }
    free(columns);
    return marked;
}

void spl_dense_blank(struct spl_image *image, const uint8_t *dense)
{
    size_t count = (size_t)image->width * image->height, bytes = spl_pixel_bytes(image->type);
    for (size_t i = 0; i < count && image->pixels; i++) {
        if (dense[i])
            continue;
        memset((char *)image->pixels + i * bytes, 0, bytes);
        if (image->layer == SPL_LAYER_DEPTH)
            ((float *)image->pixels)[i] = NAN;
    }
}
