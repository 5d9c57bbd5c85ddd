/* Scanners' poses; see station.h. */
#include "geom/station.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "geom/vector.h"

static const double coordinate_max = 1e15, row_tolerance = 1e-6, upright_cosine = 0.70710678118654752;

bool spl_rotation_straighten(double r[9])
{
    for (int round = 0; round < 8; round++) { /* R (3 - R^T R) / 2 */
        double gram[9], next[9];
        for (int i = 0; i < 9; i++)
            gram[i] = r[i / 3] * r[i % 3] + r[3 + i / 3] * r[3 + i % 3] + r[6 + i / 3] * r[6 + i % 3];
        for (int i = 0; i < 9; i++) {
            next[i] = 1.5 * r[i];
            for (int k = 0; k < 3; k++)
                next[i] -= 0.5 * r[i / 3 * 3 + k] * gram[3 * k + i % 3];
        }
        memcpy(r, next, sizeof next);
    }
    double det = r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) +
                 r[2] * (r[3] * r[7] - r[4] * r[6]);
    return fabs(det - 1) < 1e-9;
}

const char *spl_station_judge(const double pose[16])
{
    for (int i = 0; i < 12; i++)
        if (!(fabs(pose[i]) <= coordinate_max))
            return "numbers from -1e15 to 1e15";
    for (int i = 12; i < 16; i++)
        if (!(fabs(pose[i] - (i == 15)) <= row_tolerance))
            return "a pose by rows, whose last row is 0 0 0 1";
    return NULL;
}

/* `axis` without what of it goes along `up`, one long; false where nothing is left. */
static bool level(const double axis[3], const double up[3], double out[3])
{
    const double along = dot3(axis, up);
    for (int i = 0; i < 3; i++)
        out[i] = axis[i] - along * up[i];
    const double length = sqrt(dot3(out, out));
    for (int i = 0; i < 3; i++)
        out[i] /= length;
    return length > 1e-6;
}

void spl_station_look(const double pose[16], const double about[3], double forward[3], double up[3])
{
    const double largest = fmax(fmax(fabs(about[0]), fabs(about[1])), fabs(about[2]));
    double r[9], axes[3][3], length = 0;
    for (int i = 0; i < 3; i++) {
        up[i] = about[i] / largest;
        length += up[i] * up[i];
    }
    for (int i = 0; i < 3; i++)
        up[i] /= sqrt(length);
    for (int i = 0; i < 9; i++)
        r[i] = pose[i / 3 * 4 + i % 3];
    const bool turned = spl_rotation_straighten(r);
    for (int i = 0; i < 9; i++)
        axes[i / 3][i % 3] = turned ? r[i % 3 * 3 + i / 3] : i % 4 == 0; /* its columns */
    const bool upright = fabs(dot3(axes[2], up)) >= upright_cosine;
    if (level(axes[upright ? 0 : 2], up, forward) || level(axes[0], up, forward))
        return;
    level(axes[1], up, forward);
}
