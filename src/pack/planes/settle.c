/* The last fit, of all points that a plane has by now, and the last check. Sums are taken by blocks of points in
 * parallel and added block after block, so they are the same for any number of threads. */
#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "pack/planes/grow.h"

enum { block_points = 1 << 16 };
static const uint32_t unmet = UINT32_MAX;

/* Of a region's points within a block, about the region's mean so far. */
struct sums {
    uint32_t region;
    double count, sum[3], square[6];
    double off_square, off_most;
};

struct block {
    struct sums *sums;
    size_t count, capacity;
};

struct pass {
    const struct spl_points *points;
    const struct spl_regions *regions;
    uint32_t *label;
    const struct spl_plane_limits_list *limits; /* whose bounds points keep to; NULL: not yet */
    struct block *blocks;
    uint32_t **slot; /* of each worker: of each region, its place in the block at work */
    atomic_bool failed;
};

static void add_point(struct sums *s, const double d[3], double off)
{
    s->count++;
    for (int c = 0; c < 3; c++)
        s->sum[c] += d[c];
    s->square[0] += d[0] * d[0];
    s->square[1] += d[0] * d[1];
    s->square[2] += d[0] * d[2];
    s->square[3] += d[1] * d[1];
    s->square[4] += d[1] * d[2];
    s->square[5] += d[2] * d[2];
    s->off_square += off * off;
    s->off_most = fmax(s->off_most, off);
}

static int sum_block(const struct pass *p, struct block *b, size_t begin, size_t end, uint32_t *slot)
{
    for (size_t i = begin; i < end; i++) {
        uint32_t region = p->label[i];
        if (region == SPL_NO_PLANE)
            continue;
        const struct spl_region *r = &p->regions->list[region];
        double d[3], off = 0;
        for (int c = 0; c < 3; c++) {
            d[c] = spl_points_at(p->points, c, i) - r->moments.mean[c];
            off += d[c] * r->normal[c];
        }
        if (!(fabs(off) <= (p->limits ? spl_plane_limits_at(p->limits, i)->bound : INFINITY))) {
            p->label[i] = SPL_NO_PLANE;
            continue;
        }
        if (slot[region] == unmet) {
            if (spl_array_reserve(b->sums, b->capacity, b->count + 1, NULL))
                return SPL_E_NOMEM;
            slot[region] = (uint32_t)b->count;
            b->sums[b->count++] = (struct sums){.region = region};
        }
        add_point(&b->sums[slot[region]], d, fabs(off));
    }
    for (size_t k = 0; k < b->count; k++)
        slot[b->sums[k].region] = unmet;
    return 0;
}

static void sum_blocks(void *context, size_t begin, size_t end, unsigned worker)
{
    struct pass *p = context;
    for (size_t k = begin; k < end; k++) {
        size_t first = k * block_points, left = p->points->count - first;
        p->blocks[k].count = 0;
        if (sum_block(p, &p->blocks[k], first, first + (left < block_points ? left : block_points), p->slot[worker]))
            atomic_store(&p->failed, true);
    }
}

/* The sums of each region over all blocks; `total` holds zeros. */
static int sum_all(struct pass *p, size_t blocks, unsigned threads, struct sums *total, struct spl_error *err)
{
    spl_parallel_for(threads, blocks, 1, sum_blocks, p);
    if (atomic_load(&p->failed))
        return spl_fail(err, SPL_E_NOMEM, "out of memory for %u planes", p->regions->count);
    memset(total, 0, p->regions->count * sizeof *total);
    for (size_t k = 0; k < blocks; k++)
        for (size_t s = 0; s < p->blocks[k].count; s++) {
            const struct sums *from = &p->blocks[k].sums[s];
            struct sums *to = &total[from->region];
            to->count += from->count;
            for (int c = 0; c < 3; c++)
                to->sum[c] += from->sum[c];
            for (int e = 0; e < 6; e++)
                to->square[e] += from->square[e];
            to->off_square += from->off_square;
            to->off_most = fmax(to->off_most, from->off_most);
        }
    return 0;
}

static void refit(struct spl_region *r, const struct sums *sums)
{
    double sigma[3], normal[3], cosine = 0;
    if (sums->count < SPL_PLANE_POINTS)
        return;
    r->moments = spl_plane_moments_of(r->moments.mean, sums->count, sums->sum, sums->square);
    spl_plane_moments_fit(&r->moments, sigma, normal);
    for (int c = 0; c < 3; c++)
        cosine += normal[c] * r->normal[c];
    for (int c = 0; c < 3; c++)
        r->normal[c] = cosine < 0 ? -normal[c] : normal[c];
}

static void describe(struct spl_plane *plane, const struct spl_region *r, const struct sums *sums)
{
    double off = 0;
    *plane = (struct spl_plane){.error_rms = sqrt(sums->off_square / sums->count),
                                .error_max = sums->off_most,
                                .points = (uint64_t)sums->count};
    memcpy(plane->normal, r->normal, sizeof plane->normal);
    for (int c = 0; c < 3; c++)
        off += sums->sum[c] / sums->count * r->normal[c];
    for (int c = 0; c < 3; c++) /* the middle of its points, on the plane that they were measured against */
        plane->origin[c] = r->moments.mean[c] + sums->sum[c] / sums->count - off * r->normal[c];
}

/* Planes in the order of their first points. */
static int number(struct spl_planes *planes, uint32_t *label, const struct spl_regions *regions,
                  const struct sums *total, uint32_t *place, const struct spl_points *points, struct spl_error *err)
{
    uint32_t count = 0;
    for (uint32_t r = 0; r < regions->count; r++) {
        place[r] = unmet;
        count += total[r].count >= SPL_PLANE_POINTS;
    }
    planes->list = spl_alloc_raw(count, sizeof *planes->list, err);
    if (!planes->list)
        return SPL_E_NOMEM;
    for (size_t i = 0; i < points->count; i++) {
        uint32_t r = label[i];
        if (r == SPL_NO_PLANE)
            continue;
        if (total[r].count < SPL_PLANE_POINTS) {
            label[i] = SPL_NO_PLANE;
            continue;
        }
        if (place[r] == unmet) {
            describe(&planes->list[planes->count], &regions->list[r], &total[r]);
            place[r] = planes->count++;
        }
        label[i] = place[r];
    }
    return 0;
}

int spl_planes_settle(struct spl_planes *planes, uint32_t *label, struct spl_regions *regions,
                      const struct spl_points *points, const struct spl_plane_limits_list *limits, unsigned threads,
                      struct spl_error *err)
{
    size_t blocks = (points->count + block_points - 1) / block_points;
    struct pass pass = {.points = points, .regions = regions, .label = label};
    struct sums *total = spl_alloc_raw(regions->count, sizeof *total, err);
    pass.blocks = spl_alloc(blocks, sizeof *pass.blocks, err);
    pass.slot = spl_alloc(threads, sizeof *pass.slot, err);
    int rc = total && pass.blocks && pass.slot ? 0 : SPL_E_NOMEM;
    for (unsigned t = 0; !rc && t < threads; t++) {
        pass.slot[t] = spl_alloc_raw(regions->count, sizeof **pass.slot, err);
        if (pass.slot[t])
            memset(pass.slot[t], 0xff, regions->count * sizeof **pass.slot);
        else
            rc = SPL_E_NOMEM;
    }
    if (!rc)
        rc = sum_all(&pass, blocks, threads, total, err);
    for (uint32_t r = 0; !rc && r < regions->count; r++)
        refit(&regions->list[r], &total[r]);
    pass.limits = limits;
    if (!rc)
        rc = sum_all(&pass, blocks, threads, total, err);
    if (!rc)
        rc = number(planes, label, regions, total, pass.slot[0], points, err);
    for (size_t k = 0; pass.blocks && k < blocks; k++)
        free(pass.blocks[k].sums);
    for (unsigned t = 0; pass.slot && t < threads; t++)
        free(pass.slot[t]);
    free(pass.blocks);
    free(pass.slot);
    free(total);
    return rc;
}
