/* One photograph in memory while splats take their colours from it: its pixels as a pyramid, and how far away the
 * splats lie that it sees. Loading belongs to the renderer's thread; afterwards it is read-only, any thread. */
#ifndef SPL_PACK_TEXTURE_PHOTO_H
#define SPL_PACK_TEXTURE_PHOTO_H

#include <splatd/render.h>

#include "cloud/views.h"
#include "image/pyramid.h"
#include "pack/texture/photo_image.h"

struct spl_photo {
    const struct spl_named_view *view; // borrowed
    struct spl_pyramid pixels;
    struct spl_camera depth_camera; /* the same eye, a pinhole that holds the whole of the photograph */
    struct spl_image depth;         /* of the splats; NaN = nothing */
    double sharpness;               /* 0.2 (blurred) to 1 */
};

enum { SPL_PHOTO_EMPTY = 1 };

/* A panorama is cut into faces all around, of which some show nothing: that is no fault of theirs. */
static inline bool spl_photo_is_face(const struct spl_named_view *view)
{
    return view->inner && view->inner->is_panorama;
}

/* Loads the view's photograph (a panorama stays in `whole` for its next face) and renders the dataset's depth. Refuses
 * what is no photograph of this pose: other sizes than the camera's, CMYK, 16 bit channels, nothing but black, an eye
 * that stands within splats, a view without any; SPL_PHOTO_EMPTY instead of a fault for a face of a panorama that shows
 * nothing or sees no splat. Errors name the file. Unless it is SPL_OK nothing is held. Blocks. */
int spl_photo_open(struct spl_photo *photo, const struct spl_named_view *view, struct spl_photo_whole *whole,
                   struct spl_renderer *renderer, const struct spl_dataset *dataset, struct spl_error *err);
void spl_photo_close(struct spl_photo *photo);

/* The same without a renderer, for pixels (taken over, also on failure) and depth that are there already; `depth` may
 * have no pixels: then everything in the image is seen. */
int spl_photo_init(struct spl_photo *photo, const struct spl_named_view *view, struct spl_image *pixels,
                   struct spl_error *err);

/* What an opened photograph holds, and the panorama that it is a face of. */
uint64_t spl_photo_bytes(const struct spl_named_view *view);

/* How world point `p` at view depth `depth` lies to the splats in front of it. `slack`: metres that count as the same
 * surface. */
enum spl_sight {
    SPL_SIGHT_HIDDEN, /* something is nearer */
    SPL_SIGHT_EDGE,   /* something nearer ends within two samples */
    SPL_SIGHT_CLEAR,
    SPL_SIGHT_BEYOND, /* the splats there lie farther: the point floats in front of a silhouette's background */
};
enum spl_sight spl_photo_see(const struct spl_photo *photo, const double p[3], double slack);

#endif
