/* All inputs into memory: batches from the readers appended to arrays that grow by half, so that a header's promise is
 * never trusted with memory (untouched capacity costs none). One thread.
 *
 * Invariant: after each append every array that exists has `count` valid elements; arrays for stations and normals come
 * into being with the first file that has them, filled for the points before it. */
#include "pack/points.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/memory.h"
#include "cloud/cloud.h"
#include "pack/job/rules.h"
#include "pack/kept.h"

enum { batch_points = 65536 };
static const uint32_t grey = 0xb0b0b0; /* of points without any colour or intensity */

static int grow(struct spl_spill *spill, void **array, size_t capacity, size_t size, struct spl_error *err)
{
    void *bigger = spl_spill_realloc(spill, *array, capacity + SPL_POINTS_PAD, size, err);
    if (!bigger)
        return SPL_E_NOMEM;
    *array = bigger;
    return 0;
}

static int fail_count(struct spl_error *err)
{
    return spl_fail(err, SPL_E_LIMIT, "more than %u points; pack them in parts of fewer, with --parts N",
                    SPL_POINTS_MAX);
}

int spl_points_check_count(const struct spl_scans *scans, struct spl_error *err)
{
    uint64_t points = 0;
    for (size_t i = 0; i < scans->count; i++) {
        const struct spl_scan *scan = &scans->list[i];
        uint64_t more = scan->max_points ? scan->max_points : scan->counted ? scan->points_expected : 0;
        points += more < SPL_POINTS_MAX ? more : (uint64_t)SPL_POINTS_MAX + 1; /* a million scans do not overflow it */
    }
    return points > SPL_POINTS_MAX ? fail_count(err) : SPL_OK;
}

static int reserve(struct spl_points *p, size_t more, uint32_t attributes, struct spl_error *err)
{
    size_t capacity = p->capacity, old = p->count;
    if (old + more > SPL_POINTS_MAX)
        return fail_count(err);
    if (old + more > capacity)
        capacity = old + more > capacity + capacity / 2 ? old + more : capacity + capacity / 2;
    int rc = 0;
    bool wants_station = attributes & SPL_CLOUD_STATION, wants_normal = attributes & SPL_CLOUD_NORMAL;
    bool had_station = p->station, had_normal = p->normal;
    if (capacity > p->capacity) {
        for (int c = 0; c < 3 && !rc; c++)
            rc = grow(p->spill, (void **)&p->axis[c], capacity, spl_points_axis_bytes(p), err);
        if (!rc)
            rc = grow(p->spill, (void **)&p->color_class, capacity, sizeof *p->color_class, err);
    }
    for (int s = 0; s < SPL_POINT_SCALARS && !rc; s++)
        if (p->scalar[s].values && capacity > p->capacity)
            rc = grow(p->spill, &p->scalar[s].values, capacity, spl_scalar_bytes(&p->scalar[s]), err);
    if (!rc && p->has_halo && capacity > p->capacity)
        rc = grow(p->spill, (void **)&p->halo, capacity, sizeof *p->halo, err);
    if (!rc && (had_station ? capacity > p->capacity : wants_station))
        rc = grow(p->spill, (void **)&p->station, capacity, sizeof *p->station, err);
    if (!rc && (had_normal ? capacity > p->capacity : wants_normal))
        rc = grow(p->spill, (void **)&p->normal, capacity, sizeof *p->normal, err);
    if (rc)
        return rc;
    if (!had_station && wants_station)
        memset(p->station, 0xff, old * sizeof *p->station);
    if (!had_normal && wants_normal)
        memset(p->normal, 0, old * sizeof *p->normal);
    p->capacity = capacity;
    return 0;
}

/* Those that the batch has, and those that points before it had. */
static int append_scalars(struct spl_points *p, const struct spl_point_batch *batch, uint32_t scalars,
                          const double *scan, struct spl_error *err)
{
    int rc = SPL_OK;
    for (int s = 0; s < SPL_POINT_SCALARS && !rc; s++) {
        const double *values = s == SPL_SCALAR_SCAN ? scan : scalars >> s & 1 ? batch->scalar[s] : NULL;
        if (values || p->scalar[s].values)
            rc = spl_scalar_add(&p->scalar[s], p->capacity, p->count, values, batch->count, err);
    }
    return rc;
}

/* Of a scan's stations: the first one's, and what they are all below. */
struct numbers {
    uint32_t first, end;
};

static int append(struct spl_points *p, const struct spl_point_batch *batch, const struct spl_cloud_info *info,
                  uint32_t attributes, const struct numbers *stations, const double *scan, struct spl_error *err)
{
    int rc = reserve(p, batch->count, attributes, err);
    if (!rc)
        rc = append_scalars(p, batch, info->scalars, scan, err);
    if (!rc)
        rc = spl_points_put(p, (const double(*)[3])batch->position, batch->count, err);
    if (rc)
        return rc;
    size_t at = p->count;
    for (size_t i = 0; i < batch->count; i++, at++) {
        uint32_t color = grey;
        if (attributes & SPL_CLOUD_COLOR)
            color = batch->color[i][0] | (uint32_t)batch->color[i][1] << 8 | (uint32_t)batch->color[i][2] << 16;
        p->color_class[at] = color | (uint32_t)batch->classification[i] << 24;
        if (p->station) {
            uint32_t station = stations->first + batch->station[i];
            bool known = attributes & SPL_CLOUD_STATION && station < stations->end;
            p->station[at] = known ? (uint16_t)station : SPL_NO_STATION;
        }
        for (int c = 0; p->normal && c < 3; c++)
            // no -0, which has a code of its own
            p->normal[at][c] = attributes & SPL_CLOUD_NORMAL ? batch->normal[i][c] + 0.0f : 0;
    }
    p->count = at;
    return 0;
}

static int keep_stations(struct spl_points *p, const double *poses, uint32_t count, struct spl_error *err)
{
    if (!count)
        return 0;
    if (spl_array_reserve(p->stations, p->station_capacity, (size_t)p->station_count + count, err))
        return SPL_E_NOMEM;
    memcpy(p->stations + p->station_count, poses, count * sizeof *p->stations);
    p->station_count += count;
    return 0;
}

/* The scan's number of each point of a batch: its station's, from `first` on, or that of the input. */
static void number_scan(const struct spl_point_batch *batch, uint32_t attributes, bool stations, size_t first,
                        double *out)
{
    for (size_t i = 0; i < batch->count; i++)
        out[i] = !stations                        ? (double)first
                 : attributes & SPL_CLOUD_STATION ? (double)first + batch->station[i]
                                                  : (double)NAN;
}

static void forget(struct spl_scan *scan, struct spl_stage *stage)
{
    for (int c = 0; c < 3; c++) {
        scan->min[c] = INFINITY;
        scan->max[c] = -INFINITY;
    }
    scan->points_inside = 0;
    atomic_store(&stage->done, 0);
}

/* Room for what a batch's points have beside: their scan's numbers, NULL where that is not kept; of a part which of
 * them lie in its halo. */
struct beside {
    double *numbers;
    uint8_t *halo;
};

/* Of a batch, from a scan whose points before it were `read`, what is to be kept. */
static int take_batch(struct spl_points *p, struct spl_point_batch *batch, const struct spl_scans *scans,
                      struct spl_scan *scan, const struct spl_cloud_info *info, uint64_t read,
                      const struct beside *beside, struct spl_error *err)
{
    const struct spl_part_rules *rules = scans->rules;
    size_t count = p->count, first = rules ? scan->first_number : (size_t)(scan - scans->list);
    const struct numbers own = rules && rules->stations ? (struct numbers){scan->first_number, rules->pose_count}
                                                        : (struct numbers){p->station_count, SPL_NO_STATION};
    bool stations;
    spl_kept_has_scan(scans, &stations);
    if (!rules && stations)
        first = p->station_count;
    if (beside->numbers)
        number_scan(batch, info->attributes, stations, first, beside->numbers);
    size_t inside = batch->count;
    if (rules) /* where it is one of many parts of a large scan, nothing else is asked of the points of the others */
        inside =
            spl_part_filter(rules, scan->box[0], scan->box[1], batch, info->scalars, beside->numbers, beside->halo);
    int rc = spl_scan_grow(scan, batch, read, err);
    if (!rc && batch->count)
        rc = append(p, batch, info, info->attributes, &own, beside->numbers, err);
    if (!rc && rules && batch->count)
        memcpy(p->halo + count, beside->halo, batch->count);
    p->points_read += inside;
    scan->points_inside += inside;
    return rc;
}

/* The next batch of a scan, of whose rows those up to `*row` are read or left; as spl_cloud_read(). */
static int read_batch(struct spl_cloud *cloud, struct spl_point_batch *batch, const struct spl_scans *scans,
                      const struct spl_scan *scan, uint64_t *row, uint64_t *end, struct spl_error *err)
{
    const struct spl_part_blocks *blocks = &scan->blocks;
    const size_t capacity = batch->capacity;
    uint64_t begin;
    if (!blocks->boxes) {
        int rc = spl_cloud_read(cloud, batch, err);
        *row += rc == 1 ? batch->count : 0;
        return rc;
    }
    batch->count = 0;
    if (*row >= *end) {
        if (!spl_part_next_rows(scans->rules, blocks, *row, &begin, end))
            return 0;
        *row = begin;
        int rc = spl_cloud_seek(cloud, begin, err);
        if (rc < 0)
            return rc;
    }
    batch->capacity = *end - *row < capacity ? (size_t)(*end - *row) : capacity;
    int rc = spl_cloud_read(cloud, batch, err);
    batch->capacity = capacity;
    *row += rc == 1 ? batch->count : 0;
    return rc;
}

/* What is skipped of a scan lies nowhere: one part of a job counts it. */
static bool is_counted_here(const struct spl_scans *scans, const struct spl_scan *scan)
{
    double middle[3];
    for (int c = 0; c < 3; c++)
        middle[c] = scan->box[0][c] / 2 + scan->box[1][c] / 2;
    return !scans->rules || spl_part_find(scans->rules, scan->box[0], scan->box[1], middle) == SPL_PART_INSIDE;
}

static int gather_file(struct spl_points *p, struct spl_point_batch *batch, const struct spl_scans *scans,
                       struct spl_scan *scan, const struct beside *beside, struct spl_stage *stage,
                       struct spl_error *err)
{
    struct spl_cloud *cloud = NULL;
    struct spl_cloud_options options = scans->how;
    options.colors = &scan->colors;
    options.max_points = scan->max_points;
    options.points = scan->points_total;
    int rc = spl_cloud_open(scan->path, &options, &cloud, err);
    if (rc)
        return rc;
    const struct spl_cloud_info *info = spl_cloud_get_info(cloud);
    uint32_t attributes = info->attributes;
    uint64_t first = p->points_read, row = 0, end = 0;
    size_t count = p->count;
    char name[128];
    snprintf(name, sizeof name, "reading %.100s", scan->name);
    spl_stage_begin(stage, name, "points", scans->rules ? scan->points_expected : info->points_expected);
    /* One allocation where the header is honest; batches correct it where it is not. Where it may count what is
     * no point, or more than there is, they alone do, as of a part: beyond the bound of memory what is allocated takes
     * room on disk, used or not. */
    if (info->points_expected && !scans->rules && !info->points_at_most &&
        info->points_expected < SPL_POINTS_MAX - p->count)
        rc = reserve(p, (size_t)info->points_expected, attributes, err);
    while (!rc && (rc = read_batch(cloud, batch, scans, scan, &row, &end, err)) > 0) {
        if (rc == SPL_CLOUD_AGAIN) {
            p->points_read = first;
            p->count = count;
            row = end = 0;
            forget(scan, stage);
            scan->colors = scan->own_colors = info->colors;
            rc = 0;
            continue;
        }
        size_t points = batch->count; /* of which some are not kept */
        spl_stage_add(stage, points, 0);
        rc = take_batch(p, batch, scans, scan, info, row - points, beside, err);
        if (!rc)
            rc = spl_stage_check(stage, err);
    }
    info = spl_cloud_get_info(cloud);
    if (!rc && attributes & SPL_CLOUD_STATION && !(scans->rules && scans->rules->stations))
        rc = keep_stations(p, (const double *)info->stations, info->station_count, err);
    if (is_counted_here(scans, scan))
        p->points_skipped += info->points_skipped;
    memcpy(scan->points_from, info->points_from, sizeof scan->points_from);
    scan->points_behind = info->points_behind; /* of text, where they end */
    if (scans->rules) {
        memset(scan->points_from, 0, sizeof scan->points_from);
        scan->points_from[info->colors.from] = scan->points_inside;
    }
    p->has_color |= attributes & SPL_CLOUD_COLOR;
    p->has_class |= attributes & SPL_CLOUD_CLASS;
    spl_stage_end(stage);
    stage->name = "";
    spl_cloud_destroy(cloud);
    return rc;
}

/* Of no points yet. */
static void begin_points(struct spl_points *points, const struct spl_scans *scans, const struct spl_stage *stage)
{
    points->keep = scans->how.keep;
    points->spill = stage->spill;
    spl_points_begin_narrow(points, scans->count ? &scans->list[0].coordinates : NULL);
    points->has_halo = scans->rules != NULL;
    points->cells = scans->rules ? scans->rules->cells : 0;
    points->has_class = scans->rules && scans->rules->has_class;
    for (int s = 0; s < SPL_POINT_SCALARS; s++)
        points->scalar[s].spill = stage->spill;
}

/* One pass over all scans. One that breaks is taken out of the list; points mean nothing then, and the others are read
 * on only to find all that break. */
static int gather(struct spl_points *points, struct spl_point_batch *batch, struct spl_scans *scans,
                  const struct beside *beside, struct spl_stage *stage, struct spl_error *err)
{
    int rc = SPL_OK;
    begin_points(points, scans, stage);
    for (size_t i = 0; !rc && i < scans->count;) {
        struct spl_scan *scan = &scans->list[i];
        struct spl_error why = {0};
        if (!(rc = gather_file(points, batch, scans, scan, beside, stage, &why))) {
            i++;
            continue;
        }
        spl_points_finish(points);
        begin_points(points, scans, stage);
        if (!(rc = spl_inputs_leave_out(scans->inputs, scan->path, rc, &why, err)))
            spl_scans_remove(scans, i);
    }
    return rc;
}

/* A writer that was stopped before it came back to the header leaves a count of 0. */
static int refuse_empty(const struct spl_scans *scans, const struct spl_points *points, struct spl_error *err)
{
    uint64_t behind = 0;
    char more[120] = "";
    for (size_t i = 0; i < scans->count; i++)
        behind += scans->list[i].points_behind;
    if (behind)
        snprintf(more, sizeof more, "; %llu more than its header counts could lie there: mend the header's number",
                 (unsigned long long)behind);
    return spl_fail(err, SPL_E_INPUT, "%s%s: no usable point (%llu skipped as empty or not finite%s)",
                    scans->list[0].path, scans->count > 1 ? " and the other inputs" : "",
                    (unsigned long long)points->points_skipped, more);
}

/* What breaks after some of it was read has left its mark: on the common range of grey, on which arrays there are. So
 * that the result is that of a pack without it, all others are read once more. */
int spl_points_gather(struct spl_points *points, struct spl_scans *scans, struct spl_stage *stage,
                      struct spl_error *err)
{
    struct spl_point_batch batch = {0};
    struct beside beside = {0};
    bool stations;
    int rc = spl_point_batch_init(&batch, batch_points, err);
    if (!rc && spl_kept_has_scan(scans, &stations) &&
        !(beside.numbers = spl_alloc_raw(batch_points, sizeof *beside.numbers, err)))
        rc = SPL_E_NOMEM;
    if (!rc && scans->rules && !(beside.halo = spl_alloc_raw(batch_points, sizeof *beside.halo, err)))
        rc = SPL_E_NOMEM;
    for (bool again = !rc; again;) {
        size_t count = scans->count;
        if (scans->rules && scans->rules->stations)
            rc = keep_stations(points, (const double *)scans->rules->poses, scans->rules->pose_count, err);
        if (!rc)
            rc = gather(points, &batch, scans, &beside, stage, err);
        again = !rc && scans->count < count;
        if (again) {
            spl_points_finish(points);
            spl_scans_share(scans);
            rc = scans->count ? spl_kept_check(scans, err) : SPL_OK;
            again = !rc;
        }
    }
    spl_point_batch_finish(&batch);
    free(beside.numbers);
    free(beside.halo);
    if (!rc && !scans->count)
        rc = spl_inputs_fail_empty(scans->inputs, err);
    points->up[2] = 1;
    if (!rc)
        rc = spl_points_settle(points, scans->rules, err);
    if (!rc && !points->count && !scans->rules)
        rc = refuse_empty(scans, points, err);
    return rc;
}

void spl_points_finish(struct spl_points *points)
{
    for (int c = 0; c < 3; c++)
        spl_spill_free(points->spill, points->axis[c]);
    spl_spill_free(points->spill, points->color_class);
    spl_spill_free(points->spill, points->station);
    spl_spill_free(points->spill, points->normal);
    spl_spill_free(points->spill, points->halo);
    for (int s = 0; s < SPL_POINT_SCALARS; s++)
        spl_spill_free(points->spill, points->scalar[s].values);
    spl_spill_free(points->spill, points->radius);
    spl_spill_free(points->spill, points->uncertainty);
    spl_spill_free(points->spill, points->linear);
    spl_spill_free(points->spill, points->clip);
    spl_spill_free(points->spill, points->plane);
    free(points->stations);
    free(points->eyes);
    *points = (struct spl_points){0};
}
