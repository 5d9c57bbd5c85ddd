/* Random points are a function of their index alone (synth/random.h), so a world is the same on every machine. A point
 * has the exact colour of its surface, also where noise moves it off. */
#include "scattered.h"

#include <math.h>
#include <stdlib.h>

#include "synth/build.h"
#include "synth/random.h"

static const double east[3] = {1, 0, 0}, north[3] = {0, 1, 0}, up[3] = {0, 0, 1}, origin[3] = {0};
static const double half[2] = {2, 1.5}, ball = 0.003, noise = 0.03, scanner[3] = {0.4, -0.3, 1.9}, far_away = 2000;

enum { sand, iron, meadow, brick };
static const struct spl_material materials[] = {
    [sand] = {.kind = SPL_MATERIAL_PLASTER,
              .colors = {{60, 100, 110}, {210, 190, 150}, {180, 90, 50}},
              .size = {0.9, 0.9},
              .finest = 0.1,
              .seed = 601},
    [iron] = {.kind = SPL_MATERIAL_FLAT, .colors = {{20, 24, 60}}},
    [meadow] = {.kind = SPL_MATERIAL_PLASTER,
                .colors = {{60, 90, 30}, {120, 150, 60}, {190, 180, 110}},
                .size = {12, 12},
                .finest = 1,
                .seed = 607},
    [brick] = {.kind = SPL_MATERIAL_PLASTER,
               .colors = {{140, 60, 40}, {190, 110, 80}, {220, 180, 150}},
               .size = {200, 200},
               .finest = 20,
               .seed = 613},
};

static const struct {
    const char *name;
    size_t surface, strays; /* points on the sheet or ground, in the air */
} sets[SCATTERED_COUNT] = {
    [SCATTERED_NOISE] = {"thick-noise", 100000, 0}, [SCATTERED_STRAYS] = {"strays", 7500, 50},
    [SCATTERED_SWARM] = {"swarm", 7500, 5000},      [SCATTERED_GROUND] = {"ground", 96000, 0},
    [SCATTERED_HORIZON] = {"horizon", 0, 0},
};

static struct spl_skin skin(struct spl_scene *scene, uint32_t material)
{
    return (struct spl_skin){material, spl_build_object(scene, scene->name)};
}

static void build_horizon(struct spl_scene *scene)
{
    spl_build_rectangle(scene, skin(scene, meadow), origin, east, north, (double[2]){far_away, far_away}, NULL);
    spl_build_sphere(scene, skin(scene, sand), (double[3]){-0.06, 0.24, 1.53}, 0.06);
    static const double aside[3] = {0.25, 0.1, 0.45};
    for (int i = 0; i < 3; i++) {
        double away = 2 * pow(10, i), width = 0.05 * away, height = 0.3 * away;
        spl_build_box(scene, skin(scene, i < 2 ? sand : brick), (double[3]){aside[i] * away, away, height}, east,
                      (double[3]){width, width, height});
    }
    spl_build_rectangle(scene, skin(scene, brick), (double[3]){-200, far_away, 200}, east, up, (double[2]){500, 200},
                        NULL);
}

/* The surface, then a ball for each stray point, whose centre is the point. Colours all points. */
static struct spl_scene *build(enum scattered what, struct point *points, size_t count)
{
    struct spl_scene *scene = calloc(1, sizeof *scene);
    struct spl_error err = {0};
    if (!scene)
        abort();
    scene->name = sets[what].name;
    scene->materials = materials;
    if (what == SCATTERED_HORIZON)
        build_horizon(scene);
    else if (what == SCATTERED_GROUND)
        spl_build_rectangle(scene, skin(scene, meadow), (double[3]){0, 30, 0}, east, north, (double[2]){20, 30}, NULL);
    else
        spl_build_rectangle(scene, skin(scene, sand), origin, east, up, half, NULL);
    for (size_t i = 0; i < sets[what].strays; i++)
        spl_build_sphere(scene, skin(scene, iron), points[i].position, ball);
    for (size_t i = 0; i < count && !scene->error.code; i++) /* before the hierarchy puts primitives in its order */
        spl_scene_color(scene, (uint32_t)(i < sets[what].strays ? i + 1 : 0), points[i].position, points[i].color);
    if (scene->error.code || spl_bvh_build(scene->primitives, scene->primitive_count, &scene->nodes, &err))
        abort();
    return scene;
}

static struct point *scan_horizon(const struct spl_scene *scene, size_t *count)
{
    enum { across = 200, rows = 120 };
    const double step = 0.6 * M_PI / 180;
    struct point *points = calloc((size_t)across * rows, sizeof *points);
    if (!points)
        abort();
    *count = 0;
    for (int i = 0; i < across * rows; i++) {
        double turn = (i % across - across / 2 + 0.5) * step, rise = (i / across - rows * 3 / 4 + 0.5) * step;
        struct spl_hit hit;
        if (!spl_scene_hit(scene, scanner, (double[3]){sin(turn) * cos(rise), cos(turn) * cos(rise), sin(rise)}, &hit))
            continue;
        struct point *p = &points[(*count)++];
        for (int a = 0; a < 3; a++) {
            p->position[a] = hit.position[a];
            p->color[a] = hit.color[a];
        }
    }
    return points;
}

static struct point *scatter(enum scattered what)
{
    size_t strays = sets[what].strays, count = strays + sets[what].surface;
    struct point *points = calloc(count, sizeof *points);
    if (!points)
        abort();
    for (size_t i = 0; i < count; i++) {
        struct point *p = &points[i];
        uint64_t state = hash64(1000000 + i);
        if (what == SCATTERED_GROUND) {
            p->position[0] = random_between(&state, -20, 20);
            p->position[1] = random_between(&state, 0, 60);
            continue;
        }
        p->position[0] = random_between(&state, -half[0], half[0]);
        p->position[2] = random_between(&state, -half[1], half[1]);
        if (i < strays)
            p->position[1] = random_between(&state, -3, 0);
    }
    return points;
}

void world_init_scattered(struct world *world, enum scattered what)
{
    size_t count = sets[what].strays + sets[what].surface;
    struct point *points = what == SCATTERED_HORIZON ? NULL : scatter(what);
    struct spl_scene *scene = build(what, points, count);
    if (!points)
        points = scan_horizon(scene, &count);
    for (size_t i = 0; i < count && what == SCATTERED_NOISE; i++) {
        uint64_t state = hash64(i);
        for (int k = 0; k < 12; k++) /* near enough to a normal distribution */
            points[i].position[1] += noise * random_between(&state, -0.5, 0.5);
    }
    world_init_points(world, scene->name, points, count);
    world->scene = scene;
    free(points);
}
