/* Colours that are one number of a point: 0x..RRGGBB, as PCL, ROS and Windows programs write them. */
#ifndef SPL_CLOUD_PACKED_H
#define SPL_CLOUD_PACKED_H

#include "cloud/reader.h"

/* Is a field called as such a colour: "rgb", "rgba", …? */
bool spl_packed_is_name(const char *name, size_t length);

/* For readers whose fields have types, while they open: is this field of `bytes` bytes the cloud's colour? Then its
 * columns are the cloud's. One that is called so and cannot be is told in info.unused; `list`: it has several numbers,
 * or none. */
bool spl_packed_take(struct spl_cloud *cloud, const char *name, size_t length, unsigned bytes, bool list);

/* Tells in info.unused of colours that lack a component, once all fields are taken. */
void spl_packed_tell_rest(struct spl_cloud *cloud);

/* A colour from the number that stands for it: a whole one of 32 bits, signed or not, is 0x..RRGGBB; of all others the
 * bits of a float are. NaN is black: what it was is lost. */
uint32_t spl_packed_from_number(double value);

/* Likewise from the bits of a float, which may be NaN. */
uint32_t spl_packed_from_bits(uint32_t bits);

static inline void spl_packed_put(struct spl_rows *rows, size_t row, uint32_t rgb)
{
    for (unsigned k = 0; k < 3; k++)
        rows->value[SPL_COLUMN_RED + k][row] = rgb >> (16 - 8 * k) & 0xff;
}

#endif
