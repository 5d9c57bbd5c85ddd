/* What holds of images with maps of stations: they lie where the truth lies, a silhouette's fringe is at most half of
 * what it was, a frame is a function of its request, and along a path nothing jumps or flickers more than the truth
 * itself moves, though colours come from now this station, now that one. */
#include "themes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "measure.h"
#include "surveyed.h"
#include "support/motion.h"

enum { WIDTH = 160, HEIGHT = 120, FRAMES = 12 };
static const double shift_most = 0.15, halo_share = 0.5, halo_least = 1e-3;

static struct spl_view view_of(const struct world *world, const char *camera)
{
    size_t i = 0;
    while (strcmp(world->scene->cameras[i].name, camera))
        i++;
    return world_view(world, i, WIDTH, HEIGHT);
}

static bool takes_maps(int method)
{
    return spl_method_get((enum spl_method)method)->params & SPL_PARAM_BIT(maps);
}

static struct place place_of(const struct world *world, const char *view, int method)
{
    return (struct place){world->name, view, spl_method_name((enum spl_method)method), NULL};
}

static void check_place(struct suite *suite, const struct world *world, const char *camera, int method)
{
    static const char *const axes[] = {"right", "down"};
    struct spl_view view = view_of(world, camera);
    struct place place = place_of(world, camera, method);
    struct spl_image truth[SPL_LAYER_COUNT];
    struct spl_frame frame;
    double shift[2];
    view.method = (enum spl_method)method;
    if (!world_render(suite, world, &place, &view, &frame))
        return;
    truth_render(world, &view.camera, truth);
    measure_shift(&frame, truth, shift);
    for (int a = 0; a < 2; a++) {
        place.layer = axes[a];
        report_at_most(&suite->report, "lies-on-the-truth", &place, fabs(shift[a]), shift_most, "pixels, with maps");
    }
    truth_finish(truth);
    spl_frame_finish(&frame);
}

/* Of the pixels that are empty in truth, those that are painted; NAN after a failure was reported. */
static double get_halo(struct suite *suite, const struct world *world, const struct spl_view *view,
                       const struct place *place, const struct spl_image truth[SPL_LAYER_COUNT])
{
    struct spl_frame frame;
    if (!world_render(suite, world, place, view, &frame))
        return NAN;
    double halo = measure_frame(world, view, &frame, truth).halo;
    spl_frame_finish(&frame);
    return halo;
}

static void check_halo(struct suite *suite, const struct world *world, const char *camera, int method)
{
    struct spl_view view = view_of(world, camera);
    struct place place = place_of(world, camera, method);
    struct spl_image truth[SPL_LAYER_COUNT];
    truth_render(world, &view.camera, truth);
    view.method = (enum spl_method)method;
    view.maps = SPL_MAPS_OFF;
    double without = get_halo(suite, world, &view, &place, truth);
    view.maps = SPL_MAPS_ON;
    double with = get_halo(suite, world, &view, &place, truth);
    truth_finish(truth);
    report_at_least(&suite->report, "halo-to-trim", &place, without, halo_least, "else trimming has nothing to show");
    report_at_most(&suite->report, "halo-is-trimmed", &place, with, halo_share * without,
                   "share of empty pixels; half of those without maps");
}

/* Frame i along the wall from before the text to before the masonry, past the post: stations take turns. */
static struct spl_view walk(const struct world *world, int i)
{
    double eye[3] = {-0.35 + 0.06 * i, -0.9, 1.4}, target[3] = {eye[0] + 0.1, 1, 1.2};
    return world_look(world, eye, target, 60, WIDTH, HEIGHT);
}

static void check_walk(struct suite *suite, const struct world *world, int method)
{
    struct motion motion = {0}, own = {0}; /* own: the truth's, against an image that never changes */
    uint8_t *grey = calloc((size_t)WIDTH * HEIGHT, 4);
    struct spl_image still = {SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, WIDTH, HEIGHT, grey};
    struct place place = place_of(world, "walk", method);
    double flicker, popping, steps, step;
    bool rendered = grey;
    for (int i = 0; i < FRAMES && rendered; i++) {
        struct spl_view view = walk(world, i);
        struct spl_image truth[SPL_LAYER_COUNT];
        struct spl_frame frame;
        view.method = (enum spl_method)method;
        view.supersample = 2;
        truth_render(world, &view.camera, truth);
        rendered = world_render(suite, world, &place, &view, &frame);
        if (rendered) {
            motion_add(&own, &truth[SPL_LAYER_COLOR], &still);
            motion_add(&motion, &frame.images[SPL_LAYER_COLOR], &truth[SPL_LAYER_COLOR]);
            spl_frame_finish(&frame);
        }
        truth_finish(truth);
    }
    free(grey);
    motion_finish(&own, &steps, &step);
    motion_finish(&motion, &flicker, &popping);
    if (!rendered)
        return;
    report_at_most(&suite->report, "no-pop", &place, popping, step, "levels; the truth's own largest step");
    report_at_most(&suite->report, "no-flicker", &place, flicker, steps, "levels; the truth's own steps");
}

void check_maps(struct suite *suite)
{
    struct world world;
    world_init_yard(&world);
    if (suite->plant == PLANT_NO_TRIM)
        world_stop_trimming(&world);
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        if (!takes_maps(method))
            continue;
        check_halo(suite, &world, "skyline", method);
        check_halo(suite, &world, "wires", method);
        check_place(suite, &world, "text", method);
        check_place(suite, &world, "masonry", method);
        check_place(suite, &world, "station", method);
        check_walk(suite, &world, method);
        for (size_t v = 0; v < world.scene->camera_count; v += suite->whole ? 1 : 4) {
            struct spl_view view = world_view(&world, v, WIDTH, HEIGHT);
            view.method = (enum spl_method)method;
            check_frame(suite, &world, &view, place_of(&world, world.scene->cameras[v].name, method));
        }
    }
    world_finish(suite, &world);
}
