/* Chains of points on wires. The scan of a wire is a row of points in stretches with gaps between, off the wire by its
 * noise. Ends of chains, which at first are points, are paired within a reach that doubles, the best aligned near ones
 * first: what is joined then says where its wire goes, so that longer gaps ask for longer stretches. Where both sides
 * know their direction they must meet as an arc does, with the same bend at both (a sagging wire), not as an S (two
 * wires beside each other). Distances count in the points' own spacing; there is no length in metres.
 *
 * Points that are only taken for a wire's, as of noise, may be looked at by all others and walked along for ever, so
 * each look and each point on a walk is a step of `work`, and where they end, so does joining. Whoever cancels waits
 * for a sort at most. */
#include "pack/wires/join.h"

#include <math.h>
#include <stdlib.h>

#include "base/array.h"
#include "base/memory.h"
#include "geom/vector.h"
#include "pack/wires/grid.h"

static const double near = 3;      /* spacings within which a point that is alone is joined */
static const double far = 100;     /* and beyond which nothing is */
static const double gap = 4;       /* longest gap, as a multiple of the stretches that it joins */
static const double shortest = 64; /* and of the shorter of both */
static const double off = 0.1;     /* a share of a gap that the other end may lie off the direction of this one */
static const double bend = 0.05;   /* by which that may differ between both ends */
enum { looks_most = 256 };         /* ends of a cell that are looked at: noise must not cost more */
enum { cell_steps = 16, pair_steps = 256 }; /* for being sorted, and for its memory: a scan has one for each end */

struct cell {
    uint64_t key;
    uint32_t point;
};

struct pair {
    double cost;
    uint32_t a, b;
};

/* Takes a step; false when none is left. */
static bool step(struct spl_wires_work *work)
{
    return work->left && work->left--;
}

/* Takes as many of `steps` as are left. */
static void take(struct spl_wires_work *work, uint64_t steps)
{
    work->left -= steps < work->left ? steps : work->left;
}

struct join {
    struct spl_wire_point *points;
    struct cell *cells; /* sorted */
    size_t cell_count;
    double low[3], edge;
    struct pair *pairs;
    size_t pair_count, pair_capacity;
    struct spl_wires_work *work;
};

static int compare_cells(const void *a, const void *b)
{
    const struct cell *p = a, *q = b;
    return p->key != q->key ? (p->key < q->key ? -1 : 1) : (p->point > q->point) - (p->point < q->point);
}

static int compare_pairs(const void *a, const void *b)
{
    const struct pair *p = a, *q = b;
    if (p->cost != q->cost)
        return p->cost < q->cost ? -1 : 1;
    return p->a != q->a ? (p->a < q->a ? -1 : 1) : (p->b > q->b) - (p->b < q->b);
}

static int compare_doubles(const void *a, const void *b)
{
    double p = *(const double *)a, q = *(const double *)b;
    return (p > q) - (p < q);
}

static uint64_t key_of(const struct join *j, const double position[3], const int shift[3])
{
    return spl_wires_key(j->low, j->edge, position, shift);
}

static size_t find_cell(const struct join *j, uint64_t key)
{
    size_t low = 0, high = j->cell_count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (j->cells[middle].key < key)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* A grid of the points [0, count) that have a free link and, with `kept`, are in it, but for ends of chains too short
 * for gaps as wide as its cells. */
static void lay_grid(struct join *j, uint32_t count, double edge, const uint8_t *kept)
{
    j->edge = edge;
    j->cell_count = 0;
    for (uint32_t i = 0; i < count && step(j->work); i++)
        if (j->points[i].next[1] == SPL_WIRE_END &&
            (!kept || (kept[i] && edge <= fmax(shortest * j->points[i].length, 2 * near * j->points[i].spacing))))
            j->cells[j->cell_count++] = (struct cell){key_of(j, j->points[i].position, (int[3]){0}), i};
    take(j->work, cell_steps * j->cell_count);
    qsort(j->cells, j->cell_count, sizeof *j->cells, compare_cells);
}

double spl_wires_heading(const struct spl_wire_point *points, uint32_t point, uint32_t avoid, double reach,
                         double heading[3], struct spl_wires_work *work)
{
    uint32_t before = point, at = points[point].next[points[point].next[0] == avoid];
    double length = 0;
    while (at != SPL_WIRE_END && step(work)) {
        length = distance3(points[point].position, points[at].position);
        for (int c = 0; c < 3; c++)
            heading[c] = (points[point].position[c] - points[at].position[c]) / length;
        if (length >= reach)
            break;
        uint32_t next = points[at].next[points[at].next[0] == before];
        before = at;
        at = next;
    }
    return length;
}

/* How far end `b` lies off the direction of end `a`; false where it lies behind, or farther off than it may. */
static bool aim(const struct join *j, uint32_t a, uint32_t b, double length, double spacing, double aside[3],
                bool *knows)
{
    const struct spl_wire_point *p = j->points;
    double heading[3], along = 0, squared = 0;
    *knows = spl_wires_heading(p, a, SPL_WIRE_END, fmax(length, 4 * spacing), heading, j->work) > 0;
    if (!*knows)
        return true;
    for (int c = 0; c < 3; c++)
        along += (p[b].position[c] - p[a].position[c]) * heading[c];
    for (int c = 0; c < 3; c++) {
        aside[c] = p[b].position[c] - p[a].position[c] - along * heading[c];
        squared += aside[c] * aside[c];
    }
    double most = spacing + off * length;
    return along > 0 && squared <= most * most;
}

/* What joining ends `a` and `b` costs: their distance, and as much again for what they are out of line; INFINITY where
 * they do not belong together. */
static double cost_of(const struct join *j, uint32_t a, uint32_t b)
{
    const struct spl_wire_point *p = j->points;
    double length = distance3(p[a].position, p[b].position), spacing = fmax(p[a].spacing, p[b].spacing);
    double aside[2][3] = {{0}}, differ = 0, out = 0;
    bool knows[2];
    if (p[a].other == b || length > spacing * far ||
        (length > near * spacing && length > gap * (p[a].length + p[b].length)))
        return INFINITY;
    if (!aim(j, a, b, length, spacing, aside[0], &knows[0]) || !aim(j, b, a, length, spacing, aside[1], &knows[1]))
        return INFINITY;
    for (int c = 0; c < 3; c++) {
        differ += knows[0] && knows[1] ? (aside[0][c] - aside[1][c]) * (aside[0][c] - aside[1][c]) : 0;
        out += aside[0][c] * aside[0][c] + aside[1][c] * aside[1][c];
    }
    return sqrt(differ) > spacing + bend * length ? INFINITY : length + 4 * sqrt(differ) + sqrt(out);
}

/* `share` as of spl_wires_advance(). */
static int find_pairs(struct join *j, double reach, uint64_t share, struct spl_error *err)
{
    j->pair_count = 0;
    for (size_t i = 0; i < j->cell_count; i++) {
        uint32_t a = j->cells[i].point;
        int rc = spl_wires_check(j->work);
        if (rc)
            return rc;
        spl_wires_advance(j->work, i, j->cell_count, share);
        for (int k = 0; k < 27; k++) {
            uint64_t key = key_of(j, j->points[a].position, (int[3]){k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1});
            size_t first = find_cell(j, key);
            for (size_t m = first; m < j->cell_count && m < first + looks_most && j->cells[m].key == key; m++) {
                uint32_t b = j->cells[m].point;
                step(j->work);
                if (b <= a || distance3(j->points[a].position, j->points[b].position) > reach)
                    continue;
                double cost = cost_of(j, a, b);
                if (cost == INFINITY)
                    continue;
                if (spl_array_reserve(j->pairs, j->pair_capacity, j->pair_count + 1, err))
                    return SPL_E_NOMEM;
                j->pairs[j->pair_count++] = (struct pair){cost, a, b};
                take(j->work, pair_steps);
            }
        }
    }
    if (j->pair_count)
        qsort(j->pairs, j->pair_count, sizeof *j->pairs, compare_pairs);
    return SPL_OK;
}

/* Pairs the best first; what an earlier one has changed is judged anew. */
static int join_pairs(struct join *j)
{
    struct spl_wire_point *p = j->points;
    for (size_t i = 0; i < j->pair_count; i++) {
        uint32_t a = j->pairs[i].a, b = j->pairs[i].b, ends[2] = {p[a].other, p[b].other};
        int rc = spl_wires_check(j->work);
        if (rc)
            return rc;
        if (p[a].next[1] != SPL_WIRE_END || p[b].next[1] != SPL_WIRE_END || cost_of(j, a, b) == INFINITY)
            continue;
        double length = p[a].length + p[b].length + distance3(p[a].position, p[b].position);
        p[a].next[p[a].next[0] != SPL_WIRE_END] = b;
        p[b].next[p[b].next[0] != SPL_WIRE_END] = a;
        for (int k = 0; k < 2; k++) {
            p[ends[k]].other = ends[1 - k];
            p[ends[k]].length = length;
        }
    }
    return SPL_OK;
}

/* Keeps points that lie apart from those kept before, in the order given. */
static int thin_out(struct join *j, uint32_t count, double edge, uint8_t *kept)
{
    struct spl_wire_point *p = j->points;
    lay_grid(j, count, edge, NULL);
    for (uint32_t i = 0; i < count; i++) {
        double limit = fmin(p[i].spacing, edge);
        int rc = spl_wires_check(j->work);
        if (rc)
            return rc;
        spl_wires_advance(j->work, i, count, count);
        kept[i] = 1;
        for (int k = 0; k < 27 && kept[i]; k++) {
            uint64_t key = key_of(j, p[i].position, (int[3]){k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1});
            size_t first = find_cell(j, key);
            for (size_t m = first; m < j->cell_count && m < first + looks_most && j->cells[m].key == key; m++) {
                uint32_t b = j->cells[m].point;
                step(j->work);
                if (b >= i)
                    break;
                if (kept[b] && distance3(p[i].position, p[b].position) < limit) {
                    kept[i] = 0;
                    p[i].beside = b;
                    break;
                }
            }
        }
    }
    return SPL_OK;
}

int spl_wires_join(struct spl_wire_point *points, uint32_t count, struct spl_wires_work *work, struct spl_error *err)
{
    struct join j = {.points = points, .work = work};
    double *spacings = spl_alloc_raw(count + 1, sizeof *spacings, err);
    uint8_t *kept = spl_alloc(count + 1, sizeof *kept, err);
    j.cells = spl_alloc_raw(count + 1, sizeof *j.cells, err);
    int rc = spacings && kept && j.cells ? SPL_OK : SPL_E_NOMEM;
    double longest = 0;
    for (uint32_t i = 0; !rc && i < count; i++) {
        points[i].next[0] = points[i].next[1] = SPL_WIRE_END;
        points[i].other = i;
        points[i].length = 0;
        points[i].beside = SPL_WIRE_END;
        points[i].width = 0;
        spacings[i] = points[i].spacing;
        longest = fmax(longest, points[i].spacing);
        for (int c = 0; c < 3; c++)
            j.low[c] = i ? fmin(j.low[c], points[i].position[c]) : points[i].position[c];
    }
    if (rc || !count)
        goto done;
    qsort(spacings, count, sizeof *spacings, compare_doubles);
    double reach = spacings[count / 2];
    free(spacings);
    spacings = NULL;
    rc = thin_out(&j, count, 2 * reach, kept);
    /* fewer ends each time */
    for (uint64_t share = count / 2; reach <= 2 * far * longest && !rc; reach *= 2, share /= 2) {
        lay_grid(&j, count, reach, kept);
        rc = find_pairs(&j, reach, share, err);
        if (!rc)
            rc = join_pairs(&j);
    }
done:
    free(j.pairs);
    free(j.cells);
    free(kept);
    free(spacings);
    return rc;
}
