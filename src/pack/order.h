/* The key that spl_points_order() sorted by: recomputed instead of kept, for the octree's few searches. */
#ifndef SPL_PACK_ORDER_H
#define SPL_PACK_ORDER_H

#include "pack/points.h"

/* 63-bit Morton key of point `i` in a cube. Points are sorted by their keys in the cube at cube_min with edge
 * cube_size; those of equal keys by their keys in the cube at their own least corner with their largest extent as its
 * edge, and so on. */
uint64_t spl_points_key(const struct spl_points *points, size_t i, const double low[3], double size);

#endif
