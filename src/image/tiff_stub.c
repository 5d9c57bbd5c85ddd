/* A build without libtiff: the format is refused by name, nobody else needs to know. */
#include "image/encode.h"

const bool spl_tiff_is_built = false;

int spl_encode_tiff(const struct spl_image *image, const struct spl_encode_options *options, struct spl_encoded *out,
                    struct spl_error *err)
{
    (void)image;
    (void)options;
    (void)out;
    return spl_fail_field(err, SPL_E_UNSUPPORTED, "format",
                          "this build makes no GeoTIFF; ask for png and its world file");
}
