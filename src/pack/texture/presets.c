/* The table of presets: settings that exist by themselves, chosen by what they cost and gain together
 * (api/photographs.md). Any thread. */
#include "pack/texture/presets.h"

static const struct spl_texture_settings presets[SPL_TEXTURE_PRESET_COUNT] = {
    [SPL_TEXTURE_DRAFT] = {.quality = 36, .texels_max = 16, .dictionary = 1024, .epochs = 2, .sample = 1 << 16},
    [SPL_TEXTURE_NORMAL] = {.quality = 40, .texels_max = 32, .dictionary = 4096},
    [SPL_TEXTURE_BEST] = {.quality = 43, .texels_max = 32, .dictionary = 4096},
};

struct spl_texture_settings spl_texture_settings_get(const struct spl_photo_options *options)
{
    struct spl_texture_settings settings = presets[options->preset];
    if (options->texture_quality > 0)
        settings.quality = options->texture_quality;
    return settings;
}
