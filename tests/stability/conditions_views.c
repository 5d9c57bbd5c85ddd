/* Where an eye may be, what it may take in, and how large an image may be: the wall of `density` (1200 points a square
 * metre around x = 44) from very close and very flat, and the courtyard, near the origin and far from it. */
#include "conditions.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { WIDTH = 160, HEIGHT = 120 };

static const double overview[3] = {-9.3, -7.3, 1.7}, middle[3] = {3, 2, 1.9};

static void grazing(struct conditions *c, const struct world *wall)
{
    static const struct {
        const char *value;
        double degrees;
    } angles[] = {{"30 degrees", 30}, {"10 degrees", 10}, {"3 degrees", 3}, {"1 degree", 1}, {"0.3 degrees", 0.3}};
    for (size_t i = 0; i < sizeof angles / sizeof *angles; i++) {
        double a = angles[i].degrees * M_PI / 180, eye[3] = {44 - 4 * cos(a), -4 * sin(a), 2};
        struct spl_view view = world_look(wall, eye, (double[3]){44, 0, 2}, 40, WIDTH, HEIGHT);
        conditions_measure(c, wall, &view, "grazing angles", angles[i].value, false);
    }
}

/* A plane at 4.2 m is the target's own view depth: half of the wall lies before it. */
static void near_plane(struct conditions *c, const struct world *wall)
{
    static const struct {
        const char *value;
        double near;
    } planes[] = {{"through a wall aslant", 4.2}, {"just before a wall", 2.9}, {"just behind a wall", 3.1}};
    for (size_t i = 0; i < sizeof planes / sizeof *planes; i++) {
        double x = i ? 44 : 44 - sqrt(4.2 * 4.2 - 9);
        struct spl_view view = world_look(wall, (double[3]){x, -3, 2}, (double[3]){44, 0, 2}, 40, WIDTH, HEIGHT);
        view.camera.near = planes[i].near;
        conditions_measure(c, wall, &view, "near plane", planes[i].value, false);
    }
}

static void inside_a_splat(struct conditions *c, const struct world *wall)
{
    static const struct {
        const char *value;
        double away;
    } eyes[] = {{"20 mm before a wall", 0.02}, {"5 mm before it", 0.005}, {"1 mm before it", 0.001}};
    for (size_t i = 0; i < sizeof eyes / sizeof *eyes; i++) {
        double eye[3] = {44, -eyes[i].away, 2};
        struct spl_view view = world_look(wall, eye, (double[3]){45, eye[1] + 0.3, 2}, 60, WIDTH, HEIGHT);
        view.camera.near = 1e-4;
        conditions_measure(c, wall, &view, "camera inside a splat", eyes[i].value, false);
    }
    struct spl_view view = world_look(wall, (double[3]){44, -0.001, 2}, (double[3]){44.5, -1, 1.5}, 60, WIDTH, HEIGHT);
    view.camera.near = 1e-4;
    conditions_measure(c, wall, &view, "camera inside a splat", "looking away from it", false);
}

static void fields_of_view(struct conditions *c, const struct world *yard)
{
    static const double degrees[] = {0.1, 1, 10, 90, 120, 150, 170};
    for (size_t i = 0; i < sizeof degrees / sizeof *degrees; i++) {
        char value[32];
        snprintf(value, sizeof value, "%g degrees", degrees[i]);
        struct spl_view view = world_look(yard, overview, middle, degrees[i], WIDTH, HEIGHT);
        conditions_measure(c, yard, &view, "field of view", value, false);
    }
}

static void sizes(struct conditions *c, const struct world *yard)
{
    static const uint32_t sizes[][3] = {{1, 1, 0},       {2, 2, 0},      {16, 16, 0},     {64, 64, 0},
                                        {8192, 2, 0},    {2, 8192, 0},   {1024, 1024, 1}, {4096, 4096, 1},
                                        {8192, 4096, 1}, {8192, 8192, 1}};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        char value[32];
        const uint32_t *side = sizes[i];
        snprintf(value, sizeof value, "%u x %u", side[0], side[1]);
        if ((side[2] && !c->suite->whole) || !conditions_wants(c, "image size"))
            continue;
        struct spl_view view = world_look(yard, overview, middle, 70, side[0], side[1]);
        if (side[0] == 8192 && side[1] == 8192) /* a frame of all layers is 2 GB */
            view.layers &= ~(1u << SPL_LAYER_NORMAL | 1u << SPL_LAYER_RANGE);
        if (side[0] == 8192 && side[1] == 2) /* 70 degrees across, not 170 */
            view.camera.fx = view.camera.fy = 8192 / (2 * tan(35 * M_PI / 180));
        conditions_measure(c, yard, &view, "image size", value, side[2]);
    }
}

/* From far above the yard's corner; its 25 m fill the image but in the last row. */
static void far_eyes(struct conditions *c, const struct world *yard)
{
    static const struct {
        const char *value;
        double away, fov;
    } eyes[] = {{"10^3 m", 1e3, 0},
                {"10^6 m", 1e6, 0},
                {"10^9 m", 1e9, 0},
                {"10^3 m, 60 degrees", 1e3, 60},
                {"10^9 m, 60 degrees", 1e9, 60}};
    for (size_t i = 0; i < sizeof eyes / sizeof *eyes; i++) {
        double d = eyes[i].away, fov = eyes[i].fov > 0 ? eyes[i].fov : 2 * atan(12.5 / d) * 180 / M_PI;
        double eye[3] = {-0.5 * d, -0.4 * d, sqrt(1 - 0.41) * d};
        struct spl_view view = world_look(yard, eye, (double[3]){0}, fov, WIDTH, HEIGHT);
        view.camera.near = 1;
        conditions_measure(c, yard, &view, "eye far away", eyes[i].value, false);
    }
}

/* The same scan elsewhere, its truth and eye with it. */
static void offsets(struct conditions *c)
{
    static const struct {
        const char *value;
        double offset;
        bool whole_only;
    } places[] = {{"at the origin", 0, false}, {"10^9 m", 1e9, true}, {"10^11 m", 1e11, false}};
    const struct scan scan = {.scene = "courtyard", .points = 100000, .noise = -1};
    size_t count;
    if (!conditions_wants(c, "huge coordinates"))
        return;
    struct point *points = world_scan(&scan, &count);
    double moved_before = 0;
    for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
        struct world world;
        double moved = places[i].offset - moved_before;
        struct spl_error err = {0};
        if (places[i].whole_only && !c->suite->whole)
            continue;
        moved_before = places[i].offset;
        for (size_t p = 0; p < count; p++)
            for (int a = 0; a < 3; a++)
                points[p].position[a] += moved;
        world_init_points(&world, "courtyard", points, count);
        if (spl_scene_create("courtyard", &world.scene, &err))
            abort();
        for (int a = 0; a < 3; a++)
            world.scene->offset[a] = places[i].offset;
        struct spl_view view = world_look(&world, overview, middle, 70, WIDTH, HEIGHT);
        conditions_measure(c, &world, &view, "huge coordinates", places[i].value, places[i].whole_only);
        world_finish(c->suite, &world);
    }
    free(points);
}

void conditions_of_views(struct conditions *c)
{
    struct world world;
    if (conditions_wants(c, "grazing angles") || conditions_wants(c, "near plane") ||
        conditions_wants(c, "camera inside a splat")) {
        world_init(&world, &(struct scan){.scene = "density", .points = 200000, .noise = -1});
        grazing(c, &world);
        near_plane(c, &world);
        inside_a_splat(c, &world);
        world_finish(c->suite, &world);
    }
    if (conditions_wants(c, "field of view") || conditions_wants(c, "image size") ||
        conditions_wants(c, "eye far away")) {
        world_init(&world, &(struct scan){.scene = "courtyard", .points = 100000, .noise = -1});
        fields_of_view(c, &world);
        sizes(c, &world);
        far_eyes(c, &world);
        world_finish(c->suite, &world);
    }
    offsets(c);
}
