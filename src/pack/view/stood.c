/* A scanner measures nothing nearer than some decimetres, and stands higher than that above what is beneath it. A pose
 * that has what was scanned at its own height all around it, within a step, lies on the ground: it is an origin that
 * somebody has put there, such as a control point. One below which there is nothing far around lies under the ground.
 * PTX does not say its unit: it is metres then, as good as always, and in smaller ones no station is left out. */
#include "pack/view/stood.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { sectors = 8, around = 6 };
static const double step = 0.6;                  /* metres that are looked at around it, but for its tripod's head */
static const double head = 0.15, above = 0.3, below = 0.1; /* metres: as high over what is beneath it, or under it */
static const double far_around = 10;             /* metres */

/* May it be a little beneath the lowest points? */
static bool in_box(const struct spl_view_sample *s, const double at[3], double beneath)
{
    for (int a = 0; a < 3; a++)
        if (!(at[a] >= s->low[a] - (a == 2 ? beneath : 0) && at[a] <= s->high[a]))
            return false;
    return true;
}

/* A metre in the sample's unit, as far as is known. */
static double metre(const struct spl_view_sample *s)
{
    return s->metre > 0 ? s->metre : 1;
}

/* Does another station have the very same pose, turned nowhere? */
static bool is_origin(const struct spl_points *p, size_t station)
{
    const double *pose = p->stations[station];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            if (pose[4 * i + k] != (i == k))
                return false;
    for (size_t i = 0; i < p->station_count; i++)
        if (i != station && !memcmp(pose, p->stations[i], sizeof *p->stations))
            return true;
    return false;
}

/* Can no eye be there? *foot: it stands on the ground, at a height of *ground. */
static bool is_low(const struct spl_view_sample *s, const double eye[3], bool *foot, double *ground)
{
    const double high = above * metre(s);
    /* as far apart as points of a thin sample may be */
    const double apart =
        sqrt((s->high[0] - s->low[0]) * (s->high[1] - s->low[1]) / fmax((double)s->count, DBL_MIN));
    const double reach = fmax(step * metre(s), 3 * apart), wide = fmax(far_around * metre(s), reach);
    bool at_foot[sectors] = {0}, there[sectors] = {0}, under = true;
    double sum = 0;
    int feet = 0, all = 0, count = 0;
    for (size_t i = 0; i < s->count; i++) {
        const double x = s->at[i][0] - eye[0], y = s->at[i][1] - eye[1], z = s->at[i][2] - eye[2];
        const double square = x * x + y * y;
        if (square > wide * wide)
            continue;
        under = under && z >= -high;
        if (square > reach * reach || square < head * head * metre(s) * metre(s))
            continue;
        const int sector = (int)((atan2(y, x) + M_PI) / (2 * M_PI) * sectors) % sectors;
        there[sector] = true;
        if (z < -high || z > below * metre(s))
            continue;
        at_foot[sector] = true;
        sum += z;
        count++;
    }
    for (int k = 0; k < sectors; k++) {
        feet += at_foot[k];
        all += there[k];
    }
    *foot = feet >= around;
    *ground = eye[2] + (count ? sum / count : 0);
    return *foot || (under && all >= around);
}

void spl_view_list_stood(const struct spl_view_sample *s, const struct spl_points *points, struct spl_view_stood *out)
{
    const size_t stations = points->station_count, all = stations + points->eye_count;
    const size_t taken = all < SPL_VIEW_STOOD_MAX ? all : SPL_VIEW_STOOD_MAX;
    *out = (struct spl_view_stood){.taken = taken};
    for (size_t k = 0; k < taken; k++) {
        const size_t i = k * all / taken;
        double world[3], ground, *eye = out->places[out->count].eye;
        bool foot = false;
        for (int c = 0; c < 3; c++)
            world[c] = i < stations ? points->stations[i][4 * c + 3] : points->eyes[i - stations][c];
        spl_view_to_frame(s, world, eye);
        if (!in_box(s, eye, above * metre(s)))
            continue;
        if (i < stations && (is_low(s, eye, &foot, &ground) || is_origin(points, i))) {
            out->taken--;
            if (foot)
                memcpy(out->feet[out->foot_count++].eye, (double[]){eye[0], eye[1], ground}, sizeof world);
            continue;
        }
        out->count += in_box(s, eye, 0);
    }
    out->origins = all && !out->taken;
}
