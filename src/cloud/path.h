/* Camera paths as tools write them, into one struct spl_camera_path (api/tours.md has a row for each).
 *
 *   nerfstudio  camera_path.json: its `camera_path`, OpenGL axes; render_width, render_height, fps, is_cycle
 *   Open3D      PinholeCameraTrajectory: world to camera, column-major; first pixel centre at (0, 0), moved to ours
 *   COLMAP      images in the order of their names; a folder (binary or text), or {"cameras_txt": …, "images_txt": …}
 *   TUM         text, `timestamp tx ty tz qx qy qz qw` a line, camera to world, +Z forward; no lens of its own
 *   splatd      {"keyframes": […]} or {"frames": […]}: views as in a list of views, each with a "time" if all have one
 *
 * Every camera comes out at one image size; lenses given in pixels are scaled to it. Errors are SPL_E_INPUT
 * (SPL_E_LIMIT for too many) and name the frame and the field: "camera_path[3].fov", or the line of a text. Any thread.
 */
#ifndef SPL_CLOUD_PATH_H
#define SPL_CLOUD_PATH_H

#include "geom/camera_json.h"
#include "geom/camera_path.h"

struct spl_path_options {
    uint32_t width, height; /* of every camera; 0 = what the path says, 1280 x 720 when it does not; one that is 0
                             * follows from the other at the path's ratio */
    const struct spl_camera_defaults *defaults; /* may be NULL: fov 60, near 0.01, no far, and poses must be complete */
    const struct spl_camera_limits *limits;
    const struct spl_path_value *values; /* SPL_PATH_VALUES that splatd's own keys may say; NULL = none */
};

/* Each fills a zeroed path, which spl_camera_path_finish() releases, on success and leaves it zeroed on failure. */

/* An object of nerfstudio, Open3D, COLMAP or splatd, told apart by its keys; a string is TUM. `json` is borrowed and
 * may get sizes added to its views. */
int spl_camera_path_from_json(json_t *json, const struct spl_path_options *options, struct spl_camera_path *path,
                              struct spl_error *err);

/* A file of any of them (JSON when it begins with '{'), or the folder of a COLMAP model. Blocks for the reading. */
int spl_camera_path_load(const char *file, const struct spl_path_options *options, struct spl_camera_path *path,
                         struct spl_error *err);

#endif
