/* What a quality of textures means in settings of resampling, training and coding. */
#ifndef SPL_PACK_TEXTURE_PRESETS_H
#define SPL_PACK_TEXTURE_PRESETS_H

#include <splatd/pack.h>

struct spl_texture_settings {
    double quality;      /* dB */
    uint32_t texels_max; /* a side: 8, 16 or 32 */
    uint32_t dictionary; /* atoms of adaptive coding; the fixed codings have their own */
    uint32_t epochs;     /* of training at most; 0 = until it settles */
    uint64_t sample;     /* textures that are trained on at most; 0 = as many as memory holds */
};

/* The preset's, with what the options say themselves. */
struct spl_texture_settings spl_texture_settings_get(const struct spl_photo_options *options);

#endif
