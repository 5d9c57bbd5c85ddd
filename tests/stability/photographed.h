/* A wall of text and masonry with a post before it, and photographs of it: exact images that are then spoilt, or put
 * where they were not taken. Anything that goes wrong ends the program. */
#ifndef STABILITY_PHOTOGRAPHED_H
#define STABILITY_PHOTOGRAPHED_H

#include <splatd/pack.h>

#include "world.h"

enum { PHOTOGRAPHS_MAX = 8 };

struct photographs { /* the caller's; zeroed is none; photographs_finish() it */
    struct {
        double eye[3], target[3];
    } pose[PHOTOGRAPHS_MAX]; /* scene coordinates */
    struct spl_image image[PHOTOGRAPHS_MAX];
    size_t count;
};

/* The scene, without a dataset: wall_finish() it. Text from x = -1.2 m to 0, masonry to 1.2 m, both 1.5 m high around
 * z = 0 in the plane y = 0; the post stands at x = 0.6 m, y = -0.45 m. */
struct spl_scene *wall_create(void);
void wall_destroy(struct spl_scene *scene); /* NULL-safe */

/* Takes one more photograph of 320 x 240 pixels, 50 degrees. */
void photographs_take(struct photographs *photographs, const struct spl_scene *scene, const double eye[3],
                      const double target[3]);
/* A copy of `from` at the end of `photographs`. */
void photographs_copy(struct photographs *photographs, const struct photographs *from, size_t index);
void photographs_finish(struct photographs *photographs);

/* In linear light. */
void photograph_expose(struct spl_image *image, double factor);
/* Three box filters of 2 radius + 1 pixels. */
void photograph_blur(struct spl_image *image, int radius);

/* Points of the scene every 30 mm, packed with the photographs; `quality` in dB as --texture-quality. The scene is the
 * world's from then on. */
void world_init_photographed(struct world *world, struct spl_scene *scene, const struct photographs *photographs,
                             enum spl_texture_coding coding, double quality);

#endif
