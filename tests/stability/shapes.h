/* Point sets that no scanner gives, with a truth of their own: what a neighbourhood of theirs says is degenerate. */
#ifndef STABILITY_SHAPES_H
#define STABILITY_SHAPES_H

#include "world.h"

enum shape {
    SHAPE_ONE,        /* a single point: a ball of 10 mm, which is what pack takes it for */
    SHAPE_COINCIDENT, /* a million points in the same place: the same ball */
    SHAPE_LINE,       /* 2 mm apart on a straight line: a wire of 2 mm radius and 4 m, level, along x */
    SHAPE_PLANE,      /* a grid of 10 mm exactly in a plane: a sheet of 4 m by 3 m, upright, along x */
    SHAPE_NEEDLES,    /* the same sheet in upright lines of points: 2 mm apart, the lines 20 mm */
    SHAPE_SLIVERS,    /* the lines 100 mm apart, so that all neighbours of a point lie on its own */
    SHAPE_COUNT
};

/* The shape is centred on the origin and to be looked at along +y. */
void world_init_shape(struct world *world, enum shape shape);

#endif
