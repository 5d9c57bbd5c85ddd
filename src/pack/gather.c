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

enum { batch_points = 65536 };
/* Coordinates below it are 0: so is -0, and no two places are closer than floats relative to a node can tell. */
static const double nothing = 1e-15;
static const uint32_t grey = 0xb0b0b0; /* of points without any colour or intensity */

static int grow(void **array, size_t capacity, size_t size, struct spl_error *err)
{
    void *bigger = spl_realloc(*array, capacity + SPL_POINTS_PAD, size, err);
    if (!bigger)
        return SPL_E_NOMEM;
    *array = bigger;
    return 0;
}

static int reserve(struct spl_points *p, size_t more, uint32_t attributes, struct spl_error *err)
{
    size_t capacity = p->capacity, old = p->count;
    if (old + more > UINT32_MAX - 1)
        return spl_fail(err, SPL_E_LIMIT, "more than %u points; pack them as several datasets", UINT32_MAX - 1);
    if (old + more > capacity)
        capacity = old + more > capacity + capacity / 2 ? old + more : capacity + capacity / 2;
    int rc = 0;
    bool wants_station = attributes & SPL_CLOUD_STATION, wants_normal = attributes & SPL_CLOUD_NORMAL;
    bool had_station = p->station, had_normal = p->normal;
    if (capacity > p->capacity) {
        for (int c = 0; c < 3 && !rc; c++)
            rc = grow((void **)&p->axis[c], capacity, sizeof(double), err);
        if (!rc)
            rc = grow((void **)&p->color_class, capacity, sizeof *p->color_class, err);
    }
    if (!rc && (had_station ? capacity > p->capacity : wants_station))
        rc = grow((void **)&p->station, capacity, sizeof *p->station, err);
    if (!rc && (had_normal ? capacity > p->capacity : wants_normal))
        rc = grow((void **)&p->normal, capacity, sizeof *p->normal, err);
    if (rc)
        return rc;
    if (!had_station && wants_station)
        memset(p->station, 0xff, old * sizeof *p->station);
    if (!had_normal && wants_normal)
        memset(p->normal, 0, old * sizeof *p->normal);
    p->capacity = capacity;
    return 0;
}

static int append(struct spl_points *p, const struct spl_point_batch *batch, uint32_t attributes,
                  uint32_t first_station, const char *path, struct spl_error *err)
{
    int rc = reserve(p, batch->count, attributes, err);
    if (rc)
        return rc;
    size_t at = p->count;
    for (size_t i = 0; i < batch->count; i++, at++) {
        for (int c = 0; c < 3; c++) {
            double v = batch->position[i][c];
            if (fabs(v) > SPL_COORDINATE_MAX)
                return spl_fail(err, SPL_E_INPUT,
                                "%s: point %llu has %c = %g, beyond the largest coordinate %g; check the "
                                "file's scale and columns",
                                path, (unsigned long long)(p->points_read + i), "xyz"[c], v, SPL_COORDINATE_MAX);
            p->axis[c][at] = fabs(v) < nothing ? 0 : v;
        }
        uint32_t color = grey;
        if (attributes & SPL_CLOUD_COLOR)
            color = batch->color[i][0] | (uint32_t)batch->color[i][1] << 8 | (uint32_t)batch->color[i][2] << 16;
        p->color_class[at] = color | (uint32_t)batch->classification[i] << 24;
        if (p->station) {
            uint32_t station = first_station + batch->station[i];
            bool known = attributes & SPL_CLOUD_STATION && station < SPL_NO_STATION;
            p->station[at] = known ? (uint16_t)station : SPL_NO_STATION;
        }
        for (int c = 0; p->normal && c < 3; c++)
            p->normal[at][c] = attributes & SPL_CLOUD_NORMAL ? batch->normal[i][c] : 0;
    }
    p->count = at;
    p->points_read += batch->count;
    return 0;
}

static int keep_stations(struct spl_points *p, const struct spl_cloud_info *info, struct spl_error *err)
{
    if (!info->station_count)
        return 0;
    if (spl_array_reserve(p->stations, p->station_capacity, (size_t)p->station_count + info->station_count, err))
        return SPL_E_NOMEM;
    memcpy(p->stations + p->station_count, info->stations, info->station_count * sizeof *p->stations);
    p->station_count += info->station_count;
    return 0;
}

static void grow_box(struct spl_scan *scan, const struct spl_point_batch *batch)
{
    for (size_t i = 0; i < batch->count; i++)
        for (int c = 0; c < 3; c++) {
            scan->min[c] = fmin(scan->min[c], batch->position[i][c]);
            scan->max[c] = fmax(scan->max[c], batch->position[i][c]);
        }
}

static int gather_file(struct spl_points *p, struct spl_point_batch *batch, const struct spl_scans *scans,
                       struct spl_scan *scan, struct spl_stage *stage, struct spl_error *err)
{
    struct spl_cloud *cloud = NULL;
    struct spl_cloud_options options = {
        .columns = scans->columns, .intensity = scans->intensity, .colors = &scan->colors};
    int rc = spl_cloud_open(scan->path, &options, &cloud, err);
    if (rc)
        return rc;
    const struct spl_cloud_info *info = spl_cloud_get_info(cloud);
    uint32_t attributes = info->attributes;
    char name[128];
    snprintf(name, sizeof name, "reading %.100s", scan->name);
    spl_stage_begin(stage, name, "points", info->points_expected);
    /* One allocation where the header is honest; batches correct it where it is not. */
    if (info->points_expected && info->points_expected < UINT32_MAX - 1 - p->count)
        rc = reserve(p, (size_t)info->points_expected, attributes, err);
    while (!rc && (rc = spl_cloud_read(cloud, batch, err)) > 0) {
        spl_stage_add(stage, batch->count, 0);
        grow_box(scan, batch);
        rc = append(p, batch, attributes, p->station_count, scan->path, err);
        if (!rc)
            rc = spl_stage_check(stage, err);
    }
    info = spl_cloud_get_info(cloud);
    if (!rc && attributes & SPL_CLOUD_STATION)
        rc = keep_stations(p, info, err);
    p->points_skipped += info->points_skipped;
    memcpy(scan->points_from, info->points_from, sizeof scan->points_from);
    p->has_color |= attributes & SPL_CLOUD_COLOR;
    p->has_class |= attributes & SPL_CLOUD_CLASS;
    spl_stage_end(stage);
    stage->name = "";
    spl_cloud_destroy(cloud);
    return rc;
}

int spl_points_gather(struct spl_points *points, struct spl_scans *scans, struct spl_stage *stage,
                      struct spl_error *err)
{
    struct spl_point_batch batch = {0};
    points->up[2] = 1;
    int rc = spl_point_batch_init(&batch, batch_points, err);
    for (size_t i = 0; !rc && i < scans->count; i++)
        rc = gather_file(points, &batch, scans, &scans->list[i], stage, err);
    spl_point_batch_finish(&batch);
    if (!rc && !points->count)
        rc = spl_fail(err, SPL_E_INPUT, "%s%s: no usable point (%llu skipped as empty or not finite)",
                      scans->list[0].path, scans->count > 1 ? " and the other inputs" : "",
                      (unsigned long long)points->points_skipped);
    return rc;
}

void spl_points_finish(struct spl_points *points)
{
    for (int c = 0; c < 3; c++)
        free(points->axis[c]);
    free(points->color_class);
    free(points->station);
    free(points->normal);
    free(points->radius);
    free(points->uncertainty);
    free(points->linear);
    free(points->clip);
    free(points->stations);
    *points = (struct spl_points){0};
}
