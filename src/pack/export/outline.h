/* Outlines of what lies on a plane: polygons with holes. */
#ifndef SPL_PACK_EXPORT_OUTLINE_H
#define SPL_PACK_EXPORT_OUTLINE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

/* Vertices [first, first + count); a polygon's border runs counterclockwise, its holes, which follow, clockwise. */
struct spl_ring {
    uint32_t first, count;
    bool hole;
};

struct spl_polygon {
    uint32_t ring, rings; /* the first, and how many: the border and its holes */
    uint32_t loop, loops; /* vertices of `loop`: border and holes as one, by cuts that are walked there and back */
    double area;          /* without the holes */
};

struct spl_outline {
    double (*vertices)[2];
    uint32_t *loop;
    struct spl_ring *rings;
    struct spl_polygon *polygons;
    size_t vertex_count, vertex_capacity, loop_count, loop_capacity, ring_count, ring_capacity, polygon_count,
        polygon_capacity;
};

/* The outline of `count` >= 1 points of the plane with the radii of discs that reach their neighbours. Vertices are
 * left out as long as the border moves by no more than `tolerance`, or by the spacing of the points along it: closer
 * the scan does not say where it lies. Holes and islands of a few points are left out. Whoever calls finishes
 * `outline`, on failure too. SPL_E_NOMEM; SPL_E_LIMIT beyond 2^32 vertices. Any thread. */
int spl_outline_find(struct spl_outline *outline, const double (*points)[2], const float *radius, size_t count,
                     double tolerance, struct spl_error *err);

void spl_outline_finish(struct spl_outline *outline);

/* Joins the border and the holes of the last polygon to one loop (loop.c). */
int spl_outline_add_loop(struct spl_outline *outline, struct spl_polygon *polygon, struct spl_error *err);

/* Of a ring, signed: above 0 where it runs counterclockwise. */
double spl_outline_area(const double (*vertices)[2], size_t count);

#endif
