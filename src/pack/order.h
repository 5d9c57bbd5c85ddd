/* The key that spl_points_order() sorted by: recomputed instead of kept, for the octree's few searches. */
#ifndef SPL_PACK_ORDER_H
#define SPL_PACK_ORDER_H

#include "pack/points.h"

/* 63-bit Morton key of point `i` in the cube at bounds_min with edge cube_size. */
uint64_t spl_points_key(const struct spl_points *points, size_t i);

#endif
