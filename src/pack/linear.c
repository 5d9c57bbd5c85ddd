/* Wires, poles and cables: what is long and thin beside its own spacing, and no line of a scanned surface.
 *
 * A pyramid of grids gives the adaptive radius: from cells that hold five points on the average, upwards, each cell is
 * judged by the spread of the points in it and its 26 neighbours (dimensionality after the principal components). It is
 * a line when they are long in one direction alone, and as thin as the finest cells. Then
 * - one that has other things beside it within two cells is the edge of a surface or a volume;
 * - lines that have two parallel ones on both sides in one plane are a surface's: far scan lines lie up to some fifty
 *   times their points' spacing apart. Those beside such lines are its border. A pair of wires is neither. Where a
 *   coarser level tells, it takes back what a finer one has found;
 * - cells beside a line take part in it with the points that lie on its axis: crossings, ends, joints;
 * - pieces that do not connect over `length_min` cells are dropped.
 * A level costs a quarter of the one below. Lists of lines are short beside the cloud, so what walks them runs on the
 * calling thread. */
#include "pack/linear.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "geom/eigen.h"
#include "pack/cells.h"

enum { levels_max = 6, points_min = 4, grain = 4096, bucket_bits = 12, parallel_min = 2, around_most = 3 };
static const double cell_points = 5;        /* of the finest level, on the average */
static const double length_min[2] = {6, 4}; /* cells, of a connected piece on the finest level, above */
static const float thin = 0.04f;            /* second invariant of the spread over the first's square: sigma 1 : 6 */
static const float own_surface = 0.21f;     /* the same within a cell, of which a square has 0.25 */
static const float along_min = 0.2f;        /* variance along a line, squared cells; 0.75 where it crosses all three */
static const double widest = 0.5;           /* sigma across, of the finest cells' edge */
static const double apart_most = 100;       /* spacings within which a surface has two more scan lines on a side */
static const double lateral_reach = 12, lateral_least = 1.2; /* cells within which a line's neighbours are looked for */

enum state { line_alive, line_inner, line_border, line_edge };

struct line {
    uint32_t cell;
    float middle[3];    /* of the points around, cells from the cell's middle */
    float direction[3]; /* unit */
    float across;       /* sigma, cells */
    float spacing;      /* of points along it, cells */
    uint8_t state, next_state;
    uint32_t parent; /* of a union-find forest; root: itself */
    double low[3], high[3];
};

struct level {
    struct spl_cells cells;
    uint8_t *is_line; /* of each cell */
    struct line *lines;
    uint32_t line_count;
    uint32_t *bucket, bucket_count; /* first line of each run with equal key >> bucket_bits, and the end */
    uint32_t *owner;                /* of each cell: line + 1 that it belongs to, or 0 */
    double across_max, length_min;  /* cells */
    bool border;                    /* the second round of lateral checks */
};

/* Spread of sums about their mean. */
static void covariance(const struct spl_cell_sums *s, float m[6])
{
    static const int row[6] = {0, 0, 0, 1, 1, 2}, column[6] = {0, 1, 2, 1, 2, 2};
    float inverse = 1 / s->count;
    for (int e = 0; e < 6; e++)
        m[e] = s->square[e] * inverse - s->sum[row[e]] * s->sum[column[e]] * inverse * inverse;
}

static void invariants(const float m[6], float *first, float *second)
{
    *first = m[0] + m[3] + m[5];
    *second = m[0] * m[3] + m[0] * m[5] + m[3] * m[5] - m[1] * m[1] - m[2] * m[2] - m[4] * m[4];
}

static bool judge(const struct level *l, uint32_t cell)
{
    const struct spl_cell_sums *own = &l->cells.cells[cell].sums;
    float m[6], first, second;
    if (own->count == 0)
        return false;
    if (own->count >= 8) {
        covariance(own, m);
        invariants(m, &first, &second);
        if (second > own_surface * first * first)
            return false;
    }
    struct spl_cell_sums around = spl_cells_around(&l->cells, cell);
    if (around.count < points_min)
        return false;
    covariance(&around, m);
    invariants(m, &first, &second);
    return first >= along_min && second <= thin * first * first &&
           second <= 2 * first * (float)(l->across_max * l->across_max);
}

static void judge_cells(void *context, size_t begin, size_t end, unsigned worker)
{
    struct level *l = context;
    (void)worker;
    for (size_t k = begin; k < end; k++)
        l->is_line[k] = judge(l, (uint32_t)k);
}

static void fit_lines(void *context, size_t begin, size_t end, unsigned worker)
{
    struct level *l = context;
    (void)worker;
    for (size_t i = begin; i < end; i++) {
        struct line *line = &l->lines[i];
        struct spl_cell_sums around = spl_cells_around(&l->cells, line->cell);
        float m[6];
        double wide[6], values[3], least[3], most[3];
        covariance(&around, m);
        for (int e = 0; e < 6; e++)
            wide[e] = m[e];
        spl_eigen_symmetric(wide, values, least, most);
        for (int c = 0; c < 3; c++) {
            line->middle[c] = around.sum[c] / around.count;
            line->direction[c] = (float)most[c];
        }
        line->across = (float)sqrt(fmax(0, values[0]) + fmax(0, values[1]));
        line->spacing = (float)(sqrt(12 * values[2])) / around.count;
    }
}

static int find_lines(struct level *l, unsigned threads, struct spl_error *err)
{
    uint32_t count = 0;
    l->is_line = spl_alloc(l->cells.count, 1, err);
    if (!l->is_line)
        return SPL_E_NOMEM;
    spl_parallel_for(threads, l->cells.count, grain, judge_cells, l);
    for (uint32_t k = 0; k < l->cells.count; k++)
        count += l->is_line[k];
    l->lines = spl_alloc(count, sizeof *l->lines, err);
    l->bucket = spl_alloc((size_t)count + 1, sizeof *l->bucket, err);
    if (!l->lines || !l->bucket)
        return SPL_E_NOMEM;
    for (uint32_t k = 0; k < l->cells.count; k++)
        if (l->is_line[k])
            l->lines[l->line_count++] = (struct line){.cell = k};
    for (uint32_t i = 0; i < count; i++)
        if (i == 0 || l->cells.cells[l->lines[i].cell].key >> bucket_bits !=
                          l->cells.cells[l->lines[i - 1].cell].key >> bucket_bits)
            l->bucket[l->bucket_count++] = i;
    l->bucket[l->bucket_count] = count;
    spl_parallel_for(threads, count, grain, fit_lines, l);
    return 0;
}

static uint32_t find_bucket(const struct level *l, uint64_t key)
{
    uint32_t low = 0, high = l->bucket_count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        uint64_t at = l->cells.cells[l->lines[l->bucket[middle]].cell].key >> bucket_bits;
        if (at == key)
            return middle;
        if (at < key)
            low = middle + 1;
        else
            high = middle;
    }
    return UINT32_MAX;
}

struct sides {
    double axis[3];    /* across the line, towards the first parallel one that was found; 0 before */
    uint32_t place[2]; /* of those on either side, a bit each lateral_least of their distance */
    unsigned found, surface;
};

/* How many lines a side's places are: neighbouring places may be one line's. */
static unsigned count_parallel(uint32_t place)
{
    unsigned lines = 0;
    while (place) {
        unsigned first = (unsigned)__builtin_ctz(place), length = (unsigned)__builtin_ctz(~(place >> first));
        lines += (length + 1) / 2;
        place &= ~(((1u << length) - 1) << first);
    }
    return lines;
}

/* Counts `other` when it runs beside `line`, in the plane of those that do. */
static void add_side(struct sides *sides, const struct line *line, const struct line *other, const double shift[3],
                     double reach)
{
    double cosine = 0, along = 0, squared = 0, q[3], beside = 0;
    for (int c = 0; c < 3; c++) {
        q[c] = shift[c] + other->middle[c] - line->middle[c];
        cosine += (double)line->direction[c] * other->direction[c];
        along += q[c] * line->direction[c];
    }
    if (fabs(cosine) < 0.94 || fabs(along) > 3)
        return;
    for (int c = 0; c < 3; c++) {
        q[c] -= along * line->direction[c];
        squared += q[c] * q[c];
    }
    if (squared < lateral_least * lateral_least || squared > reach * reach)
        return;
    if (!sides->found)
        for (int c = 0; c < 3; c++)
            sides->axis[c] = q[c] / sqrt(squared);
    for (int c = 0; c < 3; c++)
        beside += q[c] * sides->axis[c];
    if (beside * beside < 0.8 * squared)
        return;
    sides->place[beside < 0] |= 1u << (unsigned)(fabs(beside) / lateral_least);
    sides->found++;
    sides->surface += other->state != line_alive;
}

static void check_sides(void *context, size_t begin, size_t end, unsigned worker)
{
    struct level *l = context;
    (void)worker;
    for (size_t i = begin; i < end; i++) {
        struct line *line = &l->lines[i];
        struct sides sides = {0};
        double reach = fmin(apart_most * line->spacing, lateral_reach);
        line->next_state = line->state;
        if (line->state != line_alive || reach <= lateral_least)
            continue;
        int64_t at[3], there[3];
        spl_cells_place(&l->cells, line->cell, at);
        /* its own bucket first, as the answer is often there */
        for (int b = 0; b < 27; b++) {
            int k = (b + 13) % 27;
            int64_t x = (at[0] >> 4) + k % 3 - 1, y = (at[1] >> 4) + k / 3 % 3 - 1, z = (at[2] >> 4) + k / 9 - 1;
            if (x < 0 || y < 0 || z < 0)
                continue;
            uint32_t bucket = find_bucket(l, spl_cells_key(x, y, z));
            for (uint32_t j = bucket == UINT32_MAX ? 0 : l->bucket[bucket];
                 bucket != UINT32_MAX && j < l->bucket[bucket + 1]; j++) {
                double shift[3];
                spl_cells_place(&l->cells, l->lines[j].cell, there);
                for (int c = 0; c < 3; c++)
                    shift[c] = (double)(there[c] - at[c]);
                add_side(&sides, line, &l->lines[j], shift, reach);
            }
            if (!l->border && count_parallel(sides.place[0]) >= parallel_min &&
                count_parallel(sides.place[1]) >= parallel_min) {
                line->next_state = line_inner;
                break;
            }
        }
        if (l->border && sides.found && 2 * sides.surface > sides.found)
            line->next_state = line_border;
    }
}

/* Whether what lies around a line's 27 cells is a surface's or a volume's more than other lines'. */
static bool is_edge(const struct level *l, const struct line *line)
{
    int64_t at[3];
    unsigned other = 0;
    spl_cells_place(&l->cells, line->cell, at);
    for (int k = 0; k < 125; k++) {
        int d[3] = {k % 5 - 2, k / 5 % 5 - 2, k / 25 - 2};
        if (abs(d[0]) < 2 && abs(d[1]) < 2 && abs(d[2]) < 2)
            continue;
        double along = 0, squared = 0;
        for (int c = 0; c < 3; c++) {
            along += (d[c] - line->middle[c]) * line->direction[c];
            squared += (d[c] - line->middle[c]) * (d[c] - line->middle[c]);
        }
        if (squared - along * along < lateral_least * lateral_least)
            continue; /* its own continuation */
        uint32_t cell = spl_cells_find(&l->cells, at[0] + d[0], at[1] + d[1], at[2] + d[2]);
        other += cell != UINT32_MAX && !l->is_line[cell];
    }
    return other > around_most;
}

static void check_edges(void *context, size_t begin, size_t end, unsigned worker)
{
    struct level *l = context;
    (void)worker;
    for (size_t i = begin; i < end; i++)
        l->lines[i].state = is_edge(l, &l->lines[i]) ? line_edge : line_alive;
}

static void drop_surfaces(struct level *l, unsigned threads)
{
    spl_parallel_for(threads, l->line_count, 256, check_edges, l);
    for (int round = 0; round < 3; round++) {
        l->border = round > 0;
        spl_parallel_for(threads, l->line_count, 256, check_sides, l);
        for (uint32_t i = 0; i < l->line_count; i++)
            l->lines[i].state = l->lines[i].next_state;
    }
}

enum { look, clear, mark };

/* Looks for, clears or marks the points of `cell` on the axis of `line`, whose own cell lies at `at`. */
static bool take_points(struct spl_points *p, const struct level *l, const struct line *line, const int64_t at[3],
                        uint32_t cell, int what)
{
    double origin[3], inverse = 1 / l->cells.edge, limit = fmax(3 * line->across, 0.15);
    bool any = false;
    for (int c = 0; c < 3; c++)
        origin[c] = p->bounds_min[c] + ((double)at[c] + 0.5 + line->middle[c]) * l->cells.edge;
    for (size_t i = l->cells.cells[cell].begin; i < l->cells.cells[cell + 1].begin; i++) {
        double along = 0, squared = 0;
        for (int c = 0; c < 3; c++) {
            double d = (p->axis[c][i] - origin[c]) * inverse;
            squared += d * d;
            along += d * line->direction[c];
        }
        if (squared - along * along > limit * limit)
            continue;
        any = true;
        if (what == look)
            break;
        p->linear[i] = what == mark;
    }
    return any;
}

static uint32_t root_of(struct line *lines, uint32_t i)
{
    while (lines[i].parent != i)
        i = lines[i].parent = lines[lines[i].parent].parent;
    return i;
}

static void join(struct line *lines, uint32_t i, uint32_t k)
{
    uint32_t a = root_of(lines, i), b = root_of(lines, k);
    if (a != b)
        lines[a > b ? a : b].parent = a < b ? a : b;
}

/* The cell's neighbour number k of 27, and beyond them the `near` ones and farther ones along the line, or UINT32_MAX.
 */
static uint32_t neighbour(const struct level *l, const struct line *line, const int64_t at[3], int k)
{
    if (k >= 27) {
        int64_t to[3];
        for (int c = 0; c < 3; c++)
            to[c] = at[c] + lround(line->middle[c] + (k % 2 ? 1 : -1) * (2 + (k - 27) / 2) * line->direction[c]);
        return spl_cells_find(&l->cells, to[0], to[1], to[2]);
    }

    return k == 13 ? UINT32_MAX
                   : spl_cells_find(&l->cells, at[0] + k % 3 - 1, at[1] + k / 3 % 3 - 1, at[2] + k / 9 - 1);
}

/* Lines whose cells touch, or that share points of a cell between them, are one piece. */
static void connect(struct spl_points *p, struct level *l)
{
    for (uint32_t i = 0; i < l->line_count; i++) {
        l->lines[i].parent = i;
        if (l->lines[i].state == line_alive)
            l->owner[l->lines[i].cell] = i + 1;
    }
    for (uint32_t i = 0; i < l->line_count; i++) {
        struct line *line = &l->lines[i];
        int64_t at[3];
        if (line->state != line_alive)
            continue;
        spl_cells_place(&l->cells, line->cell, at);
        for (int k = 0; k < 33; k++) {
            uint32_t cell = neighbour(l, line, at, k);
            if (cell == UINT32_MAX || (!l->owner[cell] && (k >= 29 || !take_points(p, l, line, at, cell, look))))
                continue;
            if (!l->owner[cell])
                l->owner[cell] = i + 1;
            else if (l->lines[l->owner[cell] - 1].cell == cell || take_points(p, l, line, at, cell, look))
                join(l->lines, i, l->owner[cell] - 1);
        }
    }
}

/* Marks the points of the pieces that are long enough. */
static uint64_t mark_pieces(struct spl_points *p, struct level *l)
{
    uint64_t marked = 0;
    for (uint32_t i = 0; i < l->line_count; i++) {
        struct line *line = &l->lines[i];
        int64_t at[3];
        if (line->state == line_alive || line->state == line_edge)
            continue;
        spl_cells_place(&l->cells, line->cell, at);
        take_points(p, l, line, at, line->cell, clear);
    }
    for (uint32_t i = 0; i < l->line_count; i++) {
        struct line *line = &l->lines[i], *root = &l->lines[root_of(l->lines, i)];
        int64_t at[3];
        if (line->state != line_alive)
            continue;
        spl_cells_place(&l->cells, line->cell, at);
        for (int c = 0; c < 3; c++) { /* a root comes before what hangs on it */
            double middle = (double)at[c] + line->middle[c];
            root->low[c] = root == line ? middle : fmin(root->low[c], middle);
            root->high[c] = root == line ? middle : fmax(root->high[c], middle);
        }
    }
    for (uint32_t i = 0; i < l->line_count; i++) {
        struct line *line = &l->lines[i];
        const struct line *root = &l->lines[root_of(l->lines, i)];
        double squared = 0;
        int64_t at[3];
        for (int c = 0; c < 3; c++)
            squared += (root->high[c] - root->low[c]) * (root->high[c] - root->low[c]);
        if (line->state != line_alive || sqrt(squared) + 1 < l->length_min)
            continue;
        spl_cells_place(&l->cells, line->cell, at);
        marked += take_points(p, l, line, at, line->cell, mark);
        for (int k = 0; k < 33; k++) {
            uint32_t cell = neighbour(l, line, at, k);
            if (cell != UINT32_MAX && l->owner[cell] && l->lines[l->owner[cell] - 1].cell != cell)
                take_points(p, l, line, at, cell, mark);
        }
    }
    return marked;
}

static void finish_level(struct level *l)
{
    spl_cells_finish(&l->cells);
    free(l->is_line);
    free(l->lines);
    free(l->bucket);
    free(l->owner);
    *l = (struct level){0};
}

static int search_level(struct spl_points *points, struct level *l, unsigned threads, uint64_t *marked,
                        struct spl_error *err)
{
    int rc = find_lines(l, threads, err);
    if (rc || !l->line_count)
        return rc;
    drop_surfaces(l, threads);
    l->owner = spl_alloc(l->cells.count, sizeof *l->owner, err);
    if (!l->owner)
        return SPL_E_NOMEM;
    connect(points, l);
    *marked += mark_pieces(points, l);
    return 0;
}

int spl_linear_find(struct spl_points *points, struct spl_stage *stage, struct spl_error *err)
{
    struct level l = {0}, above = {0};
    uint64_t marked = 0;
    double finest = 0;
    spl_stage_begin(stage, "wires, poles and cables", levels_max);
    points->linear = spl_alloc(points->count, 1, err);
    int rc = points->linear ? spl_cells_init(&l.cells, points, cell_points, stage->threads, err) : SPL_E_NOMEM;
    for (unsigned k = 0; !rc && k < levels_max; k++) {
        if (k == 0)
            finest = l.cells.edge;
        l.across_max = widest * finest / l.cells.edge;
        l.length_min = length_min[k > 0];
        rc = search_level(points, &l, stage->threads, &marked, err);
        spl_stage_add(stage, 1, 0);
        if (rc || l.cells.count < 8 || l.cells.shift + 1 > SPL_CELLS_SHIFT_MAX || k + 1 == levels_max)
            break;
        rc = spl_cells_init_above(&above.cells, &l.cells, stage->threads, err);
        finish_level(&l);
        l = above;
        above = (struct level){0};
    }
    finish_level(&l);
    if (rc || !marked) {
        free(points->linear);
        points->linear = NULL;
    }
    spl_stage_finish(stage);
    return rc;
}
