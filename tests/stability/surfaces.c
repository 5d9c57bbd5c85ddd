/* Surfaces, where the truth leaves no choice:
 * - an image lies where the truth lies: the mean shift is 0, whatever the splats' blur, which has no direction. A
 * seventh of a pixel is let pass, as noise of the estimate. Of two points in a pixel of a slanting surface the nearer
 * one wins, on average 1/6 of a pixel off its middle;
 * - a wall with a point for every second pixel or more has no hole. Between random points, 3.5 to a sector, filling
 * leaves one where four of eight sectors around a pixel are empty: less than one pixel in a thousand;
 * - range noise has the mean 0, so a blended surface has it too. Splats that only stand in front of each other come out
 *   nearer by about the noise; half of its sigma across the wall is the limit. Filled points are not
 *   blended, but at a point for every second pixel few hide one another, and what fills is the mean of those around;
 * - where a scan stands in the world changes nothing: 5000 km away the same image, to 60 dB. */
#include "themes.h"

#include <math.h>
#include <stdlib.h>

#include "measure.h"

enum { WIDTH = 320, HEIGHT = 240 };

/* Every sample camera, each method: shifts. */
static void check_place(struct suite *suite, const struct scan *scan)
{
    struct world world;
    world_init(&world, scan);
    for (size_t v = 0; v < world.scene->camera_count; v += suite->whole ? 1 : 4) {
        struct spl_view view = world_view(&world, v, WIDTH, HEIGHT);
        struct spl_image truth[SPL_LAYER_COUNT];
        truth_render(&world, &view.camera, truth);
        for (int method = 0; method < SPL_METHOD_COUNT; method++) {
            struct spl_frame frame;
            double shift[2];
            view.method = (enum spl_method)method;
            struct place place = {world.name, world.scene->cameras[v].name, spl_method_name(view.method), "color"};
            if (!world_render(suite, &world, &place, &view, &frame))
                continue;
            measure_shift(&frame, truth, shift);
            report_at_most(&suite->report, "lies-on-the-truth", &place, hypot(shift[0], shift[1]),
                           method == SPL_METHOD_SPLAT ? 0.1 : 0.25,
                           "pixels; blur has no direction, the nearer of two points on a slant is 1/6 off");
            spl_frame_finish(&frame);
        }
        truth_finish(truth);
    }
    world_finish(suite, &world);
}

/* The end of `density` that has 2000 points a square metre: 22 mm apart, a pixel is 19 mm. */
void check_walls(struct suite *suite)
{
    const double noise = 0.006, across = noise / sqrt(2); /* the beams come at 45 degrees */
    struct world world;
    world_init(&world, &(struct scan){.scene = "density", .points = 200000, .noise = noise});
    for (int i = 0; i < (suite->plant ? 1 : 3); i++) {
        static const double eyes[3][3] = {{44, -4, 1.7}, {43, -4, 2.5}, {44, -1.5, 2}};
        static const double target[3] = {44, 0, 2.2}, sides[3] = {1, 2, 4};
        struct spl_view view = world_look(&world, eyes[i], target, 30, WIDTH / 2, HEIGHT / 2);
        struct place place = {world.name,
                              i == 0   ? "dense-wall"
                              : i == 1 ? "dense-wall-aslant"
                                       : "dense-wall-near",
                              "splat", NULL};
        struct spl_image truth[SPL_LAYER_COUNT];
        truth_render(&world, &view.camera, truth);
        for (int s = 0; s < 6; s++) {
            struct spl_frame frame;
            view.method = s < 3 ? SPL_METHOD_SPLAT : SPL_METHOD_FILL;
            view.supersample = sides[s % 3];
            place.method = spl_method_name(view.method);
            if (!world_render(suite, &world, &place, &view, &frame))
                continue;
            place.layer = "coverage";
            report_at_most(&suite->report, "no-holes", &place, measure_frame(&world, &view, &frame, truth).holes,
                           s < 3 ? 0 : 1e-3, "share of pixels; discs overlap, points have others around");
            place.layer = "depth";
            double bias = measure_depth_bias(&frame, truth, 0.1);
            report_at_most(&suite->report, "depth-unbiased", &place, fabs(bias) / across, 0.5,
                           "of the noise's sigma, whose mean is 0");
            spl_frame_finish(&frame);
        }
        truth_finish(truth);
    }
    world_finish(suite, &world);
}

/* The courtyard where it is, and elsewhere. */
void check_far_away(struct suite *suite)
{
    static const double far_away[3] = {5e6, -5e6, 5e6};
    size_t count;
    struct scan scan = {.scene = "courtyard", .points = 100000, .noise = -1};
    struct point *points = world_scan(&scan, &count);
    struct world here, there;
    world_init_points(&here, "courtyard", points, count);
    for (size_t i = 0; i < count; i++)
        for (int a = 0; a < 3; a++)
            points[i].position[a] += far_away[a];
    world_init_points(&there, "courtyard-5000km", points, count);
    free(points);
    static const double eye[3] = {-9.3, -7.3, 1.7}, target[3] = {3, 2, 1.9};
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        struct spl_view view = world_look(&here, eye, target, 70, WIDTH, HEIGHT);
        view.method = (enum spl_method)method;
        struct place place = {there.name, "overview", spl_method_name(view.method), "color"};
        struct spl_frame near, far;
        if (!world_render(suite, &here, &place, &view, &near))
            continue;
        for (int a = 0; a < 3; a++)
            view.camera.eye[a] += far_away[a];
        if (world_render(suite, &there, &place, &view, &far)) {
            struct spl_metrics metrics = measure_frame(&there, &view, &far, near.images);
            report_at_least(&suite->report, "same-far-away", &place, metrics.psnr, 60,
                            "dB; positions are relative before they are floats");
            place.layer = "depth"; /* a float's rounding */
            report_at_most(&suite->report, "same-far-away", &place, metrics.depth_median, 1e-5,
                           "metres, median; the same");
            spl_frame_finish(&far);
        }
        spl_frame_finish(&near);
    }
    world_finish(suite, &here);
    world_finish(suite, &there);
}

/* Scenes that a scan can fill with a point a pixel: where it cannot, what is there depends on where the points fell. */
void check_places(struct suite *suite)
{
    static const char *const scenes[] = {"courtyard", "interior"};
    for (size_t i = 0; i < (suite->plant ? 1 : sizeof scenes / sizeof *scenes); i++)
        check_place(suite, &(struct scan){.scene = scenes[i], .points = suite->whole ? 2000000 : 200000, .noise = -1});
}
