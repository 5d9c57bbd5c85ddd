/* Morton (Z) order of 21 bits an axis: x in bit 0, y in bit 1, z in bit 2 of each triple, so the top triple is the
 * root's octant. Pure functions; any thread. */
#ifndef SPL_GEOM_MORTON_H
#define SPL_GEOM_MORTON_H

#include <stdint.h>

#define SPL_MORTON_BITS 21

static inline uint64_t spl_morton_spread(uint32_t v)
{
    uint64_t x = v & 0x1fffff;
    x = (x | x << 32) & 0x001f00000000ffffull;
    x = (x | x << 16) & 0x001f0000ff0000ffull;
    x = (x | x << 8) & 0x100f00f00f00f00full;
    x = (x | x << 4) & 0x10c30c30c30c30c3ull;
    return (x | x << 2) & 0x1249249249249249ull;
}

/* The inverse: every third bit of `x`, from the lowest on. */
static inline uint32_t spl_morton_compact(uint64_t x)
{
    x &= 0x1249249249249249ull;
    x = (x | x >> 2) & 0x10c30c30c30c30c3ull;
    x = (x | x >> 4) & 0x100f00f00f00f00full;
    x = (x | x >> 8) & 0x001f0000ff0000ffull;
    x = (x | x >> 16) & 0x001f00000000ffffull;
    return (uint32_t)(x | x >> 32) & 0x1fffff;
}

static inline uint64_t spl_morton_encode(uint32_t x, uint32_t y, uint32_t z)
{
    return spl_morton_spread(x) | spl_morton_spread(y) << 1 | spl_morton_spread(z) << 2;
}

/* The cell of coordinate `v` on an axis that starts at `least` with 2^21 cells over `size`; clamped at both ends. */
static inline uint32_t spl_morton_cell(double v, double least, double size)
{
    double cell = (v - least) / size * (1 << SPL_MORTON_BITS);
    if (!(cell > 0))
        return 0;
    return cell < (1 << SPL_MORTON_BITS) - 1 ? (uint32_t)cell : (1u << SPL_MORTON_BITS) - 1;
}

#endif
