/* What degrades: each condition measured against the truth, for the table. */
#ifndef STABILITY_CONDITIONS_H
#define STABILITY_CONDITIONS_H

#include "table.h"
#include "world.h"

struct conditions {
    struct suite *suite; /* .renderer writes the table, .other (may be NULL) is held against it */
    struct table *table;
    const char *const *only; /* how the conditions that are measured begin, NULL at the end; none = all */
    bool others;             /* those that begin otherwise are, instead */
    const char *method;   /* whose rows alone are measured; may be NULL */
    const char *pictures; /* a folder for a picture of each row; may be NULL */
    bool update;
};

/* Every method's row of one view; `whole_only` where the small form leaves it out. The second frame, for flicker, is
 * from an eye that moved sideways by 1.5 pixels of what is in the middle. Also holds every frame to what its layers
 * are. */
void conditions_measure(struct conditions *c, const struct world *world, const struct spl_view *view,
                        const char *condition, const char *value, bool whole_only);

/* The same, drawn by splats with their mean colours and with their textures: rows "coloured" and "textured". */
void conditions_measure_textures(struct conditions *c, const struct world *world, const struct spl_view *view,
                                 const char *condition, const char *value, bool whole_only);

/* The same, with the splats' own colours and with maps: rows "unmapped" and "mapped". Maps that lose more than `harm`
 * dB fail "maps-do-no-harm". */
void conditions_measure_maps(struct conditions *c, const struct world *world, const struct spl_view *view,
                             const char *condition, const char *value, bool whole_only, double harm);

/* How much worse a view may be with primitives than without. */
struct worse {
    double db;                 /* of PSNR */
    double holes, halo, beyond; /* shares, as of FIGURE_HOLES, FIGURE_HALO, FIGURE_DEPTH_BEYOND */
};

/* The same scan as splats and with primitives (world_init_both()): rows "discs" and "primitives". What is worse by more
 * than that fails one of four checks. */
void conditions_measure_primitives(struct conditions *c, const struct world worlds[2], const struct spl_view *view,
                                   const char *condition, const char *value, bool whole_only,
                                   const struct worse *allowed);

/* Is this condition to be measured? And is any of those that begin so? */
bool conditions_wants(const struct conditions *c, const char *condition);
bool conditions_wants_any(const struct conditions *c, const char *beginning);

void conditions_of_scans(struct conditions *c);  /* density, noise, poses, echoes; thin, stepped, leafy, fine things */
void conditions_of_views(struct conditions *c);  /* where the eye is, what it takes in, how large the image is */
void conditions_of_shapes(struct conditions *c); /* degenerate neighbourhoods */
void conditions_of_photographs(struct conditions *c); /* textures: what photographs show, and how they may be spoilt */
void conditions_of_maps(struct conditions *c);        /* maps of stations: what they show, and how they may be wrong */
void conditions_of_primitives(struct conditions *c);  /* planes and lines, and what is neither */

#endif
