/* Lines that are none: edges, and scan lines of a surface. A line with other things beside it within two cells is the
 * edge of a surface or a volume. Lines with two parallel ones on both sides in one plane are a surface's: far scan
 * lines lie up to some 150 times their points' spacing apart. Those beside such lines are its border. A pair of wires
 * is neither. Lines are found by buckets of their cells' keys; each is judged by itself, in rounds that see the states
 * of the round before. */
#include <math.h>
#include <stdlib.h>

#include "base/parallel.h"
#include "pack/linear_level.h"

enum { parallel_min = 2, around_most = 3 };
static const double apart_most = 300;   /* spacings within which a surface has two more scan lines on a side */
static const double lateral_reach = 12; /* cells within which a line's neighbours are looked for */

static uint32_t find_bucket(const struct spl_linear_level *l, uint64_t key)
{
    uint32_t low = 0, high = l->bucket_count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        uint64_t at = l->cells.cells[l->lines[l->bucket[middle]].cell].key >> SPL_LINE_BUCKET_BITS;
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
    uint32_t place[2]; /* of those on either side, a bit each SPL_LINE_BESIDE of their distance */
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
static void add_side(struct sides *sides, const struct spl_line *line, const struct spl_line *other,
                     const double shift[3], double reach)
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
    if (squared < SPL_LINE_BESIDE * SPL_LINE_BESIDE || squared > reach * reach)
        return;
    if (!sides->found)
        for (int c = 0; c < 3; c++)
            sides->axis[c] = q[c] / sqrt(squared);
    for (int c = 0; c < 3; c++)
        beside += q[c] * sides->axis[c];
    if (beside * beside < 0.8 * squared)
        return;
    sides->place[beside < 0] |= 1u << (unsigned)(fabs(beside) / SPL_LINE_BESIDE);
    sides->found++;
    sides->surface += other->state != SPL_LINE_ALIVE;
}

static void check_sides(void *context, size_t begin, size_t end, unsigned worker)
{
    struct spl_linear_level *l = context;
    (void)worker;
    for (size_t i = begin; i < end && !spl_stage_is_cancelled(l->stage); i++) {
        struct spl_line *line = &l->lines[i];
        struct sides sides = {0};
        double reach = fmin(apart_most * line->spacing, lateral_reach);
        line->next_state = line->state;
        if (line->state != SPL_LINE_ALIVE || reach <= SPL_LINE_BESIDE)
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
                line->next_state = SPL_LINE_INNER;
                break;
            }
        }
        if (l->border && sides.found && 2 * sides.surface > sides.found)
            line->next_state = SPL_LINE_BORDER;
        line->beside_surface = sides.surface;
    }
}

/* Whether what lies around a line's 27 cells is a surface's or a volume's more than other lines'. */
static bool is_edge(const struct spl_linear_level *l, const struct spl_line *line)
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
        if (squared - along * along < SPL_LINE_BESIDE * SPL_LINE_BESIDE)
            continue; /* its own continuation */
        uint32_t cell = spl_cells_find(&l->cells, at[0] + d[0], at[1] + d[1], at[2] + d[2]);
        other += cell != UINT32_MAX && !l->is_line[cell];
    }
    return other > around_most;
}

static void check_edges(void *context, size_t begin, size_t end, unsigned worker)
{
    struct spl_linear_level *l = context;
    (void)worker;
    for (size_t i = begin; i < end && !spl_stage_is_cancelled(l->stage); i++)
        l->lines[i].state = is_edge(l, &l->lines[i]) ? SPL_LINE_EDGE : SPL_LINE_ALIVE;
}

void spl_linear_drop_surfaces(struct spl_linear_level *l)
{
    unsigned threads = l->stage->threads;
    spl_parallel_for(threads, l->line_count, 256, check_edges, l);
    for (int round = 0; round < 3; round++) {
        l->border = round > 0;
        spl_parallel_for(threads, l->line_count, 256, check_sides, l);
        for (uint32_t i = 0; i < l->line_count; i++)
            l->lines[i].state = l->lines[i].next_state;
    }
}
