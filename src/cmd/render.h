/* What the files of 'splatd render' share: render_options.c reads the options, render_camera.c makes the camera of them
 * and of the dataset's views, render.c the image. */
#ifndef SPL_CMD_RENDER_H
#define SPL_CMD_RENDER_H

#include <splatd/dataset.h>

#include "cmd/drawing.h"

struct spl_cmd_render {
    struct spl_cmd_drawing drawing; /* first */
    const char *dataset;
    const char *view; // may be NULL; the name of one that the dataset was packed with
    uint64_t station; // UINT64_MAX = not given
    double eye[3], target[3], up[3], fov, fx, fy, cx, cy, near, far; /* NAN (eye[0] …) = not given */
    int projection;                      /* enum spl_projection, -1 = not given */
    double view_height, units_per_pixel; /* NAN = not given */
    double azimuth[3], elevation[3];     /* the same, of the first */
    const char *rays_file; // may be NULL
    int frame;             /* enum spl_ray_frame */
    double resolution;     /* 0 = what suits the list */
    struct spl_rays *rays; // may be NULL: of rays_file, once it is read
    bool listed;           /* rays as JSON */
    bool world_file;
    uint32_t crs; /* of eye and target; 0 = the dataset's coordinates */
};

/* Fills *arguments from the command line, whose texts they borrow; what can be refused without the dataset is.
 * SPL_CMD_DONE after --help, SPL_E_USAGE. */
int spl_cmd_render_parse(struct spl_cmd_render *arguments, int argc, char **argv, struct spl_error *err);

/* Completes the size and sets the view's camera, and where rays were read, those: what options leave out is the default
 * view's, or that of --view. What --crs is about comes into the dataset's coordinates. SPL_E_USAGE and what the camera
 * is refused with. */
int spl_cmd_render_set_camera(struct spl_cmd_render *arguments, const struct spl_dataset *dataset,
                              struct spl_error *err);

#endif
