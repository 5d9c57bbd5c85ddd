/* Regions of patches on one plane, the largest patch first: from it on the region takes what lies beside it as long as
 * it is on the plane, which is fitted anew whenever its points have become half as many more. So small patches, whose
 * own planes are uncertain, are judged by how far their points are off a good plane. A patch is on it when neither its
 * middle nor its far ends, as its tilt against the plane has them, are off by more than what is no noise may be; both
 * have been seen from the same side.
 *
 * A plane that turned while it grew may leave patches behind: those that are off the last fit are let go, and begin
 * regions of their own, or join others. */
#include "pack/planes/regions.h"

#include <math.h>

enum { rounds = 3 };
static const double facing = 0.8;        /* cosine of the two normals; small patches may be off by some degrees */
static const double far_end = 1.7320508; /* sigmas to the end of an even spread */
static const double refit = 1.5;         /* growth after which the plane is fitted anew */
static const double let_go = 1.25;       /* times the limit, is what a patch may be off the last fit */

struct state {
    const struct spl_plane_limits_list *limits;
    double fitted; /* points that the region had when it was fitted last */
};

static bool lies_on(const struct state *s, const struct spl_region *r, const struct spl_patch *q, double factor)
{
    double off = 0, cosine = 0;
    for (int c = 0; c < 3; c++) {
        off += r->normal[c] * (q->moments.mean[c] - r->moments.mean[c]);
        cosine += r->normal[c] * q->normal[c];
    }
    double limit = factor * (spl_plane_limits_at(s->limits, q->first)->step + 2 * q->rms / sqrt(q->moments.count));
    if (cosine < facing || fabs(off) > limit)
        return false;
    double spread = spl_plane_moments_spread(&q->moments, r->normal);
    return fabs(off) + far_end * sqrt(fmax(0, spread * spread - q->rms * q->rms)) <= limit;
}

static void fit(struct spl_region *r)
{
    double sigma[3], normal[3], cosine = 0;
    spl_plane_moments_fit(&r->moments, sigma, normal);
    for (int c = 0; c < 3; c++)
        cosine += normal[c] * r->normal[c];
    for (int c = 0; c < 3; c++)
        r->normal[c] = cosine < 0 ? -normal[c] : normal[c];
}

static void begin(void *state, const struct spl_patch *seed)
{
    ((struct state *)state)->fitted = seed->moments.count;
}

static bool takes(const void *state, const struct spl_region *r, const struct spl_patch *from,
                  const struct spl_patch *next)
{
    (void)from;
    return lies_on(state, r, next, 1);
}

static void took(void *state, struct spl_region *r, const struct spl_patch *q)
{
    struct state *s = state;
    (void)q;
    if (r->moments.count < refit * s->fitted)
        return;
    s->fitted = r->moments.count;
    fit(r);
}

static bool keeps(const void *state, const struct spl_region *r, const struct spl_patch *q)
{
    return lies_on(state, r, q, let_go);
}

int spl_regions_find(struct spl_regions *regions, uint32_t *region, const struct spl_patches *patches,
                     const struct spl_patch_graph *graph, const struct spl_plane_limits_list *limits,
                     const struct spl_stage *stage, struct spl_error *err)
{
    struct state state = {.limits = limits};
    const struct spl_region_rule rule = {&state, rounds, begin, takes, took, fit, keeps};
    return spl_regions_search(regions, region, patches, graph, &rule, stage, err);
}
