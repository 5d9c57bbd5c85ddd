/* Rays go by half cells: what they miss is a corner. Pure but for the cells that are made once. */
#include "pack/view/cells.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"

int spl_view_cells_init(struct spl_view_cells *c, const struct spl_view_sample *s, int across, struct spl_error *err)
{
    double extent = 0;
    size_t count = 1;
    for (int a = 0; a < 3; a++)
        extent = fmax(extent, s->high[a] - s->low[a]);
    *c = (struct spl_view_cells){.cell = extent / (across - 1)};
    for (int a = 0; a < 3; a++) {
        c->low[a] = s->low[a] - 0.5 * c->cell;
        c->size[a] = (int)((s->high[a] - c->low[a]) / c->cell) + 1;
        count *= (size_t)c->size[a];
    }
    if (!(c->full = spl_alloc(count, 1, err)))
        return SPL_E_NOMEM;
    for (size_t i = 0; i < s->count; i++) {
        int at[3];
        for (int a = 0; a < 3; a++)
            at[a] = (int)((s->at[i][a] - c->low[a]) / c->cell);
        c->full[((size_t)at[2] * (size_t)c->size[1] + (size_t)at[1]) * (size_t)c->size[0] + (size_t)at[0]] = 1;
    }
    return 0;
}

double spl_view_cells_look(const struct spl_view_cells *c, const double eye[3], const double way[3], bool *hit)
{
    int own[3];
    for (int a = 0; a < 3; a++)
        own[a] = (int)floor((eye[a] - c->low[a]) / c->cell);
    for (double t = 0;; t += 0.5 * c->cell) {
        int at[3];
        bool near = true, in = true;
        for (int a = 0; a < 3; a++) {
            at[a] = (int)floor((eye[a] + t * way[a] - c->low[a]) / c->cell);
            near = near && at[a] >= own[a] - 1 && at[a] <= own[a] + 1;
            in = in && at[a] >= 0 && at[a] < c->size[a];
        }
        *hit = in && !near && spl_view_cells_has(c, at[0], at[1], at[2]);
        if (*hit || !in)
            return t;
    }
}
