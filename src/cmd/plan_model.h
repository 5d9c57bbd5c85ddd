/* What a service of many points and many views takes, reckoned from measured figures: what is asked goes in, lines with
 * values and the factors they are products of come out. Nothing is read, written, allocated or measured here. */
#ifndef SPL_CMD_PLAN_MODEL_H
#define SPL_CMD_PLAN_MODEL_H

#include <stdbool.h>
#include <stdint.h>

enum spl_plan_figure {
#define FIGURE(name, value, unit, width, height, what, where) SPL_PLAN_FIGURE_##name,
#include "cmd/plan_figures.def"
#undef FIGURE
    SPL_PLAN_FIGURES,
    SPL_PLAN_FIGURE_none = SPL_PLAN_FIGURES
};

enum spl_plan_device {
#define DEVICE(name, units, what, first, last, cores, memory, paged, resident) SPL_PLAN_DEVICE_##name,
#include "cmd/plan_devices.def"
#undef DEVICE
    SPL_PLAN_DEVICES
};

enum spl_plan_section {
    SPL_PLAN_SCANS,
    SPL_PLAN_PACKING,
    SPL_PLAN_STORAGE,
    SPL_PLAN_RENDERING,
    SPL_PLAN_NETWORK,
    SPL_PLAN_MEMORY,
    SPL_PLAN_COST,
    SPL_PLAN_SECTIONS
};

/* What a value counts: how people read it. */
enum spl_plan_kind {
    SPL_PLAN_NUMBER, /* of the row's unit */
    SPL_PLAN_BYTES,
    SPL_PLAN_BITS,         /* a second */
    SPL_PLAN_SHARE,        /* 1 is all */
    SPL_PLAN_DEVICES_USED, /* of the device asked for */
    SPL_PLAN_DEVICE_HOURS,
};

enum spl_plan_line {
#define LINE(name, ...) SPL_PLAN_LINE_##name,
#include "cmd/plan_lines.def"
#undef LINE
    SPL_PLAN_LINES
};

enum spl_plan_input {
    SPL_PLAN_INPUT_points,
    SPL_PLAN_INPUT_views,
    SPL_PLAN_INPUT_headroom,
    SPL_PLAN_INPUT_rendered, /* 1 - cached */
    SPL_PLAN_INPUT_cached,
    SPL_PLAN_INPUT_copies,
    SPL_PLAN_INPUT_pixels, /* of a view */
    SPL_PLAN_INPUTS
};

enum { SPL_PLAN_TERMS_MAX = 8 };

/* A factor, with the operation in front of it; the first one's is not said. */
struct spl_plan_term {
    char op; // '*', '/' or '+'
    enum spl_plan_from {
        SPL_PLAN_FROM_NONE,
        SPL_PLAN_FROM_INPUT,
        SPL_PLAN_FROM_FIGURE,
        SPL_PLAN_FROM_DEVICE, // in rows only: a figure of the device, as SPL_PLAN_OF_…
        SPL_PLAN_FROM_SIZED,  // in rows only: a figure at the size, of enum spl_plan_family
        SPL_PLAN_FROM_PIXELS, // those of a figure's size
        SPL_PLAN_FROM_LINE
    } from;
    int which;
};

/* Exact up to 1e15 points, 1e9 views a second and 32768 pixels a side. */
struct spl_plan_asked {
    double points;    // 1 and more
    double views;     // a second, in the mean of a month; 0 and more
    double headroom;  // peaks over the mean, 1 and more
    double cached;    // share of the views, 0 to 1
    double copies;    // of what is packed, 1 and more
    uint32_t size[2]; // pixels
    enum spl_plan_device device;
};

struct spl_plan {
    struct spl_plan_asked asked;
    double inputs[SPL_PLAN_INPUTS];
    struct {
        bool known; // false: the device lacks a figure
        double value;
        int count;
        struct spl_plan_term terms[SPL_PLAN_TERMS_MAX]; // none FROM_DEVICE or FROM_SIZED
    } lines[SPL_PLAN_LINES];
    bool used[SPL_PLAN_FIGURES]; // by a line that is known
    bool beyond;                 // the size is larger than what some figure was measured at, so pixels scale it
};

struct spl_plan spl_plan_reckon(const struct spl_plan_asked *asked);

/* Rows of the tables, static. */
struct spl_plan_figure_row {
    const char *name;
    double value;
    const char *unit;
    uint32_t width, height; // 0: of no image
    const char *what, *where;
};
const struct spl_plan_figure_row *spl_plan_figure_row(enum spl_plan_figure figure);

struct spl_plan_device_row {
    const char *name, *units, *what;
};
const struct spl_plan_device_row *spl_plan_device_row(enum spl_plan_device device);

struct spl_plan_line_row {
    const char *name;
    enum spl_plan_section section;
    const char *what;
    enum spl_plan_kind kind;
    const char *unit, *note; // note may be NULL
};
const struct spl_plan_line_row *spl_plan_line_row(enum spl_plan_line line);

#endif
