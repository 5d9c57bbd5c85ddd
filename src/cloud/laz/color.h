/* Colours of items RGB12 (version 2), RGB14 and RGBNIR14: bytes that changed are coded as differences, green and blue
 * predicted by how far red went. One thread. */
#ifndef SPL_CLOUD_LAZ_COLOR_H
#define SPL_CLOUD_LAZ_COLOR_H

#include "cloud/laz/coder.h"

struct spl_laz_color {
    struct spl_laz_model *changed, *byte[6]; /* red low, high, green low, high, blue low, high */
};

struct spl_laz_infrared {
    struct spl_laz_model *changed, *byte[2];
};

size_t spl_laz_color_bytes(void);
size_t spl_laz_infrared_bytes(void);

/* `rgb` is the colour before and becomes the next one. */
void spl_laz_color_read(struct spl_laz_color *c, struct spl_laz_coder *coder, struct spl_laz_arena *arena,
                        uint16_t rgb[3]);
void spl_laz_infrared_read(struct spl_laz_infrared *c, struct spl_laz_coder *coder, struct spl_laz_arena *arena,
                           uint16_t *value);

#endif
