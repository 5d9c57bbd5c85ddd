/* Faces to images. A pixel's ray decides alone, in doubles, which face it is looked up in and where, so images are the
 * same however rows are shared out. */
#include "render/around.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "geom/ray_list.h"
#include "geom/size.h"
#include "image/resample.h"
#include "image/rows.h"
#include "render/readback.h"
#include "render/view.h"

static const float edge = 0.01f; /* of depth */

static bool begin_face(struct spl_around *around, struct spl_view *view)
{
    while (around->face < SPL_FACES && !around->faces.cameras[around->face].width)
        around->face++;
    if (around->face == SPL_FACES)
        return false;
    view->camera = around->faces.cameras[around->face];
    return true;
}

int spl_around_create(struct spl_view *view, struct spl_around **out, struct spl_error *err)
{
    const uint32_t range = 1u << SPL_LAYER_RANGE;
    struct spl_around *around = *out = spl_alloc(1, sizeof *around, err);
    if (!around)
        return SPL_E_NOMEM;
    around->side = (uint32_t)view->supersample;
    int rc = spl_faces_init_of(&around->faces, &view->camera, view->rays, SPL_VIEW_SIDE_MAX, err);
    if (rc)
        return rc;
    if (view->layers & range)
        view->layers = (view->layers & ~range) | 1u << SPL_LAYER_DEPTH;
    begin_face(around, view);
    return SPL_OK;
}

void spl_around_destroy(struct spl_around *around)
{
    for (int face = 0; around && face < SPL_FACES; face++)
        for (int layer = 0; layer < SPL_LAYER_COUNT; layer++)
            spl_image_finish(&around->images[face][layer]);
    free(around);
}

bool spl_around_next(struct spl_around *around, struct spl_image images[SPL_LAYER_COUNT], struct spl_view *view)
{
    if (around->face == SPL_FACES)
        return false;
    memcpy(around->images[around->face], images, sizeof around->images[0]);
    memset(images, 0, sizeof around->images[0]);
    around->face++;
    return begin_face(around, view);
}

bool spl_around_is_empty(const struct spl_around *around)
{
    return !spl_faces_get_pixels(&around->faces);
}

uint64_t spl_around_get_samples_left(const struct spl_around *around)
{
    uint64_t pixels = 0;
    for (unsigned face = around->face + 1; face < SPL_FACES; face++)
        pixels += (uint64_t)around->faces.cameras[face].width * around->faces.cameras[face].height;
    return pixels * around->side * around->side;
}

/* The lesser of the two steps of inverse depth from `own` to its neighbours, 0 where one says nothing, or they turn. */
static double slope(double own, float before, float after)
{
    const double down = own - 1 / (double)before, up = 1 / (double)after - own;
    return down * up > 0 ? (fabs(down) < fabs(up) ? down : up) : 0; /* false for NAN */
}

double spl_around_depth_at(const struct spl_image *image, double x, double y)
{
    const double column = fmin(fmax(floor(x), 1), image->width - 2.0),
                 row = fmin(fmax(floor(y), 1), image->height - 2.0);
    const float *at = (const float *)image->pixels + (size_t)row * image->width + (size_t)column;
    const double own = 1 / (double)*at;
    const double carried = own + slope(own, at[-1], at[1]) * (x - column - 0.5) +
                           slope(own, at[-(ptrdiff_t)image->width], at[image->width]) * (y - row - 0.5);
    return 1 / (carried > own / 2 ? carried : own);
}

/* A pixel that sees nothing. */
static void put_nothing(enum spl_layer layer, const uint8_t background[4], void *to)
{
    memset(to, layer == SPL_LAYER_ID ? 0xff : 0, spl_pixel_bytes(spl_readback_type(layer)));
    if (layer == SPL_LAYER_COLOR && background[3])
        memcpy(to, background, 4);
    if (layer == SPL_LAYER_RANGE)
        *(float *)to = NAN;
}

struct job {
    const struct spl_around *around;
    const struct spl_view *wanted;
    struct spl_image *images;
    uint32_t first; /* row */
};

static void look_up_pixel(const struct job *j, uint32_t x, uint32_t y)
{
    double ray[3], place[2], along = 0;
    const bool listed = j->wanted->rays != NULL;
    const bool sees = listed || spl_camera_get_ray(&j->wanted->camera, x + 0.5, y + 0.5, ray);
    if (listed)
        memcpy(ray, j->wanted->rays->directions[y], sizeof ray);
    const unsigned face = sees ? spl_faces_place(&j->around->faces, ray, place, &along) : 0;
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
        const struct spl_image *image = &j->images[layer], *from = j->around->images[face];
        if (!image->pixels)
            continue;
        void *to = (char *)spl_image_row(image, y) + (size_t)x * spl_pixel_bytes(image->type);
        if (!sees || !j->around->faces.cameras[face].width ||
            !from[layer == SPL_LAYER_RANGE ? SPL_LAYER_DEPTH : layer].pixels)
            put_nothing(layer, j->wanted->background, to);
        else if (layer == SPL_LAYER_RANGE)
            *(float *)to = (float)(spl_around_depth_at(&from[SPL_LAYER_DEPTH], place[0], place[1]) / along);
        else
            spl_image_sample(&from[layer], place[0], place[1], edge, to);
    }
}

static void look_up_rows(void *context, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const struct job *j = context;
    for (size_t y = j->first + begin; y < j->first + end; y++)
        for (uint32_t x = 0; x < j->wanted->camera.width; x++)
            look_up_pixel(j, x, (uint32_t)y);
}

void spl_around_look_up(const struct spl_around *around, const struct spl_view *wanted,
                        struct spl_image images[SPL_LAYER_COUNT], uint32_t begin, uint32_t end)
{
    struct job job = {.around = around, .wanted = wanted, .images = images, .first = begin};
    const size_t rows = wanted->rays ? 1024 : 8; /* of one pixel */
    spl_parallel_for(0, end - begin, rows, look_up_rows, &job);
}
