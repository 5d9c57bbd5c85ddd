/* Chooses a setting for a demand on time or accuracy, from what a profile promises and what frames then took.
 *
 * A setting's time is estimated as
 *     ms = (fixed_ms + ms_per_mpx · megapixels) · exp(shared + setting + layer)
 * where the three terms are learned from measured frames: how this machine is now, how this setting differs from its
 * model, how a layer other than colour does. `spread` follows the 97 % quantile of what remains, ln(measured /
 * estimate), so that the tail, not the mean, is held against the budget. A view with something soft takes that, less
 * what is no longer solid, and its soft stage (planner_soft.h). No clock, no I/O; a planner belongs to one thread. */
#ifndef SPL_MEASURE_PLANNER_H
#define SPL_MEASURE_PLANNER_H

#include "measure/planner_soft.h"
#include "measure/profile.h"

/* Of a budget: frames may take up to this multiple, and one in fifty longer. */
#define SPL_BUDGET_TOLERANCE 1.1

struct spl_demand {
    double budget_ms; /* > 0; NAN: any time */
    double psnr;      /* dB; NAN: any accuracy */
    double extra_ms;  /* >= 0: what the budget must hold beside the frame, the encoding */
    uint32_t width, height;
    uint64_t samples_max; /* that a setting may need for it; 0 = any */
    enum spl_layer layer;
    const struct spl_soft_params *soft; /* may be NULL: as without terms, nothing; it is kept as it is */
    double soft_splats, soft_share; /* for a first guess: of the dataset, 0 = unknown; how many of them are soft, 0 to
                                       1, NAN = unknown */
    bool keep_method, keep_lod, keep_supersample, keep_atoms, keep_maps; /* only settings that equal `kept` in these */
    struct spl_setting kept;
};

struct spl_choice {
    struct spl_setting setting;
    size_t index; /* of the planner's setting; for learn() */
    double ms;    /* expected time of the frame, without extra_ms */
    double psnr;  /* dB that 19 of 20 views reach, see spl_profile_psnr_bound(); NAN without a profile */
    bool meets;   /* whether the demand can be met; else this is the best there is: of an accuracy out of reach the one
                     that promises most, in the least time */
};

struct spl_planner {
    struct spl_candidate {
        struct spl_setting setting;
        double fixed_ms, ms_per_mpx;
        double psnr, bound; /* mean and lower bound, dB; the mean without a profile is a rank, the bound NAN */
        double learned;     /* ln of this setting's own factor */
    } * candidates;
    size_t count;
    bool atoms, maps; /* candidates name them; else any number of atoms, or maps on and off, is a candidate's setting */
    double shared, layer[SPL_LAYER_COUNT], spread; /* ln */
    double device; /* ln of how its profile's times are to those of the methods' guesses; 0 without one */
    uint64_t frames;                               /* learned from */
    struct spl_soft_costs soft;
};

/* The PSNR that a further view reaches with 95 % probability: the one-sided prediction bound mean − t · sd · √(1 + 1/n)
 * of n views whose PSNR is normally distributed. The 5 % quantile where the deviation is unknown; NAN where PSNR is. */
double spl_profile_psnr_bound(const struct spl_profile *profile, const struct spl_profile_point *point);

/* Takes what it needs from `profile`. NULL: a conservative table of common settings whose times are those of a slow
 * machine; nothing is promised of their accuracy. Settings that `usable` (may be NULL) refuses are left out; when none
 * is left the table is used. Points with something soft are no settings to choose: they say what that costs. */
int spl_planner_init(struct spl_planner *planner, const struct spl_profile *profile,
                     bool (*usable)(const struct spl_setting *setting), struct spl_error *err);
void spl_planner_finish(struct spl_planner *planner);

/* Of a dataset without a surface: settings of a method that needs one become those of what is drawn instead, where that
 * has none of its own, so that what is chosen is what is drawn, and learned of. */
void spl_planner_draw_bare(struct spl_planner *planner);

/* budget alone: the most accurate setting whose 98 % quantile stays below 1.1 times the budget and whose expected time
 * stays within it. psnr alone: the cheapest setting whose bound reaches it. Both: the cheapest that does both; if there
 * is none, the most accurate within the budget. What no setting meets gets the fastest (budget) or the most
 * accurate (psnr), and `meets` is false. All settings of the profile are candidates, those behind its front too:
 * what is learned may bring them to the front; one that needs more samples than samples_max is none. SPL_E_INPUT names
 * the kept parameter that no setting has. Atoms that nobody measured are kept: they are drawn in place of the next
 * more, or the most, that were measured, whose time they are taken to need, and nothing is promised of their accuracy;
 * methods without textures have any number of them. The same of maps. */
int spl_planner_choose(const struct spl_planner *planner, const struct spl_demand *demand, struct spl_choice *choice,
                       struct spl_error *err);

/* The estimate for one setting, as choose() makes it where nothing is soft. */
double spl_planner_estimate(const struct spl_planner *planner, size_t index, uint32_t width, uint32_t height,
                            enum spl_layer layer);

/* The index of `setting`, or -1: frames that nobody planned teach as well. */
ptrdiff_t spl_planner_find(const struct spl_planner *planner, const struct spl_setting *setting);

/* A frame of setting `index` took `ms`. Single outliers move little, a lasting change of speed is followed within about
 * ten frames; learned factors stay within 1/1000 … 1000. Numbers that are not finite and positive are ignored. */
void spl_planner_learn(struct spl_planner *planner, size_t index, uint32_t width, uint32_t height, enum spl_layer layer,
                       double ms);

/* The same of a frame in which something was soft, of whose time soft_ms were the soft stage's: it teaches what is
 * soft, not the setting. */
void spl_planner_learn_soft(struct spl_planner *planner, size_t index, uint32_t width, uint32_t height,
                            enum spl_layer layer, const struct spl_soft_params *soft, double ms, double soft_ms);

#endif
