/* Whether a few points stretch the bounds: the box of all but a thousandth on either side, of an even sample, against
 * that of all. A tripod's points reach some ten times as far as most of them lie; beyond `far_ratio` something is wrong
 * with them, which bounds, first view and the search for wires and planes pay for. More than a thousandth are strays
 * where a gap parts them that is `gap_ratio` times as wide as nearly all others lie: heights that mean none. Of more
 * than a twentieth nobody can say which are the scan, unless all of them have one value, which surfaces do not have so
 * far from all else.
 * Points of equal coordinates are one point, as a pack keeps them: those that are not kept are sampled by place, so
 * that "0 0 0" for each pixel that saw nothing weighs no more than it does there. One thread. */
#include "pack/strays.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/hash.h"
#include "base/memory.h"
#include "pack/bulk.h"

enum { sample_most = 1 << 16, points_least = 2000, twentieth = 20 };
enum { slots = 1 << 17, probes = 16, halved_most = 40 };
static const double left_out = 1e-3, far_ratio = 50, gap_ratio = 4;

/* How many of `values` are `level`; *gap to the nearest other, *width of what nearly all others lie in. */
static size_t part(const double *values, size_t count, double level, double *others, double *gap, double *width)
{
    size_t kept = 0;
    *gap = INFINITY;
    for (size_t i = 0; i < count; i++) {
        if (values[i] == level)
            continue;
        *gap = fmin(*gap, fabs(values[i] - level));
        others[kept++] = values[i];
    }
    *width = kept ? spl_bulk_order(others, kept) : 0;
    return count - kept;
}

/* Of more than a twentieth of the points: one value of an axis, its lowest or highest, far from all others. */
static bool find_level(double *const axis[3], size_t count, const double width[3], double *scratch,
                       char text[SPL_STRAYS_TEXT_MAX])
{
    for (int c = 2; c >= 0; c--) {
        double ends[2] = {axis[c][0], axis[c][0]}, gap, own;
        for (size_t i = 1; i < count; i++) {
            ends[0] = fmin(ends[0], axis[c][i]);
            ends[1] = fmax(ends[1], axis[c][i]);
        }
        for (int e = 0; e < 2; e++) {
            const size_t same = part(axis[c], count, ends[e], scratch, &gap, &own);
            const double widest = fmax(own, fmax(width[(c + 1) % 3], width[(c + 2) % 3]));
            if (same <= count / twentieth || count - same <= count / twentieth || !(gap > gap_ratio * widest))
                continue;
            snprintf(text, SPL_STRAYS_TEXT_MAX,
                     "%.0f %% of all points have %c = %.10g, %.4g away from all others: if that means none, take them "
                     "out of the scan, for they are too many to be left out of the default view, or give it "
                     "(--default-view)",
                     100 * (double)same / (double)count, "xyz"[c], ends[e], gap);
            return true;
        }
    }
    return false;
}

/* Of a sample whose order is lost, and the bounds of all; `scratch` is as long. */
static bool judge(double *const axis[3], size_t count, double *scratch, const double min[3], const double max[3],
                  char text[SPL_STRAYS_TEXT_MAX])
{
    const size_t outer = (size_t)(left_out * (double)count) + 1;
    double low[3], high[3], width[3], most = 0, all = 0;
    bool parted = false;
    for (int c = 0; c < 3; c++)
        width[c] = spl_bulk_order(axis[c], count);
    if (find_level(axis, count, width, scratch, text))
        return true;
    const double gap = gap_ratio * fmax(width[0], fmax(width[1], width[2]));
    for (int c = 0; c < 3; c++) {
        size_t first, last;
        spl_bulk_find(axis[c], count, outer, gap, &first, &last);
        parted = parted || first > outer || last < count - 1 - outer;
        low[c] = axis[c][first];
        high[c] = axis[c][last];
        most += (high[c] - low[c]) * (high[c] - low[c]);
        all += (max[c] - min[c]) * (max[c] - min[c]);
    }
    if (!parted && !(sqrt(all) > far_ratio * sqrt(most)))
        return false;
    snprintf(text, SPL_STRAYS_TEXT_MAX,
             "nearly all points lie between %.10g %.10g %.10g and %.10g %.10g %.10g, others up to %.4g away: strays "
             "widen what views, plans and depths reckon with, so take them out of the scan unless they are meant",
             low[0], low[1], low[2], high[0], high[1], high[2], sqrt(all));
    return true;
}

bool spl_strays_find(const struct spl_points *p, char text[SPL_STRAYS_TEXT_MAX])
{
    const size_t count = p->count < sample_most ? p->count : sample_most;
    double *sample = count < points_least ? NULL : spl_alloc_raw(4 * count, sizeof *sample, NULL);
    if (!sample)
        return false;
    double *const axis[3] = {sample, sample + count, sample + 2 * count};
    for (int c = 0; c < 3; c++)
        for (size_t i = 0; i < count; i++) {
            if (i % 256 == 0)
                spl_spill_keep_bound(p->spill);
            axis[c][i] = spl_points_at(p, c, i * p->count / count);
        }
    const bool found = judge(axis, count, sample + 3 * count, p->bounds_min, p->bounds_max, text);
    free(sample);
    return found;
}

/* By chance, for a step would meet the rows of grids, but of one place always the same. */
static uint64_t hash_place(const double at[3])
{
    uint64_t h = 0;
    for (int c = 0; c < 3; c++) {
        const double v = at[c] + 0.0; /* no -0 */
        uint64_t bits;
        memcpy(&bits, &v, sizeof bits);
        h = spl_hash_mix(h + SPL_GOLDEN_64 + bits);
    }
    return h;
}

static bool is_drawn(const struct spl_strays *s, uint64_t hash)
{
    return !(hash & (((uint64_t)1 << s->halved) - 1));
}

/* Into the sample, unless its place is there, or all slots near its own are full, as whoever makes a scan may want. */
static void take(struct spl_strays *s, const double at[3], uint64_t hash)
{
    double *const x = s->sample, *const y = x + sample_most, *const z = y + sample_most;
    size_t slot = spl_hash_slot(hash, slots - 1);
    for (int i = 0; i < probes && s->count < sample_most; i++, slot = (slot + 1) % slots) {
        const uint32_t there = s->slots[slot];
        if (there && x[there - 1] == at[0] && y[there - 1] == at[1] && z[there - 1] == at[2])
            return;
        if (there)
            continue;
        x[s->count] = at[0];
        y[s->count] = at[1];
        z[s->count] = at[2];
        s->slots[slot] = (uint32_t)++s->count;
        return;
    }
}

static void halve(struct spl_strays *s)
{
    const size_t count = s->count;
    s->halved++;
    s->count = 0;
    memset(s->slots, 0, slots * sizeof *s->slots);
    for (size_t i = 0; i < count; i++) {
        const double at[3] = {s->sample[i], s->sample[sample_most + i], s->sample[2 * sample_most + i]};
        const uint64_t hash = hash_place(at);
        if (is_drawn(s, hash))
            take(s, at, hash);
    }
}

static void finish(struct spl_strays *s)
{
    free(s->sample);
    free(s->slots);
    *s = (struct spl_strays){0};
}

void spl_strays_add(struct spl_strays *s, const struct spl_point_batch *batch)
{
    if (!s->sample) {
        s->sample = spl_alloc_raw(4 * (size_t)sample_most, sizeof *s->sample, NULL);
        s->slots = spl_alloc(slots, sizeof *s->slots, NULL);
        if (!s->sample || !s->slots) {
            finish(s);
            return;
        }
    }
    for (size_t i = 0; i < batch->count; i++) {
        const uint64_t hash = hash_place(batch->position[i]);
        if (!is_drawn(s, hash))
            continue;
        take(s, batch->position[i], hash);
        if (s->count == sample_most && s->halved < halved_most)
            halve(s);
    }
}

bool spl_strays_tell(struct spl_strays *s, const double min[3], const double max[3], char text[SPL_STRAYS_TEXT_MAX])
{
    bool found = false;
    if (s->count >= points_least) {
        double *const axis[3] = {s->sample, s->sample + sample_most, s->sample + 2 * sample_most};
        found = judge(axis, s->count, s->sample + 3 * sample_most, min, max, text);
    }
    finish(s);
    return found;
}
