/* The planner: estimate, choice, learning; see planner.h for the model.
 *
 * Learning is a stochastic gradient on the residual r = ln(measured / estimate): each term takes a share of r. The
 * first frames take large shares, because a profile may come from a machine of another speed; later r is clipped to a
 * few spreads before it is used, so that one stalled frame cannot move what hundreds have taught. A setting's own term
 * fades as other settings are drawn, or one that was slow once would never be tried again. The spread takes a large
 * step up when a frame exceeds it and a small one down when it does not (Robbins and Monro), which settles where 3 %
 * exceed it, whatever the distribution. Pure but for allocation. */
#include "measure/planner.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "render/method.h"
#include "shared.h"

static const double spread_quantile = 0.98, spread_step = 0.08;
static const double spread_least = 0.02, spread_most = 1.5;
static const double shared_gain = 0.1, setting_gain = 0.1, layer_gain = 0.1, fade = 0.99;
static const double learned_most = 6.9; /* ln 1000 */
enum { first_frames = 6 };
static const double first_gain = 0.5;

/* Without a profile, what the methods' rows say. */
static size_t add_guesses(struct spl_candidate *candidates, bool (*usable)(const struct spl_setting *setting))
{
    size_t count = 0;
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        const struct spl_method_guess *guess = spl_method_row((enum spl_method)method)->guesses;
        for (int i = 0; i < SPL_METHOD_GUESSES_MAX && guess[i].lod > 0; i++) {
            struct spl_setting setting = {(enum spl_method)method, guess[i].lod, guess[i].supersample,
                                          SPL_TEXTURE_ATOMS, SPL_SETTING_NO_MAPS};
            if (!usable || usable(&setting))
                candidates[count++] = (struct spl_candidate){.setting = setting,
                                                             .fixed_ms = guess[i].fixed_ms,
                                                             .ms_per_mpx = guess[i].ms_per_mpx,
                                                             .psnr = guess[i].psnr,
                                                             .bound = NAN};
        }
    }
    return count;
}

/* How slow the profile's machine is to the one of the guesses: the mean over the settings that both have. */
static double compare_devices(const struct spl_planner *planner)
{
    double sum = 0, count = 0;
    for (size_t i = 0; i < planner->count; i++) {
        const struct spl_candidate *c = &planner->candidates[i];
        const struct spl_method_guess *guess = spl_method_row(c->setting.method)->guesses;
        for (int k = 0; k < SPL_METHOD_GUESSES_MAX && guess[k].lod > 0; k++)
            if (guess[k].lod == c->setting.lod && guess[k].supersample == c->setting.supersample &&
                c->fixed_ms + c->ms_per_mpx > 0) {
                sum += log((c->fixed_ms + c->ms_per_mpx) / (guess[k].fixed_ms + guess[k].ms_per_mpx));
                count++;
            }
    }
    return count ? sum / count : 0;
}

/* One-sided 95 % point of Student's t, by Cornish and Fisher's expansion, which is within 1 % from 4 degrees of freedom
 * on, and up to 27 % too little below. */
static double student(double freedom)
{
    static const double exact[] = {0, 6.314, 2.920, 2.353};
    if (freedom < sizeof exact / sizeof *exact)
        return exact[(int)freedom];
    return 1.6449 + 1.5238 / freedom + 1.4203 / (freedom * freedom);
}

double spl_profile_psnr_bound(const struct spl_profile *profile, const struct spl_profile_point *point)
{
    double n = profile->views;
    if (n < 2 || isnan(point->psnr_sd))
        return isnan(point->psnr_q05) ? point->psnr : point->psnr_q05;
    return point->psnr - student(n - 1) * point->psnr_sd * sqrt(1 + 1 / n);
}

/* What was measured of soft settings: beside the same ones with nothing soft. */
static void add_soft(struct spl_planner *planner, const struct spl_profile *profile)
{
    for (size_t i = 0; profile && i < profile->count; i++) {
        const struct spl_profile_point *p = &profile->points[i];
        struct spl_soft_params soft = profile->soft;
        struct spl_setting solid = p->setting;
        ptrdiff_t index;
        if (!p->setting.soft || isnan(p->soft_ms))
            continue;
        solid.soft = 0;
        soft.model = (enum spl_soft_model)(p->setting.soft - 1);
        if ((index = spl_planner_find(planner, &solid)) >= 0)
            spl_planner_learn_soft(planner, (size_t)index, profile->width, profile->height, SPL_LAYER_COLOR, &soft,
                                   p->ms, p->soft_ms);
    }
}

int spl_planner_init(struct spl_planner *planner, const struct spl_profile *profile,
                     bool (*usable)(const struct spl_setting *setting), struct spl_error *err)
{
    size_t guesses = SPL_METHOD_COUNT * SPL_METHOD_GUESSES_MAX;
    size_t capacity = profile && profile->count > guesses ? profile->count : guesses;
    double tail = 0;
    *planner = (struct spl_planner){0};
    if (!(planner->candidates = spl_alloc(capacity, sizeof *planner->candidates, err)))
        return SPL_E_NOMEM;
    for (size_t i = 0; profile && i < profile->count; i++) {
        const struct spl_profile_point *p = &profile->points[i];
        if (p->setting.soft || (usable && !usable(&p->setting)))
            continue;
        planner->candidates[planner->count++] = (struct spl_candidate){.setting = p->setting,
                                                                       .fixed_ms = p->fixed_ms,
                                                                       .ms_per_mpx = p->ms_per_mpx,
                                                                       .psnr = p->psnr,
                                                                       .bound = spl_profile_psnr_bound(profile, p)};
        tail += log(p->ms_q90 / p->ms);
    }
    /* From the 90 % quantile of a normal distribution to its 98 %: 2.05 / 1.28. */
    planner->spread = planner->count ? fmin(fmax(1.6 * tail / (double)planner->count, 0.1), spread_most) : 0.5;
    planner->device = compare_devices(planner);
    if (!planner->count)
        planner->count = add_guesses(planner->candidates, usable);
    add_soft(planner, profile);
    for (size_t i = 0; i < planner->count; i++) {
        planner->atoms |= planner->candidates[i].setting.atoms != SPL_TEXTURE_ATOMS;
        planner->maps |= planner->candidates[i].setting.maps != SPL_SETTING_NO_MAPS;
    }
    return 0;
}

void spl_planner_finish(struct spl_planner *planner)
{
    free(planner->candidates);
    *planner = (struct spl_planner){0};
}

void spl_planner_draw_bare(struct spl_planner *planner)
{
    size_t count = 0;
    for (int own = 1; own >= 0; own--) // those that are drawn as they are first
        for (size_t i = own ? 0 : count; i < planner->count; i++) {
            struct spl_candidate candidate = planner->candidates[i];
            const struct spl_method_info *method = spl_method_get(candidate.setting.method);
            bool known = false;
            if (own == method->needs_surface)
                continue;
            candidate.setting.method = own ? candidate.setting.method : method->stand_in;
            for (size_t k = 0; k < count && !own; k++)
                known |= spl_setting_equal(&planner->candidates[k].setting, &candidate.setting);
            if (known)
                continue;
            planner->candidates[i] = planner->candidates[count];
            planner->candidates[count++] = candidate;
        }
    planner->count = count;
}

double spl_planner_estimate(const struct spl_planner *planner, size_t index, uint32_t width, uint32_t height,
                            enum spl_layer layer)
{
    const struct spl_candidate *c = &planner->candidates[index];
    double mpx = 1e-6 * width * height;
    return (c->fixed_ms + c->ms_per_mpx * mpx) * exp(planner->shared + c->learned + planner->layer[layer]);
}

/* What is compared where candidates do not differ in atoms or maps: whatever is asked for is drawn in the candidate's
 * time. */
static struct spl_setting get_setting(const struct spl_planner *planner, const struct spl_setting *setting)
{
    struct spl_setting out = *setting;
    if (!planner->atoms)
        out.atoms = SPL_TEXTURE_ATOMS;
    if (!planner->maps)
        out.maps = SPL_SETTING_NO_MAPS;
    return out;
}

static bool matches(const struct spl_setting *setting, const struct spl_demand *demand)
{
    struct spl_setting kept = demand->kept;
    kept.method = demand->keep_method ? kept.method : setting->method;
    kept.lod = demand->keep_lod ? kept.lod : setting->lod;
    kept.supersample = demand->keep_supersample ? kept.supersample : setting->supersample;
    kept.atoms = demand->keep_atoms ? kept.atoms : setting->atoms;
    kept.maps = demand->keep_maps ? kept.maps : setting->maps;
    return spl_setting_equal(setting, &kept);
}

/* Is it within what one view may cost? Below one sample a pixel the pixels are, which the view's size has settled. */
static bool is_affordable(const struct spl_setting *setting, const struct spl_demand *demand)
{
    double side = setting->supersample > 1 ? setting->supersample : 1;
    return !demand->samples_max || side * side * demand->width * demand->height <= (double)demand->samples_max;
}

/* Was anything measured with maps, or without, as they are kept? */
static bool has_measured_maps(const struct spl_planner *planner, const struct spl_demand *demand)
{
    struct spl_demand any = *demand;
    any.keep_atoms = false;
    for (size_t i = 0; i < planner->count; i++) {
        const struct spl_setting *s = &planner->candidates[i].setting;
        if (spl_setting_has_maps(s->method) && matches(s, &any))
            return true;
    }
    return false;
}

/* The demand with maps and atoms that were measured: with maps or without, if only one of them was; of atoms the next
 * more than those kept, else the most; so its time is no promise too much. The same where no method with textures
 * matches. */
static struct spl_demand get_measured(const struct spl_planner *planner, const struct spl_demand *demand)
{
    struct spl_demand out = *demand, any;
    bool found = false;
    out.keep_maps = demand->keep_maps && has_measured_maps(planner, demand);
    any = out;
    any.keep_atoms = false;
    for (size_t i = 0; demand->keep_atoms && i < planner->count; i++) {
        const struct spl_setting *s = &planner->candidates[i].setting;
        if (!spl_method_has_textures(s->method) || s->maps == SPL_SETTING_MAPS_ON || !matches(s, &any))
            continue;
        bool enough = s->atoms >= demand->kept.atoms, had = found && out.kept.atoms >= demand->kept.atoms;
        if (!found || (enough && (!had || s->atoms < out.kept.atoms)) || (!enough && !had && s->atoms > out.kept.atoms))
            out.kept.atoms = s->atoms;
        found = true;
    }
    return out;
}

/* Is the accuracy that was measured that of other atoms or maps than are asked for? */
static bool is_unmeasured(const struct spl_setting *setting, const struct spl_demand *demand)
{
    struct spl_setting kept = *setting;
    kept.atoms = demand->keep_atoms ? demand->kept.atoms : setting->atoms;
    kept.maps = demand->keep_maps ? demand->kept.maps : setting->maps;
    return !spl_setting_equal(setting, &kept);
}

static double rank(double psnr)
{
    return isnan(psnr) ? -INFINITY : psnr;
}

static struct spl_soft_work work_of(const struct spl_setting *setting, uint32_t width, uint32_t height,
                                    enum spl_layer layer)
{
    double samples = setting->supersample * setting->supersample * width * height;
    return (struct spl_soft_work){1e-6 * samples, setting->lod, layer, setting->method, 0, 1};
}

/* How one candidate stands to the demand; `bound` as of the candidate, NAN where its own is that of something else. */
struct standing {
    double ms, tail_ms, bound;
    bool in_time, accurate;
};

static struct standing assess(const struct spl_planner *planner, size_t index, const struct spl_demand *demand)
{
    const struct spl_candidate *c = &planner->candidates[index];
    struct standing s = {.in_time = true, .bound = is_unmeasured(&c->setting, demand) ? NAN : c->bound};
    s.accurate = isnan(demand->psnr) || rank(s.bound) >= demand->psnr;
    double spread = planner->spread;
    s.ms = spl_planner_estimate(planner, index, demand->width, demand->height, demand->layer);
    if (demand->soft && demand->soft->what.count) {
        struct spl_soft_work work = work_of(&c->setting, demand->width, demand->height, demand->layer);
        work.spheres = spl_soft_guess_spheres(demand->soft_splats, demand->soft_splats > 0 ? demand->soft_share : NAN,
                                              work.megasamples, work.lod);
        work.slowness = exp(planner->device + planner->shared);
        s.ms = spl_soft_costs_estimate(&planner->soft, demand->soft, work, s.ms, &spread);
    }
    s.tail_ms = s.ms * exp(spread);
    if (!isnan(demand->budget_ms))
        s.in_time = s.ms + demand->extra_ms <= demand->budget_ms &&
                    s.tail_ms + demand->extra_ms <= SPL_BUDGET_TOLERANCE * demand->budget_ms;
    return s;
}

/* Is candidate a (standing x) to be preferred to b (standing y)? */
static bool better(const struct spl_demand *demand, const struct spl_candidate *a, const struct standing *x,
                   const struct spl_candidate *b, const struct standing *y)
{
    bool timed = !isnan(demand->budget_ms);
    if (timed && x->in_time != y->in_time)
        return x->in_time;
    if (timed && !x->in_time) // neither: the fastest
        return x->ms < y->ms;
    if (x->accurate != y->accurate)
        return x->accurate;
    if (!isnan(demand->psnr) && x->accurate) // both: the cheaper
        return x->ms < y->ms;
    double gain = isnan(demand->psnr) ? NAN : rank(x->bound) - rank(y->bound); // out of reach: as near as is promised
    if (isnan(gain)) // nobody asks for a promise, or neither makes one: what they do; NAN again: both unknown
        gain = rank(a->psnr) - rank(b->psnr);
    return isnan(gain) || gain == 0 ? x->ms < y->ms : gain > 0;
}

static int refuse(const struct spl_demand *demand, struct spl_error *err)
{
    const char *field = demand->keep_lod ? "lod" : demand->keep_supersample ? "supersample" : "method";
    return spl_fail_field(err, SPL_E_INPUT, field,
                          "no measured setting has the %s asked for; leave it out, or ask without budget and psnr",
                          field);
}

int spl_planner_choose(const struct spl_planner *planner, const struct spl_demand *demand, struct spl_choice *choice,
                       struct spl_error *err)
{
    struct standing best = {0};
    const struct spl_candidate *chosen = NULL;
    bool matched = false;
    struct spl_demand measured = get_measured(planner, demand);
    for (size_t i = 0; i < planner->count; i++) {
        const struct spl_candidate *c = &planner->candidates[i];
        if (!matches(&c->setting, &measured))
            continue;
        matched = true;
        if (!is_affordable(&c->setting, demand))
            continue;
        struct standing s = assess(planner, i, demand);
        if (chosen && !better(demand, c, &s, chosen, &best))
            continue;
        chosen = c;
        best = s;
    }
    if (!chosen && matched)
        return spl_fail_field(err, SPL_E_INPUT, "width",
                              "every measured setting takes more than %llu samples for %u x %u pixels; ask for fewer",
                              (unsigned long long)demand->samples_max, demand->width, demand->height);
    if (!chosen)
        return refuse(demand, err);
    *choice = (struct spl_choice){.setting = chosen->setting,
                                  .index = (size_t)(chosen - planner->candidates),
                                  .ms = best.ms,
                                  .psnr = is_unmeasured(&chosen->setting, demand) ? NAN : chosen->bound,
                                  .meets = best.in_time && best.accurate};
    if (demand->keep_atoms)
        choice->setting.atoms = demand->kept.atoms;
    if (demand->keep_maps)
        choice->setting.maps = demand->kept.maps;
    return 0;
}

ptrdiff_t spl_planner_find(const struct spl_planner *planner, const struct spl_setting *setting)
{
    struct spl_setting wanted = get_setting(planner, setting);
    for (size_t i = 0; i < planner->count; i++)
        if (spl_setting_equal(&planner->candidates[i].setting, &wanted))
            return (ptrdiff_t)i;
    return -1;
}

static double clamp(double x, double most)
{
    return fmin(fmax(x, -most), most);
}

void spl_planner_learn(struct spl_planner *planner, size_t index, uint32_t width, uint32_t height, enum spl_layer layer,
                       double ms)
{
    spl_assert(index < planner->count);
    if (!(ms > 0) || !isfinite(ms))
        return;
    double residual = log(ms / spl_planner_estimate(planner, index, width, height, layer));
    bool first = planner->frames++ < first_frames;
    if (!first) {
        planner->spread += spread_step * (residual > planner->spread ? spread_quantile : spread_quantile - 1);
        planner->spread = fmin(fmax(planner->spread, spread_least), spread_most);
        residual = clamp(residual, 2 * planner->spread + 0.1);
    }
    for (size_t i = 0; i < planner->count; i++)
        planner->candidates[i].learned *= fade;
    struct spl_candidate *c = &planner->candidates[index];
    double before = planner->shared;
    planner->shared = clamp(before + (first ? first_gain : shared_gain) * residual, learned_most);
    if (first)
        spl_soft_costs_shift(&planner->soft, planner->shared - before);
    c->learned = clamp(c->learned + setting_gain * residual, learned_most);
    if (layer != SPL_LAYER_COLOR)
        planner->layer[layer] = clamp(planner->layer[layer] + layer_gain * residual, learned_most);
}

void spl_planner_learn_soft(struct spl_planner *planner, size_t index, uint32_t width, uint32_t height,
                            enum spl_layer layer, const struct spl_soft_params *soft, double ms, double soft_ms)
{
    spl_assert(index < planner->count);
    spl_soft_costs_learn(&planner->soft, soft, work_of(&planner->candidates[index].setting, width, height, layer),
                         spl_planner_estimate(planner, index, width, height, layer), ms, soft_ms);
}
