/* Recursive bisection. A region is a box of space and the cells that reach into it or its halo; where to cut it the
 * points say, which are counted by how much of a cell lies in the region. Which side is the longest is asked of all but
 * the outermost hundredths of the points, so that a stray one turns no cut. One thread; the time is that of some
 * hundred passes over the cells a level. */
#include "pack/job/cut.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

static const double outermost = 0.01; /* of the points, on either side */
enum { steps = 50, rough_steps = 24 };

struct region {
    const struct spl_job_cell *cells;
    uint32_t *list;  // owned: cells that reach into it or its halo
    double *weights; // owned: points of each that lie in it
    size_t count;
    double min[3], max[3], halo;
};

/* How much of [from, to] lies in [low, high). */
static double share_of_side(double from, double to, double low, double high)
{
    if (!(to > from))
        return from >= low && from < high ? 1 : 0;
    double begin = from > low ? from : low, end = to < high ? to : high;
    return end > begin ? (end - begin) / (to - from) : 0;
}

static double points_within(const struct region *r, const double min[3], const double max[3])
{
    double sum = 0;
    for (size_t i = 0; i < r->count; i++) {
        const struct spl_job_cell *cell = &r->cells[r->list[i]];
        double points = cell->points;
        for (int c = 0; c < 3 && points > 0; c++)
            points *= share_of_side(cell->min[c], cell->max[c], min[c], max[c]);
        sum += points;
    }
    return sum;
}

/* Of its points, those that lie below `place` along an axis. */
static double points_below(const struct region *r, int axis, double place)
{
    double sum = 0;
    for (size_t i = 0; i < r->count; i++) {
        if (!(r->weights[i] > 0))
            continue;
        const struct spl_job_cell *cell = &r->cells[r->list[i]];
        double from = cell->min[axis] > r->min[axis] ? cell->min[axis] : r->min[axis];
        double to = cell->max[axis] < r->max[axis] ? cell->max[axis] : r->max[axis];
        sum += r->weights[i] * share_of_side(from, to, r->min[axis], place);
    }
    return sum;
}

/* Where, along an axis, `wanted` of the region's points lie below; *low and *high are bounds of all its cells there. */
static double find_place(const struct region *r, int axis, double wanted, double low, double high, int most)
{
    for (int i = 0; i < most && low < high; i++) {
        double middle = low / 2 + high / 2;
        if (!(middle > low && middle < high))
            break;
        if (points_below(r, axis, middle) < wanted)
            low = middle;
        else
            high = middle;
    }
    return high;
}

static void find_extent(const struct region *r, int axis, double *low, double *high)
{
    *low = INFINITY;
    *high = -INFINITY;
    for (size_t i = 0; i < r->count; i++) {
        *low = fmin(*low, r->cells[r->list[i]].min[axis]);
        *high = fmax(*high, r->cells[r->list[i]].max[axis]);
    }
    *low = fmax(*low, r->min[axis]);
    *high = fmin(*high, r->max[axis]);
}

static void finish(struct region *r)
{
    free(r->list);
    free(r->weights);
    r->list = NULL;
    r->weights = NULL;
}

static int take_side(const struct region *r, struct region *side, struct spl_error *err)
{
    side->list = spl_alloc_raw(r->count ? r->count : 1, sizeof *side->list, err);
    side->weights = spl_alloc_raw(r->count ? r->count : 1, sizeof *side->weights, err);
    if (!side->list || !side->weights)
        return SPL_E_NOMEM;
    side->count = 0;
    for (size_t i = 0; i < r->count; i++) {
        const struct spl_job_cell *cell = &r->cells[r->list[i]];
        bool reaches = true;
        for (int c = 0; c < 3; c++)
            reaches &= cell->min[c] <= side->max[c] + side->halo && cell->max[c] >= side->min[c] - side->halo;
        if (!reaches)
            continue;
        side->weights[side->count] = cell->points;
        for (int c = 0; c < 3; c++)
            side->weights[side->count] *= share_of_side(cell->min[c], cell->max[c], side->min[c], side->max[c]);
        side->list[side->count++] = r->list[i];
    }
    return SPL_OK;
}

static void finish_part(const struct region *r, struct spl_job_box *part)
{
    double min[3], max[3];
    memcpy(part->min, r->min, sizeof part->min);
    memcpy(part->max, r->max, sizeof part->max);
    for (int c = 0; c < 3; c++) {
        min[c] = r->min[c] - r->halo;
        max[c] = r->max[c] + r->halo;
    }
    double inside = points_within(r, r->min, r->max), all = points_within(r, min, max);
    part->points = (uint64_t)llround(inside);
    part->halo_points = (uint64_t)llround(fmax(all - inside, 0));
}

/* `r` is used up. */
static int cut(struct region *r, struct spl_job_box *parts, uint32_t part_count, struct spl_error *err)
{
    if (part_count == 1) {
        finish_part(r, parts);
        finish(r);
        return SPL_OK;
    }
    double all = points_within(r, r->min, r->max), longest = -1, low = 0, high = 0;
    uint32_t below = part_count / 2;
    int axis = 0;
    for (int c = 0; c < 3; c++) {
        double from, to;
        find_extent(r, c, &from, &to);
        double side = all > 0 ? find_place(r, c, all * (1 - outermost), from, to, rough_steps) -
                                    find_place(r, c, all * outermost, from, to, rough_steps)
                              : 0;
        if (!(side > longest))
            continue;
        longest = side;
        axis = c;
        low = from;
        high = to;
    }
    /* without points anywhere will do, within what is finite */
    double at = all > 0                  ? find_place(r, axis, all * below / part_count, low, high, steps)
                : isfinite(r->min[axis]) ? r->min[axis]
                : isfinite(r->max[axis]) ? r->max[axis]
                                         : 0;
    struct region left = *r, right = *r;
    left.max[axis] = right.min[axis] = at;
    left.list = right.list = NULL;
    left.weights = right.weights = NULL;
    int rc = take_side(r, &left, err);
    if (!rc)
        rc = take_side(r, &right, err);
    finish(r);
    if (rc) {
        finish(&left);
        finish(&right);
        return rc;
    }
    if ((rc = cut(&left, parts, below, err)))
        finish(&right);
    return rc ? rc : cut(&right, parts + below, part_count - below, err);
}

int spl_job_cut(const struct spl_job_cell *cells, size_t count, double halo, struct spl_job_box *parts,
                uint32_t part_count, struct spl_error *err)
{
    struct region all = {.cells = cells,
                         .count = count,
                         .min = {-INFINITY, -INFINITY, -INFINITY},
                         .max = {INFINITY, INFINITY, INFINITY},
                         .halo = halo};
    all.list = spl_alloc_raw(count ? count : 1, sizeof *all.list, err);
    all.weights = spl_alloc_raw(count ? count : 1, sizeof *all.weights, err);
    if (!all.list || !all.weights) {
        finish(&all);
        return SPL_E_NOMEM;
    }
    for (size_t i = 0; i < count; i++) {
        all.list[i] = (uint32_t)i;
        all.weights[i] = cells[i].points;
    }
    return cut(&all, parts, part_count, err);
}

struct spaced {
    double spacing, points;
};

static int by_spacing(const void *a, const void *b)
{
    double x = ((const struct spaced *)a)->spacing, y = ((const struct spaced *)b)->spacing;
    return (x > y) - (x < y);
}

static double find_share(const struct spaced *list, size_t count, double points)
{
    size_t i = 0;
    for (double sum = 0; i < count && (sum += list[i].points) < points;)
        i++;
    return count ? list[i < count ? i : count - 1].spacing : 0;
}

void spl_job_find_spacing(const struct spl_job_cell *cells, size_t count, struct spl_job_spacing *out)
{
    struct spaced *list = spl_alloc_raw(count ? count : 1, sizeof *list, NULL);
    double sum = 0, surface = 0;
    size_t used = 0;
    *out = (struct spl_job_spacing){0};
    for (size_t i = 0; list && i < count; i++) {
        double side[3], area = 0;
        for (int c = 0; c < 3; c++)
            side[c] = cells[i].max[c] - cells[i].min[c];
        for (int c = 0; c < 3; c++)
            area = fmax(area, side[c] * side[(c + 1) % 3]);
        if (!(cells[i].points >= 1))
            continue;
        list[used++] = (struct spaced){sqrt(area / cells[i].points), cells[i].points};
        sum += cells[i].points;
        surface += area;
    }
    if (list && used) {
        qsort(list, used, sizeof *list, by_spacing);
        out->usual = find_share(list, used, sum / 2);
        out->wide = find_share(list, used, sum * 0.95);
        out->mean = sqrt(surface / sum);
    }
    free(list);
}
