/* Where the points are, by quantiles: the box begins at a hundredth of them from either end, or within a gap as wide as
 * most of the scan, and goes on outwards as long as there is no gap, so that a mast or a wire that few points show
 * belongs to it, and a bird or noise far off does not. One thread; the outcome depends on the points alone. */
#include "pack/view/sample.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "geom/vector.h"
#include "pack/bulk.h"
#include "pack/median.h"
#include "pack/up.h"

enum { sample_max = 200000, tail = 100 };
static const double gap_most = 0.04, beyond_most = 0.3; /* of the larger extent of the bulk */

void spl_view_to_world(const struct spl_view_sample *s, const double local[3], double world[3])
{
    for (int c = 0; c < 3; c++)
        world[c] = s->frame[0][c] * local[0] + s->frame[1][c] * local[1] + s->frame[2][c] * local[2];
}

void spl_view_to_frame(const struct spl_view_sample *s, const double world[3], double local[3])
{
    for (int a = 0; a < 3; a++)
        local[a] = dot3(s->frame[a], world);
}

double spl_view_sample_width(const struct spl_view_sample *s)
{
    return fmax(s->high[0] - s->low[0], s->high[1] - s->low[1]);
}

/* From sorted[from] on by `step` (1 or -1) as far as there is no gap, and not beyond `end`. */
static double walk(const double *sorted, size_t count, size_t from, int step, double gap, double beyond)
{
    double begin = sorted[from], at = begin;
    for (size_t i = from; i + (size_t)step < count; i += (size_t)step) {
        double next = sorted[i + (size_t)step];
        if (fabs(next - at) > gap || fabs(next - begin) > beyond)
            break;
        at = next;
    }
    return at;
}

static int find_box(struct spl_view_sample *s, size_t count, struct spl_error *err)
{
    double *sorted[3] = {0}, width = 0, extent = 0, radius;
    if (!(sorted[0] = spl_alloc_raw(count, sizeof **sorted, err)))
        return SPL_E_NOMEM;
    for (size_t i = 0; i < count; i++)
        sorted[0][i] = (double)s->area[i];
    radius = 10 * sqrt(spl_nth(sorted[0], count, count / 2));
    for (int a = 0; a < 3; a++) /* what doubles tell apart there */
        radius = fmax(radius, 1e-14 * fabs(s->at[count / 2][a]));
    size_t first[3], last[3];
    int rc = 0;
    for (int a = 0; !rc && a < 3; a++) {
        if (!sorted[a] && !(sorted[a] = spl_alloc_raw(count, sizeof **sorted, err))) {
            rc = SPL_E_NOMEM;
            break;
        }
        for (size_t i = 0; i < count; i++)
            sorted[a][i] = s->at[i][a];
        width = fmax(width, spl_bulk_order(sorted[a], count));
    }
    for (int a = 0; !rc && a < 3; a++) {
        spl_bulk_find(sorted[a], count, count / tail, width, &first[a], &last[a]);
        extent = fmax(extent, sorted[a][last[a]] - sorted[a][first[a]]);
    }
    for (int a = 0; !rc && a < 3; a++) {
        s->low[a] = walk(sorted[a], count, first[a], -1, gap_most * extent, beyond_most * extent);
        s->high[a] = walk(sorted[a], count, last[a], 1, gap_most * extent, beyond_most * extent);
        if (s->high[a] - s->low[a] < radius) { /* of a single point, too, there is something to see */
            s->low[a] -= radius;
            s->high[a] += radius;
        }
    }
    for (int a = 0; a < 3; a++)
        free(sorted[a]);
    return rc;
}

/* Keeps what lies within the box. */
static void keep(struct spl_view_sample *s, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        bool inside = true;
        for (int a = 0; a < 3; a++)
            inside = inside && s->at[i][a] >= s->low[a] && s->at[i][a] <= s->high[a];
        if (!inside)
            continue;
        memcpy(s->at[s->count], s->at[i], sizeof *s->at);
        if (s->normal)
            memcpy(s->normal[s->count], s->normal[i], sizeof *s->normal);
        s->area[s->count++] = s->area[i];
    }
}

int spl_view_sample_init(struct spl_view_sample *s, const struct spl_points *p, double unit_m, bool sides,
                         struct spl_error *err)
{
    size_t count = p->count < sample_max ? p->count : sample_max;
    bool surface = p->normal && !p->no_surface;
    *s = (struct spl_view_sample){.metre = unit_m > 0 ? 1 / unit_m : 0, .sides = sides && surface};
    spl_up_get_frame(p->up, s->frame);
    if (!(s->at = spl_alloc_raw(count, sizeof *s->at, err)) ||
        !(s->area = spl_alloc_raw(count, sizeof *s->area, err)) ||
        (surface && !(s->normal = spl_alloc_raw(count, sizeof *s->normal, err))))
        return SPL_E_NOMEM;
    for (size_t k = 0; k < count; k++) {
        size_t i = k * p->count / count;
        spl_spill_keep_bound(p->spill); /* each is in pages of its own */
        spl_view_to_frame(s, (double[]){spl_points_at(p, 0, i), spl_points_at(p, 1, i), spl_points_at(p, 2, i)},
                          s->at[k]);
        s->area[k] = p->radius[i] * p->radius[i];
        for (int a = 0; s->normal && a < 3; a++)
            s->normal[k][a] =
                (float)(s->frame[a][0] * (double)p->normal[i][0] + s->frame[a][1] * (double)p->normal[i][1] +
                        s->frame[a][2] * (double)p->normal[i][2]);
    }
    int rc = find_box(s, count, err);
    if (!rc)
        keep(s, count);
    return rc;
}

void spl_view_sample_finish(struct spl_view_sample *s)
{
    free(s->at);
    free(s->normal);
    free(s->area);
    *s = (struct spl_view_sample){0};
}
