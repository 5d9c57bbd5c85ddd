/* A pass over all points. What attributes have in common is found as points come, with an array of one batch; what
 * needs many values at once, of a sample. One thread. */
#include "pack/job/survey.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "pack/kept.h"
#include "pack/points.h"

enum { batch_points = 65536, sample_most = 1 << 20 };
/* Rows of a block at least, and as many blocks as a plan has room for: of each scan, of all of them. */
enum { block_rows = 1 << 14, blocks_least = 4, blocks_most = 4096, blocks_some = 64, blocks_of_all = 1 << 16 };

struct survey {
    struct spl_scans *scans;
    struct spl_job_grid *grid;
    struct spl_stage *stage;
    struct spl_point_batch batch;
    struct spl_scalar_values all[SPL_SCALAR_COUNT], sample[SPL_SCALAR_COUNT];
    double *picked; // owned: of a batch, for the sample
    size_t sampled;
    uint64_t points, step; /* so far; of how many one is in the sample */
};

/* Takes a batch into what is known of one attribute, which the batch may lack. */
static int add_scalar(struct survey *s, int scalar, const double *values, size_t picks, struct spl_error *err)
{
    struct spl_scalar_values *all = &s->all[scalar], *sample = &s->sample[scalar];
    const size_t count = s->batch.count;
    const bool fresh = !all->values;
    if (fresh && !values)
        return SPL_OK;
    int rc = spl_scalar_add(all, batch_points, 0, values, count, err);
    all->missing |= fresh && s->points > 0;
    for (size_t i = 0, at = (size_t)((s->step - s->points % s->step) % s->step); values && i < picks; i++)
        s->picked[i] = values[at + i * s->step];
    return rc ? rc : spl_scalar_add(sample, sample_most, s->sampled, values ? s->picked : NULL, picks, err);
}

static int add_batch(struct survey *s, struct spl_scan *scan, uint64_t read, uint32_t scalars, struct spl_error *err)
{
    const size_t first = (size_t)((s->step - s->points % s->step) % s->step);
    size_t picks = s->batch.count > first ? (s->batch.count - first + s->step - 1) / s->step : 0;
    picks = picks > sample_most - s->sampled ? sample_most - s->sampled : picks;
    int rc = spl_scan_grow(scan, &s->batch, read, err);
    if (!rc)
        spl_job_grid_add(s->grid, (const double(*)[3])s->batch.position, s->batch.count);
    for (int k = 0; !rc && k < SPL_SCALAR_COUNT; k++)
        rc = add_scalar(s, k, scalars >> k & 1 ? s->batch.scalar[k] : NULL, picks, err);
    s->points += s->batch.count;
    s->sampled += picks;
    return rc;
}

static void forget(struct spl_scan *scan)
{
    for (int c = 0; c < 3; c++) {
        scan->min[c] = INFINITY;
        scan->max[c] = -INFINITY;
    }
}

static int begin_blocks(const struct survey *s, struct spl_scan *scan, struct spl_error *err)
{
    struct spl_part_blocks *blocks = &scan->blocks;
    size_t most = blocks_of_all / s->scans->count;
    most = most < blocks_some ? blocks_some : most > blocks_most ? blocks_most : most;
    *blocks = (struct spl_part_blocks){.rows = block_rows, .total = scan->rows};
    while (scan->rows / blocks->rows >= most)
        blocks->rows *= 2;
    blocks->count = (size_t)((scan->rows + blocks->rows - 1) / blocks->rows);
    if (blocks->count < blocks_least)
        return SPL_OK;
    double(*boxes)[6] = spl_alloc_raw(blocks->count, sizeof *boxes, err);
    for (size_t i = 0; boxes && i < blocks->count; i++)
        for (int c = 0; c < 3; c++) {
            boxes[i][c] = INFINITY;
            boxes[i][3 + c] = -INFINITY;
        }
    blocks->boxes = (const double(*)[6])boxes;
    return boxes ? SPL_OK : SPL_E_NOMEM;
}

/* Of points that are rows, the first of which is `row`. */
static void add_to_blocks(const struct spl_part_blocks *blocks, const struct spl_point_batch *batch, uint64_t row)
{
    double(*boxes)[6] = (double(*)[6])blocks->boxes;
    for (size_t i = 0; boxes && i < batch->count; i++) {
        size_t block = (size_t)((row + i) / blocks->rows);
        for (int c = 0; block < blocks->count && c < 3; c++) {
            double v = spl_points_coordinate(batch->position[i][c]);
            boxes[block][c] = v < boxes[block][c] ? v : boxes[block][c];
            boxes[block][3 + c] = v > boxes[block][3 + c] ? v : boxes[block][3 + c];
        }
    }
}

static void drop_blocks(struct spl_scan *scan)
{
    free((void *)scan->blocks.boxes);
    scan->blocks = (struct spl_part_blocks){0};
}

static int read_scan(struct survey *s, struct spl_scan *scan, struct spl_error *err)
{
    struct spl_cloud *cloud = NULL;
    struct spl_cloud_options options = s->scans->how;
    char name[128];
    uint64_t read = 0;
    options.colors = &scan->colors;
    options.points = scan->points_total;
    int rc = spl_cloud_open(scan->path, &options, &cloud, err);
    if (rc)
        return rc;
    const struct spl_cloud_info *info = spl_cloud_get_info(cloud);
    snprintf(name, sizeof name, "counting %.100s", scan->name);
    spl_stage_begin(s->stage, name, "points", info->points_expected);
    rc = begin_blocks(s, scan, err);
    while (!rc && (rc = spl_cloud_read(cloud, &s->batch, err)) > 0) {
        if (rc == SPL_CLOUD_AGAIN) { /* what was counted of it weighs twice, which is a matter of balance */
            forget(scan);
            read = 0;
            scan->colors = scan->own_colors = info->colors;
            rc = SPL_OK;
            continue;
        }
        rc = add_batch(s, scan, read, info->scalars, err);
        add_to_blocks(&scan->blocks, &s->batch, read);
        read += s->batch.count;
        spl_stage_add(s->stage, s->batch.count, 0);
        if (!rc)
            rc = spl_stage_check(s->stage, err);
    }
    info = spl_cloud_get_info(cloud);
    scan->stations = info->station_count;
    if (!rc && info->station_count) {
        if ((scan->poses = spl_alloc_raw(info->station_count, sizeof *scan->poses, err)))
            memcpy(scan->poses, info->stations, info->station_count * sizeof *scan->poses);
        else
            rc = SPL_E_NOMEM;
    }
    memcpy(scan->points_from, info->points_from, sizeof scan->points_from);
    scan->points_inside = read;
    if (rc || read != scan->rows || info->points_skipped)
        drop_blocks(scan);
    spl_stage_end(s->stage);
    s->stage->name = "";
    spl_cloud_destroy(cloud);
    return rc;
}

static int settle(struct survey *s, struct spl_part_rules *rules, struct spl_error *err)
{
    int rc = SPL_OK;
    for (int k = 0; k < SPL_SCALAR_COUNT && !rc; k++) {
        struct spl_scalar_values *all = &s->all[k], *sample = &s->sample[k];
        if (!all->values || (spl_scalar_is_constant(all) && !spl_kept_is_named(s->scans->how.keep, k)))
            continue;
        sample->min = all->min;
        sample->max = all->max;
        sample->missing = all->missing;
        sample->floats = all->floats;
        sample->decimals = all->decimals;
        sample->halvings = all->halvings;
        rc = spl_scalar_settle(sample, s->sampled, err);
        rules->scalars |= 1u << k;
        rules->steps[k] = (struct spl_scalar_steps){sample->plain, sample->first, sample->steps_a_unit};
    }
    return rc;
}

int spl_survey(struct spl_scans *scans, struct spl_job_grid *grid, struct spl_part_rules *rules,
               struct spl_stage *stage, struct spl_error *err)
{
    struct survey s = {.scans = scans, .grid = grid, .stage = stage};
    uint64_t expected = 0;
    int rc = spl_point_batch_init(&s.batch, batch_points, err);
    if (!rc && !(s.picked = spl_alloc_raw(batch_points, sizeof *s.picked, err)))
        rc = SPL_E_NOMEM;
    for (size_t i = 0; i < scans->count; i++)
        expected += scans->list[i].points_expected;
    s.step = expected / sample_most + 1;
    spl_stage_plan(stage, "counting", 0.3e-6 * (double)expected, expected);
    for (size_t i = 0; !rc && i < scans->count;) {
        struct spl_error why = {0};
        if (!(rc = read_scan(&s, &scans->list[i], &why))) {
            i++;
            continue;
        }
        if (!(rc = spl_inputs_leave_out(scans->inputs, scans->list[i].path, rc, &why, err)))
            spl_scans_remove(scans, i);
    }
    if (!rc && !scans->count)
        rc = spl_inputs_fail_empty(scans->inputs, err);
    if (!rc)
        rc = settle(&s, rules, err);
    for (int k = 0; k < SPL_SCALAR_COUNT; k++) {
        spl_spill_free(NULL, s.all[k].values);
        spl_spill_free(NULL, s.sample[k].values);
    }
    spl_point_batch_finish(&s.batch);
    free(s.picked);
    return rc;
}
