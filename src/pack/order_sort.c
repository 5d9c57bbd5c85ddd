/* Indices of points in Morton order over the cubic bounds: a stable parallel radix sort, 4 bytes a point.
 *
 * Keys are found anew from coordinates, which takes less than to move them. Points go by the first bits of their keys
 * into parts (pieces count, one prefix sum, pieces scatter), then each part is sorted digit by digit, by one worker and
 * in so little memory that it is near. So the result does not depend on the number of threads. Equal keys (a cell of
 * 2^-21 of the cloud) are left to order_equal.c. Beside one stray point far away that can be all the points: a part
 * that is much larger than others is divided by the next bits of its keys, a long run of equal ones in its own cube, by
 * all threads. */
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "pack/order.h"
#include "pack/order_parts.h"

enum { digits = 256, threads_max = 64, long_run = 1 << 16 };
enum { lead_bits = 16, leads = 1 << lead_bits, key_bits = 3 * SPL_MORTON_BITS, parts_most = 1024 };

struct run { /* points whose keys have all but `bits` bits in common; 0: within a cube of their own */
    size_t begin, count;
    double low[3], size; /* of the cube that keys are counted in */
    unsigned bits;
};

struct sorter { /* of one worker */
    struct spl_order_pair *pairs, *spare;
    size_t capacity;
};

struct order {
    struct spl_points *points;
    struct run at;         /* the run at work */
    uint32_t *index;       /* of all points, as sorted so far; nothing yet while `first` */
    uint32_t *index_to;    /* of a run that is sorted again */
    bool first;
    struct run *runs;      /* that wait */
    size_t run_count, run_capacity;
    struct sorter *sorters;
    size_t piece, part_points;     /* of a piece; at most, of a part of several leads */
    unsigned pieces, part_count;
    uint32_t (*leads)[leads];       /* of each piece: points by the first bits of their keys */
    uint32_t (*to)[parts_most + 2]; /* of each piece: where its next point of a part goes */
    uint16_t *part_of;              /* of each lead */
    size_t begin_of[parts_most + 3]; /* of parts, from the run's begin on */
    double low[threads_max][3], high[threads_max][3];
    struct spl_stage *stage;
    pthread_mutex_t lock; /* of runs */
    atomic_bool failed;
};

static uint32_t get_index(const struct order *o, size_t i)
{
    return o->first ? (uint32_t)i : o->index[o->at.begin + i];
}

static void bounds_piece(void *context, size_t begin, size_t end, unsigned worker)
{
    struct order *o = context;
    spl_spill_keep_bound(o->points->spill);
    for (int c = 0; c < 3; c++) {
        double low = o->low[worker][c], high = o->high[worker][c];
        for (size_t i = begin; i < end; i++) {
            double at = spl_points_at(o->points, c, get_index(o, i));
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
    struct run *run = &o->at;
    for (unsigned t = 0; t < threads_max; t++)
        for (int c = 0; c < 3; c++)
            o->low[t][c] = o->high[t][c] = spl_points_at(o->points, c, get_index(o, 0));
    spl_parallel_for(o->stage->threads, run->count, SPL_ORDER_GRAIN, bounds_piece, o);
    run->size = 0;
    run->bits = key_bits;
    for (int c = 0; c < 3; c++) {
        run->low[c] = o->low[0][c];
        high[c] = o->high[0][c];
        for (unsigned t = 1; t < threads_max; t++) {
            run->low[c] = fmin(run->low[c], o->low[t][c]);
            high[c] = fmax(high[c], o->high[t][c]);
        }
        run->size = fmax(run->size, high[c] - run->low[c]);
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
        o->at.low[c] = p->cube_min[c] = (floor(p->bounds_min[c] / step - aside) + aside) * step;
        while (!(size > p->bounds_max[c] - o->at.low[c]))
            size *= 2;
    }
    p->cube_size = o->at.size = size;
}

static void find_whole_cube(struct order *o)
{
    struct spl_points *p = o->points;
    find_cube(o, p->bounds_max);
    memcpy(p->bounds_min, o->at.low, sizeof p->bounds_min);
    memcpy(p->cube_min, o->at.low, sizeof p->cube_min);
    if (p->cells > 0) {
        align_cube(o);
        return;
    }
    /* The next float up, as the container keeps it: the cube of the file is the cube of the keys. */
    p->cube_size = o->at.size = o->at.size > 0 ? nextafterf((float)o->at.size, INFINITY) : 1;
}

/* Where runs are sorted again the stage's end has been reached by then. */
static void add_done(struct order *o, size_t points, unsigned worker)
{
    if (o->first)
        spl_stage_add(o->stage, points, worker);
    else
        spl_spill_keep_bound(o->points->spill);
}

/* The first bits of a key of those that the run's points do not have in common. */
static unsigned lead_of(const struct run *run, uint64_t key)
{
    return (unsigned)(run->bits > lead_bits ? key >> (run->bits - lead_bits) : key) & (leads - 1);
}

static uint64_t key_of(const struct order *o, uint32_t index)
{
    return spl_points_key(o->points, index, o->at.low, o->at.size);
}

/* How many points of a piece begin with each lead. */
static void count_piece(void *context, size_t begin, size_t end, unsigned worker)
{
    struct order *o = context;
    uint32_t *count = o->leads[begin / o->piece];
    memset(count, 0, sizeof *o->leads);
    for (size_t i = begin; i < end; i++) {
        count[lead_of(&o->at, key_of(o, get_index(o, i)))]++;
        if (i % SPL_ORDER_GRAIN == SPL_ORDER_GRAIN - 1)
            add_done(o, SPL_ORDER_GRAIN / 8, worker);
    }
}

static void scatter_piece(void *context, size_t begin, size_t end, unsigned worker)
{
    struct order *o = context;
    uint32_t *at = o->to[begin / o->piece], *out = o->first ? o->index : o->index_to;
    for (size_t i = begin; i < end; i++) {
        uint32_t index = get_index(o, i);
        out[at[o->part_of[lead_of(&o->at, key_of(o, index))]]++] = index;
        if (i % SPL_ORDER_RANDOM_GRAIN == 0)
            spl_spill_keep_bound(o->points->spill);
        if (i % SPL_ORDER_GRAIN == SPL_ORDER_GRAIN - 1)
            add_done(o, SPL_ORDER_GRAIN / 8, worker);
    }
}

/* Parts: runs of leads with about as many points each, however unevenly these lie. */
static void divide(struct order *o)
{
    size_t most = 2 * o->at.count / parts_most + 1, in_part = 0, sum = 0;
    o->part_count = 0;
    o->part_points = most;
    for (size_t lead = 0; lead < leads; lead++) {
        size_t points = 0;
        for (unsigned t = 0; t < o->pieces; t++)
            points += o->leads[t][lead];
        if (!lead || (in_part && in_part + points > most)) {
            for (unsigned t = 0; t < o->pieces; t++)
                o->to[t][o->part_count] = 0;
            o->begin_of[o->part_count++] = sum;
            in_part = 0;
        }
        o->part_of[lead] = (uint16_t)(o->part_count - 1);
        in_part += points;
        sum += points;
        for (unsigned t = 0; t < o->pieces; t++)
            o->to[t][o->part_count - 1] += o->leads[t][lead];
    }
    o->begin_of[o->part_count] = sum;
    for (unsigned part = 0; part < o->part_count; part++) {
        uint32_t at = (uint32_t)o->begin_of[part];
        for (unsigned t = 0; t < o->pieces; t++) {
            uint32_t n = o->to[t][part];
            o->to[t][part] = at;
            at += n;
        }
    }
}

static void add_run(struct order *o, const struct run *run)
{
    pthread_mutex_lock(&o->lock);
    if (spl_array_reserve(o->runs, o->run_capacity, o->run_count + 1, NULL))
        atomic_store(&o->failed, true);
    else
        o->runs[o->run_count++] = *run;
    pthread_mutex_unlock(&o->lock);
}

/* Digit by digit from the last on, between the sorter's two arrays; returns the one that has the result. */
static const struct spl_order_pair *sort_pairs(struct sorter *s, size_t n)
{
    uint32_t count[8][digits] = {0};
    struct spl_order_pair *from = s->pairs, *to = s->spare;
    for (size_t i = 0; i < n; i++)
        for (unsigned d = 0; d < 8; d++)
            count[d][from[i].key >> 8 * d & (digits - 1)]++;
    for (unsigned d = 0; d < 8; d++) {
        uint32_t *at = count[d], sum = 0;
        if (at[from[0].key >> 8 * d & (digits - 1)] == n)
            continue;
        for (unsigned v = 0; v < digits; v++) {
            uint32_t some = at[v];
            at[v] = sum;
            sum += some;
        }
        for (size_t i = 0; i < n; i++)
            to[at[from[i].key >> 8 * d & (digits - 1)]++] = from[i];
        struct spl_order_pair *other = from;
        from = to;
        to = other;
    }
    return from;
}

static bool reserve_pairs(struct sorter *s, size_t n)
{
    if (n <= s->capacity)
        return true;
    free(s->pairs);
    free(s->spare);
    s->capacity = 0;
    s->pairs = spl_alloc_raw(n, sizeof *s->pairs, NULL);
    s->spare = spl_alloc_raw(n, sizeof *s->spare, NULL);
    s->capacity = s->pairs && s->spare ? n : 0;
    return s->capacity;
}

/* A part of the run at work, which begins at point `first` of all. */
static void sort_part(struct order *o, struct sorter *s, uint32_t *index, size_t first, size_t n)
{
    if (n > o->part_points && n > long_run) { /* of one lead: there is more to tell its points by */
        struct run rest = o->at;
        rest.begin = first;
        rest.count = n;
        rest.bits = o->at.bits > lead_bits ? o->at.bits - lead_bits : 0;
        add_run(o, &rest);
        return;
    }
    if (!reserve_pairs(s, n)) {
        atomic_store(&o->failed, true);
        return;
    }
    for (size_t i = 0; i < n; i++) {
        if (i % SPL_ORDER_RANDOM_GRAIN == 0)
            spl_spill_keep_bound(o->points->spill);
        s->pairs[i] = (struct spl_order_pair){key_of(o, index[i]), index[i]};
    }
    const struct spl_order_pair *pairs = sort_pairs(s, n);
    for (size_t i = 0; i < n; i++)
        index[i] = pairs[i].index;
    for (size_t i = 0, end; i < n; i = end) {
        for (end = i + 1; end < n && pairs[end].key == pairs[i].key;)
            end++;
        if (end - i > long_run)
            add_run(o, &(struct run){.begin = first + i, .count = end - i});
        else if (end - i > 1 && !spl_order_equal(o->points, index + i, end - i))
            atomic_store(&o->failed, true);
    }
}

static void sort_parts(void *context, size_t begin, size_t end, unsigned worker)
{
    struct order *o = context;
    uint32_t *index = o->first ? o->index : o->index_to;
    for (size_t part = begin; part < end; part++) {
        size_t first = o->begin_of[part], n = o->begin_of[part + 1] - first;
        if (n)
            sort_part(o, &o->sorters[worker], index + first, o->at.begin + first, n);
        add_done(o, n / 2, worker);
    }
}

/* The run at work, whose points have some bits of their keys to be told by; what is left of it are runs. */
static void sort_run(struct order *o)
{
    o->piece = (o->at.count + o->stage->threads - 1) / o->stage->threads;
    o->piece = o->piece < SPL_ORDER_GRAIN ? SPL_ORDER_GRAIN : o->piece;
    o->pieces = (unsigned)((o->at.count + o->piece - 1) / o->piece); /* fewer than threads, where there are few */
    spl_parallel_for(o->stage->threads, o->at.count, o->piece, count_piece, o);
    divide(o);
    spl_parallel_for(o->stage->threads, o->at.count, o->piece, scatter_piece, o);
    spl_parallel_for(o->stage->threads, o->part_count, 1, sort_parts, o);
    for (size_t i = 0, some; !o->first && i < o->at.count; i += some) {
        some = o->at.count - i < SPL_ORDER_GRAIN ? o->at.count - i : SPL_ORDER_GRAIN;
        spl_spill_keep_bound(o->points->spill);
        memcpy(o->index + o->at.begin + i, o->index_to + i, some * sizeof *o->index);
    }
}

static void order_all(struct order *o)
{
    double high[3];
    o->first = true;
    find_whole_cube(o);
    sort_run(o);
    o->first = false;
    while (o->run_count && !atomic_load(&o->failed)) {
        o->at = o->runs[--o->run_count];
        if (!o->at.bits)
            find_cube(o, high);
        if (!(o->at.size > 0)) {
            spl_order_keep_one(o->points, o->index + o->at.begin, o->at.count);
            continue;
        }
        o->index_to = spl_spill_alloc_raw(o->points->spill, o->at.count, sizeof *o->index_to, NULL);
        if (o->index_to)
            sort_run(o);
        else
            atomic_store(&o->failed, true);
        spl_spill_free(o->points->spill, o->index_to);
    }
}

static void finish(struct order *o)
{
    for (unsigned t = 0; o->sorters && t < o->stage->threads; t++) {
        free(o->sorters[t].pairs);
        free(o->sorters[t].spare);
    }
    free(o->sorters);
    free(o->leads);
    free(o->to);
    free(o->part_of);
    free(o->runs);
    pthread_mutex_destroy(&o->lock);
}

int spl_order_sort(struct spl_points *points, uint32_t *index, struct spl_stage *stage, struct spl_error *err)
{
    struct order o = {.points = points, .index = index, .at.count = points->count, .stage = stage};
    int rc = SPL_E_NOMEM;
    pthread_mutex_init(&o.lock, NULL);
    o.leads = spl_alloc_raw(stage->threads, sizeof *o.leads, err);
    o.to = spl_alloc_raw(stage->threads, sizeof *o.to, err);
    o.part_of = spl_alloc_raw(leads, sizeof *o.part_of, err);
    o.sorters = spl_alloc(stage->threads, sizeof *o.sorters, err);
    if (o.leads && o.to && o.part_of && o.sorters) {
        order_all(&o);
        rc = SPL_OK;
        if (atomic_load(&o.failed))
            rc = spl_fail(err, SPL_E_NOMEM, "out of memory while ordering %zu points", points->count);
    }
    finish(&o);
    return rc;
}
