/* What soft transparency adds to a frame's time, learned by what is soft: its terms, its model, the layer, the solid
 * method (behind whose holes more spheres are seen), and whether anything of it is drawn at all.
 *
 * Nothing of a profile says how many spheres a view's terms make and how they overlap, so a soft view is estimated as
 *     ms = solid · exp(rest) + exp(cost + by_samples · ln samples - by_lod · ln lod)
 * where `solid` is the estimate of the same view with nothing soft, and the other four are learned from frames: how
 * much of the solid work is left, what the stage takes, and how that follows size and level. Before the first frame of
 * its terms and method a view is taken to cost what its terms did with another method, or else the last other terms of
 * its model, or of another model as much more as that takes. Before any it is a guess that is rather too much than too
 * little, so that no first frame takes twenty times what it was promised: by model, from how many spheres there may be,
 * times what this device takes of what the table of guesses was made on. Pure; owned by the planner's thread. */
#ifndef SPL_MEASURE_PLANNER_SOFT_H
#define SPL_MEASURE_PLANNER_SOFT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <splatd/render.h>
#include <splatd/soft.h>

enum { SPL_SOFT_COSTS_MAX = 32 };

struct spl_soft_cost {
    uint64_t key;  /* of what is soft; 0 = free */
    enum spl_method method;
    uint64_t used; /* when last, in frames; who was not for longest gives way */
    enum spl_soft_model model;
    enum spl_layer layer;
    bool drawn;
    uint32_t frames;             /* learned from */
    double rest;                 /* ln */
    double cost;                 /* ln ms where size and level are `at` */
    double by_samples, by_lod;   /* ln ms by each of the two, see above */
    double at[2];                /* means of ln megasamples and ln lod */
    double spread;               /* ln; the 97 % quantile of what remains, as the planner's */
};

struct spl_soft_costs {
    struct spl_soft_cost rows[SPL_SOFT_COSTS_MAX];
    uint64_t frames;
};

/* A frame's size as the stage sees it: `megasamples` > 0 of all its pixels, lod >= 0. For guesses: how many spheres it
 * may have, and the device's times as multiples of those of the table (> 0). */
struct spl_soft_work {
    double megasamples, lod;
    enum spl_layer layer;
    enum spl_method method;
    double spheres, slowness;
};

/* How many spheres a view may have of a dataset of `splats` (0 = unknown), of which terms take `share` (NAN =
 * unknown). */
double spl_soft_guess_spheres(double splats, double share, double megasamples, double lod);

/* The expected time of a soft frame whose solid estimate is solid_ms, of which nothing has to be known. *spread, if not
 * NULL, is raised to that of such frames. */
double spl_soft_costs_estimate(const struct spl_soft_costs *costs, const struct spl_soft_params *soft,
                               struct spl_soft_work work, double solid_ms, double *spread);

/* A soft frame took ms, of which soft_ms were its soft stage. Numbers that are not finite, ms of 0 and less are
 * ignored. */
void spl_soft_costs_learn(struct spl_soft_costs *costs, const struct spl_soft_params *soft, struct spl_soft_work work,
                          double solid_ms, double ms, double soft_ms);

/* Solid estimates have become exp(by) times what they were, because the machine's speed was not known before: what was
 * learned of soft views stays. */
void spl_soft_costs_shift(struct spl_soft_costs *costs, double by);

#endif
