/* Small datasets for tests, straight from an array of splats. Anything that goes wrong ends the test program. */
#ifndef TEST_SUPPORT_MAKE_DATASET_H
#define TEST_SUPPORT_MAKE_DATASET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <jansson.h>

#include <splatd/dataset.h>

#include "dataset/panels.h"

struct make_splat {
    double position[3];   /* world */
    float normal[3];      /* unit */
    float radius;
    uint8_t color[3];
    uint8_t classification;
    float uncertainty;
    bool linear;
    float width; /* of a vertex: its line's, 0 = not known; the first one's is that of all */
    bool vertex; /* of a line, not a splat; `linear` then says that a piece goes to the next vertex */
    float clip[3], clip_offset; /* struct spl_clip: all 0 = no line */
};

/* Writes `count` (> 0) splats to `path` at default errors, with classes and uncertainties. Vertices of lines, at
 * most 128, stand behind the splats and are for one level only.
 * One level: a single node that keeps the order given, so that a splat's id is its index (at most 524,288 splats).
 * Two levels: the root holds every k-th splat, k <= 8, of radius * sqrt(k); its children are the cube's octants (their
 * splats in the order given), of at most 524,288 splats each. */
void make_dataset_file(const char *path, const struct make_splat *splats, size_t count, int levels);

/* Panels of a plane, whose origin is in world coordinates here. */
struct make_panels {
    struct spl_panel_plane plane;
    const struct spl_panel *panels;
    const struct spl_relief *reliefs; /* theirs, of one level: they are meshes; NULL = they are flat */
    size_t count;       /* a chunk for each SPL_PANELS_MAX of them; the points are those of the first */
    double color_error; /* as of spl_panels_encode() */
    uint8_t classification;
    bool classes_vary;  /* panel i has i % 3 more */
    bool coarse;        /* of two levels: the root's; else of the octant where its origin lies */
};

/* The same with panels behind each node's splats and lines, of which there may be none then. A panel's id is the
 * splats and vertices, and the panels before it. */
void make_dataset_file_panels(const char *path, const struct make_splat *splats, size_t count,
                              const struct make_panels *panels, size_t panel_count, int levels);
struct spl_dataset *make_dataset_panels(const struct make_splat *splats, size_t count,
                                        const struct make_panels *panels, size_t panel_count, int levels);

/* Mean error of the normals that follow, radians; default 1 degree. */
extern double make_dataset_normal_error;

/* What META of files that follow says; default "us-ft" and "EPSG:2263". NULL = nothing. */
extern const char *make_dataset_unit, *make_dataset_crs;

/* META of files that follow says a station at the origin: normals show to it. */
extern bool make_dataset_station;

/* What META of files that follow says besides, borrowed; NULL = nothing. */
extern const json_t *make_dataset_meta;

/* Bytes of the pages of files that follow; default SPL_PAGE_BYTES. 0 = a page for each node. */
extern size_t make_dataset_page_bytes;

/* The same as an open dataset of id "made" whose file is gone already; one level where that holds all splats. */
struct spl_dataset *make_dataset(const struct make_splat *splats, size_t count);
struct spl_dataset *make_dataset_levels(const struct make_splat *splats, size_t count, int levels);

/* A new folder for a test's files: mkdtemp's name in `path`, which has room for 256 bytes. */
void make_folder(char *path);

#endif
