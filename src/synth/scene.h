/* An analytic scene: primitives with materials, the scanner that samples it, sample cameras, and exact answers to rays.
 *
 * A scene is modelled near the origin, in metres, z up. What is written for others to read (points, poses, views) lies
 * at world = scene + spl_scene.offset. Built once, then read-only: every call but create and destroy may run on any
 * thread at once. */
#ifndef SPL_SYNTH_SCENE_H
#define SPL_SYNTH_SCENE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"
#include "synth/bvh.h"
#include "synth/primitive.h"
#include "synth/texture.h"

enum spl_scanner_kind {
    SPL_SCANNER_TERRESTRIAL, /* each station is a tripod: a spherical grid of rays around it, -60 to +90 degrees */
    SPL_SCANNER_MOBILE,   /* each station is a head on a vehicle (x forward, y left, z up, origin on the track), which
                             turns around its z axis while the vehicle follows the track at constant speed */
    SPL_SCANNER_AIRBORNE, /* each station is the start of a flight line of `length` along its x axis, scanned in lines
                             across: from -half_angle to +half_angle around -z */
    SPL_SCANNER_SWEEP,    /* each station is the corner of a rectangle, `length` along its x axis by `width` along y,
                             from which parallel beams leave along -z, their number per square metre growing
                             `growth`-fold from x = 0 to the end, exponentially */
};

struct spl_station {
    double position[3];
    double rotation[9];           /* station to scene (a mobile head: to vehicle), row-major */
};

struct spl_scanner {
    enum spl_scanner_kind kind;
    double noise;                 /* range noise that suits the scene, sigma in metres */
    double aperture;              /* the beam's diameter where it leaves, metres */
    double divergence;            /* the beam's full angle, radians */
    double range;                 /* metres, at which a dropout share is as asked for */
    unsigned returns;             /* of one pulse, at most, 1 .. SPL_SCANNER_RETURNS_MAX */
    double length;                /* airborne, sweep */
    double half_angle;            /* airborne, degrees */
    bool zigzag;                  /* airborne: every other line runs back, else all run the same way */
    double width, growth;         /* sweep */
};

struct spl_track_point {
    double position[3], heading[3]; /* heading: unit, between its neighbours' directions */
    double at;                      /* metres from the start */
};

/* Where somebody would stand, or hover, and look; scene coordinates, z up. */
struct spl_named_camera {
    const char *name;
    double eye[3], target[3];
    double fov;                   /* vertical, degrees */
};

struct spl_scene {
    const char *name, *help;      /* static */
    struct spl_primitive *primitives;
    size_t primitive_count, primitive_capacity;
    struct spl_bvh_node *nodes;   /* over the primitives once they are complete */
    const struct spl_material *materials; /* static */
    const char **objects;         /* names, static; an object's id is its index */
    size_t object_count, object_capacity;
    const uint8_t *classes;       /* of the objects, as spl_scene_class(); NULL of scenes that were built otherwise */
    struct spl_scanner scanner;
    struct spl_station *stations; /* what they are is the scanner's kind */
    size_t station_count, station_capacity;
    struct spl_track_point *track; /* mobile: the trajectory, a polyline */
    size_t track_count;
    double offset[3];             /* world = scene + offset; whole metres */
    const struct spl_named_camera *cameras; /* static */
    size_t camera_count;
    struct spl_error error;       /* the first failure while it was built */
};

enum { SPL_SCANNER_RETURNS_MAX = 4 };

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

/* The same without some objects, or with only some of them: lists, parted by ',', of objects' names and of classes
 * ("class:5"); NULL = all. Stations, cameras and the objects' ids stay. SPL_E_USAGE with field "without" or "only". */
int spl_scene_create_part(const char *name, const char *without, const char *only, struct spl_scene **out,
                          struct spl_error *err);
void spl_scene_destroy(struct spl_scene *scene); /* NULL-safe */

/* The first surface along origin + t direction, t > 0 (a direction of any length but 0); false for sky, and *hit is
 * untouched. */
bool spl_scene_hit(const struct spl_scene *scene, const double origin[3], const double direction[3],
                   struct spl_hit *hit);

/* The id of the object of that name, UINT32_MAX when there is none. */
uint32_t spl_scene_find_object(const struct spl_scene *scene, const char *name);

/* What an object of that name is, as LAS has it: 1 = nothing of the kinds that there are, 2 ground, 5 vegetation,
 * 6 building, 10 rails, 11 road, 13 and 14 wires, 15 pylons, 16 what wires hang on, 17 bridges; 64 ceilings,
 * 65 furniture. */
uint8_t spl_scene_class(const char *object);

/* Drops primitives of objects as spl_scene_create_part() says; before the hierarchy is built. */
int spl_scene_keep(struct spl_scene *scene, const char *without, const char *only, struct spl_error *err);

/* The exact colour of a primitive at a point of its surface. */
void spl_scene_color(const struct spl_scene *scene, uint32_t primitive, const double position[3], uint8_t color[3]);

#endif
