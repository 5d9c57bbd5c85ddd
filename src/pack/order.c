/* Morton order over the cubic bounds, and exact duplicates out: of equal coordinates the point stays that has a
 * station, a normal, the greater class and colour, and so on. The order is that of the points, not that in which they
 * were read.
 *
 * A stable parallel radix sort of (key, index) pairs: by the first bits of their keys into parts (pieces count, one
 * prefix sum, pieces scatter), then each part digit by digit, by one worker and in so little memory that it is near. So
 * the result does not depend on the number of threads. Equal keys (a cell of 2^-21 of the cloud) are ordered within
 * their own bounds, recursively, so that a dense cluster in a wide cloud is as well ordered as any other; equal
 * coordinates can only lie in one such run. Beside one stray point far away that can be all the others: a long run is
 * sorted as the whole is, by all threads and within the same arrays, a short one by one worker, on the heap. */
#include "pack/points.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "geom/morton.h"
#include "pack/order.h"

enum { digits = 256, threads_max = 64, short_run = 32, long_run = 1 << 16, grain = 1 << 16 };
/* Each element of these may be in a page of its own, which comes with fifteen others. */
enum { random_grain = 256 };
enum { lead_bits = 16, leads = 1 << lead_bits, lead_shift = 63 - lead_bits, parts_most = 1024 };
static const uint32_t dropped = UINT32_MAX;

struct run { /* points of equal keys; at first all points */
    size_t begin, count;
};

struct order {
    struct spl_points *points;
    uint64_t *key, *key_to; /* of the run at work, as all below */
    uint32_t *index, *index_to;
    void *spare_of_8, *spare_of_4; /* arrays that are left over, by the size of their elements */
    size_t begin, count, piece;
    double origin[3], size; /* of its cube */
    struct run *runs;       /* long ones that wait: room for all that there can be */
    atomic_size_t run_count;
    unsigned pieces, part_count;
    uint32_t (*leads)[leads];       /* of each piece: points by the first bits of their keys */
    uint32_t (*at)[parts_most + 2]; /* of each piece: where its next point of a part goes */
    uint16_t *part_of;              /* of each lead */
    size_t first[parts_most + 3];   /* points of parts */
    double low[threads_max][3], high[threads_max][3];
    struct spl_stage *stage;
    atomic_bool failed;
};

static void bounds_piece(void *context, size_t begin, size_t end, unsigned worker)
{
    struct order *o = context;
    spl_spill_keep_bound(o->points->spill);
    for (int c = 0; c < 3; c++) {
        const double *v = o->points->axis[c];
        double low = o->low[worker][c], high = o->high[worker][c];
        for (size_t i = begin; i < end; i++) {
            double at = v[o->index[i]];
            low = at < low ? at : low;
            high = at > high ? at : high;
        }
        o->low[worker][c] = low;
        o->high[worker][c] = high;
    }
}

/* Around the run at work; its far corner goes to `high`. */
static void find_cube(struct order *o, double high[3])
{
    for (unsigned t = 0; t < threads_max; t++)
        for (int c = 0; c < 3; c++)
            o->low[t][c] = o->high[t][c] = o->points->axis[c][o->index[0]];
    spl_parallel_for(o->stage->threads, o->count, grain, bounds_piece, o);
    o->size = 0;
    for (int c = 0; c < 3; c++) {
        o->origin[c] = o->low[0][c];
        high[c] = o->high[0][c];
        for (unsigned t = 1; t < threads_max; t++) {
            o->origin[c] = fmin(o->origin[c], o->low[t][c]);
            high[c] = fmax(high[c], o->high[t][c]);
        }
        o->size = fmax(o->size, high[c] - o->origin[c]);
    }
}

/* Of a part: cells of all parts lie at the same places, up to those of as many levels as wires are looked for on. Where
 * coordinates are round numbers floors and walls lie: none of the larger cells may end there, for a surface on both
 * sides of such an end is ordered as two that are far apart. So all cells are moved by `aside`, which is exact. */
static void align_cube(struct order *o)
{
    struct spl_points *p = o->points;
    const double step = p->cells * SPL_CELLS_ALIGNED;
    const double aside = 1365.0 / 4096; /* a third in few bits: of cells half as large it is one or two thirds again */
    double size = step;
    for (int c = 0; c < 3; c++) {
        o->origin[c] = p->cube_min[c] = (floor(p->bounds_min[c] / step - aside) + aside) * step;
        while (!(size > p->bounds_max[c] - o->origin[c]))
            size *= 2;
    }
    p->cube_size = o->size = size;
}

static void find_whole_cube(struct order *o)
{
    struct spl_points *p = o->points;
    find_cube(o, p->bounds_max);
    memcpy(p->bounds_min, o->origin, sizeof p->bounds_min);
    memcpy(p->cube_min, o->origin, sizeof p->cube_min);
    if (p->cells > 0) {
        align_cube(o);
        return;
    }
    /* The next float up, as the container keeps it: the cube of the file is the cube of the keys. */
    p->cube_size = o->size = o->size > 0 ? nextafterf((float)o->size, INFINITY) : 1;
}

uint64_t spl_points_key(const struct spl_points *points, size_t i, const double low[3], double size)
{
    uint32_t cell[3];
    for (int c = 0; c < 3; c++)
        cell[c] = spl_morton_cell(spl_points_at(points, c, i), low[c], size);
    return spl_morton_encode(cell[0], cell[1], cell[2]);
}

static void number_piece(void *context, size_t begin, size_t end, unsigned worker)
{
    struct order *o = context;
    (void)worker;
    spl_spill_keep_bound(o->points->spill);
    for (size_t i = begin; i < end; i++)
        o->index[i] = (uint32_t)i;
}

/* Where runs are sorted again the stage's end has been reached by then. */
static void add_done(struct order *o, size_t points, unsigned worker)
{
    if (o->count == o->points->count)
        spl_stage_add(o->stage, points, worker);
    else
        spl_spill_keep_bound(o->points->spill);
}

static void key_piece(void *context, size_t begin, size_t end, unsigned worker)
{
    struct order *o = context;
    for (size_t i = begin; i < end; i++)
        o->key[i] = spl_points_key(o->points, o->index[i], o->origin, o->size);
    add_done(o, (end - begin) / 8, worker);
}

/* How many points of a piece begin with each lead. */
static void count_piece(void *context, size_t begin, size_t end, unsigned worker)
{
    struct order *o = context;
    uint32_t *count = o->leads[begin / o->piece];
    (void)worker;
    memset(count, 0, sizeof *o->leads);
    for (size_t i = begin; i < end; i++)
        count[o->key[i] >> lead_shift]++;
}

static void scatter_piece(void *context, size_t begin, size_t end, unsigned worker)
{
    struct order *o = context;
    uint32_t *at = o->at[begin / o->piece];
    (void)worker;
    for (size_t i = begin; i < end; i++) {
        if (i % random_grain == 0)
            spl_spill_keep_bound(o->points->spill);
        uint32_t to = at[o->part_of[o->key[i] >> lead_shift]]++;
        o->key_to[to] = o->key[i];
        o->index_to[to] = o->index[i];
    }
}

/* Parts: runs of leads with about as many points each, however unevenly these lie. */
static void divide(struct order *o)
{
    size_t most = 2 * o->count / parts_most + 1, in_part = 0, sum = 0;
    o->part_count = 0;
    for (size_t lead = 0; lead < leads; lead++) {
        size_t points = 0;
        for (unsigned t = 0; t < o->pieces; t++)
            points += o->leads[t][lead];
        if (!lead || (in_part && in_part + points > most)) {
            for (unsigned t = 0; t < o->pieces; t++)
                o->at[t][o->part_count] = 0;
            o->first[o->part_count++] = sum;
            in_part = 0;
        }
        o->part_of[lead] = (uint16_t)(o->part_count - 1);
        in_part += points;
        sum += points;
        for (unsigned t = 0; t < o->pieces; t++)
            o->at[t][o->part_count - 1] += o->leads[t][lead];
    }
    o->first[o->part_count] = sum;
    for (unsigned part = 0; part < o->part_count; part++) {
        uint32_t at = (uint32_t)o->first[part];
        for (unsigned t = 0; t < o->pieces; t++) {
            uint32_t n = o->at[t][part];
            o->at[t][part] = at;
            at += n;
        }
    }
}

/* Digit by digit from the last on, between the two pairs of arrays. */
static void sort_part(struct order *o, size_t begin, size_t end)
{
    uint32_t count[8][digits] = {0};
    uint64_t *key = o->key_to, *key_to = o->key;
    uint32_t *index = o->index_to, *index_to = o->index;
    for (size_t i = begin; i < end; i++) {
        if (i % grain == 0)
            spl_spill_keep_bound(o->points->spill);
        for (unsigned d = 0; d < 8; d++)
            count[d][key[i] >> 8 * d & (digits - 1)]++;
    }
    for (unsigned d = 0; d < 8; d++) {
        uint32_t *at = count[d], sum = (uint32_t)begin;
        if (at[key[begin] >> 8 * d & (digits - 1)] == end - begin)
            continue;
        for (unsigned v = 0; v < digits; v++) {
            uint32_t n = at[v];
            at[v] = sum;
            sum += n;
        }
        for (size_t i = begin; i < end; i++) {
            if (i % grain == 0)
                spl_spill_keep_bound(o->points->spill);
            uint32_t to = at[key[i] >> 8 * d & (digits - 1)]++;
            key_to[to] = key[i];
            index_to[to] = index[i];
        }
        uint64_t *other_key = key;
        uint32_t *other_index = index;
        key = key_to;
        index = index_to;
        key_to = other_key;
        index_to = other_index;
    }
    for (size_t i = begin, some; key != o->key && i < end; i += some) {
        some = end - i < grain ? end - i : grain;
        spl_spill_keep_bound(o->points->spill);
        memcpy(o->key + i, key + i, some * sizeof *key);
        memcpy(o->index + i, index + i, some * sizeof *index);
    }
}

static void sort_parts(void *context, size_t begin, size_t end, unsigned worker)
{
    struct order *o = context;
    for (size_t part = begin; part < end; part++) {
        if (o->first[part + 1] > o->first[part])
            sort_part(o, o->first[part], o->first[part + 1]);
        add_done(o, (o->first[part + 1] - o->first[part]) / 2, worker);
    }
}

static void radix_sort(struct order *o)
{
    o->piece = (o->count + o->stage->threads - 1) / o->stage->threads;
    o->piece = o->piece < grain ? grain : o->piece;
    o->pieces = (unsigned)((o->count + o->piece - 1) / o->piece); /* fewer than threads, where there are few points */
    spl_parallel_for(o->stage->threads, o->count, o->piece, count_piece, o);
    divide(o);
    spl_parallel_for(o->stage->threads, o->count, o->piece, scatter_piece, o);
    spl_parallel_for(o->stage->threads, o->part_count, 1, sort_parts, o);
}

struct pair { /* of a short run */
    uint64_t key;
    uint32_t index;
};

static int compare_whole(uint32_t a, uint32_t b)
{
    return (a > b) - (a < b);
}

static int compare_reals(double a, double b)
{
    return (a > b) - (a < b);
}

static int compare_pairs(const void *a, const void *b)
{
    const struct pair *p = a, *q = b;
    if (p->key != q->key)
        return p->key < q->key ? -1 : 1;
    return p->index < q->index ? -1 : p->index > q->index;
}

/* Which of two points at one place comes first: by what they have beside it. 0 where that is the same too. */
static int compare_points(const struct spl_points *p, uint32_t a, uint32_t b)
{
    int order = p->station ? compare_whole(p->station[a], p->station[b]) : 0; /* SPL_NO_STATION is the greatest */
    for (int c = 0; p->normal && !order && c < 3; c++)
        order = compare_reals((double)p->normal[b][c], (double)p->normal[a][c]);
    if (!order)
        order = compare_whole(p->color_class[b], p->color_class[a]);
    for (int s = 0; !order && s < SPL_POINT_SCALARS; s++)
        if (p->scalar[s].values)
            order = compare_whole(spl_scalar_number(&p->scalar[s], a), spl_scalar_number(&p->scalar[s], b));
    return order;
}

/* Of points at one place. */
static void keep_one(const struct spl_points *p, uint32_t *index, size_t n)
{
    for (size_t i = 1; i < n; i++) {
        if (i % random_grain == 0)
            spl_spill_keep_bound(p->spill);
        index[0] = compare_points(p, index[i], index[0]) < 0 ? index[i] : index[0];
        index[i] = dropped;
    }
}

/* Each level divides the extent by 2^21, so doubles end the recursion after a few. `index` is ascending at first, and
 * so is each run of equal keys. */
static void order_run(struct order *o, uint32_t *index, size_t n)
{
    const struct spl_points *p = o->points;
    double low[3], size = 0;
    spl_spill_keep_bound(p->spill);
    for (int c = 0; c < 3; c++) {
        double high = low[c] = p->axis[c][index[0]];
        for (size_t i = 1; i < n; i++) {
            double v = p->axis[c][index[i]];
            low[c] = v < low[c] ? v : low[c];
            high = v > high ? v : high;
        }
        size = fmax(size, high - low[c]);
    }
    if (size == 0) {
        keep_one(p, index, n);
        return;
    }
    struct pair few[short_run], *many = n <= short_run ? NULL : spl_alloc_raw(n, sizeof *many, NULL);
    struct pair *pairs = n <= short_run ? few : many;
    if (!pairs) {
        atomic_store(&o->failed, true);
        return;
    }
    for (size_t i = 0; i < n; i++)
        pairs[i] = (struct pair){spl_points_key(p, index[i], low, size), index[i]};
    qsort(pairs, n, sizeof *pairs, compare_pairs);
    for (size_t i = 0; i < n; i++)
        index[i] = pairs[i].index;
    for (size_t i = 0, end; i < n; i = end) {
        for (end = i + 1; end < n && pairs[end].key == pairs[i].key;)
            end++;
        if (end - i > 1)
            order_run(o, index + i, end - i);
    }
    free(many);
}

/* A piece does the runs that begin in it. */
static void runs_piece(void *context, size_t begin, size_t end, unsigned worker)
{
    struct order *o = context;
    size_t i = begin;
    while (i < end && i > 0 && o->key[i] == o->key[i - 1])
        i++;
    for (size_t next; i < end; i = next) {
        for (next = i + 1; next < o->count && o->key[next] == o->key[i]; next++)
            if (next % grain == 0)
                spl_spill_keep_bound(o->points->spill);
        if (next - i > long_run)
            o->runs[atomic_fetch_add(&o->run_count, 1)] = (struct run){o->begin + i, next - i};
        else if (next - i > 1)
            order_run(o, o->index + i, next - i);
    }
    add_done(o, (end - begin) / 8, worker);
}

/* Makes another run that at work. */
static void enter(struct order *o, struct run run)
{
    ptrdiff_t by = (ptrdiff_t)run.begin - (ptrdiff_t)o->begin;
    o->key += by;
    o->key_to += by;
    o->index += by;
    o->index_to += by;
    o->begin = run.begin;
    o->count = run.count;
}

/* Orders the run at work within its cube; what is left of it are runs. */
static void order_in_cube(struct order *o)
{
    spl_parallel_for(o->stage->threads, o->count, grain, key_piece, o);
    radix_sort(o);
    spl_parallel_for(o->stage->threads, o->count, grain, runs_piece, o);
}

static void order_all(struct order *o)
{
    const struct run all = {0, o->count};
    double high[3];
    spl_parallel_for(o->stage->threads, o->count, grain, number_piece, o);
    find_whole_cube(o);
    order_in_cube(o);
    while (o->run_count) {
        enter(o, o->runs[--o->run_count]);
        find_cube(o, high);
        if (o->size > 0)
            order_in_cube(o);
        else
            keep_one(o->points, o->index, o->count);
    }
    enter(o, all);
}

struct permutation {
    struct spl_spill *spill;
    const uint32_t *index;
    const char *from;
    char *to;
    size_t size;
};

static void permute_piece(void *context, size_t begin, size_t end, unsigned worker)
{
    struct permutation *p = context;
    (void)worker;
    spl_spill_keep_bound(p->spill);
    if (p->size == 8) {
        for (size_t i = begin; i < end; i++)
            ((uint64_t *)p->to)[i] = ((const uint64_t *)p->from)[p->index[i]];
    } else {
        for (size_t i = begin; i < end; i++)
            memcpy(p->to + i * p->size, p->from + p->index[i] * p->size, p->size);
    }
}

/* What an array is permuted into: one that was left over, of elements as large, or a new one. What the array was is
 * left over then. So the kernel need not clear new memory for each. */
static int permute(struct order *o, void **array, size_t size, struct spl_error *err)
{
    struct spl_spill *spill = o->points->spill;
    void **spare = size == sizeof *o->key ? &o->spare_of_8 : size == sizeof *o->index ? &o->spare_of_4 : NULL;
    if (!*array)
        return 0;
    struct permutation p = {.spill = spill, .index = o->index, .from = *array, .size = size};
    p.to = spare && *spare ? *spare : spl_spill_alloc_raw(spill, o->count + SPL_POINTS_PAD, size, err);
    if (!p.to)
        return SPL_E_NOMEM;
    spl_parallel_for(o->stage->threads, o->count, spill ? random_grain : grain, permute_piece, &p);
    memset(p.to + o->count * size, 0, SPL_POINTS_PAD * size);
    if (spare)
        *spare = *array;
    else
        spl_spill_free(spill, *array);
    *array = p.to;
    spl_stage_add(o->stage, o->count / 32, 0);
    return 0;
}

static void drop_duplicates(struct order *o)
{
    size_t kept = 0;
    for (size_t i = 0; i < o->count; i++)
        if (o->index[i] != dropped)
            o->index[kept++] = o->index[i];
    o->points->duplicates = o->count - kept;
    o->count = kept;
}

int spl_points_order(struct spl_points *points, struct spl_stage *stage, struct spl_error *err)
{
    struct order o = {.points = points, .count = points->count, .stage = stage};
    int rc = SPL_E_NOMEM;
    spl_stage_begin(stage, "ordering", "points", o.count);
    o.key = spl_spill_alloc_raw(points->spill, o.count + SPL_POINTS_PAD, sizeof *o.key, err);
    o.key_to = spl_spill_alloc_raw(points->spill, o.count, sizeof *o.key, err);
    o.index = spl_spill_alloc_raw(points->spill, o.count, sizeof *o.index, err);
    o.index_to = spl_spill_alloc_raw(points->spill, o.count + SPL_POINTS_PAD, sizeof *o.index, err);
    o.leads = spl_alloc_raw(stage->threads, sizeof *o.leads, err);
    o.at = spl_alloc_raw(stage->threads, sizeof *o.at, err);
    o.part_of = spl_alloc_raw(leads, sizeof *o.part_of, err);
    o.runs = spl_alloc_raw(o.count / long_run + 1, sizeof *o.runs, err);
    if (!o.key || !o.key_to || !o.index || !o.index_to || !o.leads || !o.at || !o.part_of || !o.runs)
        goto done;
    order_all(&o);
    if (atomic_load(&o.failed)) {
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory while ordering %zu points", o.count);
        goto done;
    }
    drop_duplicates(&o);
    spl_spill_free(points->spill, o.key_to);
    o.spare_of_8 = o.key;
    o.spare_of_4 = o.index_to;
    o.key = o.key_to = NULL;
    o.index_to = NULL;
    rc = 0;
    for (int c = 0; c < 3 && !rc; c++)
        rc = permute(&o, (void **)&points->axis[c], sizeof(double), err);
    if (!rc)
        rc = permute(&o, (void **)&points->color_class, sizeof *points->color_class, err);
    if (!rc)
        rc = permute(&o, (void **)&points->station, sizeof *points->station, err);
    if (!rc)
        rc = permute(&o, (void **)&points->normal, sizeof *points->normal, err);
    if (!rc)
        rc = permute(&o, (void **)&points->halo, sizeof *points->halo, err);
    for (int s = 0; s < SPL_POINT_SCALARS && !rc; s++)
        rc = permute(&o, &points->scalar[s].values, spl_scalar_bytes(&points->scalar[s]), err);
    spl_stage_finish(stage);
    points->count = points->capacity = o.count;
done:
    spl_spill_free(points->spill, o.key);
    spl_spill_free(points->spill, o.key_to);
    spl_spill_free(points->spill, o.index);
    spl_spill_free(points->spill, o.index_to);
    spl_spill_free(points->spill, o.spare_of_8);
    spl_spill_free(points->spill, o.spare_of_4);
    free(o.leads);
    free(o.at);
    free(o.part_of);
    free(o.runs);
    return rc;
}
