/* Pieces of lines, and the points on them. Lines whose cells touch are one piece, and so are two that continue each
 * other beyond a gap: a scan meets a wire in stretches. Cells beside a line take part in it with the points that lie on
 * its axis: crossings, ends, joints; the cells of a gap with those on the axis from one end to the other. A piece is a
 * tree of a union-find forest. Lists of lines are short beside the cloud: all of it runs on the calling thread. */
#include <math.h>

#include "pack/linear_level.h"

enum { gap_most = 16, look_grain = 64 }; /* cells between lines that continue each other; lines looked at in a row */
static const double straight = 0.97; /* cosine between those, and of each with the axis between them */

enum { look, clear, mark };

/* Of a line's points. What is around them may be another line, whose distance says nothing of their size: a disc
 * reaches over the next point on this one, or is as wide as a thing that has points side by side. */
static float most_radius(const struct spl_linear_level *l, const struct spl_line *line)
{
    return line->beside_surface ? INFINITY : (float)l->cells.edge * fmaxf(line->spacing, 2 * line->across);
}

static void take_point(const struct spl_points *p, size_t i, bool marked, float radius)
{
    p->linear[i] = marked;
    p->radius[i] = !marked ? 0 : p->radius[i] > 0 ? fminf(p->radius[i], radius) : radius;
}

/* Looks for, clears or marks the points of `cell` on the axis of `line`, whose own cell lies at `at`. */
static bool take_points(const struct spl_points *p, const struct spl_linear_level *l, const struct spl_line *line,
                        const int64_t at[3], uint32_t cell, int what)
{
    double origin[3], inverse = 1 / l->cells.edge, limit = fmax(3 * line->across, 0.15);
    const float radius = most_radius(l, line);
    bool any = false;
    for (int c = 0; c < 3; c++)
        origin[c] = p->cube_min[c] + ((double)at[c] + 0.5 + line->middle[c]) * l->cells.edge;
    for (size_t i = l->cells.cells[cell].begin; i < l->cells.cells[cell + 1].begin; i++) {
        double along = 0, squared = 0;
        for (int c = 0; c < 3; c++) {
            double d = (spl_points_at(p, c, i) - origin[c]) * inverse;
            squared += d * d;
            along += d * line->direction[c];
        }
        if (squared - along * along > limit * limit)
            continue;
        any = true;
        if (what == look)
            break;
        take_point(p, i, what == mark, radius);
    }
    return any;
}

static uint32_t root_of(struct spl_line *lines, uint32_t i)
{
    while (lines[i].parent != i)
        i = lines[i].parent = lines[lines[i].parent].parent;
    return i;
}

static void join(struct spl_line *lines, uint32_t i, uint32_t k)
{
    uint32_t a = root_of(lines, i), b = root_of(lines, k);
    if (a != b)
        lines[a > b ? a : b].parent = a < b ? a : b;
}

/* The cell that lies `steps` cells along the line, or UINT32_MAX. */
static uint32_t along(const struct spl_linear_level *l, const struct spl_line *line, const int64_t at[3], int steps)
{
    int64_t to[3];
    for (int c = 0; c < 3; c++)
        to[c] = at[c] + lround(line->middle[c] + steps * line->direction[c]);
    return spl_cells_find(&l->cells, to[0], to[1], to[2]);
}

/* The cell's neighbour number k of 27, and beyond them the two along the line, or UINT32_MAX. */
static uint32_t neighbour(const struct spl_linear_level *l, const struct spl_line *line, const int64_t at[3], int k)
{
    if (k >= 27)
        return along(l, line, at, k % 2 ? 2 : -2);
    return k == 13 ? UINT32_MAX
                   : spl_cells_find(&l->cells, at[0] + k % 3 - 1, at[1] + k / 3 % 3 - 1, at[2] + k / 9 - 1);
}

/* The line that goes on where this one ends at a gap, on `side` (-1, 1), or UINT32_MAX. `axis` goes from one to the
 * other, its middle as of this line's cell; `steps` is their distance, cells. */
static uint32_t continuation(const struct spl_linear_level *l, const struct spl_line *line, const int64_t at[3],
                             int side, struct spl_line *axis, int *steps)
{
    for (int n = 3; n <= gap_most; n++) {
        uint32_t cell = along(l, line, at, side * n), k = cell == UINT32_MAX ? 0 : l->owner[cell];
        int64_t there[3];
        double cosine = 0, own = 0, others = 0, length = 0;
        if (!k || l->lines[k - 1].cell != cell)
            continue;
        const struct spl_line *other = &l->lines[k - 1];
        spl_cells_place(&l->cells, cell, there);
        *axis = *line;
        for (int c = 0; c < 3; c++) {
            double d = (double)(there[c] - at[c]) + other->middle[c] - line->middle[c];
            length += d * d;
            own += d * line->direction[c];
            others += d * other->direction[c];
            cosine += (double)line->direction[c] * other->direction[c];
            axis->direction[c] = (float)d;
        }
        for (int c = 0; c < 3; c++)
            axis->direction[c] /= (float)sqrt(length);
        *steps = n;
        if (fabs(cosine) >= straight && fmin(fabs(own), fabs(others)) >= straight * sqrt(length))
            return k - 1;
    }
    return UINT32_MAX;
}

/* Lines whose cells touch, that share points of a cell between them, or that go on beyond a gap, are one piece. */
void spl_linear_connect(const struct spl_points *p, struct spl_linear_level *l)
{
    for (uint32_t i = 0; i < l->line_count; i++) {
        l->lines[i].parent = i;
        if (l->lines[i].state == SPL_LINE_ALIVE)
            l->owner[l->lines[i].cell] = i + 1;
    }
    for (uint32_t i = 0; i < l->line_count && !spl_stage_is_cancelled(l->stage); i++) {
        struct spl_line *line = &l->lines[i];
        int64_t at[3];
        if (i % look_grain == 0)
            spl_spill_keep_bound(p->spill);
        if (line->state != SPL_LINE_ALIVE)
            continue;
        spl_cells_place(&l->cells, line->cell, at);
        for (int k = 0; k < 29; k++) {
            uint32_t cell = neighbour(l, line, at, k);
            if (cell == UINT32_MAX || (!l->owner[cell] && !take_points(p, l, line, at, cell, look)))
                continue;
            if (!l->owner[cell])
                l->owner[cell] = i + 1;
            else if (l->lines[l->owner[cell] - 1].cell == cell || take_points(p, l, line, at, cell, look))
                join(l->lines, i, l->owner[cell] - 1);
        }
        for (int side = -1; side <= 1; side += 2) {
            struct spl_line axis;
            int steps;
            uint32_t other = continuation(l, line, at, side, &axis, &steps);
            if (other != UINT32_MAX)
                join(l->lines, i, other);
        }
    }
}

/* Marks the points of the pieces that are long enough. */
uint64_t spl_linear_mark(struct spl_points *p, struct spl_linear_level *l)
{
    uint64_t marked = 0;
    for (uint32_t i = 0; i < l->line_count; i++) {
        struct spl_line *line = &l->lines[i];
        int64_t at[3];
        if (i % look_grain == 0)
            spl_spill_keep_bound(p->spill);
        if (line->state == SPL_LINE_ALIVE || line->state == SPL_LINE_EDGE)
            continue;
        spl_cells_place(&l->cells, line->cell, at);
        take_points(p, l, line, at, line->cell, clear);
    }
    for (uint32_t i = 0; i < l->line_count; i++) {
        struct spl_line *line = &l->lines[i], *root = &l->lines[root_of(l->lines, i)];
        int64_t at[3];
        if (line->state != SPL_LINE_ALIVE)
            continue;
        spl_cells_place(&l->cells, line->cell, at);
        for (int c = 0; c < 3; c++) { /* a root comes before what hangs on it */
            double middle = (double)at[c] + line->middle[c];
            root->low[c] = root == line ? middle : fmin(root->low[c], middle);
            root->high[c] = root == line ? middle : fmax(root->high[c], middle);
        }
    }
    for (uint32_t i = 0; i < l->line_count && !spl_stage_is_cancelled(l->stage); i++) {
        struct spl_line *line = &l->lines[i];
        const struct spl_line *root = &l->lines[root_of(l->lines, i)];
        double squared = 0;
        int64_t at[3];
        if (i % look_grain == 0)
            spl_spill_keep_bound(p->spill);
        for (int c = 0; c < 3; c++)
            squared += (root->high[c] - root->low[c]) * (root->high[c] - root->low[c]);
        if (line->state != SPL_LINE_ALIVE || sqrt(squared) + 1 < l->length_min)
            continue;
        spl_cells_place(&l->cells, line->cell, at);
        marked += take_points(p, l, line, at, line->cell, mark);
        for (int k = 0; k < 29; k++) {
            uint32_t cell = neighbour(l, line, at, k);
            if (cell != UINT32_MAX && l->owner[cell] && l->lines[l->owner[cell] - 1].cell != cell)
                take_points(p, l, line, at, cell, mark);
        }
        for (int side = -1; side <= 1; side += 2) {
            struct spl_line axis;
            int steps = 0;
            if (continuation(l, line, at, side, &axis, &steps) == UINT32_MAX)
                continue;
            axis.spacing = INFINITY; /* of what a gap holds */
            for (int n = 1; n < steps; n++) {
                uint32_t cell = along(l, &axis, at, n);
                if (cell != UINT32_MAX && !l->is_line[cell])
                    take_points(p, l, &axis, at, cell, mark);
            }
        }
    }
    return marked;
}
