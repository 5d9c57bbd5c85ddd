/* Whether a few points stretch the bounds: the box of all but a thousandth on either side, of an even sample, against
 * that of all. A tripod's points reach some ten times as far as most of them lie; beyond `far_ratio` something is wrong
 * with them, which bounds, first view and the search for wires and planes pay for. One thread. */
#include "pack/strays.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/memory.h"
#include "pack/median.h"

enum { sample_most = 1 << 16, points_least = 2000 };
static const double left_out = 1e-3, far_ratio = 50;

bool spl_strays_find(const struct spl_points *p, char text[SPL_STRAYS_TEXT_MAX])
{
    const size_t count = p->count < sample_most ? p->count : sample_most;
    double *sample = count < points_least ? NULL : spl_alloc_raw(count, sizeof *sample, NULL);
    double low[3], high[3], most = 0, all = 0;
    if (!sample)
        return false;
    for (int c = 0; c < 3; c++) {
        const size_t outer = (size_t)(left_out * (double)count) + 1;
        for (size_t i = 0; i < count; i++) {
            if (i % 256 == 0)
                spl_spill_keep_bound(p->spill);
            sample[i] = spl_points_at(p, c, i * p->count / count);
        }
        low[c] = spl_nth(sample, count, outer);
        high[c] = spl_nth(sample + outer, count - outer, count - 1 - 2 * outer);
        most += (high[c] - low[c]) * (high[c] - low[c]);
        all += (p->bounds_max[c] - p->bounds_min[c]) * (p->bounds_max[c] - p->bounds_min[c]);
    }
    free(sample);
    if (!(sqrt(all) > far_ratio * sqrt(most)))
        return false;
    snprintf(text, SPL_STRAYS_TEXT_MAX,
             "nearly all points lie between %.10g %.10g %.10g and %.10g %.10g %.10g, a few up to %.4g away: strays "
             "widen what views, plans and depths reckon with, so take them out of the scan unless they are meant",
             low[0], low[1], low[2], high[0], high[1], high[2], sqrt(all));
    return true;
}
