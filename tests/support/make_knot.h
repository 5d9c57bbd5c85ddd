/* A dataset whose checksums hold and whose content is made to cost whoever opens it as much as it can. */
#ifndef TEST_SUPPORT_MAKE_KNOT_H
#define TEST_SUPPORT_MAKE_KNOT_H

#include <stddef.h>

/* `count` (at most 524,288) points in a cube, in no order, that all claim to lie on wires, 6 bytes each. Radii are 1 cm
 * but for those of every twentieth chunk, which says 1 km: so to join these points, one would look at all others, along
 * whatever has been joined already, at every distance up to 200 km. */
void make_knot_file(const char *path, size_t count);

#endif
