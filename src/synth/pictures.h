/* Exact pictures of a scene as files: the truth of given views, photographs with poses, panoramas. */
#ifndef SPL_SYNTH_PICTURES_H
#define SPL_SYNTH_PICTURES_H

#include <splatd/pack.h>

#include "cloud/views.h"

enum {
    SPL_PHOTOS_MAX = 9999,
    SPL_PANORAMA_WIDTH_MIN = 256,
    SPL_PANORAMA_WIDTH_MAX = 8192,
};

struct spl_pictures_options {
    const char *scene, *directory;     /* made when missing */
    const char *without, *only;        /* as of spl_scene_create_part() */
    const struct spl_view_list *views; /* may be NULL: no truth */
    size_t photos;                     /* 0: none */
    uint32_t photo_width, photo_height;
    bool jpeg;               /* photographs as JPEG of quality 95 instead of PNG */
    uint32_t panorama_width; /* 0: none; even */
    uint32_t samples;        /* as of spl_exact_render() */
    uint64_t seed;           /* of where photographs are taken */
    unsigned threads;        /* 0 = all cores; the files do not depend on it */
    void (*progress)(void *context, const struct spl_progress *progress); /* may be NULL; a call a picture */
    void *progress_context;
    void (*file)(void *context, const char *path); /* may be NULL: each file once it is complete */
    void *file_context;
};

/* What spl_pictures_write() would refuse, before it takes its time. */
int spl_pictures_check(const struct spl_pictures_options *options, struct spl_error *err);

/* Writes, each file under a temporary name and renamed when it is complete:
 *   truth/VIEW.{color.png,depth.npy,normal.npy,id.npy,coverage.npy}   what spl_exact_render() gives for each view
 *   photos/images/0001.png …      straight alpha: 0 where the sky is; a JPEG's sky is black
 *   photos/sparse/0/{cameras,images,points3D}.txt   COLMAP's text model of them, world coordinates, no points; written
 *                                 after the images, images.txt last
 *   panoramas/NAME.{color.png,range.npy}   the whole sphere around each tripod of a scene that is scanned from tripods
 *                                 (NAME = station-1 …), around each sample camera of others (NAME = its name)
 *   panoramas/panoramas.json      their poses and the formula from direction to pixel; last
 * Everything that can be refused is refused before the first file. Errors name "scene", "samples", "photos",
 * "photo-size", "panoramas", or a view's field; SPL_E_IO. Any thread; blocks. */
int spl_pictures_write(const struct spl_pictures_options *options, struct spl_error *err);

#endif
