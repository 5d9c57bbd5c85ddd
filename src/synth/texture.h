/* Procedural surface colours: sRGB as a function of the place on the surface, band-limited (no feature is finer than
 * about 5 mm) and, but for its regular joints, without a period. */
#ifndef SPL_SYNTH_TEXTURE_H
#define SPL_SYNTH_TEXTURE_H

#include <stdbool.h>
#include <stdint.h>

#include "synth/primitive.h"

enum spl_material_kind {
    SPL_MATERIAL_FLAT,    /* colors[0] */
    SPL_MATERIAL_MASONRY, /* blocks of size[0] × size[1] metres in running bond between joints of colors[2] */
    SPL_MATERIAL_PLASTER, /* noise over the surface, from colors[0] over colors[1] to colors[2] */
    SPL_MATERIAL_SOLID,   /* the same in space */
    SPL_MATERIAL_WINDOW,  /* panes of colors[0] to colors[1] between bars of colors[2], over the whole rectangle */
    SPL_MATERIAL_PLAQUE,  /* lines of text in colors[1] on colors[0], over the whole rectangle */
    SPL_MATERIAL_LEAF,    /* a disc with a rib, a shade between colors[0] and colors[1] for each primitive */
};

enum { SPL_PLAQUE_LETTERS = 18, SPL_PLAQUE_LINES = 6 };

struct spl_material {
    enum spl_material_kind kind;
    uint8_t colors[3][3];
    double size[2]; /* of a block; of the noise's coarsest wave along and across */
    double joint;   /* width, metres */
    double grain;   /* 0..1, strength of the noise */
    uint32_t seed;
    double finest;         /* shortest wave of the noise, metres; 0 = 16 mm */
    const char (
        *text)[SPL_PLAQUE_LETTERS + 1]; /* of a plaque: SPL_PLAQUE_LINES lines of A to Z; NULL = an inscription */
};

/* The colour of `primitive` at a point of its surface: sRGB levels 0..255, not rounded. Any thread. */
void spl_material_shade(const struct spl_material *material, const struct spl_primitive *primitive,
                        const double position[3], double color[3]);

/* The same, rounded. */
void spl_material_color(const struct spl_material *material, const struct spl_primitive *primitive,
                        const double position[3], uint8_t color[3]);

#endif
