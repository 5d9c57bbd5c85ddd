/* Pieces of patches that bend. Whether one goes on where the other ends is asked between the two, where both quadratics
 * say how high the surface is and how it is tilted: a step or a kink shows there. */
#include <math.h>

#include "geom/vector.h"
#include "pack/planes/quadratic.h"
#include "pack/planes/regions.h"

static const double tilted = 0.76;  /* cosine of a patch's normal and the piece's */
static const double unbroken = 0.9; /* cosine of two patches' normals between them */
static const double beside = 1.25;  /* times both half widths, is how far apart two patches lie at most */
static const double half_width = 2; /* sigmas */
static const double alike = 2.5;    /* spacings of a piece's patches differ by no more, either way from the first */

struct state {
    const struct spl_points *points;
    const struct spl_plane_limits_list *limits;
    double spacing; /* of the piece's first patch */
    double sum[3];  /* of the normals of its points */
};

static double half_width_of(const struct spl_patch *p)
{
    return p->curve.scale / 1.7320508 * half_width;
}

/* The place of the patch's surface over or under `at`, and its normal there. */
static void extend(const struct spl_patch *p, const double at[3], double place[3], double normal[3])
{
    const struct spl_curve *k = &p->curve;
    double off[3], slope[2];
    for (int c = 0; c < 3; c++)
        off[c] = (at[c] - k->origin[c]) / k->scale;
    double x = dot3(off, k->u), y = dot3(off, k->v), height = spl_quadratic_height(k->q, x, y);
    spl_quadratic_slope(k->q, x, y, slope);
    double length = sqrt(1 + slope[0] * slope[0] + slope[1] * slope[1]);
    for (int c = 0; c < 3; c++) {
        place[c] = k->origin[c] + k->scale * (x * k->u[c] + y * k->v[c] + height * k->normal[c]);
        normal[c] = (k->normal[c] - slope[0] * k->u[c] - slope[1] * k->v[c]) / length;
    }
}

static bool goes_on(const struct state *s, const struct spl_patch *a, const struct spl_patch *b)
{
    double wide[2] = {half_width_of(a), half_width_of(b)}, apart = 0, middle[3], place[2][3], normal[2][3], step = 0;
    for (int c = 0; c < 3; c++) {
        double d = b->moments.mean[c] - a->moments.mean[c];
        apart += d * d;
        middle[c] = a->moments.mean[c] + d * wide[0] / (wide[0] + wide[1]);
    }
    if (sqrt(apart) > beside * (wide[0] + wide[1]))
        return false;
    extend(a, middle, place[0], normal[0]);
    extend(b, middle, place[1], normal[1]);
    for (int c = 0; c < 3; c++)
        step += (place[1][c] - place[0][c]) * (normal[0][c] + normal[1][c]) / 2;
    double limit = 2 * spl_plane_limits_at(s->limits, b->first)->step +
                   2 * (a->rms / sqrt(a->moments.count) + b->rms / sqrt(b->moments.count));
    return dot3(normal[0], normal[1]) >= unbroken && fabs(step) <= limit;
}

static double spacing_of(const struct state *s, const struct spl_patch *p)
{
    return (double)s->points->radius[p->first];
}

static void begin(void *state, const struct spl_patch *seed)
{
    struct state *s = state;
    s->spacing = spacing_of(s, seed);
    for (int c = 0; c < 3; c++)
        s->sum[c] = seed->normal[c] * seed->moments.count;
}

static bool takes(const void *state, const struct spl_region *r, const struct spl_patch *from,
                  const struct spl_patch *next)
{
    const struct state *s = state;
    double ratio = spacing_of(s, next) / s->spacing;
    return dot3(next->normal, r->normal) >= tilted && ratio <= alike && ratio >= 1 / alike && goes_on(s, from, next);
}

static void took(void *state, struct spl_region *r, const struct spl_patch *q)
{
    struct state *s = state;
    for (int c = 0; c < 3; c++)
        s->sum[c] += q->normal[c] * q->moments.count;
    double length = sqrt(dot3(s->sum, s->sum));
    for (int c = 0; c < 3; c++)
        r->normal[c] = s->sum[c] / length;
}

int spl_pieces_find(struct spl_regions *pieces, uint32_t *piece, const struct spl_patches *patches,
                    const struct spl_patch_graph *graph, const struct spl_points *points,
                    const struct spl_plane_limits_list *limits, const struct spl_stage *stage, struct spl_error *err)
{
    struct state state = {.points = points, .limits = limits};
    const struct spl_region_rule rule = {.state = &state, .rounds = 1, .begin = begin, .takes = takes, .took = took};
    return spl_regions_search(pieces, piece, patches, graph, &rule, stage, err);
}
