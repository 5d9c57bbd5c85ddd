/* What C and GLSL share of soft spheres; see shared.h. */
#ifndef SPL_SHARED_SOFT_H
#define SPL_SHARED_SOFT_H

#include "shared.h"

/* Soft spheres of model concentric have a shell for every so many samples of their radius, at most so many. */
#define SPL_SOFT_SHELL_SAMPLES 4
#define SPL_SOFT_SHELLS_MAX 16
/* A splat on a wire stands for a stretch of it that is so many of its radii long (1 / SPL_RADIUS_SPACING). */
#define SPL_SOFT_STRETCH 1.3333333f
/* Models with a kernel of their own, beside express. */
#define SPL_SOFT_BASE 0
#define SPL_SOFT_CONCENTRIC 1
#define SPL_SOFT_LAYER 2

/* Soft transparency: spheres as items in the order of their ids, which are sorted by depth and listed by the tiles of
 * SPL_SOFT_TILE x SPL_SOFT_TILE_ROWS samples that they reach; see src/render/soft/order.h. An item is
 * SPL_SOFT_ITEM_WORDS words: x y z of the centre in view space, the radius (which may be less than a sample:
 * soft_radius()), colour | mark << 24, id. Behind all items lie their rectangles, a word each: the first tile (row *
 * columns + column) in 22 bits, columns less 1 and rows less 1 in 5 bits each. */
#define SPL_SOFT_TILE 8 /* samples of a row of a tile */
#define SPL_SOFT_TILE_ROWS 4
#define SPL_SOFT_SAMPLES 4 /* of a column of a tile that an invocation blends */
#define SPL_SOFT_ITEM_WORDS 6
#define SPL_SOFT_RECT_COLUMNS 22
#define SPL_SOFT_RECT_ROWS 27
#define SPL_SOFT_SPAN_MAX 32 /* tiles of a rectangle's side */
/* What is in front lets this much through, in fixed point, and is not looked behind where it is less than the least. */
#define SPL_SOFT_CLEAR 0xffffffu
#define SPL_SOFT_CLEAR_LEAST 0x4000u
#define SPL_SOFT_FARTHEST 0x7fffffff /* what SPL_NOTHING is among depths that compare as signed numbers */
#define SPL_SOFT_STATE_WORDS 4 /* a sample: sums of red, green, blue times share, share covered; 0 = nothing */
/* What an invocation counts: items | most entries of one << 4 | entries << 16, least and greatest depth, largest radius
 * as drawn (float bits). */
#define SPL_SOFT_SLOT_WORDS 4
#define SPL_SOFT_SLOT_THIN 0x8000u /* bit of a slot's first word: it has spheres narrower than a sample */
#define SPL_SOFT_SLOT_SPLATS 4 /* discs of a slot; SPL_SOFT_SLOT_CELLS cells */
#define SPL_SOFT_SLOT_CELLS 8
/* Models with a density and layer keep these of a sample from window to window of depth, and those of an invocation
 * from run to run. Events are rounded: where spheres may begin and end is asked for with so much more of the depth. */
#define SPL_SOFT_WALK_WORDS 2
#define SPL_SOFT_KEPT_WORDS 16
#define SPL_SOFT_MET 32 /* spheres that a ray has met, of which an invocation remembers the entries */
#define SPL_SOFT_SLACK 1e-6f
#define SPL_SOFT_ROUNDS 60000u /* of an invocation at most: see SPL_WINDOW */

/* What of soft spheres is found on a sample for layers but color and coverage (soft_of.comp; constant 0). Of models
 * with a density optical depth is counted in units of 2^-SPL_SOFT_DEPTH_BITS. */
#define SPL_SOFT_FOUND_WORDS 4  /* a sample: view depth (SPL_NOTHING: no sphere), id, normal, what as (SPL_DRAWN_*);
                                 * without a sphere the last is what was hidden so far, inverted */
#define SPL_SOFT_DETAIL_WORDS 2 /* of each item, where it is looked for: normal, what as */
#define SPL_SOFT_FIND_FIRST 0
#define SPL_SOFT_FIND_MEDIAN 1  /* of model express; the next, of SPL_SOFT_BASE and so on */
#define SPL_SOFT_FIND_DENSE 2
#define SPL_SOFT_SEEN 257u      /* opacity of 65536, at least 1/255 */
#define SPL_SOFT_DEPTH_BITS 20
#define SPL_SOFT_DEPTH_HALF 726818u /* ln 2 of them */
#define SPL_SOFT_DEPTH_SEEN 4120u   /* ln(255 / 254) */
#define SPL_SOFT_FIND_SHELLS 64     /* rounds of an item that has shells, at most */

/* Of one dispatch of it. */
struct spl_soft_step {
    SPL_U32 count;         /* items to sort or to list; tiles to blend */
    SPL_U32 block, blocks; /* items an invocation walks; invocations */
    SPL_U32 digits;        /* counters of an invocation: values of a digit, or tiles */
    SPL_U32 low, shift;    /* a digit is (key - low) >> shift & (digits - 1); soft_of: optical depth to find */
    SPL_U32 columns;       /* tiles of a row */
    SPL_U32 rects;         /* word of the items' rectangles */
    SPL_U32 progress;      /* word of the counters where blocks keep how far they came */
    SPL_U32 first;         /* word of the lists where those of this dispatch start */
    SPL_F32 depth;         /* optical, through a sphere's centre: models with a density, and layer */
    SPL_F32 reach;         /* no sphere of the lists has a larger radius */
    SPL_F32 thin;          /* optical depth of the thinnest over their share of the opacity and `depth`; models.h */
    SPL_F32 until;         /* view depth up to which these lists have all that begins before it */
    SPL_F32 fall_0, fall_1, fall_2, fall_3, fall_4; /* of a sphere: sum of fall_i m^(i + 1), m = 1 - d^2 / r^2, of
                                                       65536 */
    SPL_U32 low_slot;      /* of a window: from (low, low_slot) */
    SPL_U32 ends;          /* of layer: this is its last window */
    SPL_U32 high, high_slot; /* to (high, high_slot), exclusive; a slot is what an invocation gathers, by rising ids */
    SPL_U32 details;       /* word of the items' details */
    SPL_U32 entries;       /* of all lists */
};

#ifndef SPL_GLSL
_Static_assert(sizeof(struct spl_soft_step) <= 256, "spl_soft_step fits its slot");
_Static_assert(SPL_WINDOW / SPL_SOFT_TILE + 1 <= SPL_SOFT_SPAN_MAX && SPL_WINDOW % SPL_SOFT_TILE == 0 &&
               SPL_WINDOW / SPL_SOFT_TILE_ROWS + 1 <= SPL_SOFT_SPAN_MAX && SPL_WINDOW % SPL_SOFT_TILE_ROWS == 0,
               "a window is whole tiles, and any footprint that is not cut in windows fits a rectangle");
#endif

#endif
