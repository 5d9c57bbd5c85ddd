/* Points in Morton order over the cubic bounds, exact duplicates out: their order is found as indices (order_sort.c),
 * and then one array after the other is moved into it. It is that of the points, not that in which they were read. Runs
 * on the caller's thread; parallel loops end before it goes on. */
#include <string.h>

#include "base/parallel.h"
#include "pack/order_parts.h"

struct order {
    struct spl_points *points;
    uint32_t *index; /* of the points that are kept, as sorted */
    size_t kept;
    void *spare_of_8, *spare_of_4; /* arrays that are left over, by the size of their elements */
    struct spl_stage *stage;
};

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
    void **spare = size == sizeof(double) ? &o->spare_of_8 : size == sizeof *o->index ? &o->spare_of_4 : NULL;
    if (!*array)
        return 0;
    struct permutation p = {.spill = spill, .index = o->index, .from = *array, .size = size};
    p.to = spare && *spare ? *spare : spl_spill_alloc_raw(spill, o->points->count + SPL_POINTS_PAD, size, err);
    if (!p.to)
        return SPL_E_NOMEM;
    spl_parallel_for(o->stage->threads, o->kept, spill ? SPL_ORDER_RANDOM_GRAIN : SPL_ORDER_GRAIN, permute_piece, &p);
    memset(p.to + o->kept * size, 0, SPL_POINTS_PAD * size);
    if (spare)
        *spare = *array;
    else
        spl_spill_free(spill, *array);
    *array = p.to;
    spl_stage_add(o->stage, o->kept / 32, 0);
    return 0;
}

static void drop_duplicates(struct order *o)
{
    size_t kept = 0;
    for (size_t i = 0; i < o->points->count; i++)
        if (o->index[i] != SPL_ORDER_DROPPED)
            o->index[kept++] = o->index[i];
    o->points->duplicates = o->points->count - kept;
    o->kept = kept;
}

int spl_points_order(struct spl_points *points, struct spl_stage *stage, struct spl_error *err)
{
    struct order o = {.points = points, .stage = stage};
    spl_stage_begin(stage, "ordering", "points", points->count);
    o.index = spl_spill_alloc_raw(points->spill, points->count, sizeof *o.index, err);
    int rc = o.index ? spl_order_sort(points, o.index, stage, err) : SPL_E_NOMEM;
    if (rc)
        goto done;
    drop_duplicates(&o);
    for (int c = 0; c < 3 && !rc; c++)
        rc = permute(&o, (void **)&points->axis[c], spl_points_axis_bytes(points), err);
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
    points->count = points->capacity = o.kept;
done:
    spl_spill_free(points->spill, o.index);
    spl_spill_free(points->spill, o.spare_of_8);
    spl_spill_free(points->spill, o.spare_of_4);
    return rc;
}
