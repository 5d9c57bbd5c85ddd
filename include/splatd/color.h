/* What colours mean in a view: what of a splat they show, and how they are shaded for shape. Both are of layer color
 * alone; api/colors.md shows them. */
#ifndef SPLATD_COLOR_H
#define SPLATD_COLOR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <splatd/api.h>
#include <splatd/dataset.h>
#include <splatd/error.h>

SPL_BEGIN_DECLARATIONS

/* How what is solid is shaded, once it is drawn: any of these together, or none. */
enum {
    SPL_SHADE_NONE = 1,      /* stands alone */
    SPL_SHADE_EDL = 2,       /* eye-dome lighting: darker where what lies around is nearer, from depth alone */
    SPL_SHADE_HEADLIGHT = 4, /* brighter where the surface faces the eye */
    SPL_SHADE_SUN = 8,       /* brighter where it faces the sun; casts no shadows */
};

struct spl_shade_params {
    uint32_t kinds;  /* SPL_SHADE_*; 0 = EDL where the dataset has no colours of its own, else none */
    double sun[2];   /* of SUN: azimuth, degrees clockwise from +y (north), and elevation, -90 to 90 */
    double strength; /* of EDL: the share of its light that the deepest gap loses */
    uint32_t radius; /* of EDL: pixels that are looked away, 1 to 5 */
};

/* Reads "none", "edl", "headlight", "sun:AZIMUTH,ELEVATION", joined by '+' or blanks; "auto" is what kinds 0 is. Leaves
 * strength and radius. SPL_E_INPUT (field "shade") says what is wrong; then `out` is as it was. */
SPL_API int spl_shade_parse(const char *text, struct spl_shade_params *out, struct spl_error *err);

/* Writes the same so that it reads back; returns the length, as snprintf(). */
SPL_API int spl_shade_print(const struct spl_shade_params *shade, char *text, size_t bytes);

/* Are kinds, sun, strength and radius in range? SPL_E_USAGE names the field. */
SPL_API int spl_shade_check(const struct spl_shade_params *shade, struct spl_error *err);

/* The kinds that a view of the dataset is shaded by, without NONE: 0 = none. */
SPL_API uint32_t spl_shade_for(const struct spl_shade_params *shade, const struct spl_dataset_info *dataset);

SPL_END_DECLARATIONS

#endif
