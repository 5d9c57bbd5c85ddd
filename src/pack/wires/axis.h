/* The axes of chains of points on wires, and how thick these are. */
#ifndef SPL_PACK_WIRES_AXIS_H
#define SPL_PACK_WIRES_AXIS_H

#include "pack/wires/join.h"

/* Metres: what a wire is at least; as a scan sees it, the noise's sigma is. */
#define SPL_WIRE_THIN 0.25e-3

/* Moves the points of chains, as spl_wires_join() left them, onto their axes, and sets `width` of each and of the
 * points beside them: metres, 0 where it is no line but a heap of points. `noise`: sigma of the scan, in its own unit,
 * 0 = none is taken off. SPL_E_NOMEM, SPL_E_CANCELLED. Pure function but for `work`; any thread. */
int spl_wires_find_axes(struct spl_wire_point *points, uint32_t count, double noise, struct spl_wires_work *work,
                        struct spl_error *err);

#endif
