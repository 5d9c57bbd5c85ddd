/* Where the eye of parallel rays stands while a frame is drawn. Along the axis it may stand anywhere without changing
 * the image, so it is brought to where what is drawn begins: depths are small there, and floats keep all of them apart
 * however far away the view says its eye is. Pure; any thread. */
#ifndef SPL_RENDER_ADVANCE_H
#define SPL_RENDER_ADVANCE_H

#include <splatd/camera.h>
#include <splatd/dataset.h>

/* Moves the eye of an orthographic camera, and near and far with it; returns by how much, which depths are less by
 * then. 0, and nothing, of a pinhole. */
double spl_camera_advance(struct spl_camera *camera, const struct spl_dataset_info *info);

#endif
