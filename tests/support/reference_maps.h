/* Maps of stations, once more in C: what trims a fragment, and what colours a sample takes. Shares the layout of maps
 * and the float mapping with the product (each has tests of its own), nothing of what is done with them. */
#ifndef TEST_SUPPORT_REFERENCE_MAPS_H
#define TEST_SUPPORT_REFERENCE_MAPS_H

#include <stdbool.h>
#include <stdint.h>

#include <splatd/camera.h>

#include "dataset/dataset.h"

struct reference_map {
    const struct spl_map_row *row;
    uint32_t *words;
    float pose[12];
};

/* All of a dataset's, seen by `camera`; the caller frees their words and them. */
struct reference_map *reference_maps(const struct spl_dataset *dataset, const struct spl_camera *camera);

/* Did the station see through the fragment at p of a disc of `normal` and `radius`? */
bool reference_map_trims(const struct reference_map *map, const float p[3], const float normal[3], float radius);

/* A sample as maps see it, view space. */
struct reference_sample {
    float p[3], right[3], down[3]; /* where it lies, and how far the surface goes to the next */
    float radius;                  /* of its discs, as far as that is known */
    bool parallel;                 /* rays */
};

/* The weight of the station's colour there, and that colour, 0..255. */
float reference_map_color(const struct reference_map *map, const struct reference_sample *sample, float color[3]);

#endif
