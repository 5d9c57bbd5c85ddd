/* Putting scenes together. A refusal of memory is kept in scene->error and later calls do nothing, so that a scene's
 * description reads as a list; spl_scene_create() looks at it once, at the end. */
#ifndef SPL_SYNTH_BUILD_H
#define SPL_SYNTH_BUILD_H

#include "synth/scene.h"

struct spl_skin {              /* what a primitive looks like and belongs to */
    uint32_t material, object; /* indices in scene->materials and scene->objects */
};

uint32_t spl_build_object(struct spl_scene *scene, const char *name);
/* A scanner at `position`, turned by `yaw` around z after tilting by `tilt` around its x axis; degrees. */
void spl_build_station(struct spl_scene *scene, const double position[3], double yaw, double tilt);

/* The trajectory of a mobile scanner: at least two points, none above the one before it. */
void spl_build_track(struct spl_scene *scene, const double (*points)[3], size_t count);

/* `u` and `v` are unit and orthogonal; `offset` (may be NULL) is the texture coordinate of the centre. */
void spl_build_rectangle(struct spl_scene *scene, struct spl_skin skin, const double center[3], const double u[3],
                         const double v[3], const double half[2], const double offset[2]);
/* Six rectangles; `along` is the horizontal unit direction of half[0], half[2] is upwards. */
void spl_build_box(struct spl_scene *scene, struct spl_skin skin, const double center[3], const double along[3],
                   const double half[3]);
void spl_build_disc(struct spl_scene *scene, struct spl_skin skin, const double center[3], const double normal[3],
                    double radius);
void spl_build_sphere(struct spl_scene *scene, struct spl_skin skin, const double center[3], double radius);
/* The side of a truncated cone, without its ends. */
void spl_build_cone(struct spl_scene *scene, struct spl_skin skin, const double from[3], const double to[3],
                    double radius_from, double radius_to);

/* A wire between two points that hangs `sag` below their line in the middle, as `segments` cylinders. */
void spl_build_wire(struct spl_scene *scene, struct spl_skin skin, const double from[3], const double to[3], double sag,
                    double radius, unsigned segments);
/* A tree with its foot at `foot`: a trunk, four generations of branches, some thousand leaf discs. */
void spl_build_tree(struct spl_scene *scene, struct spl_skin bark, struct spl_skin leaf, const double foot[3],
                    double height, uint64_t seed);

/* The scenes; one file each in scenes/. They set materials, scanner, cameras and offset as well. */
void spl_build_courtyard(struct spl_scene *scene);
void spl_build_railway(struct spl_scene *scene);
void spl_build_powerline(struct spl_scene *scene);
void spl_build_thin_walls(struct spl_scene *scene);
void spl_build_steps(struct spl_scene *scene);
void spl_build_density(struct spl_scene *scene);
void spl_build_trees(struct spl_scene *scene);
void spl_build_interior(struct spl_scene *scene);

#endif
