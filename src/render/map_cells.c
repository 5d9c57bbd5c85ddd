/* Cells by station; see map_cells.h. A bit a cell, of stations that a tile meets. */
#include "render/map_cells.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "render/select.h"

/* Around what a box projects to: for what discs reach beyond it and what is rounded, and no round number, so that tiles
 * and the whole image, whose doubles differ in the last place, do not fall on two sides of a cell's edge. */
static const double around = 2.37;

int spl_map_cells_init(struct spl_map_cells *cells, const struct spl_select_params *params, struct spl_error *err)
{
    *cells = (struct spl_map_cells){.params = params};
    uint32_t count = spl_dataset_get_info(params->dataset)->maps;
    if (!params->maps || !count)
        return SPL_OK;
    const uint32_t size[2] = {params->camera->width, params->camera->height};
    for (int i = 0; i < 2; i++) {
        cells->first[i] = params->corner[i] / SPL_MAP_CELL;
        cells->size[i] = (params->corner[i] + size[i] - 1) / SPL_MAP_CELL - cells->first[i] + 1;
    }
    cells->count = count;
    cells->answers = spl_alloc(count, sizeof *cells->answers, err);
    cells->cells = spl_alloc(count, sizeof *cells->cells, err);
    if (cells->answers && cells->cells)
        return SPL_OK;
    spl_map_cells_finish(cells);
    return SPL_E_NOMEM;
}

void spl_map_cells_finish(struct spl_map_cells *cells)
{
    for (uint32_t i = 0; i < cells->count && cells->cells; i++)
        free(cells->cells[i]);
    free(cells->cells);
    free(cells->answers);
    *cells = (struct spl_map_cells){0};
}

static bool has_map(struct spl_map_cells *cells, uint32_t station)
{
    uint8_t *answer = &cells->answers[station];
    if (!*answer)
        *answer = 1 + (uint8_t)cells->params->mapped(cells->params->context, station);
    return *answer == 1 + SPL_SELECT_YES;
}

static uint64_t row_words(const struct spl_map_cells *cells)
{
    return (cells->size[0] + 63) / 64;
}

/* The cells [first, end) that what lies in front of the near plane of the box can project to. */
static void find_cells(const struct spl_map_cells *cells, const struct spl_view_box *box, uint32_t first[2],
                       uint32_t end[2])
{
    const struct spl_camera *camera = cells->params->camera;
    const double focal[2] = {camera->fx, camera->fy}, center[2] = {camera->cx, camera->cy};
    double near = fmax(box->center[2] - box->half[2], camera->near), far = fmax(box->center[2] + box->half[2], near);
    near = spl_camera_ray_scale(camera, near);
    far = spl_camera_ray_scale(camera, far);
    for (int i = 0; i < 2; i++) {
        double a = box->center[i] - box->half[i], b = box->center[i] + box->half[i];
        double low = focal[i] * (a / (a < 0 ? near : far)) + center[i] - around;
        double high = focal[i] * (b / (b > 0 ? near : far)) + center[i] + around;
        double corner = cells->params->corner[i], size = cells->size[i];
        first[i] = (uint32_t)fmin(fmax(floor((low + corner) / SPL_MAP_CELL) - cells->first[i], 0), size);
        end[i] = (uint32_t)fmin(fmax(floor((high + corner) / SPL_MAP_CELL) + 1 - cells->first[i], 0), size);
    }
}

static int mark(struct spl_map_cells *cells, uint32_t station, const uint32_t first[2], const uint32_t end[2],
                struct spl_error *err)
{
    uint64_t words = row_words(cells), **bits = &cells->cells[station];
    if (!*bits && !(*bits = spl_alloc(words * cells->size[1], sizeof **bits, err)))
        return SPL_E_NOMEM;
    for (uint32_t y = first[1]; y < end[1]; y++) {
        uint64_t *row = *bits + y * words;
        for (uint32_t x = first[0]; x < end[0]; x = (x / 64 + 1) * 64) {
            uint64_t rest = end[0] - x, from = ~0ull << x % 64;
            row[x / 64] |= rest < 64 - x % 64 ? from & ((1ull << (x % 64 + rest)) - 1) : from;
        }
    }
    return SPL_OK;
}

int spl_map_cells_add(struct spl_map_cells *cells, const struct spl_chunk_stations *seen,
                      const struct spl_view_box *box, struct spl_draw_list *list, struct spl_error *err)
{
    const struct spl_select_params *params = cells->params;
    uint32_t own = seen->seen_by[0] & SPL_STATION_ROW, first[2], end[2];
    int trims = 0;
    if (own && seen->seen_by[0] & SPL_STATION_TRIMS && params->maps & SPL_MAP_TRIMS) {
        trims = has_map(cells, own - 1) ? (int)own : 0;
        list->complete &= trims != 0;
    }
    if (!(params->maps & SPL_MAP_COLORS))
        return trims;
    find_cells(cells, box, first, end);
    for (int i = 0; i < SPL_CHUNK_STATIONS && seen->seen_by[i]; i++) {
        uint32_t station = (seen->seen_by[i] & SPL_STATION_ROW) - 1;
        bool has = has_map(cells, station);
        list->complete &= has;
        int rc = has ? mark(cells, station, first, end, err) : SPL_OK;
        if (rc)
            return rc;
    }
    return trims;
}

int spl_map_cells_lay_out(const struct spl_map_cells *cells, struct spl_draw_list *list, struct spl_error *err)
{
    uint64_t words = row_words(cells);
    int rc = SPL_OK;
    for (uint32_t s = 0; s < cells->count && !rc; s++) {
        const uint64_t *bits = cells->cells[s];
        uint32_t count = 0;
        for (uint64_t i = 0; bits && i < words * cells->size[1]; i++)
            count += (uint32_t)__builtin_popcountll(bits[i]);
        if (!count)
            continue;
        rc = spl_draw_list_add_map(list, s, count, err);
        for (uint32_t y = 0; y < cells->size[1] && !rc; y++)
            for (uint32_t x = 0; x < cells->size[0]; x++)
                if (bits[y * words + x / 64] >> x % 64 & 1)
                    list->entries[list->entry_count++] = (cells->first[0] + x) | (cells->first[1] + y) << 16;
    }
    return rc;
}
