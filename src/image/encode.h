/* The encoders behind spl_image_encode(): each takes an image that was checked and fills `out`, whose bytes are
 * released with free(). Inside src/image only; any thread. */
#ifndef SPL_IMAGE_ENCODE_H
#define SPL_IMAGE_ENCODE_H

#include <splatd/image.h>

#include "base/error.h"

int spl_encode_jpeg(const struct spl_image *image, int quality, int chroma, struct spl_encoded *out,
                    struct spl_error *err);
int spl_encode_webp(const struct spl_image *image, int quality, struct spl_encoded *out, struct spl_error *err);
extern const bool spl_webp_is_built;
/* Of a map alone: ground, unit and crs of `options` count. */
int spl_encode_tiff(const struct spl_image *image, const struct spl_encode_options *options, struct spl_encoded *out,
                    struct spl_error *err);
extern const bool spl_tiff_is_built;
/* depth_scale and unit of `options` count; the scale is above 0. */
int spl_encode_png(const struct spl_image *image, const struct spl_encode_options *options, struct spl_encoded *out,
                   struct spl_error *err);
int spl_encode_npy(const struct spl_image *image, bool list, struct spl_encoded *out, struct spl_error *err);
int spl_encode_raw(const struct spl_image *image, struct spl_encoded *out, struct spl_error *err);

/* ---- 8 bit pictures of the layers that are no picture yet (convert.c) ----
 * `count` pixels each; outputs hold 3 bytes a pixel, coverage 1. */

/* The picture of a layer that is none: RGB, or one grey byte a pixel for coverage. The caller frees *out; near and far
 * of `encoded` are set. */
int spl_convert_picture(const struct spl_image *image, uint8_t **out, struct spl_encoded *encoded,
                        struct spl_error *err);

/* round((n + 1) / 2 * 255); nothing (zero or not a number) = 0, 0, 0. */
void spl_convert_normal(const float *normals, size_t count, uint8_t *rgb);

/* spl_shape_color() of each. */
void spl_convert_primitive(const uint32_t *primitives, size_t count, uint8_t *rgb);

void spl_convert_coverage(const float *values, size_t count, uint8_t *grey);

/* round(value * scale) in 1..65535, nothing (negative or not a number) = 0. Returns how many were beyond 65535. */
uint64_t spl_convert_depth16(const float *values, size_t count, double scale, uint16_t *grey);

#endif
