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

struct spl_view; /* <splatd/render.h> */

SPL_BEGIN_DECLARATIONS

/* How what is solid is shaded, once it is drawn: any of these together, or none. */
enum {
    SPL_SHADE_NONE = 1,      /* stands alone */
    SPL_SHADE_EDL = 2,       /* eye-dome lighting: darker where what lies around is nearer, from depth alone */
    SPL_SHADE_HEADLIGHT = 4, /* brighter where the surface faces the eye */
    SPL_SHADE_SUN = 8,       /* brighter where it faces the sun; casts no shadows */
};

struct spl_shade_params {
    uint32_t kinds;  /* SPL_SHADE_*; 0 = EDL where colours show no shape: of a dataset that has none of its own, or
                        classes or one colour in their place; else none */
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

/* What colours show. */
enum spl_color_by {
    SPL_COLOR_BY_RGB,       /* what the dataset has: textures, maps, its splats' own */
    SPL_COLOR_BY_ATTRIBUTE, /* an optional attribute by name: of "class" a colour each without ramp and range */
    SPL_COLOR_BY_HEIGHT,    /* z, world */
    SPL_COLOR_BY_PLANE,     /* distance to a plane, positive on the side of its normal */
    SPL_COLOR_BY_NORMAL,    /* world axes: x is red, y green, z blue */
    SPL_COLOR_BY_FLAT,      /* one colour */
    SPL_COLOR_BY_COUNT
};

/* What values become colours by, from the range's low end to its high one. */
enum spl_ramp { SPL_RAMP_AUTO, SPL_RAMP_VIRIDIS, SPL_RAMP_TURBO, SPL_RAMP_GREY, SPL_RAMP_TERRAIN, SPL_RAMP_COUNT };
SPL_API const char *spl_ramp_name(enum spl_ramp ramp);
SPL_API int spl_ramp_from_name(const char *name); /* -1 for an unknown name */

enum { SPL_COLOR_NAME_MAX = 32, SPL_COLOR_TEXT_MAX = 400 };

struct spl_color_params {
    enum spl_color_by by;
    char name[SPL_COLOR_NAME_MAX]; /* of the attribute */
    bool rgb;                      /* the splats' own colours times these: what has a value shows both */
    double plane[6];               /* a point of it and its normal, world */
    uint8_t flat[3];
    enum spl_ramp ramp;            /* AUTO: grey of intensity, terrain of height, else viridis */
    bool has_range;                /* false: quantiles 0.02 and 0.98 where the dataset says them, else all */
    double range[2];               /* rising */
    bool shares[2];                /* an end is a quantile, 0 to 1 */
};

/* Reads "rgb", "height", "normal", "plane:x,y,z,nx,ny,nz", "flat:COLOUR" or an attribute's name, which "rgb+" may stand
 * before. Leaves ramp and range. SPL_E_INPUT (field "color_by") says what is wrong; then `out` is as it was. */
SPL_API int spl_color_parse(const char *text, struct spl_color_params *out, struct spl_error *err);

/* Reads "0..200", "q0.02..q0.98", or one of each. SPL_E_INPUT, field "range". */
SPL_API int spl_color_parse_range(const char *text, struct spl_color_params *out, struct spl_error *err);

/* Writes what colours show so that it reads back; returns the length, as snprintf(). */
SPL_API int spl_color_print(const struct spl_color_params *color, char *text, size_t bytes);

/* Is all of it in range? SPL_E_USAGE names the field. */
SPL_API int spl_color_check(const struct spl_color_params *color, struct spl_error *err);

/* The kinds that the colours of a view of the dataset are shaded by, without NONE: 0 = none. */
SPL_API uint32_t spl_shade_for(const struct spl_view *view, const struct spl_dataset_info *dataset);

SPL_END_DECLARATIONS

#endif
