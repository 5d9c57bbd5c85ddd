/* Where the rows of an image lie. */
#ifndef SPL_IMAGE_ROWS_H
#define SPL_IMAGE_ROWS_H

#include <splatd/image.h>

/* Bytes from one row to the next. */
static inline size_t spl_image_row_bytes(const struct spl_image *image)
{
    return image->row_bytes ? image->row_bytes : (size_t)image->width * spl_pixel_bytes(image->type);
}

static inline void *spl_image_row(const struct spl_image *image, size_t y)
{
    return (char *)image->pixels + y * spl_image_row_bytes(image);
}

#endif
