/* A list of named views: what a benchmark renders, what the truth is made for. Read from our own JSON or from a COLMAP
 * text model.
 *
 * JSON (api/cameras.md):
 *   {"views": [{"name": "east", "width": 1280, "height": 720, "photograph": "east.jpg",
 *               "camera": {…as in the body of POST /v1/datasets/{id}/view…}}]}
 * Each camera must give its pose and its intrinsics; `near` is 0.01 and `far` infinite where they are left out.
 * `photograph` may be left out; its path is taken from the JSON file's folder.
 *
 * COLMAP: a folder with cameras.txt (SIMPLE_PINHOLE, PINHOLE; those with distortion are taken when it is 0) and
 * images.txt. A view is called after its image without the extension, '/' becoming '_'. Its photograph is NAME in the
 * first of FOLDER/images, FOLDER/../images and FOLDER/../../images that has it, otherwise FOLDER/images/NAME. */
#ifndef SPL_CLOUD_VIEWS_H
#define SPL_CLOUD_VIEWS_H

#include <stddef.h>

#include <splatd/camera.h>

#include "base/error.h"

enum {
    SPL_VIEW_NAME_MAX = 100,  /* bytes */
    SPL_VIEW_LIST_MAX = 65536 /* views */
};

struct spl_named_view {
    char *name; /* unique; part of file names: no '/', no control character, no '.' in front */
    struct spl_camera camera;
    char *photograph; /* path; may be NULL */
};

struct spl_view_list {
    struct spl_named_view *views;
    size_t count;
};

/* Reads `path`: a folder is a COLMAP model, anything else our JSON. Fills `list` on success, which
 * spl_view_list_finish() releases; leaves it zeroed on failure. An empty list is refused. Errors are SPL_E_INPUT and
 * name file, view and field; SPL_E_IO or SPL_E_NOT_FOUND for files that cannot be read. Any thread; blocks for the
 * reading. */
int spl_view_list_load(struct spl_view_list *list, const char *path, struct spl_error *err);

/* Takes NULL and zeroed lists. */
void spl_view_list_finish(struct spl_view_list *list);

#endif
