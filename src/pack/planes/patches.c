/* Flat cells, from the largest down: a cell whose points lie on a plane, or on one a side of a thin wall, is a patch as
 * it is; another one is split, as long as enough points are left. Small cells are asked once more, on the way back up,
 * for the planes that meet in them (corner.c). Sorted points make each cell a run of them.
 *
 * Parallel over tasks: the largest cells of no more than `task_points`, which do not depend on the number of threads,
 * each with a list of its own. A label counts from its task's first patch until all are done. */
#include "pack/planes/patches.h"

#include <stdlib.h>

#include "base/array.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "geom/morton.h"
#include "pack/order.h"
#include "pack/planes/planes.h"

enum { task_points = 1 << 15, corner_points = 512, corner_planes = 6 };

struct task {
    size_t begin, end;
    struct spl_patch *list;
    size_t count, capacity;
    uint32_t first; /* number of its first patch */
};

struct worker {
    struct spl_fit fit;
    uint64_t *key; /* of each point of the task */
};

struct search {
    const struct spl_points *points;
    const struct spl_plane_limits_list *limits;
    uint32_t *label;
    struct spl_stage *stage;
    struct task *tasks;
    size_t count, capacity;
    struct worker *workers;
    atomic_bool failed;
};

static uint64_t key_of(const struct spl_points *p, size_t i)
{
    return spl_points_key(p, i, p->cube_min, p->cube_size);
}

/* How many triples the smallest cell that holds both keys leaves open. */
static unsigned shift_of(uint64_t first, uint64_t last)
{
    return first == last ? 0 : (63 - (unsigned)__builtin_clzll(first ^ last)) / 3 + 1;
}

/* Cuts [begin, end) into tasks. Points of one key are in the order of smaller cells: any cut of them is compact. */
static int make_tasks(struct search *s, size_t begin, size_t end, struct spl_error *err)
{
    uint64_t first = key_of(s->points, begin), last = key_of(s->points, end - 1);
    unsigned shift = shift_of(first, last);
    if (end - begin <= task_points || shift == 0) {
        for (size_t at = begin; at < end; at += task_points) {
            if (spl_array_reserve(s->tasks, s->capacity, s->count + 1, err))
                return SPL_E_NOMEM;
            s->tasks[s->count++] = (struct task){.begin = at, .end = end - at < task_points ? end : at + task_points};
        }
        return 0;
    }
    for (uint64_t octant = first >> 3 * (shift - 1); begin < end; octant++) {
        size_t low = begin, high = end; /* the first point beyond the octant */
        while (low < high) {
            size_t middle = low + (high - low) / 2;
            spl_spill_keep_bound(s->points->spill); /* each is in pages of its own */
            if (key_of(s->points, middle) >> 3 * (shift - 1) <= octant)
                low = middle + 1;
            else
                high = middle;
        }
        int rc = low > begin ? make_tasks(s, begin, low, err) : 0;
        if (rc)
            return rc;
        begin = low;
    }
    return 0;
}

static int keep(const struct search *s, const struct worker *w, struct task *t, size_t begin, size_t end,
                const struct spl_patch *found, unsigned count)
{
    if (spl_array_reserve(t->list, t->capacity, t->count + count, NULL))
        return SPL_E_NOMEM;
    for (size_t i = begin; i < end; i++)
        if (w->fit.group[i - t->begin])
            s->label[i] = (uint32_t)t->count + w->fit.group[i - t->begin] - 1;
    for (unsigned k = 0; k < count; k++) {
        t->list[t->count] = found[k];
        t->list[t->count++].first = begin;
    }
    return 0;
}

static int search_cell(const struct search *s, struct worker *w, struct task *t, size_t begin, size_t end)
{
    struct spl_patch found[SPL_FIT_PATCHES];
    if (end - begin < SPL_PATCH_POINTS || spl_stage_is_cancelled(s->stage))
        return 0;
    w->fit.limits = *spl_plane_limits_at(s->limits, begin + (end - begin) / 2);
    unsigned count =
        w->fit.taken ? spl_fit_curve(&w->fit, begin, end, found) : spl_fit_find(&w->fit, begin, end, found);
    if (count)
        return keep(s, w, t, begin, end, found, count);
    const uint64_t *key = w->key - t->begin;
    unsigned shift = shift_of(key[begin], key[end - 1]);
    for (size_t at = begin; shift > 0 && at < end;) {
        uint64_t octant = key[at] >> 3 * (shift - 1);
        size_t low = at + 1, high = end;
        while (low < high) {
            size_t middle = low + (high - low) / 2;
            if (key[middle] >> 3 * (shift - 1) <= octant)
                low = middle + 1;
            else
                high = middle;
        }
        int rc = search_cell(s, w, t, at, low);
        if (rc)
            return rc;
        at = low;
    }
    w->fit.limits = *spl_plane_limits_at(s->limits, begin + (end - begin) / 2); /* smaller cells had theirs */
    for (int k = 0; !w->fit.taken && end - begin <= corner_points && k < corner_planes; k++) {
        if (!spl_fit_corner(&w->fit, begin, end, s->label, found))
            return 0;
        int rc = keep(s, w, t, begin, end, found, 1);
        if (rc)
            return rc;
    }
    return 0;
}

static void search_tasks(void *context, size_t begin, size_t end, unsigned worker)
{
    struct search *s = context;
    struct worker *w = &s->workers[worker];
    for (size_t k = begin; k < end; k++) {
        struct task *t = &s->tasks[k];
        w->fit.base = t->begin;
        for (size_t i = t->begin; i < t->end; i++) {
            s->label[i] = SPL_NO_PLANE;
            w->key[i - t->begin] = key_of(s->points, i);
        }
        if (search_cell(s, w, t, t->begin, t->end))
            atomic_store(&s->failed, true);
        spl_stage_add(s->stage, (t->end - t->begin) / 2, worker);
    }
}

static void shift_labels(void *context, size_t begin, size_t end, unsigned worker)
{
    struct search *s = context;
    (void)worker;
    for (size_t k = begin; k < end; k++)
        for (size_t i = s->tasks[k].begin; i < s->tasks[k].end; i++)
            s->label[i] += s->label[i] == SPL_NO_PLANE ? 0 : s->tasks[k].first;
}

/* One list of all tasks' patches. */
static int gather(struct search *s, struct spl_patches *patches, struct spl_error *err)
{
    for (size_t k = 0; k < s->count; k++) {
        s->tasks[k].first = patches->count;
        patches->count += (uint32_t)s->tasks[k].count;
    }
    patches->list = spl_alloc_raw(patches->count, sizeof *patches->list, err);
    if (!patches->list)
        return SPL_E_NOMEM;
    for (size_t k = 0; k < s->count; k++)
        for (size_t i = 0; i < s->tasks[k].count; i++)
            patches->list[s->tasks[k].first + i] = s->tasks[k].list[i];
    spl_parallel_for(s->stage->threads, s->count, 1, shift_labels, s);
    return 0;
}

static int init_worker(struct worker *w, const struct spl_points *points, const uint32_t *taken, size_t room,
                       struct spl_error *err)
{
    w->fit = (struct spl_fit){.points = points,
                              .taken = taken,
                              .group = spl_alloc_raw(room, 1, err),
                              .off = spl_alloc_raw(room, sizeof *w->fit.off, err)};
    w->key = spl_alloc_raw(room, sizeof *w->key, err);
    return w->fit.group && w->fit.off && w->key ? 0 : SPL_E_NOMEM;
}

static void finish_worker(struct worker *w)
{
    free(w->fit.group);
    free(w->fit.off);
    free(w->key);
}

int spl_patches_find(struct spl_patches *patches, uint32_t *label, const uint32_t *taken,
                     const struct spl_points *points, const struct spl_plane_limits_list *limits,
                     struct spl_stage *stage, struct spl_error *err)
{
    struct search s = {.points = points, .limits = limits, .label = label, .stage = stage};
    *patches = (struct spl_patches){0};
    s.workers = spl_alloc(stage->threads, sizeof *s.workers, err);
    int rc = s.workers ? make_tasks(&s, 0, points->count, err) : SPL_E_NOMEM;
    for (unsigned t = 0; !rc && t < stage->threads; t++)
        rc = init_worker(&s.workers[t], points, taken, points->count < task_points ? points->count : task_points, err);
    if (!rc) {
        spl_parallel_for(stage->threads, s.count, 1, search_tasks, &s);
        rc = atomic_load(&s.failed)
                 ? spl_fail(err, SPL_E_NOMEM, "out of memory for the planes of %zu points", points->count)
                 : gather(&s, patches, err);
    }
    for (size_t k = 0; k < s.count; k++)
        free(s.tasks[k].list);
    for (unsigned t = 0; s.workers && t < stage->threads; t++)
        finish_worker(&s.workers[t]);
    free(s.workers);
    free(s.tasks);
    return rc;
}

void spl_patches_finish(struct spl_patches *patches)
{
    free(patches->list);
    *patches = (struct spl_patches){0};
}
