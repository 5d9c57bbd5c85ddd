/* A list of named views: what a benchmark renders, what the truth is made for. Read from our own JSON or from a COLMAP
 * text model.
 *
 * JSON (api/cameras.md):
 *   {"views": [{"name": "east", "width": 1280, "height": 720, "photograph": "east.jpg",
 *               "camera": {…as in the body of POST /v1/datasets/{id}/view…}}]}
 * Each camera must give its pose and its intrinsics; `near` is 0.01 and `far` infinite where they are left out.
 * `photograph` may be left out; its path is taken from the JSON file's folder.
 *
 * COLMAP: a folder with cameras.bin and images.bin, or cameras.txt and images.txt. A view is called after its image
 * without the extension, '/' becoming '_'. Its photograph is NAME in the first of FOLDER/images, FOLDER/../images and
 * FOLDER/../../images that has it, otherwise FOLDER/images/NAME.
 *
 * transforms.json of nerfstudio and instant-ngp: frames[].file_path (beside the JSON) and transform_matrix, camera to
 * world, OpenGL axes; lenses for all or by frame; an applied_transform is not undone: the scan must lie in the poses'
 * coordinates. Open3D's PinholeCameraTrajectory: photographs are the images of its folder's color, image, rgb or images
 * (or of `images`), in the order of their names, one a camera.
 *
 * Pose folders: camera-intrinsics.txt (3 x 3; the first pixel's centre is (0, 0)), NAME.pose.txt (4 x 4, camera to
 * world, z forward) beside NAME.color.jpg or .png; the photographs say their own size.
 *
 * E57: the images of the scans' file that have a pose: pinholes as they are, spherical and cylindrical ones as faces of
 * 90 degrees (views_e57.c).
 *
 * Panoramas: a JSON of "panoramas", or a folder with panoramas.json, as `splatd synth --panoramas` writes it
 * (api/photographs.md): equirectangular images as faces of 90 degrees, and cubes of six images (views_panoramas.c).
 *
 * A view is drawn as a pinhole: those with distortion are taken when it is 0. Photographs keep their lens. */
#ifndef SPL_CLOUD_VIEWS_H
#define SPL_CLOUD_VIEWS_H

#include <stddef.h>
#include <stdio.h>

#include <splatd/camera.h>

#include "base/error.h"
#include "geom/distortion.h"
#include "geom/panorama.h"

enum {
    SPL_VIEW_NAME_MAX = 100,  /* bytes */
    SPL_VIEW_LIST_MAX = 65536, /* views */
    SPL_PANORAMA_PIXELS_MAX = 128 << 20
};

/* A photograph that lies inside a scan's file, or a panorama that the view cuts a face out of, or both. */
struct spl_inner_photograph {
    char *path;         /* of the file */
    uint64_t at, bytes; /* of its section in an E57 file, and of the image; 0: the file is the image */
    bool is_panorama;
    uint32_t width, height; /* of the image, pixels */
    struct spl_panorama panorama;
};

struct spl_named_view {
    char *name; /* unique; part of file names: no '/', no control character, no '.' in front */
    struct spl_camera camera;
    struct spl_distortion distortion;   /* NONE but for photographs */
    char *photograph;                   /* path, of an inner one for messages alone; may be NULL */
    struct spl_inner_photograph *inner; /* may be NULL: the photograph is a file */
    uint32_t panorama;                  /* which one of its list it is a face of, from 1; 0: of none */
};

struct spl_view_list {
    struct spl_named_view *views;
    size_t count, capacity;
};

/* Reads `path`: a folder is a COLMAP model, anything else our JSON. Fills `list` on success, which
 * spl_view_list_finish() releases; leaves it zeroed on failure. An empty list is refused. Errors are SPL_E_INPUT and
 * name file, view and field; SPL_E_IO or SPL_E_NOT_FOUND for files that cannot be read. Any thread; blocks for the
 * reading. */
int spl_view_list_load(struct spl_view_list *list, const char *path, struct spl_error *err);

struct spl_photograph_options {
    const char *images; /* folder that NAME, or its last part, is looked for in instead; may be NULL */
    /* The size of an image file, for poses that come without, whose lack is refused where this is NULL, and of every
     * panorama; may fail for what is no photograph. */
    int (*get_size)(const char *path, uint32_t *width, uint32_t *height, struct spl_error *err);
    /* Called for each photograph whose pose or lens is at fault, which is then left out; NULL: the first one fails. */
    void (*refuse)(void *context, const struct spl_error *why);
    void *context;
};

/* The same list as photographs with their lenses: each view has its path, which may not exist, and COLMAP's models
 * SIMPLE_PINHOLE to FULL_OPENCV, SIMPLE_RADIAL_FISHEYE and RADIAL_FISHEYE are taken. */
int spl_view_list_load_photographs(struct spl_view_list *list, const char *path,
                                   const struct spl_photograph_options *options, struct spl_error *err);

/* What colours of a whole surrounding come from: panoramas, or photographs on tripods. As
 * spl_view_list_load_photographs(), and a folder whose folder `panoramas` has a panoramas.json will do: what `splatd
 * synth -o` was given. */
int spl_panoramas_load(struct spl_view_list *list, const char *path, const struct spl_photograph_options *options,
                       struct spl_error *err);

/* Removes all views but the first `count`. */
void spl_view_list_cut(struct spl_view_list *list, size_t count);

/* Whether a scan's file has images that are views: an E57 whose images2D have poses. Any thread; blocks for reading. */
bool spl_panoramas_are_inside(const char *path);

/* Moves the views of `more`, which is left empty, to the end of `list`; their panoramas are numbered on. SPL_E_LIMIT,
 * SPL_E_NOMEM; both lists as they were then. */
int spl_view_list_append(struct spl_view_list *list, struct spl_view_list *more, struct spl_error *err);

/* An inner photograph as a file of its own, which the caller closes: the image as it was stored. Any thread; blocks. */
int spl_view_open_inner(const struct spl_named_view *view, FILE **file, struct spl_error *err);

/* Takes NULL and zeroed lists. */
void spl_view_list_finish(struct spl_view_list *list);

#endif
