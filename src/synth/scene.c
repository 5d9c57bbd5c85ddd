/* The table of scenes, and exact answers to rays. A scene is a list of primitives under a bounding volume hierarchy;
 * the user's seed never changes it. */
#include "synth/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "synth/build.h"
#include "synth/synth.h"
#include "geom/vector.h"

static const struct {
    const char *name, *help;
    void (*build)(struct spl_scene *scene);
} scenes[] = {
    {"courtyard", "20 x 16 m: textured facades, columns, a sphere, wires, a tree; 4 terrestrial stations",
     spl_build_courtyard},
    {"railway", "120 m of two curved tracks: rails, catenary wires, a platform, a bridge; mobile, two heads",
     spl_build_railway},
    {"powerline", "400 x 120 m: pylons, conductors, fields, trees, a road; airborne, UTM coordinates, 20 points/m2",
     spl_build_powerline},
    {"thin-walls", "sheets 5 to 50 mm apart, a wedge, sheets seen edge-on; 5 terrestrial stations",
     spl_build_thin_walls},
    {"steps", "stairs of 1 mm to 1 m, fins and pickets of all spacings; 5 terrestrial stations", spl_build_steps},
    {"density", "one surface, 1 to 10000 points/m2 along its 46 m (at a million points)", spl_build_density},
    {"tree", "three trees, a hedge, a brick wall behind; 5 terrestrial stations", spl_build_trees},
    {"interior", "two furnished rooms with a door between and labelled walls; 5 terrestrial stations",
     spl_build_interior},
};
enum { scene_count = sizeof scenes / sizeof *scenes };

const char *spl_synth_scene_name(size_t i)
{
    return i < scene_count ? scenes[i].name : NULL;
}

const char *spl_synth_scene_help(size_t i)
{
    return i < scene_count ? scenes[i].help : NULL;
}

static int unknown(const char *name, struct spl_error *err)
{
    char names[256] = "";
    for (size_t i = 0; i < scene_count; i++)
        snprintf(names + strlen(names), sizeof names - strlen(names), "%s%s", i ? ", " : "", scenes[i].name);
    return spl_fail_field(err, SPL_E_USAGE, "scene", "there is no scene '%s'; there are: %s", name, names);
}

static void classify(struct spl_scene *scene)
{
    uint8_t *classes = spl_alloc(scene->object_count, 1, &scene->error);
    scene->classes = classes;
    for (size_t i = 0; classes && i < scene->object_count; i++)
        classes[i] = spl_scene_class(scene->objects[i]);
}

int spl_scene_create(const char *name, struct spl_scene **out, struct spl_error *err)
{
    return spl_scene_create_part(name, NULL, NULL, out, err);
}

int spl_scene_create_part(const char *name, const char *without, const char *only, struct spl_scene **out,
                          struct spl_error *err)
{
    size_t i = 0;
    while (i < scene_count && strcmp(scenes[i].name, name))
        i++;
    if (i == scene_count)
        return unknown(name, err);
    struct spl_scene *scene = spl_alloc(1, sizeof *scene, err);
    if (!scene)
        return SPL_E_NOMEM;
    scene->name = scenes[i].name;
    scene->help = scenes[i].help;
    scenes[i].build(scene);
    if (!scene->error.code)
        classify(scene);
    if (!scene->error.code) {
        int code = spl_scene_keep(scene, without, only, err);
        if (code) {
            spl_scene_destroy(scene);
            return code;
        }
        spl_bvh_build(scene->primitives, scene->primitive_count, &scene->nodes, &scene->error);
    }
    if (scene->error.code) {
        int code = spl_fail(err, scene->error.code, "%s", scene->error.message);
        spl_scene_destroy(scene);
        return code;
    }
    *out = scene;
    return 0;
}

void spl_scene_destroy(struct spl_scene *scene)
{
    if (!scene)
        return;
    free(scene->primitives);
    free(scene->nodes);
    free(scene->objects);
    free((void *)scene->classes);
    free(scene->stations);
    free(scene->track);
    free(scene);
}

bool spl_scene_hit(const struct spl_scene *scene, const double origin[3], const double direction[3],
                   struct spl_hit *hit)
{
    double t = INFINITY;
    uint32_t index = 0;
    if (!spl_bvh_hit(scene->nodes, scene->primitives, origin, direction, &t, &index))
        return false;
    const struct spl_primitive *p = &scene->primitives[index];
    hit->t = t;
    hit->primitive = index;
    hit->id = p->object;
    mad3(origin, t, direction, hit->position);
    spl_primitive_normal(p, hit->position, hit->normal);
    if (dot3(hit->normal, direction) > 0)
        mad3((double[3]){0}, -1, hit->normal, hit->normal);
    spl_scene_color(scene, index, hit->position, hit->color);
    return true;
}

uint32_t spl_scene_find_object(const struct spl_scene *scene, const char *name)
{
    for (size_t i = 0; i < scene->object_count; i++)
        if (!strcmp(scene->objects[i], name))
            return (uint32_t)i;
    return UINT32_MAX;
}

void spl_scene_color(const struct spl_scene *scene, uint32_t primitive, const double position[3], uint8_t color[3])
{
    const struct spl_primitive *p = &scene->primitives[primitive];
    spl_material_color(&scene->materials[p->material], p, position, color);
}
