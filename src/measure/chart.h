/* Speed against accuracy as an SVG picture: milliseconds from left to right (logarithmic), PSNR upwards, so that better
 * is up and left. It brings its own background and colours for light and for dark pages. */
#ifndef SPL_MEASURE_CHART_H
#define SPL_MEASURE_CHART_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

struct spl_chart_point {
    double ms, psnr;  /* milliseconds > 0; dB */
    bool front;       /* drawn filled */
    int32_t index;    /* becomes data-index of the point's group, for a page's script; -1 = none */
    char label[64];   /* may be "" */
    char detail[160]; /* shown by a browser when the pointer rests on it; may be "" */
};

struct spl_chart_curve {
    char name[64];                        /* in the legend */
    unsigned color;                       /* curves of the same colour belong together */
    unsigned dash;                        /* 0 = a full line */
    double fade;                          /* 0 = in its full colour, towards 1 = paler */
    const struct spl_chart_point *points; /* borrowed; any order, drawn by ms */
    size_t count;
};

struct spl_chart {
    const char *title, *subtitle;
    const char *axis; /* what `ms` is, where it is no time of a frame; NULL = milliseconds a frame */
    const char *unit; /* of a point's `ms`; NULL = "ms" */
    const char *note; /* below the plot; NULL = what labels are of a chart of frames */
    const struct spl_chart_curve *curves; /* borrowed */
    size_t curve_count;
};

/* Writes the chart as one SVG document into *svg (released with free(), 0-terminated). Every point with finite ms > 0
 * and a psnr that is a number is drawn; PSNR from SPL_CHART_EXACT on stands at the upper edge. Labels are set where
 * they hide no point or other label, those of the front first, and left out where there is no room. Names are escaped.
 * Pure; any thread. Errors: SPL_E_NOMEM. */
enum { SPL_CHART_EXACT = 90 };
int spl_chart_write(const struct spl_chart *chart, char **svg, size_t *length, struct spl_error *err);

#endif
