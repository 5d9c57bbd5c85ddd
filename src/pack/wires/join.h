/* Points on wires, poles and cables, joined along them. */
#ifndef SPL_PACK_WIRES_JOIN_H
#define SPL_PACK_WIRES_JOIN_H

#include <stdint.h>

#include "base/error.h"
#include "pack/stage.h"

#define SPL_WIRE_END UINT32_MAX

struct spl_wire_point {
    double position[3];
    double spacing;   /* metres, > 0: what lies nearer may lie beside it, off by the scan's noise */
    uint32_t next[2]; /* the points that it is joined with, SPL_WIRE_END where there is none */
    uint32_t other;   /* of an end: the chain's other end; itself when alone */
    double length;    /* of an end: from there to the other */
    uint32_t beside;  /* of a point that is left alone: the one that it lies beside; else SPL_WIRE_END */
    double width;     /* spl_wires_find_axes() */
};

/* How far joining may go: what steps are left of those that the number of points allows, and the stage that it is. */
struct spl_wires_work { // owned by: the thread that joins
    uint64_t left;
    struct spl_stage *stage;
};

/* SPL_E_CANCELLED, SPL_E_LIMIT when no step is left, or 0. Without a message: what stops is for the caller to say. */
static inline int spl_wires_check(const struct spl_wires_work *work)
{
    return spl_stage_is_cancelled(work->stage) ? SPL_E_CANCELLED : work->left ? SPL_OK : SPL_E_LIMIT;
}

/* Item `i` of `count`, which together are `share` items of the stage: adds a piece of it every thousand items. */
static inline void spl_wires_advance(const struct spl_wires_work *work, uint64_t i, uint64_t count, uint64_t share)
{
    enum { every = 1000 };
    uint64_t left = count - i;
    if (i % every == 0)
        spl_stage_add(work->stage, (uint64_t)((double)share * (double)(left < every ? left : every) / (double)count),
                      0);
}

/* Does a chain begin at point `i`? At the lower of its ends. */
static inline bool spl_wires_is_begin(const struct spl_wire_point *p, uint32_t i)
{
    return p[i].next[0] != SPL_WIRE_END && p[i].next[1] == SPL_WIRE_END && p[i].other >= i;
}

/* Sets the links of `count` points (`next`, `other`, `length`, `beside`, which need no value before): chains without
 * branches or loops. Points that lie beside another one are left alone. Adds up to 2 `count` items to the stage.
 * SPL_E_NOMEM; else as spl_wires_check(): the links hold then, but are not all. Pure function but for `work`; any
 * thread. */
int spl_wires_join(struct spl_wire_point *points, uint32_t count, struct spl_wires_work *work, struct spl_error *err);

/* How `point` lies off what it is joined with on the other side of `avoid` (one of its links; SPL_WIRE_END at an end):
 * the unit vector to it from the chain's point that lies `reach` behind, or its end. Returns the distance of those two,
 * or 0 where nothing is there. Takes a step of `work` for each point on the way, and goes no farther than they last. */
double spl_wires_heading(const struct spl_wire_point *points, uint32_t point, uint32_t avoid, double reach,
                         double heading[3], struct spl_wires_work *work);

#endif
