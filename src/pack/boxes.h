/* Boxes over sorted points: every 16 points in a row are a leaf with a box, every 8 boxes a group with a box of its
 * own, up to one group. */
#ifndef SPL_PACK_BOXES_H
#define SPL_PACK_BOXES_H

#include "pack/points.h"

enum { SPL_BOXES_LEAF = 16, SPL_BOXES_FAN = 8, SPL_BOXES_LEVELS = 12 };

/* Corners of boxes that lie beside each other; unused ones are empty: low infinite, high -infinite. */
struct spl_box_group {
    double low[3][SPL_BOXES_FAN], high[3][SPL_BOXES_FAN];
};

/* Box b of a level is entry b % SPL_BOXES_FAN of that level's group b / SPL_BOXES_FAN, and bounds group b of the level
 * below; on level 0 it bounds the points from b * SPL_BOXES_LEAF on. */
struct spl_boxes {
    struct spl_spill *spill; /* the points' */
    struct spl_box_group *groups;   // owned; all levels, leaves' first
    size_t first[SPL_BOXES_LEVELS]; /* of each level in groups */
    unsigned levels;                /* the last has one group */
};

/* At least 1 point; 3.5 bytes a point. SPL_E_NOMEM; nothing is held then. */
int spl_boxes_init(struct spl_boxes *boxes, const struct spl_points *points, unsigned threads, struct spl_error *err);
void spl_boxes_finish(struct spl_boxes *boxes);

#endif
