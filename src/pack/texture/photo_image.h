/* The pixels of a photograph, whether it is a file, lies inside a scan's file, or is a face of a panorama there. */
#ifndef SPL_PACK_TEXTURE_PHOTO_IMAGE_H
#define SPL_PACK_TEXTURE_PHOTO_IMAGE_H

#include "cloud/views.h"
#include "image/load.h"

/* As the photograph's header says, the size of a face being its camera's. Refuses what is no photograph: CMYK, channels
 * of other than 8 bits, a panorama of another size than its scan's file says. Blocks for the reading. */
int spl_photo_image_get_info(const struct spl_named_view *view, struct spl_image_info *info, struct spl_error *err);

/* A panorama that is held between its faces, so that six of them in a row decode it once. Zeroed before use. */
struct spl_photo_whole {
    char *path;
    uint64_t at;
    struct spl_image image;
};

void spl_photo_whole_finish(struct spl_photo_whole *whole);

/* RGBA8; what a panorama does not show of a face is transparent. The first keeps the panorama in `whole`, in the place
 * of another one. Blocks. */
int spl_photo_image_load_of(struct spl_photo_whole *whole, const struct spl_named_view *view, struct spl_image *out,
                            struct spl_error *err);
/* The whole panorama that the view is a face of, of which black is transparent. */
int spl_photo_image_load_whole(const struct spl_named_view *view, struct spl_image *out, struct spl_error *err);

int spl_photo_image_load(const struct spl_named_view *view, struct spl_image *out, struct spl_error *err);

#endif
