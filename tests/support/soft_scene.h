/* What a dataset's view draws as soft spheres, for the reference of soft_rays.h: written from headers and docs, apart
 * from the product's selection. */
#ifndef TEST_SUPPORT_SOFT_SCENE_H
#define TEST_SUPPORT_SOFT_SCENE_H

#include <stdbool.h>
#include <stddef.h>

#include <splatd/render.h>

#include "dataset/dataset.h"
#include "support/soft_rays.h"

/* Every splat that the view draws at its lod, as a sphere in view space, by depth and of equal depths by id. Those of
 * class `solid` are left out; -1 = none are. So are those whose centres lie before the near plane, as splats do. The
 * caller's to free(). Panels and lines must not be there. */
struct soft_sphere *soft_spheres_of(const struct spl_dataset *dataset, const struct spl_view *view, int solid,
                                    size_t *count);

/* How the view's model looks. */
struct soft_look soft_look_of(const struct spl_view *view);

/* The ray of a pixel's middle. */
void soft_ray_of(const struct spl_camera *camera, uint32_t x, uint32_t y, double ray[2]);

#endif
