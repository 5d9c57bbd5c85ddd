/* Meshes for tests: whole panels of one plane side by side, with relief. */
#ifndef TEST_SUPPORT_MAKE_SHEET_H
#define TEST_SUPPORT_MAKE_SHEET_H

#include "support/make_dataset.h"

enum { SHEET_ACROSS_MAX = 5, SHEET_PANELS_MAX = SHEET_ACROSS_MAX * SHEET_ACROSS_MAX };

/* `made` points into the others: it is not for copying. */
struct make_sheet {
    struct make_panels made;
    struct spl_panel panels[SHEET_PANELS_MAX];
    struct spl_relief reliefs[SHEET_PANELS_MAX];
};

/* `across` x `across` whole panels of one colour, flat as yet, around `center` on the plane of `normal`, cells of
 * `cell` metres, lattices of `level`. */
void make_sheet_begin(struct make_sheet *sheet, const float normal[3], const double center[3], unsigned across,
                      double cell, unsigned level);

/* Heights of waves `high` cells high and `length` panels long, which begin at phases `turn`; panels agree where they
 * meet. */
void make_sheet_waves(struct make_sheet *sheet, double high, double length, const double turn[2]);

#endif
