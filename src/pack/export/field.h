/* How far inside of a sheet of points each cell of a grid lies. */
#ifndef SPL_PACK_EXPORT_FIELD_H
#define SPL_PACK_EXPORT_FIELD_H

#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

struct spl_field {
    double origin[2], cell; /* the middle of cell (0, 0); cells are square */
    uint32_t width, height; /* a frame of cells that are outside lies around */
    float *inside;          /* row by row, of each cell's middle: above 0 inside; owned */
    float *spacing;         /* of the points there, 0 where there are none; owned */
};

/* The field of `count` >= 1 points of the plane, each with the radius of a disc that reaches its neighbours. Inside is
 * what lies among the points, and half a spacing beyond the outer ones: gaps narrower than two radii are closed, wider
 * ones stay. Cells are of `cell`, or as much wider as SPL_FIELD_CELLS of them need, or 24 a point. Takes 8 bytes a cell
 * meanwhile.
 * SPL_E_NOMEM. Any thread. */
enum { SPL_FIELD_CELLS = 1 << 21 };
int spl_field_init(struct spl_field *field, const double (*points)[2], const float *radius, size_t count, double cell,
                   struct spl_error *err);

void spl_field_finish(struct spl_field *field);

#endif
