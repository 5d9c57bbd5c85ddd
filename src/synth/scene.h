/* An analytic scene: primitives with materials, the stations it is scanned from, and exact answers to rays.
 *
 * Built once, then read-only: every call but create and destroy may run on any thread at once. */
#ifndef SPL_SYNTH_SCENE_H
#define SPL_SYNTH_SCENE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"
#include "synth/bvh.h"
#include "synth/primitive.h"
#include "synth/texture.h"

struct spl_station {
    double position[3];
    double rotation[9];           /* station to world, row-major */
};

struct spl_scene {
    const char *name, *help;      /* static */
    struct spl_primitive *primitives;
    size_t primitive_count, primitive_capacity;
    struct spl_bvh_node *nodes;   /* over the primitives once they are complete */
    const struct spl_material *materials; /* static */
    const char **objects;         /* names, static; an object's id is its index */
    size_t object_count;
    struct spl_station *stations;
    size_t station_count;
    double noise;                 /* range noise that suits the scene, sigma in metres */
    struct spl_error error;       /* the first failure while it was built */
};

struct spl_hit {
    double t;                     /* position = origin + t direction */
    double position[3];
    double normal[3];             /* unit, towards the origin */
    uint8_t color[3];             /* sRGB, unlit */
    uint32_t id;                  /* the object */
    uint32_t primitive;           /* index in scene->primitives */
};

/* Builds the scene of that name; SPL_E_USAGE with field "scene" lists the names. The caller owns *out. */
int spl_scene_create(const char *name, struct spl_scene **out, struct spl_error *err);
void spl_scene_destroy(struct spl_scene *scene); /* NULL-safe */

/* The first surface along origin + t direction, t > 0 (a direction of any length but 0); false for sky, and *hit is
 * untouched. */
bool spl_scene_hit(const struct spl_scene *scene, const double origin[3], const double direction[3],
                   struct spl_hit *hit);

/* The id of the object of that name, UINT32_MAX when there is none. */
uint32_t spl_scene_find_object(const struct spl_scene *scene, const char *name);

/* The exact colour of a primitive at a point of its surface. */
void spl_scene_color(const struct spl_scene *scene, uint32_t primitive, const double position[3], uint8_t color[3]);

#endif
