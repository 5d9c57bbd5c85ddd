/* Whether a few points stretch the bounds: the box of all but a thousandth on either side, of an even sample, against
 * that of all. A tripod's points reach some ten times as far as most of them lie; beyond `far_ratio` something is wrong
 * with them, which bounds, first view and the search for wires and planes pay for. More than a thousandth are strays
 * where a gap parts them that is `gap_ratio` times as wide as nearly all others lie: heights that mean none. One
 * thread. */
#include "pack/strays.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/memory.h"
#include "pack/bulk.h"

enum { sample_most = 1 << 16, points_least = 2000 };
static const double left_out = 1e-3, far_ratio = 50, gap_ratio = 4;

bool spl_strays_find(const struct spl_points *p, char text[SPL_STRAYS_TEXT_MAX])
{
    const size_t count = p->count < sample_most ? p->count : sample_most;
    const size_t outer = (size_t)(left_out * (double)count) + 1;
    double *sample = count < points_least ? NULL : spl_alloc_raw(3 * count, sizeof *sample, NULL);
    double low[3], high[3], width = 0, most = 0, all = 0;
    bool parted = false;
    if (!sample)
        return false;
    for (int c = 0; c < 3; c++) {
        for (size_t i = 0; i < count; i++) {
            if (i % 256 == 0)
                spl_spill_keep_bound(p->spill);
            sample[(size_t)c * count + i] = spl_points_at(p, c, i * p->count / count);
        }
        width = fmax(width, spl_bulk_order(sample + (size_t)c * count, count));
    }
    for (int c = 0; c < 3; c++) {
        size_t first, last;
        spl_bulk_find(sample + (size_t)c * count, count, outer, gap_ratio * width, &first, &last);
        parted = parted || first > outer || last < count - 1 - outer;
        low[c] = sample[(size_t)c * count + first];
        high[c] = sample[(size_t)c * count + last];
        most += (high[c] - low[c]) * (high[c] - low[c]);
        all += (p->bounds_max[c] - p->bounds_min[c]) * (p->bounds_max[c] - p->bounds_min[c]);
    }
    free(sample);
    if (!parted && !(sqrt(all) > far_ratio * sqrt(most)))
        return false;
    snprintf(text, SPL_STRAYS_TEXT_MAX,
             "nearly all points lie between %.10g %.10g %.10g and %.10g %.10g %.10g, others up to %.4g away: strays "
             "widen what views, plans and depths reckon with, so take them out of the scan unless they are meant",
             low[0], low[1], low[2], high[0], high[1], high[2], sqrt(all));
    return true;
}
