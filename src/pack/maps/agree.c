/* Brightness of a map against that of its splats. A pose that is off by little moves the map's edges against theirs,
 * more the nearer they are: that tells a shift from a turn. Only samples that the station shows without doubt take
 * part: nothing ends beside them. */
#include "pack/maps/agree.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "geom/vector.h"

enum { unknowns = 8, most = 60000, few = 4000, angles = 72, bands = 12 };

struct point {
    double own[3]; /* the station's frame */
    double bright;
};

struct work {
    uint32_t side, width;
    float *bright; /* of the atlas's texels; owned */
    struct point *points;
    size_t count;
};

static double brightness(double r, double g, double b)
{
    return 0.3 * r + 0.59 * g + 0.11 * b;
}

static double look_up(const struct work *w, const double d[3])
{
    double place[2];
    spl_polar_place(w->side, SPL_MAP_APRON, d, place);
    double x = place[0] - 0.5, y = place[1] - 0.5, u = x - floor(x), v = y - floor(y);
    const float *t = w->bright + (size_t)y * w->width + (size_t)x;
    return ((double)t[0] * (1 - u) + (double)t[1] * u) * (1 - v) +
           ((double)t[w->width] * (1 - u) + (double)t[w->width + 1] * u) * v;
}

static int prepare(struct work *w, const struct spl_atlas *atlas, const struct spl_station *station, uint32_t index,
                   bool scanned, const struct spl_map_sight *map, const struct spl_samples *samples,
                   struct spl_error *err)
{
    size_t texels = (size_t)atlas->width * atlas->height;
    *w = (struct work){.side = atlas->side, .width = atlas->width};
    w->bright = spl_alloc_raw(texels, sizeof *w->bright, err);
    w->points = spl_alloc_raw(samples->count, sizeof *w->points, err);
    if (!w->bright || !w->points)
        return SPL_E_NOMEM;
    for (size_t i = 0; i < texels; i++) {
        const float *t = atlas->texels[i];
        w->bright[i] = (float)brightness((double)spl_srgb_of_linear(t[0]), (double)spl_srgb_of_linear(t[1]),
                                         (double)spl_srgb_of_linear(t[2]));
    }
    for (size_t i = 0; i < samples->count; i++) {
        const struct spl_sample *s = &samples->list[i];
        double own[3];
        if (scanned && s->of != index)
            continue;
        if (!spl_sample_is_seen(s, station, map, own))
            continue;
        memcpy(w->points[w->count].own, own, sizeof own);
        w->points[w->count++].bright = brightness(s->color[0], s->color[1], s->color[2]);
    }
    size_t step = w->count / most + 1, kept = 0;
    for (size_t i = 0; i < w->count; i += step)
        w->points[kept++] = w->points[i];
    w->count = kept;
    return SPL_OK;
}

/* Correlation within bands of elevation: that floors are dark and skies bright says nothing of where one stands. */
static double correlate(const struct work *w, size_t step, bool mirrored, double degrees)
{
    double sums[bands][6] = {{0}}, aa = 0, bb = 0, ab = 0, count = 0;
    double c = cos(degrees * M_PI / 180), s = sin(degrees * M_PI / 180);
    for (size_t i = 0; i < w->count; i += step) {
        const double *own = w->points[i].own, y = mirrored ? -own[1] : own[1];
        const double d[3] = {c * own[0] - s * y, s * own[0] + c * y, own[2]};
        double a = look_up(w, d), b = w->points[i].bright;
        double rise = atan2(own[2], hypot(own[0], own[1])) / M_PI + 0.5;
        double *sum = sums[(int)fmin(rise * bands, bands - 1)];
        const double terms[6] = {1, a, b, a * a, b * b, a * b};
        for (int k = 0; k < 6; k++)
            sum[k] += terms[k];
    }
    for (int k = 0; k < bands; k++) {
        const double *sum = sums[k];
        if (!(sum[0] > 0))
            continue;
        aa += sum[3] - sum[1] * sum[1] / sum[0];
        bb += sum[4] - sum[2] * sum[2] / sum[0];
        ab += sum[5] - sum[1] * sum[2] / sum[0];
        count += sum[0];
    }
    return aa > count && bb > count ? ab / sqrt(aa * bb) : NAN; /* a level of contrast is least */
}

/* Solves the symmetric system in place of `b`, and leaves the inverse's diagonal in `inverse`; false: singular. */
static bool solve(double m[unknowns][unknowns], double b[unknowns], double inverse[unknowns])
{
    double l[unknowns][unknowns] = {{0}};
    for (int i = 0; i < unknowns; i++)
        for (int j = 0; j <= i; j++) {
            double sum = m[i][j];
            for (int k = 0; k < j; k++)
                sum -= l[i][k] * l[j][k];
            if (i == j && !(sum > 1e-12 * m[i][i]))
                return false;
            l[i][j] = i == j ? sqrt(sum) : sum / l[j][j];
        }
    for (int column = 0; column <= unknowns; column++) { /* unit vectors for the inverse, b last */
        double x[unknowns] = {0};
        if (column < unknowns)
            x[column] = 1;
        else
            memcpy(x, b, sizeof x);
        for (int i = 0; i < unknowns; i++) {
            for (int k = 0; k < i; k++)
                x[i] -= l[i][k] * x[k];
            x[i] /= l[i][i];
        }
        for (int i = unknowns; i-- > 0;) {
            for (int k = i + 1; k < unknowns; k++)
                x[i] -= l[k][i] * x[k];
            x[i] /= l[i][i];
        }
        if (column < unknowns)
            inverse[column] = x[column];
        else
            memcpy(b, x, sizeof x);
    }
    return true;
}

/* One equation: brightness of a point by that of the map around its direction, over `wide` radians. */
static double make_row(const struct work *w, const struct point *point, const double shift[3], const double turn[3],
                       double wide, double row[unknowns])
{
    double own[3], swing[3], d[3], e[2][3], range = 0, middle;
    cross3(turn, point->own, swing);
    for (int k = 0; k < 3; k++) {
        own[k] = point->own[k] - shift[k] - swing[k];
        range += own[k] * own[k];
    }
    range = sqrt(range);
    for (int k = 0; k < 3; k++)
        d[k] = own[k] / range;
    const double axis[3] = {fabs(d[0]) < 0.6, fabs(d[0]) >= 0.6, 0};
    cross3(d, axis, e[0]);
    double length = sqrt(e[0][0] * e[0][0] + e[0][1] * e[0][1] + e[0][2] * e[0][2]);
    for (int k = 0; k < 3; k++)
        e[0][k] /= length;
    cross3(d, e[0], e[1]);
    memset(row, 0, unknowns * sizeof *row);
    middle = look_up(w, d);
    for (int a = 0; a < 2; a++) {
        double ahead[3], behind[3], around[3];
        for (int k = 0; k < 3; k++) {
            ahead[k] = d[k] + wide * e[a][k];
            behind[k] = d[k] - wide * e[a][k];
        }
        double far = look_up(w, ahead), near = look_up(w, behind), slope = (far - near) / (2 * wide);
        middle += far + near;
        cross3(d, e[a], around);
        for (int k = 0; k < 3; k++) {
            row[2 + k] -= slope * e[a][k] / range;
            row[5 + k] -= slope * around[k];
        }
    }
    row[0] = 1;
    row[1] = middle / 5;
    return point->bright;
}

static int by_value(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* The pose's six unknowns in the station's frame. False where the map has no edges to hold on to. */
static bool register_pose(const struct work *w, float *residuals, double shift[3], double turn[3], double errors[2])
{
    static const double widths[] = {6, 4, 2, 2, 1, 1, 1, 1}; /* texels */
    double scale = 40, known[unknowns] = {0, 1};
    for (size_t round = 0; round < sizeof widths / sizeof *widths; round++) {
        double m[unknowns][unknowns] = {{0}}, b[unknowns] = {0}, inverse[unknowns], weights = 0, squares = 0;
        double wide = widths[round] * spl_polar_texel(w->side);
        for (size_t i = 0; i < w->count; i++) {
            double row[unknowns], bright = make_row(w, &w->points[i], shift, turn, wide, row);
            double off = bright - known[0] - known[1] * row[1], share = off / (3 * scale);
            double weight = 1 / ((1 + share * share) * (1 + share * share));
            residuals[i] = (float)fabs(off);
            weights += weight;
            squares += weight * off * off;
            for (int j = 0; j < unknowns; j++) {
                b[j] += weight * row[j] * bright;
                for (int k = 0; k <= j; k++)
                    m[j][k] += weight * row[j] * row[k];
            }
        }
        if (!solve(m, b, inverse) || !(b[1] > 0.05))
            return false;
        known[0] = b[0];
        known[1] = b[1];
        errors[0] = errors[1] = 0;
        for (int k = 0; k < 3; k++) {
            shift[k] += b[2 + k] / b[1];
            turn[k] += b[5 + k] / b[1];
            errors[0] += inverse[2 + k] * squares / weights / (b[1] * b[1]);
            errors[1] += inverse[5 + k] * squares / weights / (b[1] * b[1]);
        }
        qsort(residuals, w->count, sizeof *residuals, by_value);
        scale = fmax(1.4826 * (double)residuals[w->count / 2], 1);
    }
    errors[0] = sqrt(errors[0]);
    errors[1] = sqrt(errors[1]);
    return true;
}

static void find_other(struct spl_agreement *agreement, const struct work *w)
{
    size_t step = w->count / few + 1;
    agreement->other = -1;
    for (int k = 0; k < 2 * angles; k++) {
        double degrees = 360.0 / angles * (k % angles);
        double c = k ? correlate(w, step, k >= angles, degrees) : NAN;
        if (!(c > agreement->other))
            continue;
        agreement->other = c;
        agreement->mirrored = k >= angles;
        agreement->turned = degrees > 180 ? degrees - 360 : degrees;
    }
}

int spl_agreement_find(struct spl_agreement *agreement, const struct spl_atlas *atlas,
                       const struct spl_station *station, uint32_t index, bool scanned, const struct spl_map_sight *map,
                       const struct spl_samples *samples, struct spl_error *err)
{
    struct work w;
    double shift[3] = {0}, turn[3] = {0}, errors[2];
    float *residuals = NULL;
    *agreement = (struct spl_agreement){.shift_error = INFINITY, .turn_error = INFINITY};
    int rc = prepare(&w, atlas, station, index, scanned, map, samples, err);
    if (!rc && w.count >= SPL_AGREEMENT_LEAST && !(residuals = spl_alloc_raw(w.count, sizeof *residuals, err)))
        rc = SPL_E_NOMEM;
    if (!rc && w.count >= SPL_AGREEMENT_LEAST) {
        agreement->shared = w.count;
        agreement->correlation = correlate(&w, 1, false, 0);
        find_other(agreement, &w);
    }
    if (!rc && residuals && register_pose(&w, residuals, shift, turn, errors)) {
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 3; k++)
                agreement->shift[i] += station->rotation[3 * i + k] * shift[k];
        agreement->shift_error = errors[0];
        agreement->turn = sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]);
        agreement->turn_error = errors[1];
    }
    free(residuals);
    free(w.bright);
    free(w.points);
    return rc;
}
