/* The axes of chains, and how thick what they run along is. A scan has points of a wire's surface, off by its noise; a
 * chain of them zigzags. Each point is moved to where a parabola through those before and behind it in its stretch has
 * it, over windows that are several times as long as the chain is wide. Then all points that belong to the chain, also
 * those that lie beside it, say by how far they are spread across: along the direction in which they are most, between
 * the quantiles at 5 and 95 %. Of a cylinder that is seen from one side these are 0.90 of its diameter apart, from all
 * sides 0.99. What the scan's noise adds is taken off: it lies along the rays, so where it is about as large as the
 * spread, which may then be either's, it is taken off those of both directions together. Chains that are not long
 * beside their width are no lines. Owned by the thread that joins. */
#include "pack/wires/axis.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "geom/vector.h"

static const double share_seen = 0.945;     /* of the diameter, between the quantiles */
static const double quantile = 0.05, noise_span = 3.29; /* between them, of a normal distribution: sigma */
static const double noise_small = 0.4;      /* of the square of the spread: what the noise adds there */
static const double share_both = 0.93;      /* both spreads' squares in sum, of the diameter's, seen from one side */
static const double break_at = 6;           /* spacings: beyond, another stretch begins */
static const double window_wide = 8;        /* a window is so many times as long as the chain is spread */
static const double length_least = 4;       /* widths, of a line */
enum { half_least = 12, half_most = 96, measured_least = 12 };

struct chain {
    const struct spl_wire_point *points;
    uint32_t *order; /* points of the chain, from end to end */
    double (*axis)[3];
    double (*off)[2]; /* of every point that belongs to it, across */
    uint32_t count, off_count;
};

/* Does the chain go on without a gap from its point `i` to the next? */
static bool goes_on(const struct chain *c, uint32_t i)
{
    const struct spl_wire_point *a = &c->points[c->order[i]], *b = a;
    if (i + 1 == c->count)
        return false;
    b = &c->points[c->order[i + 1]];
    return distance3(a->position, b->position) <= break_at * fmax(a->spacing, b->spacing);
}

/* Points [*first, *last] around `i` of its stretch: `half` on either side, more on one where the other has fewer. */
static void find_window(const struct chain *c, uint32_t i, uint32_t half, uint32_t *first, uint32_t *last)
{
    *first = *last = i;
    for (uint32_t k = 0; k < half && goes_on(c, *last); k++)
        ++*last;
    while (*last - *first < 2 * half && *first && goes_on(c, *first - 1))
        --*first;
    while (*last - *first < 2 * half && goes_on(c, *last))
        ++*last;
}

/* Solves the symmetric 3 x 3 system of moments s[0..4] for `b`; false where it is singular. */
static bool solve(const double s[5], const double b[3], double out[3])
{
    double m[3][4] = {{s[0], s[1], s[2], b[0]}, {s[1], s[2], s[3], b[1]}, {s[2], s[3], s[4], b[2]}};
    for (int k = 0; k < 3; k++) {
        if (!(m[k][k] > 1e-9 * s[0])) /* parameters are within -1 and 1 */
            return false;
        for (int r = k + 1; r < 3; r++) {
            double share = m[r][k] / m[k][k];
            for (int e = k; e < 4; e++)
                m[r][e] -= share * m[k][e];
        }
    }
    for (int k = 2; k >= 0; k--) {
        out[k] = m[k][3];
        for (int e = k + 1; e < 3; e++)
            out[k] -= m[k][e] * out[e];
        out[k] /= m[k][k];
    }
    return true;
}

/* Where point `i` lies on the parabola through its window; which way that goes there. The point itself where the window
 * has too few. */
static void fit(const struct chain *c, uint32_t i, uint32_t half, double at[3], double heading[3])
{
    const double *own = c->points[c->order[i]].position;
    uint32_t first, last;
    double length = 0, most = 0, s[5] = {0}, b[3][3] = {{0}};
    find_window(c, i, half, &first, &last);
    memcpy(at, own, 3 * sizeof *at);
    const double *from = c->points[c->order[first]].position, *to = c->points[c->order[last]].position;
    for (int k = 0; k < 3; k++) {
        heading[k] = to[k] - from[k];
        length += heading[k] * heading[k];
    }
    length = sqrt(length);
    for (int k = 0; k < 3; k++)
        heading[k] = length > 0 ? heading[k] / length : k == 0;
    if (last - first < 4 || !(length > 0))
        return;
    for (uint32_t j = first; j <= last; j++)
        most = fmax(most, distance3(c->points[c->order[j]].position, own));
    for (uint32_t j = first; j <= last; j++) {
        const double *p = c->points[c->order[j]].position;
        double t = 0, power = 1;
        for (int k = 0; k < 3; k++)
            t += (p[k] - own[k]) * heading[k] / most;
        for (int k = 0; k < 5; k++, power *= t) {
            s[k] += power;
            for (int a = 0; a < 3 && k < 3; a++)
                b[a][k] += power * (p[a] - own[a]);
        }
    }
    double turned[3], squared = 0;
    for (int a = 0; a < 3; a++) {
        double curve[3];
        if (!solve(s, b[a], curve))
            return;
        at[a] = own[a] + curve[0];
        turned[a] = curve[1];
        squared += curve[1] * curve[1];
    }
    for (int k = 0; k < 3 && squared > 0; k++)
        heading[k] = turned[k] / sqrt(squared);
}

/* How far `at` lies off the axis at `from`, across: level and upwards where the axis is not upright. */
static void find_off(const double from[3], const double heading[3], const double at[3], double off[2])
{
    double side[3] = {-heading[1], heading[0], 0}, length = sqrt(side[0] * side[0] + side[1] * side[1]), up[3];
    if (length < 0.1) {
        memcpy(side, (double[3]){0, -heading[2], heading[1]}, sizeof side);
        length = sqrt(side[1] * side[1] + side[2] * side[2]);
    }
    off[0] = off[1] = 0;
    for (int k = 0; k < 3; k++)
        side[k] /= length;
    for (int k = 0; k < 3; k++)
        up[k] = heading[(k + 1) % 3] * side[(k + 2) % 3] - heading[(k + 2) % 3] * side[(k + 1) % 3];
    for (int k = 0; k < 3; k++) {
        off[0] += (at[k] - from[k]) * side[k];
        off[1] += (at[k] - from[k]) * up[k];
    }
}

static int compare_doubles(const void *a, const void *b)
{
    double p = *(const double *)a, q = *(const double *)b;
    return (p > q) - (p < q);
}

/* The spreads of the chain's points across, along the direction of their most and the other one; `sorted` has room for
 * them. */
static void find_spreads(const struct chain *c, double *sorted, double spread[2])
{
    double m[3] = {0}, mean[2] = {0}, n = c->off_count;
    for (uint32_t i = 0; i < c->off_count; i++)
        for (int k = 0; k < 2; k++)
            mean[k] += c->off[i][k] / n;
    for (uint32_t i = 0; i < c->off_count; i++) {
        double x = c->off[i][0] - mean[0], y = c->off[i][1] - mean[1];
        m[0] += x * x;
        m[1] += x * y;
        m[2] += y * y;
    }
    for (int k = 0; k < 2; k++) {
        double turn = 0.5 * atan2(2 * m[1], m[0] - m[2]) + k * M_PI / 2, last = n - 1;
        for (uint32_t i = 0; i < c->off_count; i++)
            sorted[i] = cos(turn) * c->off[i][0] + sin(turn) * c->off[i][1];
        qsort(sorted, c->off_count, sizeof *sorted, compare_doubles);
        spread[k] = sorted[(size_t)(last * (1 - quantile) + 0.5)] - sorted[(size_t)(last * quantile + 0.5)];
    }
}

/* Fills `order` with the chain from its end `begin` on. */
static void follow(struct chain *c, uint32_t begin)
{
    c->count = 0;
    for (uint32_t before = SPL_WIRE_END, at = begin; at != SPL_WIRE_END;) {
        uint32_t next = c->points[at].next[c->points[at].next[0] == before && before != SPL_WIRE_END];
        c->order[c->count++] = at;
        if (at == c->points[begin].other)
            break;
        before = at;
        at = next;
    }
}

/* The points that lie beside those of chains, by these: point `i`'s are beside[first[i]] to beside[first[i + 1]]. */
struct besides {
    uint32_t *first, *list;
};

static int list_besides(struct besides *b, const struct spl_wire_point *p, uint32_t count, struct spl_error *err)
{
    b->first = spl_alloc((size_t)count + 2, sizeof *b->first, err);
    b->list = spl_alloc_raw((size_t)count + 1, sizeof *b->list, err);
    if (!b->first || !b->list)
        return SPL_E_NOMEM;
    for (uint32_t i = 0; i < count; i++)
        if (p[i].beside != SPL_WIRE_END)
            b->first[p[i].beside + 2]++;
    for (uint32_t i = 2; i < count + 2; i++)
        b->first[i] += b->first[i - 1];
    for (uint32_t i = 0; i < count; i++)
        if (p[i].beside != SPL_WIRE_END)
            b->list[b->first[p[i].beside + 1]++] = i;
    return SPL_OK;
}

/* Fits the axis with windows of `half` points a side, and lists how far all points lie off. */
static void fit_axis(struct chain *c, const struct besides *b, uint32_t half)
{
    c->off_count = 0;
    for (uint32_t i = 0; i < c->count; i++) {
        uint32_t own = c->order[i];
        double heading[3];
        fit(c, i, half, c->axis[i], heading);
        find_off(c->axis[i], heading, c->points[own].position, c->off[c->off_count++]);
        for (uint32_t k = b->first[own]; k < b->first[own + 1]; k++)
            find_off(c->axis[i], heading, c->points[b->list[k]].position, c->off[c->off_count++]);
    }
}

/* Moves the chain to its axis; its width, 0: it is no line, NAN: it has too few points to say. */
static double measure(struct chain *c, const struct besides *b, double noise, double *sorted)
{
    const struct spl_wire_point *p = c->points;
    double length = p[c->order[0]].length, apart = length / (c->count - 1), spread[2] = {0};
    double noise_squared = noise_span * noise_span * noise * noise;
    for (uint32_t half = half_least;; half *= 2) {
        fit_axis(c, b, half);
        if (c->off_count >= measured_least)
            find_spreads(c, sorted, spread);
        if (2 * half * apart >= window_wide * spread[0] || 2 * half > half_most || half >= c->count)
            break;
    }
    if (c->off_count < measured_least)
        return NAN;
    double most = spread[0] * spread[0];
    double squared = noise_squared < noise_small * most ? (most - noise_squared) / (share_seen * share_seen)
                                                        : (most + spread[1] * spread[1] - noise_squared) / share_both;
    double width = sqrt(fmax(squared, 0));
    return length < length_least * width ? 0 : fmax(width, fmax(noise, SPL_WIRE_THIN));
}

/* What has too few points to say how thick it is is as thick as most are, but no more than its points are apart. */
static void take_median(struct spl_wire_point *points, uint32_t count, double *sorted)
{
    size_t known = 0;
    for (uint32_t i = 0; i < count; i++)
        if (points[i].next[0] != SPL_WIRE_END && points[i].width > 0)
            sorted[known++] = points[i].width;
    if (known)
        qsort(sorted, known, sizeof *sorted, compare_doubles);
    for (uint32_t i = 0; i < count; i++)
        if (isnan(points[i].width))
            points[i].width = known ? fmin(sorted[known / 2], points[i].spacing) : SPL_WIRE_THIN;
}

int spl_wires_find_axes(struct spl_wire_point *points, uint32_t count, double noise, struct spl_wires_work *work,
                        struct spl_error *err)
{
    struct chain c = {.points = points};
    struct besides b = {0};
    double *sorted = spl_alloc_raw((size_t)count + 1, sizeof *sorted, err);
    c.order = spl_alloc_raw((size_t)count + 1, sizeof *c.order, err);
    c.axis = spl_alloc_raw((size_t)count + 1, sizeof *c.axis, err);
    c.off = spl_alloc_raw((size_t)count + 1, sizeof *c.off, err);
    int rc = sorted && c.order && c.axis && c.off ? list_besides(&b, points, count, err) : SPL_E_NOMEM;
    for (uint32_t i = 0; i < count && !rc; i++) {
        if (!spl_wires_is_begin(points, i))
            continue;
        follow(&c, i);
        double width = measure(&c, &b, noise, sorted);
        for (uint32_t k = 0; k < c.count; k++) {
            struct spl_wire_point *p = &points[c.order[k]];
            p->width = width;
            memcpy(p->position, c.axis[k], sizeof p->position);
        }
        rc = spl_stage_check(work->stage, err);
    }
    if (!rc)
        take_median(points, count, sorted);
    for (uint32_t i = 0; i < count && !rc; i++)
        if (points[i].beside != SPL_WIRE_END)
            points[i].width = points[points[i].beside].width;
    free(sorted);
    free(c.order);
    free(c.axis);
    free(c.off);
    free(b.first);
    free(b.list);
    return rc;
}
