/* What colours of a view show in place of the splats' own: which value, and what becomes of it. Shared by selection,
 * which tells chunks where their codes are, recording, and legends. Pure functions; any thread. */
#ifndef SPL_RENDER_PAINT_H
#define SPL_RENDER_PAINT_H

#include <stdbool.h>
#include <stdint.h>

#include <splatd/camera.h>
#include <splatd/color.h>
#include <splatd/dataset.h>

#include "base/error.h"
#include "shared.h"

/* Of a dataset. */
struct spl_paint {
    uint32_t kind;   /* SPL_PAINT_*, with SPL_PAINT_TIMES_RGB; 0 = the splats' own colours */
    int stream;      /* of the dataset; -1 = none */
    bool steps;      /* it is of that type: its last code is no value */
    bool classes;    /* each has its colour, by its number */
    double low, high; /* of the palette's two ends, values; low < high */
    double first, steps_a_unit; /* of the stream: value = (first + number) / steps_a_unit */
    double plane[4]; /* of POSITION: value = plane[0..2] . place + plane[3], world */
    uint32_t colors[SPL_PALETTE_COLORS + 1]; /* r | g << 8 | b << 16; the last of what has no value */
};

/* Names become streams, quantiles values. SPL_E_INPUT (field "color_by" or "range") where the dataset has no such
 * attribute, which lists those that it has, or does not say how its values are distributed. */
int spl_paint_init(struct spl_paint *paint, const struct spl_color_params *color, const struct spl_dataset_info *info,
                   struct spl_error *err);

/* Part of it: the view's streams, where `paint` is by one: first and steps of numbers, which info does not have. */
struct spl_stream;
void spl_paint_set_stream(struct spl_paint *paint, const struct spl_stream *streams);

/* The palette of a camera, as kernels read it. */
void spl_paint_see(const struct spl_paint *paint, const struct spl_camera *camera, uint32_t words[SPL_PALETTE_WORDS]);

/* The colour at `share` of a ramp, 0..1, bytes; that of a class, and its name, NULL of one that has none. */
void spl_ramp_get(enum spl_ramp ramp, double share, uint8_t rgb[3]);
uint32_t spl_class_get_color(uint32_t number);
const char *spl_class_get_name(uint32_t number);

/* The ramp that values get: AUTO by what they are. */
enum spl_ramp spl_color_get_ramp(const struct spl_color_params *color);

#endif
