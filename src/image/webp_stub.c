/* A build without libwebp: the format is refused by name, nobody else needs to know. */
#include "image/encode.h"

const bool spl_webp_is_built = false;

int spl_encode_webp(const struct spl_image *image, int quality, struct spl_encoded *out, struct spl_error *err)
{
    (void)image;
    (void)quality;
    (void)out;
    return spl_fail_field(err, SPL_E_UNSUPPORTED, "format", "this build makes no WebP; ask for jpeg or png");
}
