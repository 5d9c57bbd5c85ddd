/* Lists are filled cell by cell from the points, which lie in a row: each by one worker, in their order. A cell with
 * more labels than a list holds keeps the first ones; what it leaves out is met at a finer level. */
#include "pack/planes/lists.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "pack/planes/planes.h"

enum { grain = 1 << 12 };
static const double cell_points = 6; /* of the finest level, on the average */

struct fill {
    const struct spl_points *points;
    const struct spl_cells *cells;
    const uint32_t *label;
    struct spl_plane_list *lists;
    const struct spl_plane_part *part; /* NULL: all cells are filled */
};

int spl_plane_levels_init(struct spl_plane_levels *levels, const struct spl_points *points, unsigned threads,
                          struct spl_error *err)
{
    *levels = (struct spl_plane_levels){0};
    int rc = spl_cells_init(&levels->cells[0], points, cell_points, threads, err);
    levels->count = 1;
    while (!rc && levels->count < SPL_PLANE_LEVELS) {
        const struct spl_cells *below = &levels->cells[levels->count - 1];
        if (below->count < 8 || below->shift + 1 > SPL_CELLS_SHIFT_MAX)
            break;
        rc = spl_cells_init_above(&levels->cells[levels->count++], below, threads, err);
    }
    if (!rc &&
        !(levels->lists = spl_spill_alloc_raw(points->spill, levels->cells[0].count, sizeof *levels->lists, err)))
        rc = SPL_E_NOMEM;
    return rc;
}

uint32_t spl_plane_cell_of(const struct spl_cells *cells, size_t point)
{
    uint32_t low = 0, high = cells->count;
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (cells->cells[middle].begin <= point)
            low = middle;
        else
            high = middle;
    }
    return low;
}

static void fill_lists(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct fill *f = context;
    const uint8_t *linear = f->points->linear;
    const struct spl_cells *coarse = f->part ? f->part->coarse : NULL;
    uint32_t above = coarse ? spl_plane_cell_of(coarse, f->cells->cells[begin].begin) : 0;
    (void)worker;
    for (size_t k = begin; k < end; k++) {
        while (coarse && coarse->cells[above + 1].begin <= f->cells->cells[k].begin)
            above++;
        if (coarse && !atomic_load_explicit(&f->part->where[above], memory_order_relaxed))
            continue;
        struct spl_plane_list *list = &f->lists[k];
        memset(list->label, 0xff, sizeof list->label);
        memset(list->count, 0, sizeof list->count);
        list->open = list->linear = 0;
        for (size_t i = f->cells->cells[k].begin; i < f->cells->cells[k + 1].begin; i++) {
            uint32_t label = f->label[i];
            if (label == SPL_NO_PLANE) {
                bool thin = linear && linear[i];
                list->open += !thin;
                list->linear += thin && list->linear < UINT16_MAX;
                continue;
            }
            for (int s = 0; s < SPL_PLANE_LIST; s++) {
                if (list->label[s] == SPL_NO_PLANE)
                    list->label[s] = label;
                if (list->label[s] != label)
                    continue;
                list->count[s] += list->count[s] < UINT16_MAX;
                break;
            }
        }
    }
}

void spl_plane_levels_fill(struct spl_plane_levels *levels, unsigned k, const struct spl_points *points,
                           const uint32_t *label, unsigned threads)
{
    spl_plane_levels_fill_part(levels, k, points, label, NULL, threads);
}

void spl_plane_levels_fill_part(struct spl_plane_levels *levels, unsigned k, const struct spl_points *points,
                                const uint32_t *label, const struct spl_plane_part *part, unsigned threads)
{
    struct fill fill = {points, &levels->cells[k], label, levels->lists, part};
    spl_parallel_for(threads, fill.cells->count, grain, fill_lists, &fill);
}

void spl_plane_levels_finish(struct spl_plane_levels *levels)
{
    spl_spill_free(levels->cells[0].spill, levels->lists);
    for (unsigned k = 0; k < levels->count; k++)
        spl_cells_finish(&levels->cells[k]);
    *levels = (struct spl_plane_levels){0};
}
