/* Costs of what is soft; see planner_soft.h for the model.
 *
 * Each frame moves the stage's three terms by a share of its residual, along the gradient and by its length (normalised
 * least mean squares), with size and level measured from their means, so that a viewer who stays at one size and level
 * teaches the cost alone. First frames take large shares; later a residual is clipped to a few spreads. Invariant: all
 * terms are finite and within the bounds below. */
#include "measure/planner_soft.h"

#include <math.h>
#include <string.h>

static const double first_gain = 0.5, gain = 0.15, mean_gain = 0.1;
static const double least_ms = 1e-3, ln_most = 20, rest_most = 6.9;
static const double spread_quantile = 0.97, spread_step = 0.08, spread_least = 0.02, spread_most = 1.5;
static const double first_spread = 0.35, samples_first = 0.8, samples_most = 1.5, lod_first = 1, lod_most = 2.5;
enum { first_frames = 6 };

/* What the stage takes where nothing is known, in milliseconds of the machine that the methods' guesses are of: the
 * upper end of what scans took (tests/bench/RESULTS.md, "What a first guess promises"). */
static const struct guess {
    double fixed, a_megasample, a_million_spheres;
} guesses[SPL_SOFT_MODEL_COUNT] = {[SPL_SOFT_MODEL_EXPRESS] = {5, 60, 400},
                                   [SPL_SOFT_MODEL_CONCENTRIC] = {10, 1000, 6000},
                                   [SPL_SOFT_MODEL_BASE] = {10, 1000, 6000},
                                   [SPL_SOFT_MODEL_LAYER] = {5, 60, 400}};
static const double guessed_spread = 0.7, unknown_share = 0.5, deep = 5; /* spheres a sample, where splats are one */

static double clamp(double x, double least, double most)
{
    return fmin(fmax(x, least), most);
}

static bool is_drawn(const struct spl_soft_params *soft)
{
    return soft->opacity > 0;
}

/* FNV-1a; never 0. Opacity and border change what a frame shows, and hardly what it takes. */
static uint64_t key_of(const struct spl_soft_params *soft, enum spl_layer layer)
{
    char text[SPL_TERMS_TEXT_MAX + 1];
    uint64_t key = 14695981039346656037u ^
                   ((uint64_t)layer << 8 | (uint64_t)soft->of << 4 | (uint64_t)soft->model << 1 | is_drawn(soft));
    spl_soft_print(soft, text, sizeof text);
    for (const char *c = text; *c; c++)
        key = (key ^ (uint8_t)*c) * 1099511628211u;
    return key ? key : 1;
}

/* Of the same terms and method, else of the same terms, else the last of the same model and layer; NULL if there is
 * none. */
static const struct spl_soft_cost *find(const struct spl_soft_costs *costs, const struct spl_soft_params *soft,
                                        struct spl_soft_work work)
{
    const uint64_t key = key_of(soft, work.layer);
    const struct spl_soft_cost *like = NULL, *same = NULL;
    for (const struct spl_soft_cost *row = costs->rows; row < costs->rows + SPL_SOFT_COSTS_MAX; row++) {
        if (row->key == key && row->method == work.method)
            return row;
        if (row->key == key && (!same || row->used > same->used))
            same = row;
        bool alike = row->key && row->model == soft->model && row->layer == work.layer && row->drawn == is_drawn(soft);
        if (alike && (!like || row->used > like->used))
            like = row;
    }
    return same ? same : like;
}

static double stage_ln(const struct spl_soft_cost *row, const double x[2])
{
    return clamp(row->cost + row->by_samples * (x[0] - row->at[0]) - row->by_lod * (x[1] - row->at[1]), -ln_most,
                 ln_most);
}

static void measure(struct spl_soft_work work, double x[2])
{
    x[0] = log(fmax(work.megasamples, 1e-6));
    x[1] = log(fmax(work.lod, 0.25));
}

double spl_soft_guess_spheres(double splats, double share, double megasamples, double lod)
{
    const double fine = fmax(lod, 0.25), shown = deep * 1e6 * megasamples / (fine * fine);
    const double all = !(splats > 0) ? shown : lod > 0 ? fmin(splats, shown) : splats;
    return (isnan(share) ? unknown_share : clamp(share, 0, 1)) * all;
}

static double guess_ms(enum spl_soft_model model, struct spl_soft_work work)
{
    const struct guess *guess = &guesses[model];
    return work.slowness * (guess->fixed + guess->a_megasample * work.megasamples * (work.spheres > 0) +
                            1e-6 * guess->a_million_spheres * work.spheres);
}

/* The last of another model that was drawn, of the same layer: it says how fast this device is; NULL = none. */
static const struct spl_soft_cost *find_other(const struct spl_soft_costs *costs, enum spl_layer layer)
{
    const struct spl_soft_cost *found = NULL;
    for (const struct spl_soft_cost *row = costs->rows; row < costs->rows + SPL_SOFT_COSTS_MAX; row++)
        if (row->key && row->drawn && row->layer == layer && (!found || row->used > found->used))
            found = row;
    return found;
}

double spl_soft_costs_estimate(const struct spl_soft_costs *costs, const struct spl_soft_params *soft,
                               struct spl_soft_work work, double solid_ms, double *spread)
{
    const struct spl_soft_cost *row = find(costs, soft, work);
    double x[2];
    measure(work, x);
    if (spread)
        *spread = fmax(*spread, row ? row->spread : guessed_spread);
    if (!row && !is_drawn(soft))
        return solid_ms;
    if (!row) {
        const struct spl_soft_cost *other = find_other(costs, work.layer);
        const double guess = guess_ms(soft->model, work);
        return solid_ms + (other ? exp(stage_ln(other, x)) * guess / guess_ms(other->model, work) : guess);
    }
    return solid_ms * exp(row->rest) + (row->drawn ? exp(stage_ln(row, x)) : 0);
}

/* A row of its own: as others of the model were, or as this first frame is. */
static struct spl_soft_cost *take_row(struct spl_soft_costs *costs, const struct spl_soft_params *soft,
                                      struct spl_soft_work work, const double x[2], double rest, double stage)
{
    const uint64_t key = key_of(soft, work.layer);
    const struct spl_soft_cost *like = find(costs, soft, work);
    struct spl_soft_cost *row = costs->rows, fresh = {.rest = rest,
                                                      .cost = stage,
                                                      .by_samples = samples_first,
                                                      .by_lod = lod_first,
                                                      .at = {x[0], x[1]},
                                                      .spread = first_spread};
    if (like && like->key == key && like->method == work.method)
        return &costs->rows[like - costs->rows];
    if (like) {
        fresh.by_samples = like->by_samples;
        fresh.by_lod = like->by_lod;
    }
    for (struct spl_soft_cost *r = costs->rows; r < costs->rows + SPL_SOFT_COSTS_MAX; r++)
        if (row->key && (!r->key || r->used < row->used))
            row = r;
    *row = fresh;
    row->key = key;
    row->model = soft->model;
    row->layer = work.layer;
    row->method = work.method;
    row->drawn = is_drawn(soft);
    return row;
}

static void learn_stage(struct spl_soft_cost *row, const double x[2], double residual)
{
    const double dx[2] = {x[0] - row->at[0], x[1] - row->at[1]};
    const double step = residual / (1 + dx[0] * dx[0] + dx[1] * dx[1]);
    row->cost = clamp(row->cost + step, -ln_most, ln_most);
    row->by_samples = clamp(row->by_samples + step * dx[0], 0, samples_most);
    row->by_lod = clamp(row->by_lod - step * dx[1], 0, lod_most);
    for (int i = 0; i < 2; i++) { /* another middle of the same line */
        row->at[i] += mean_gain * dx[i];
        row->cost += mean_gain * dx[i] * (i ? -row->by_lod : row->by_samples);
    }
}

void spl_soft_costs_learn(struct spl_soft_costs *costs, const struct spl_soft_params *soft, struct spl_soft_work work,
                          double solid_ms, double ms, double soft_ms)
{
    if (!(ms > 0) || !isfinite(ms) || !(soft_ms >= 0) || !(solid_ms > 0) || !isfinite(solid_ms))
        return;
    double x[2];
    measure(work, x);
    const double stage = log(fmax(fmin(soft_ms, ms), least_ms));
    const double rest = clamp(log(fmax(ms - soft_ms, 0.01 * ms) / solid_ms), -rest_most, rest_most);
    struct spl_soft_cost *row = take_row(costs, soft, work, x, rest, stage);
    const bool first = row->frames < first_frames;
    const double left = log(ms / (solid_ms * exp(row->rest) + (row->drawn ? exp(stage_ln(row, x)) : 0)));
    const double share = first ? first_gain : gain, bound = first ? ln_most : 2 * row->spread + 0.1;
    if (row->frames)
        row->spread = clamp(row->spread + spread_step * (left > row->spread ? spread_quantile : spread_quantile - 1),
                            spread_least, spread_most);
    row->rest = clamp(row->rest + share * clamp(rest - row->rest, -bound, bound), -rest_most, rest_most);
    learn_stage(row, x, share * clamp(stage - stage_ln(row, x), -bound, bound));
    row->frames += row->frames < UINT32_MAX;
    row->used = ++costs->frames;
}

void spl_soft_costs_shift(struct spl_soft_costs *costs, double by)
{
    for (struct spl_soft_cost *row = costs->rows; row < costs->rows + SPL_SOFT_COSTS_MAX; row++)
        if (row->key)
            row->rest = clamp(row->rest - by, -rest_most, rest_most);
}
