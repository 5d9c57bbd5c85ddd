/* Robust planes of a run of points: least squares, then again of what lies near, until all of it is within the bound.
 *
 * Points that were seen from the two sides of a plane are two groups, fitted each on its own, however close they lie: a
 * thin wall. So are two sheets seen from the same side, or from none that is known, which shows in the distances: two
 * heaps, farther apart than noise makes them, and mixed: from one point to the next as different as of all.
 * A group is flat where
 * - nine tenths of it lie within the bound, and their sigma is a small share of their width: a volume is no plane;
 * - the normal is certain enough: a single scan line has planes in all directions;
 * - each dozen of points that lie together has its middle near the plane: noise is off on both sides at every place,
 * while a step, a bend or a kink is off on one side somewhere. */
#include "pack/planes/fit.h"

enum { run_points = 16, tries = 5, heap_points = 8 };
static const double most_share = 0.9;   /* of a group that lies within the bound, and of a run that is on patches */
static const double flat_first = 0.4;   /* sigma across over the smaller one along, of all points */
static const double flat_enough = 0.15; /* and of a patch */
static const double certain = 0.03;     /* sigma of the normal's angle, radians */
static const double two_heaps = 3.5;    /* distance of the two halves' means over their sigma: 2.65 of normal noise */
static const double mixed = 0.5;        /* rms from one point to the next over that of all: 1 of noise, 0 of a bend */
static const double above_noise = 1.3;  /* times it, is what is looked at for two heaps */

struct spl_plane_moments spl_fit_sum(const struct spl_fit *f, size_t begin, size_t end, uint8_t group, double limit)
{
    const struct spl_points *p = f->points;
    double origin[3], at[3];
    spl_points_place(p, begin, origin);
    double count = 0, sum[3] = {0}, square[6] = {0};
    for (size_t i = begin; i < end; i++) {
        if (f->group[i - f->base] != group || fabsf(f->off[i - f->base]) > limit)
            continue;
        spl_points_apart(p, origin, i, at);
        double x = at[0], y = at[1], z = at[2];
        count++;
        sum[0] += x;
        sum[1] += y;
        sum[2] += z;
        square[0] += x * x;
        square[1] += x * y;
        square[2] += x * z;
        square[3] += y * y;
        square[4] += y * z;
        square[5] += z * z;
    }
    return spl_plane_moments_of(origin, count, sum, square);
}

/* Distances of a group's points; returns the largest. */
static double measure(const struct spl_fit *f, size_t begin, size_t end, uint8_t group, const double mean[3],
                      const double normal[3])
{
    double most = 0;
    for (size_t i = begin; i < end; i++) {
        if (f->group[i - f->base] != group)
            continue;
        double off = spl_plane_distance(f->points, i, mean, normal);
        f->off[i - f->base] = (float)off;
        most = fmax(most, fabs(off));
    }
    return most;
}

bool spl_fit_has_layers(const struct spl_fit *f, size_t begin, size_t end, uint8_t group)
{
    double count[2] = {0}, sum[2] = {0}, square = 0, change = 0, last = NAN;
    for (size_t i = begin; i < end; i++) {
        if (f->group[i - f->base] != group)
            continue;
        double off = f->off[i - f->base];
        count[off > 0]++;
        sum[off > 0] += off;
        square += off * off;
        change += last == last ? (off - last) * (off - last) : 0;
        last = off;
    }
    double n = count[0] + count[1];
    if (fmin(count[0], count[1]) < heap_points)
        return false;
    double low = sum[0] / count[0], high = sum[1] / count[1];
    double within = fmax(0, square / n - (count[0] * low * low + count[1] * high * high) / n);
    return (high - low) > two_heaps * sqrt(within) && change / 2 >= mixed * mixed * square;
}

bool spl_fit_is_even(const struct spl_fit *f, size_t begin, size_t end, uint8_t group, double rms, bool drop)
{
    double sum = 0, limit = f->limits.step + 3 * fmax(rms, f->limits.noise) / sqrt(run_points);
    int run = 0;
    unsigned runs = 0, off_runs = 0;
    size_t first = begin;
    for (size_t i = begin; i < end; i++) {
        if (f->group[i - f->base] != group || fabsf(f->off[i - f->base]) > f->limits.bound)
            continue;
        sum += f->off[i - f->base];
        if (++run < run_points)
            continue;
        bool off = fabs(sum) > limit * run_points;
        for (size_t k = first; k <= i && off && drop; k++)
            f->group[k - f->base] = f->group[k - f->base] == group ? 0 : f->group[k - f->base];
        runs++;
        off_runs += off;
        first = i + 1;
        run = 0;
        sum = 0;
    }
    return off_runs * 100 <= runs;
}

bool spl_fit_group(const struct spl_fit *f, size_t begin, size_t end, uint8_t group, size_t count,
                   struct spl_patch *patch, bool *layers)
{
    double limit = INFINITY, bound = f->limits.bound, sigma[3];
    struct spl_plane_moments *m = &patch->moments;
    *layers = false;
    for (size_t i = begin; i < end; i++)
        if (f->group[i - f->base] == group)
            f->off[i - f->base] = 0;
    for (int t = 0; t < tries; t++) {
        *m = spl_fit_sum(f, begin, end, group, limit);
        if (m->count < SPL_PATCH_POINTS || m->count < most_share * (double)count)
            return false;
        spl_plane_moments_fit(m, sigma, patch->normal);
        if (sigma[0] > flat_first * sigma[1])
            return false;
        double most = measure(f, begin, end, group, m->mean, patch->normal);
        if (t == 0 && sigma[0] > above_noise * f->limits.noise && spl_fit_has_layers(f, begin, end, group)) {
            *layers = true;
            return false;
        }
        if (limit <= bound || most <= bound)
            break;
        limit = fmax(bound, 1.5 * sigma[0]);
    }
    patch->rms = sigma[0] * sqrt(m->count / (m->count - 3));
    double angle = fmax(patch->rms, f->limits.noise) / (sigma[1] * sqrt(m->count));
    if (!(sigma[1] > 0) || sigma[0] > flat_enough * sigma[1] || angle > certain ||
        !spl_fit_is_even(f, begin, end, group, sigma[0], false))
        return false;
    spl_fit_is_even(f, begin, end, group, sigma[0], true);
    size_t within = 0;
    for (size_t i = begin; i < end; i++) {
        if (f->group[i - f->base] != group)
            continue;
        if (fabsf(f->off[i - f->base]) > bound)
            f->group[i - f->base] = 0;
        else
            within++;
    }
    return within >= SPL_PATCH_POINTS && (double)within >= most_share * (double)count;
}

void spl_fit_part_sides(const struct spl_fit *f, size_t begin, size_t end, const double normal[3], size_t count[2])
{
    count[0] = count[1] = 0;
    for (size_t i = begin; i < end; i++) {
        uint8_t *group = &f->group[i - f->base];
        if (!*group)
            continue;
        bool below = !spl_plane_is_seen(f->points, i, normal);
        *group = 1 + below;
        count[below]++;
    }
}

/* Of a group with two layers the upper one becomes group `to`; returns how many that are. */
static size_t part_layers(const struct spl_fit *f, size_t begin, size_t end, uint8_t from, uint8_t to)
{
    size_t count = 0;
    for (size_t i = begin; i < end; i++)
        if (f->group[i - f->base] == from && f->off[i - f->base] > 0) {
            f->group[i - f->base] = to;
            count++;
        }
    return count;
}

void spl_patch_face(struct spl_patch *patch, const double normal[3])
{
    double cosine = 0;
    for (int c = 0; c < 3; c++)
        cosine += patch->normal[c] * normal[c];
    for (int c = 0; c < 3 && cosine < 0; c++)
        patch->normal[c] = -patch->normal[c];
}

unsigned spl_fit_find(const struct spl_fit *f, size_t begin, size_t end, struct spl_patch patches[SPL_FIT_PATCHES])
{
    size_t all = 0, side[2], taken = 0;
    unsigned found = 0;
    double sigma[3], normal[3];
    uint8_t number[SPL_FIT_PATCHES + 1] = {0};
    for (size_t i = begin; i < end; i++) {
        bool flat = !(f->points->linear && f->points->linear[i]);
        f->group[i - f->base] = flat;
        f->off[i - f->base] = 0;
        all += flat;
    }
    if (all < SPL_PATCH_POINTS)
        return 0;
    struct spl_plane_moments moments = spl_fit_sum(f, begin, end, 1, INFINITY);
    spl_plane_moments_fit(&moments, sigma, normal);
    if (sigma[0] > flat_first * sigma[1])
        return 0;
    spl_fit_part_sides(f, begin, end, normal, side);
    for (uint8_t s = 0; s < 2; s++) {
        const double facing[3] = {s ? -normal[0] : normal[0], s ? -normal[1] : normal[1], s ? -normal[2] : normal[2]};
        uint8_t group[2] = {1 + s, 3 + s};
        size_t count[2] = {side[s], 0};
        bool layers;
        if (side[s] < SPL_PATCH_POINTS)
            continue;
        bool flat = spl_fit_group(f, begin, end, group[0], side[s], &patches[found], &layers);
        if (layers) {
            count[1] = part_layers(f, begin, end, group[0], group[1]);
            count[0] -= count[1];
            flat = true;
        }
        for (int k = 0; k < 2 && flat; k++) {
            if (layers)
                flat = spl_fit_group(f, begin, end, group[k], count[k], &patches[found], &(bool){false});
            else if (k == 1)
                break;
            if (!flat)
                return 0;
            spl_patch_face(&patches[found], facing);
            taken += (size_t)patches[found].moments.count;
            number[group[k]] = (uint8_t)++found;
        }
        if (!flat)
            return 0;
    }
    if ((double)taken < most_share * (double)all)
        return 0;
    for (size_t i = begin; i < end; i++)
        f->group[i - f->base] = number[f->group[i - f->base]];
    return found;
}
