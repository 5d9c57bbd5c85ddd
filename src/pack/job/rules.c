/* The points of one part: found while scans are read, and what is around them dropped again. Coordinates are compared
 * as the packer keeps them, where what is nearly 0 is 0. Pure. */
#include "pack/job/rules.h"

#include <math.h>
#include <string.h>

#include "pack/points.h"

enum spl_part_place spl_part_find(const struct spl_part_rules *rules, const double low[3], const double high[3],
                                  const double at[3])
{
    bool inside = true, near = true;
    for (int c = 0; c < 3; c++) {
        double v = spl_points_coordinate(at[c]), held = v < low[c] ? low[c] : v > high[c] ? high[c] : v;
        inside &= held >= rules->min[c] && held < rules->max[c];
        near &= v >= rules->min[c] - rules->halo && v <= rules->max[c] + rules->halo;
    }
    return inside ? SPL_PART_INSIDE : near ? SPL_PART_HALO : SPL_PART_OUTSIDE;
}

static bool reaches(const struct spl_part_rules *rules, const double box[6])
{
    bool reaches = true;
    for (int c = 0; c < 3; c++)
        reaches &= box[c] <= rules->max[c] + rules->halo && box[3 + c] >= rules->min[c] - rules->halo;
    return reaches;
}

bool spl_part_next_rows(const struct spl_part_rules *rules, const struct spl_part_blocks *blocks, uint64_t row,
                        uint64_t *begin, uint64_t *end)
{
    size_t block = (size_t)(row / blocks->rows), after;
    while (block < blocks->count && !reaches(rules, blocks->boxes[block]))
        block++;
    if (row >= blocks->total || block >= blocks->count)
        return false;
    for (after = block + 1; after < blocks->count && reaches(rules, blocks->boxes[after]);)
        after++;
    *begin = block * blocks->rows > row ? block * blocks->rows : row;
    *end = after < blocks->count ? after * blocks->rows : blocks->total;
    return true;
}

size_t spl_part_filter(const struct spl_part_rules *rules, const double low[3], const double high[3],
                       struct spl_point_batch *batch, uint32_t scalars, double *numbers, uint8_t *halo)
{
    size_t to = 0, inside = 0;
    for (size_t i = 0; i < batch->count; i++) {
        enum spl_part_place place = spl_part_find(rules, low, high, batch->position[i]);
        if (place == SPL_PART_OUTSIDE)
            continue;
        halo[to] = place == SPL_PART_HALO;
        inside += place == SPL_PART_INSIDE;
        if (to < i) {
            spl_point_batch_move(batch, scalars, to, i);
            if (numbers)
                numbers[to] = numbers[i];
        }
        to++;
    }
    batch->count = to;
    return inside;
}

static void drop(const struct spl_points *p, void *array, size_t size)
{
    char *values = array;
    size_t to = 0;
    for (size_t i = 0; array && i < p->count; i++) {
        if (i % 4096 == 0)
            spl_spill_keep_bound(p->spill);
        if (p->halo[i])
            continue;
        if (to < i)
            memcpy(values + to * size, values + i * size, size);
        to++;
    }
}

static void find_bounds(struct spl_points *p)
{
    for (int c = 0; c < 3 && p->count; c++) {
        double low = spl_points_at(p, c, 0), high = low;
        for (size_t i = 1; i < p->count; i++) {
            if (i % 4096 == 0)
                spl_spill_keep_bound(p->spill);
            low = fmin(low, spl_points_at(p, c, i));
            high = fmax(high, spl_points_at(p, c, i));
        }
        p->bounds_min[c] = low;
        p->bounds_max[c] = high;
    }
}

void spl_part_drop_halo(struct spl_points *p)
{
    size_t left = 0;
    if (!p->halo)
        return;
    for (size_t i = 0; i < p->count; i++)
        left += !p->halo[i];
    for (int c = 0; c < 3; c++)
        drop(p, p->axis[c], spl_points_axis_bytes(p));
    drop(p, p->color_class, sizeof *p->color_class);
    drop(p, p->station, sizeof *p->station);
    drop(p, p->normal, sizeof *p->normal);
    drop(p, p->linear, sizeof *p->linear);
    drop(p, p->radius, sizeof *p->radius);
    drop(p, p->uncertainty, sizeof *p->uncertainty);
    drop(p, p->clip, sizeof *p->clip);
    for (int s = 0; s < SPL_POINT_SCALARS; s++)
        if (p->scalar[s].values)
            drop(p, p->scalar[s].values, spl_scalar_bytes(&p->scalar[s]));
    p->halo_points = p->count - left;
    p->count = p->capacity = left;
    p->duplicates = p->points_read > left ? p->points_read - left : 0;
    spl_spill_free(p->spill, p->halo);
    p->halo = NULL;
    find_bounds(p);
}
