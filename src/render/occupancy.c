/* Counts as a two-dimensional difference array (modulo 2^64, so negative differences are fine) and sums once. */
#include "render/occupancy.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "shared.h"

enum { cell = 16 };

int spl_occupancy_init(struct spl_occupancy *occupancy, uint32_t width, uint32_t height, struct spl_error *err)
{
    *occupancy = (struct spl_occupancy){.columns = width / cell + 2, .rows = height / cell + 2};
    occupancy->cells = spl_alloc((size_t)occupancy->columns * occupancy->rows, sizeof *occupancy->cells, err);
    return occupancy->cells ? SPL_OK : SPL_E_NOMEM;
}

void spl_occupancy_finish(struct spl_occupancy *occupancy)
{
    free(occupancy->cells);
    *occupancy = (struct spl_occupancy){0};
}

/* First cell and one past the last that samples of [low, high] fall into, within `count` usable cells. */
static void span(double low, double high, uint32_t count, uint32_t *first, uint32_t *end)
{
    double a = floor(low / cell), b = floor(high / cell) + 1;
    *first = a > 0 ? (a < count ? (uint32_t)a : count) : 0;
    *end = b > 0 ? (b < count ? (uint32_t)b : count) : 0;
}

void spl_occupancy_add(struct spl_occupancy *occupancy, const double low[2], const double high[2], uint32_t splats)
{
    uint32_t x0, x1, y0, y1, stride = occupancy->columns;
    span(low[0], high[0], occupancy->columns - 1, &x0, &x1);
    span(low[1], high[1], occupancy->rows - 1, &y0, &y1);
    occupancy->cells[y0 * stride + x0] += splats;
    occupancy->cells[y0 * stride + x1] -= splats;
    occupancy->cells[y1 * stride + x0] -= splats;
    occupancy->cells[y1 * stride + x1] += splats;
}

void spl_occupancy_add_everywhere(struct spl_occupancy *occupancy, uint32_t splats)
{
    occupancy->everywhere += splats;
}

void spl_occupancy_join(struct spl_occupancy *to, const struct spl_occupancy *from)
{
    const size_t cells = (size_t)to->columns * to->rows;
    spl_assert(from->columns == to->columns && from->rows == to->rows);
    for (size_t i = 0; i < cells; i++)
        to->cells[i] += from->cells[i];
    to->everywhere += from->everywhere;
}

uint64_t spl_occupancy_bound(struct spl_occupancy *occupancy)
{
    uint64_t most = 0, *cells = occupancy->cells;
    uint32_t stride = occupancy->columns;
    for (uint32_t y = 0; y < occupancy->rows; y++) {
        uint64_t row = 0;
        for (uint32_t x = 0; x < stride; x++) {
            row += cells[y * stride + x];
            cells[y * stride + x] = row + (y ? cells[(y - 1) * stride + x] : 0);
            if (cells[y * stride + x] > most)
                most = cells[y * stride + x];
        }
    }
    return most + occupancy->everywhere;
}

uint32_t spl_occupancy_weight(uint64_t splats, uint64_t panels)
{
    const uint64_t most = UINT32_MAX / 512, cells = SPL_PANEL_SIDE * SPL_PANEL_SIDE;
    if (panels >= most / cells || splats > most)
        return 0;
    uint64_t all = splats + panels, weight = (most - panels * cells) / (all ? all : 1);
    return weight > 255 ? 255 : (uint32_t)weight;
}
