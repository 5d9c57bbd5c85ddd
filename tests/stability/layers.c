/* Whatever is in view, each layer holds what its kind allows, and layers of one frame say the same thing: there is a
 * depth, a range, a normal, an id and a primitive exactly where something is covered. The limits are definitions
 * (include/splatd/image.h), so not one pixel may break them. A frame is a function of its request: other frames in
 * between change no byte of it. Two drivers run the same arithmetic; what their rounding may change is one level. */
#include "themes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "surveyed.h"

enum { WIDTH = 160, HEIGHT = 120 };

static size_t pixels_of(const struct spl_image *image)
{
    return (size_t)image->width * image->height;
}

/* Pixels that break the rule of each layer. */
static void count_broken(const struct spl_view *view, const struct spl_frame *f, uint64_t ids,
                         size_t broken[SPL_LAYER_COUNT])
{
    const struct spl_camera *c = &view->camera;
    const uint8_t *color = f->images[SPL_LAYER_COLOR].pixels;
    const float *depth = f->images[SPL_LAYER_DEPTH].pixels, *range = f->images[SPL_LAYER_RANGE].pixels;
    const float *normal = f->images[SPL_LAYER_NORMAL].pixels, *coverage = f->images[SPL_LAYER_COVERAGE].pixels;
    const uint32_t *id = f->images[SPL_LAYER_ID].pixels, *shape = f->images[SPL_LAYER_PRIMITIVE].pixels;
    double samples = view->supersample * view->supersample;
    memset(broken, 0, SPL_LAYER_COUNT * sizeof *broken);
    for (size_t i = 0; i < (size_t)c->width * c->height; i++) {
        double share = coverage[i], x = ((double)(i % c->width) + 0.5 - c->cx) / c->fx,
               y = ((double)(i / c->width) + 0.5 - c->cy) / c->fy, z = depth[i];
        bool there = share > 0;
        broken[SPL_LAYER_COVERAGE] +=
            !(share >= 0 && share <= 1) || fabs(share * samples - rint(share * samples)) > 1e-4;
        broken[SPL_LAYER_COLOR] += fabs(color[4 * i + 3] - 255 * share) > 0.51;
        broken[SPL_LAYER_DEPTH] += there ? !(z > 0 && z < INFINITY) : !isnan(depth[i]);
        broken[SPL_LAYER_RANGE] +=
            there ? !(fabs(range[i] / (z * sqrt(1 + x * x + y * y)) - 1) < 1e-5) : !isnan(range[i]);
        double length = sqrt(normal[3 * i] * (double)normal[3 * i] + normal[3 * i + 1] * (double)normal[3 * i + 1] +
                             normal[3 * i + 2] * (double)normal[3 * i + 2]);
        broken[SPL_LAYER_NORMAL] += there ? !(fabs(length - 1) < 1e-3) : length != 0;
        broken[SPL_LAYER_PRIMITIVE] += there != (shape[i] > SPL_SHAPE_NONE && shape[i] < SPL_SHAPE_COUNT);
        broken[SPL_LAYER_ID] += there ? id[i] >= ids : id[i] != UINT32_MAX;
    }
}

void check_kinds(struct suite *suite, const struct world *world, const struct spl_view *view,
                 const struct spl_frame *frame, struct place place)
{
    size_t broken[SPL_LAYER_COUNT];
    if (view->layers != (1u << SPL_LAYER_COUNT) - 1)
        return; /* layers are held against each other */
    count_broken(view, frame, spl_dataset_get_info(world->dataset)->ids, broken);
    for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
        place.layer = spl_layer_name((enum spl_layer)layer);
        report_at_most(&suite->report, "layer-holds-its-kind", &place, (double)broken[layer], 0,
                       "pixels; image.h says what a layer holds");
    }
}

void check_frame(struct suite *suite, const struct world *world, const struct spl_view *view, struct place place)
{
    struct spl_frame frame, again;
    if (!world_render(suite, world, &place, view, &frame))
        return;
    check_kinds(suite, world, view, &frame, place);
    /* another view in between, so that nothing of this one is left over by chance */
    struct spl_view other = *view;
    other.camera.cx += 40;
    other.lod = 3;
    place.layer = NULL;
    if (world_render(suite, world, &place, &other, &again))
        spl_frame_finish(&again);
    if (world_render(suite, world, &place, view, &again)) {
        for (int layer = 0; layer < SPL_LAYER_COUNT; layer++) {
            const struct spl_image *a = &frame.images[layer], *b = &again.images[layer];
            place.layer = spl_layer_name((enum spl_layer)layer);
            report_at_most(&suite->report, "repeats", &place,
                           memcmp(a->pixels, b->pixels, pixels_of(a) * spl_pixel_bytes(a->type)) != 0, 0,
                           "a frame is a function of its request");
        }
        spl_frame_finish(&again);
    }
    spl_frame_finish(&frame);
}

static const struct scan scans[] = {
    {"courtyard", 200000, -1, 0, 0, 0}, {"thin-walls", 200000, -1, 0, 0, 0}, {"powerline", 100000, -1, 0, 0, 0},
    {"railway", 200000, -1, 0, 0, 0},   {"steps", 200000, -1, 0, 0, 0},      {"density", 200000, -1, 0, 0, 0},
    {"tree", 200000, -1, 0, 0, 0},      {"interior", 200000, -1, 0, 0, 0},
};
enum { scan_count = sizeof scans / sizeof *scans, small_scans = 2 };

void check_layers(struct suite *suite)
{
    for (size_t s = 0; s < (suite->whole ? scan_count : small_scans); s++) {
        struct world world;
        world_init(&world, &scans[s]);
        size_t step = suite->whole ? 1 : 4;
        for (size_t v = 0; v < world.scene->camera_count; v += step)
            for (int method = 0; method < SPL_METHOD_COUNT; method++)
                for (int side = 1; side <= (v && !suite->whole ? 1 : 2); side++) {
                    struct spl_view view = world_view(&world, v, WIDTH, HEIGHT);
                    view.method = (enum spl_method)method;
                    view.supersample = side;
                    struct place place = {world.name, world.scene->cameras[v].name, spl_method_name(view.method), NULL};
                    check_frame(suite, &world, &view, place);
                }
        world_finish(suite, &world);
    }
}

/* Share of pixels whose difference is above `levels` of colour, or `relative` of a float. */
static double differing(const struct spl_image *a, const struct spl_image *b)
{
    size_t count = 0, pixels = pixels_of(a);
    uint32_t parts = spl_pixel_bytes(a->type) / (a->type == SPL_PIXEL_RGBA8 ? 1 : 4);
    for (size_t i = 0; i < pixels; i++) {
        bool differs = false;
        for (uint32_t k = 0; k < parts; k++) {
            size_t at = i * parts + k;
            if (a->type == SPL_PIXEL_RGBA8) {
                differs |= abs(((uint8_t *)a->pixels)[at] - ((uint8_t *)b->pixels)[at]) > 1;
            } else {
                float x = ((float *)a->pixels)[at], y = ((float *)b->pixels)[at];
                bool both = isnan(x) && isnan(y);
                double scale = a->layer == SPL_LAYER_NORMAL ? 1 : fabs(x);
                differs |= !both && !(fabs(x - y) <= (a->layer == SPL_LAYER_NORMAL ? 0.01 : 1e-5) * scale);
            }
        }
        count += differs;
    }
    return (double)count / (double)pixels;
}

/* One view by both. */
static void compare_drivers(struct suite *suite, const struct world *world, const struct spl_view *view,
                            struct place place)
{
    struct spl_frame first, second;
    if (!world_render(suite, world, &place, view, &first))
        return;
    struct suite with_other = *suite;
    with_other.renderer = suite->other;
    bool rendered = world_render(&with_other, world, &place, view, &second);
    suite->report = with_other.report;
    for (int layer = 0; layer < SPL_LAYER_COUNT && rendered; layer++) {
        if (layer == SPL_LAYER_ID)
            continue; /* ties may be broken differently */
        place.layer = spl_layer_name((enum spl_layer)layer);
        report_at_most(&suite->report, "drivers-agree", &place,
                       differing(&first.images[layer], &second.images[layer]), 1e-4,
                       "share of pixels off by more than a level, 1e-5 of a depth, 0.6 degrees");
    }
    spl_frame_finish(&first);
    if (rendered)
        spl_frame_finish(&second);
}

static void compare_views(struct suite *suite, struct world *world, size_t step)
{
    for (size_t v = 0; v < world->scene->camera_count; v += step)
        for (int method = 0; method < SPL_METHOD_COUNT; method++) {
            struct spl_view view = world_view(world, v, WIDTH, HEIGHT);
            view.method = (enum spl_method)method;
            struct place place = {world->name, world->scene->cameras[v].name, spl_method_name(view.method), NULL};
            compare_drivers(suite, world, &view, place);
        }
    world_finish(suite, world);
}

void check_drivers(struct suite *suite)
{
    struct world world;
    for (size_t s = 0; s < (suite->whole ? scan_count : small_scans); s++) {
        world_init(&world, &scans[s]);
        compare_views(suite, &world, suite->whole ? 1 : 3);
    }
    world_init_yard(&world);
    compare_views(suite, &world, 1);
}
