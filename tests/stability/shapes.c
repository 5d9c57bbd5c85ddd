/* Scenes of a single primitive that are not in synth's table, and their points: exactly where the surface is, of its
 * exact colour, without a scanner in between. */
#include "shapes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "synth/build.h"

enum { MILLION = 1000000 };

static const double east[3] = {1, 0, 0}, up[3] = {0, 0, 1}, origin[3] = {0};
static const double half[2] = {2, 1.5}, thick = 0.002, ball = 0.01;

enum { flat, banded, marbled };
static const struct spl_material materials[] = {
    [flat] = {.kind = SPL_MATERIAL_FLAT, .colors = {{200, 120, 40}}},
    [banded] = {.kind = SPL_MATERIAL_SOLID,
                .colors = {{40, 60, 90}, {150, 150, 140}, {230, 200, 120}},
                .size = {0.5, 0.5},
                .seed = 503},
    [marbled] = {.kind = SPL_MATERIAL_PLASTER,
                 .colors = {{60, 100, 110}, {210, 190, 150}, {180, 90, 50}},
                 .size = {0.9, 0.9},
                 .seed = 509},
};

static const struct {
    const char *name;
    int material;
    double apart[2]; /* of points, along x and z; metres */
} shapes[SHAPE_COUNT] = {
    [SHAPE_ONE] = {"one-point", flat, {0, 0}},
    [SHAPE_COINCIDENT] = {"coincident", flat, {0, 0}},
    [SHAPE_LINE] = {"collinear", banded, {0.002, 0}},
    [SHAPE_PLANE] = {"coplanar", marbled, {0.01, 0.01}},
    [SHAPE_NEEDLES] = {"needles", marbled, {0.02, 0.002}},
    [SHAPE_SLIVERS] = {"slivers", marbled, {0.1, 0.002}},
};

static void *must_have(void *p)
{
    if (!p)
        abort();
    return p;
}

static struct spl_scene *build(enum shape shape)
{
    struct spl_scene *scene = must_have(calloc(1, sizeof *scene));
    struct spl_error err = {0};
    scene->name = shapes[shape].name;
    scene->materials = materials;
    struct spl_skin skin = {(uint32_t)shapes[shape].material, spl_build_object(scene, shapes[shape].name)};
    if (shape == SHAPE_ONE || shape == SHAPE_COINCIDENT)
        spl_build_sphere(scene, skin, origin, ball);
    else if (shape == SHAPE_LINE)
        spl_build_wire(scene, skin, (double[3]){-half[0], 0, 0}, (double[3]){half[0], 0, 0}, 0, thick, 1);
    else
        spl_build_rectangle(scene, skin, origin, east, up, half, NULL);
    if (scene->error.code || spl_bvh_build(scene->primitives, scene->primitive_count, &scene->nodes, &err))
        abort();
    return scene;
}

void world_init_shape(struct world *world, enum shape shape)
{
    const double *apart = shapes[shape].apart;
    size_t across = apart[0] > 0 ? (size_t)lrint(2 * half[0] / apart[0]) : 1;
    size_t rows = apart[1] > 0 ? (size_t)lrint(2 * half[1] / apart[1]) : shape == SHAPE_COINCIDENT ? MILLION : 1;
    struct spl_scene *scene = build(shape);
    struct point *points = must_have(calloc(across * rows, sizeof *points));
    for (size_t i = 0; i < across * rows; i++) {
        struct point *p = &points[i];
        if (across > 1)
            p->position[0] = ((double)(i % across) + 0.5) * apart[0] - half[0];
        if (apart[1] > 0)
            p->position[2] = ((double)(i / across) + 0.5) * apart[1] - half[1];
        spl_scene_color(scene, 0, p->position, p->color);
    }
    world_init_points(world, shapes[shape].name, points, across * rows);
    world->scene = scene;
    free(points);
}
