/* Along a path the image's error changes from frame to frame (api/measures.md: popping is its largest step). The limit
 * is what the truth itself changes between two frames: what changes less than the motion does is not seen as a jump.
 * Points are one sample of their pixel, each frame another, so they shimmer everywhere (table.json says how much); of
 * them no step may stand out from the others, half as large again as their root mean square. Filled, they hold to the
 * same limits as splats, and no frame of the wall has holes that could crawl.
 * The paths are those of a viewer at 25 frames a second: walking at 1.5 m/s, turning by 30 degrees a second; and a
 * fall from 12 m to 1.5 m before a wall, which changes three levels of detail. Through the courtyard, with leaves and
 * silhouettes, image and truth both change at edges, each in its own way: half as much again as the truth is let pass,
 * with 2 x 2 samples, for one sample a pixel aliases whatever the method. */
#include "themes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "measure.h"
#include "support/motion.h"

enum { WIDTH = 128, HEIGHT = 96, FRAMES = 12 };
static const double jump = 1.5;      /* times the other steps */
static const double crawling = 1e-3; /* share of pixels: what check_walls() lets pass of filled points */

/* Frame i of a path. */
static struct spl_view dolly(const struct world *world, int i)
{
    double eye[3] = {43.2 + 0.03 * i, -3, 1.7}, target[3] = {eye[0], 0, 2};
    return world_look(world, eye, target, 50, WIDTH, HEIGHT);
}

static struct spl_view turn(const struct world *world, int i)
{
    double yaw = (105 - 1.2 * i) * M_PI / 180, eye[3] = {43.5, -3, 1.7};
    return world_look(world, eye, (double[3]){eye[0] + cos(yaw), eye[1] + sin(yaw), 1.8}, 50, WIDTH, HEIGHT);
}

static struct spl_view approach(const struct world *world, int i)
{
    double away = 6 * pow(1.5 / 6, (double)i / (FRAMES - 1));
    return world_look(world, (double[3]){44, -away, 2}, (double[3]){44, 0, 2}, 40, WIDTH, HEIGHT);
}

/* A step sideways every frame, between the columns towards the tree. */
static struct spl_view walk(const struct world *world, int i)
{
    double eye[3] = {-6 + 0.06 * i, -4.5, 1.7}, target[3] = {eye[0] + 3, 2, 1.7};
    return world_look(world, eye, target, 60, WIDTH, HEIGHT);
}

static const struct {
    const char *name, *scene;
    struct spl_view (*view)(const struct world *world, int i);
    double samples, steps; /* a pixel's side; times the truth's own */
} paths[] = {{"dolly", "density", dolly, 1, 1},
             {"turn", "density", turn, 1, 1},
             {"approach", "density", approach, 1, 1},
             {"walk", "courtyard", walk, 2, 1.5}};

static void check_path(struct suite *suite, const struct world *world, size_t p)
{
    struct motion motion[SPL_METHOD_COUNT] = {0}, own = {0}; /* own: the truth's, against an image that never changes */
    uint8_t *grey = calloc((size_t)WIDTH * HEIGHT, 4);
    struct spl_image still = {SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, WIDTH, HEIGHT, grey};
    double flicker, popping, steps, step, holes[SPL_METHOD_COUNT] = {0};
    bool rendered = grey;
    for (int i = 0; i < FRAMES && rendered; i++) {
        struct spl_view view = paths[p].view(world, i);
        struct spl_image truth[SPL_LAYER_COUNT];
        truth_render(world, &view.camera, truth);
        motion_add(&own, &truth[SPL_LAYER_COLOR], &still);
        for (int method = 0; method < SPL_METHOD_COUNT && rendered; method++) {
            struct place place = {world->name, paths[p].name, spl_method_name((enum spl_method)method), "color"};
            struct spl_frame frame;
            view.method = (enum spl_method)method;
            view.supersample = paths[p].samples;
            if (suite->plant == PLANT_POP && i >= FRAMES / 2)
                view.lod = 16;
            rendered = world_render(suite, world, &place, &view, &frame);
            if (!rendered)
                break;
            motion_add(&motion[method], &frame.images[SPL_LAYER_COLOR], &truth[SPL_LAYER_COLOR]);
            if (method != SPL_METHOD_POINTS && paths[p].view != walk) /* where a scan has shadows, holes are right */
                holes[method] = fmax(holes[method], measure_frame(world, &view, &frame, truth).holes);
            spl_frame_finish(&frame);
        }
        truth_finish(truth);
    }
    motion_finish(&own, &steps, &step);
    steps *= paths[p].steps;
    step *= paths[p].steps;
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        struct place place = {world->name, paths[p].name, spl_method_name((enum spl_method)method), "color"};
        motion_finish(&motion[method], &flicker, &popping);
        bool shimmers = method == SPL_METHOD_POINTS;
        report_at_most(&suite->report, "no-pop", &place, popping, shimmers ? fmax(step, jump * flicker) : step,
                       "levels; the truth's own largest step");
        if (shimmers)
            continue;
        report_at_most(&suite->report, "no-flicker", &place, flicker, steps, "levels; the truth's own steps");
        place.layer = "coverage";
        if (paths[p].view != walk)
            report_at_most(&suite->report, "no-holes", &place, holes[method], crawling, "share of a frame's pixels");
    }
    free(grey);
}

void check_motion(struct suite *suite)
{
    struct world world = {0};
    for (size_t p = 0; p < (suite->plant ? 1 : sizeof paths / sizeof *paths); p++) {
        if (!p || strcmp(paths[p].scene, paths[p - 1].scene)) {
            if (p)
                world_finish(suite, &world);
            world_init(&world,
                       &(struct scan){.scene = paths[p].scene, .points = suite->whole ? 1000000 : 200000, .noise = -1});
        }
        check_path(suite, &world, p);
    }
    world_finish(suite, &world);
}
