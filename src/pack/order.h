/* The key that spl_points_order() sorted by: recomputed instead of kept, for the octree's few searches. */
#ifndef SPL_PACK_ORDER_H
#define SPL_PACK_ORDER_H

#include "geom/morton.h"
#include "pack/points.h"

/* 63-bit Morton key of point `i` in a cube. Points are sorted by their keys in the cube at cube_min with edge
 * cube_size; those of equal keys by their keys in the cube at their own least corner with their largest extent as its
 * edge, and so on. */
static inline uint64_t spl_points_key(const struct spl_points *points, size_t i, const double low[3], double size)
{
    uint32_t cell[3];
    for (int c = 0; c < 3; c++)
        cell[c] = spl_morton_cell(spl_points_at(points, c, i), low[c], size);
    return spl_morton_encode(cell[0], cell[1], cell[2]);
}

#endif
