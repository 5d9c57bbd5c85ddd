/* What the suite renders: a scene's truth, its scan as a dataset, and a renderer. Anything that goes wrong while one is
 * made ends the program. */
#ifndef STABILITY_WORLD_H
#define STABILITY_WORLD_H

#include <splatd/dataset.h>
#include <splatd/pack.h>
#include <splatd/render.h>

#include "synth/scene.h"

#include "report.h"

struct scan { /* as in struct spl_synth_options; noise 0 is none */
    const char *scene;
    uint64_t points;
    double noise, mixed, dropout, misregister;
};

struct point {
    double position[3];
    uint8_t color[3];
};

struct world {
    struct spl_scene *scene; /* NULL where the points were given */
    struct spl_dataset *dataset;
    char name[64];
};

enum plant { PLANT_NONE, PLANT_HALF_PIXEL, PLANT_MARGIN_0, PLANT_POP, PLANT_NO_TRIM, PLANT_SIX_AXES };

struct suite {
    struct report report;
    struct spl_renderer *renderer, *other; /* other: to compare drivers with, may be NULL */
    enum plant plant;                      /* done to every view that is rendered; a pop: halfway along a path */
    bool whole;
};

/* Scans the scene and packs it. */
void world_init(struct world *world, const struct scan *scan);
/* The same scan packed as splats alone and with primitives: worlds[0] and worlds[1], the first of which has the scene.
 * From tripods it is PTX, so that it is known which side each point was seen from. `error` as of spl_pack_options. */
void world_init_both(struct world worlds[2], const struct scan *scan, double error);
/* Likewise a scan's file, and points as they are; the caller's is the scene. */
void world_init_scan_both(struct world worlds[2], const char *name, const char *scan, double error);
void world_init_points_both(struct world worlds[2], const char *name, const struct point *points, size_t count,
                            double error);
/* Packs points as they are. */
void world_init_points(struct world *world, const char *name, const struct point *points, size_t count);
/* The same with photographs. */
void world_init_photos(struct world *world, const char *name, const struct point *points, size_t count,
                       const struct spl_photo_options *photos);
/* A scan's file with maps of its stations: from panoramas, or (NULL) from the scan's own colours. */
void world_init_mapped(struct world *world, const char *name, const char *scan, const char *panoramas);
/* Chunks are no longer said to reach where their station saw through. Before the world is rendered. */
void world_stop_trimming(struct world *world);
void world_finish(struct suite *suite, struct world *world);

/* The points of the scene's scan, which the caller frees. */
struct point *world_scan(const struct scan *scan, size_t *count);

/* A method's view of sample camera `index` of the world's scene, all layers, transparent background. */
struct spl_view world_view(const struct world *world, size_t index, uint32_t width, uint32_t height);
/* The same from any place, in scene coordinates; up is z unless the view is along it. */
struct spl_view world_look(const struct world *world, const double eye[3], const double target[3], double fov,
                           uint32_t width, uint32_t height);

/* Renders with the suite's planted fault; false after the failure was reported. spl_frame_finish() it. */
bool world_render(struct suite *suite, const struct world *world, const struct place *place,
                  const struct spl_view *view, struct spl_frame *frame);

/* The exact images of a camera; truth_finish() them. */
void truth_render(const struct world *world, const struct spl_camera *camera, struct spl_image truth[SPL_LAYER_COUNT]);
void truth_finish(struct spl_image truth[SPL_LAYER_COUNT]);

#endif
