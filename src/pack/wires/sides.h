/* What lies beside chains: points of something thicker than a line, and points of the wire that were not marked. */
#ifndef SPL_PACK_WIRES_SIDES_H
#define SPL_PACK_WIRES_SIDES_H

#include "pack/points.h"
#include "pack/wires/join.h"
#include "pack/wires/wires.h"

/* Sets the width of chains to 0 that are no wires: those that stand, along `up` of length 1, and those whose points
 * have others beside them, of something that is a surface. SPL_E_NOMEM, SPL_E_CANCELLED. One thread. */
int spl_wires_drop_thick(struct spl_wire_point *points, uint32_t count, const double up[3], struct spl_wires_work *work,
                         struct spl_error *err);

/* Makes those points linear that lie on the lines, but for points of planes. `noise` as of the options. SPL_E_NOMEM,
 * SPL_E_CANCELLED. One thread; some 100 ns a point. */
int spl_wires_claim(const struct spl_wires *wires, struct spl_points *points, double noise,
                    const struct spl_stage *stage, struct spl_error *err);

#endif
