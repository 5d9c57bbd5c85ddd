/* Points on wires, poles and cables, joined along them. */
#ifndef SPL_PACK_WIRES_JOIN_H
#define SPL_PACK_WIRES_JOIN_H

#include <stdint.h>

#include "base/error.h"
#include "base/work.h"

#define SPL_WIRE_END UINT32_MAX

struct spl_wire_point {
    double position[3];
    double spacing;   /* metres, > 0: what lies nearer may lie beside it, off by the scan's noise */
    uint32_t next[2]; /* the points that it is joined with, SPL_WIRE_END where there is none */
    uint32_t other;   /* of an end: the chain's other end; itself when alone */
    double length;    /* of an end: from there to the other */
};

/* Sets the links of `count` points (`next`, `other`, `length`, which need no value before): chains without branches or
 * loops. Points that lie beside another one are left alone. SPL_E_NOMEM; as spl_work_check() when no step is left: the
 * links hold then, but are not all. Pure function but for `work`; any thread. */
int spl_wires_join(struct spl_wire_point *points, uint32_t count, struct spl_work *work, struct spl_error *err);

/* How `point` lies off what it is joined with on the other side of `avoid` (one of its links; SPL_WIRE_END at an end):
 * the unit vector to it from the chain's point that lies `reach` behind, or its end. Returns the distance of those two,
 * or 0 where nothing is there. Takes a step of `work` for each point on the way, and goes no farther than they last. */
double spl_wires_heading(const struct spl_wire_point *points, uint32_t point, uint32_t avoid, double reach,
                         double heading[3], struct spl_work *work);

#endif
