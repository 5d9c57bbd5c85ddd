/* What lies beside chains. A pole or a pipe has, where it is scanned closely, several points side by side all along it:
 * chains would be so many lines, and the pole a bundle of wires. It is a surface, which discs show. Of a pole that one
 * row of points lies on nothing says how thick it is; but it is thicker than a wire, so no line is made of what stands
 * upright.
 *
 * The search for linear points judges cells, and misses points at a wire's joints, ends and gaps: each would be a disc,
 * as large as the points are apart, on the line that runs through it. */
#include "pack/wires/sides.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "pack/planes/planes.h"
#include "pack/wires/grid.h"

static const double upright = 0.94;   /* cosine: what stands within 20 degrees of up; guys and stays lean more */
static const double around = 1.5;     /* spacings within which others are looked for */
static const double aside = 0.5;      /* spacings off the chain from which on they are beside it */
enum { beside_least = 2, looks_most = 64, every = 4096 };

static double median_spacing(const struct spl_wire_point *p, uint32_t count)
{
    double sum = 0; /* the geometric mean, which needs no memory */
    for (uint32_t i = 0; i < count; i++)
        sum += log(p[i].spacing);
    return exp(sum / count);
}

/* Has point `i` of a chain that goes along `axis` others beside it? */
static bool is_accompanied(const struct spl_wires_grid *grid, const struct spl_wire_point *p, uint32_t i,
                           const double axis[3])
{
    double reach = fmin(around * p[i].spacing, grid->edge), limit = aside * p[i].spacing;
    uint32_t beside = 0;
    for (int k = 0; k < 27; k++) {
        size_t first,
            end = spl_wires_grid_find(grid, p[i].position, (int[3]){k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1}, &first);
        end = end - first > looks_most ? first + looks_most : end;
        for (size_t m = first; m < end; m++) {
            double squared = 0, along = 0;
            for (int c = 0; c < 3; c++) {
                double off = p[grid->cells[m].item].position[c] - p[i].position[c];
                squared += off * off;
                along += off * axis[c];
            }
            beside += squared <= reach * reach && squared - along * along >= limit * limit;
        }
    }
    return beside >= beside_least;
}

int spl_wires_drop_thick(struct spl_wire_point *points, uint32_t count, const double up[3], struct spl_wires_work *work,
                         struct spl_error *err)
{
    struct spl_wires_grid grid = {.edge = count ? around * median_spacing(points, count) : 1};
    int rc = SPL_OK;
    for (uint32_t i = 0; i < count; i++)
        for (int c = 0; c < 3; c++)
            grid.low[c] = i ? fmin(grid.low[c], points[i].position[c]) : points[i].position[c];
    for (uint32_t i = 0; i < count && !rc; i++)
        rc = spl_wires_grid_add(&grid, points[i].position, i, err);
    spl_wires_grid_sort(&grid);
    for (uint32_t i = 0; i < count && !rc; i++) {
        const struct spl_wire_point *from = &points[i], *to = &points[from->other];
        uint32_t all = 0, accompanied = 0;
        double axis[3], length = 0;
        if (!spl_wires_is_begin(points, i))
            continue;
        for (int c = 0; c < 3; c++) {
            axis[c] = to->position[c] - from->position[c];
            length += axis[c] * axis[c];
        }
        for (int c = 0; c < 3; c++)
            axis[c] /= sqrt(length);
        bool stands = fabs(axis[0] * up[0] + axis[1] * up[1] + axis[2] * up[2]) >= upright;
        for (uint32_t pass = 0; pass < 2; pass++)
            for (uint32_t before = SPL_WIRE_END, at = i; at != SPL_WIRE_END;) {
                uint32_t next = points[at].next[before != SPL_WIRE_END && points[at].next[0] == before];
                if (pass)
                    points[at].width = stands || 2 * accompanied > all ? 0 : points[at].width;
                accompanied += !pass && !stands && is_accompanied(&grid, points, at, axis);
                all += !pass;
                before = at;
                at = at == from->other ? SPL_WIRE_END : next;
            }
        rc = spl_stage_check(work->stage, err);
    }
    for (uint32_t i = 0; i < count && !rc; i++)
        if (points[i].beside != SPL_WIRE_END)
            points[i].width = points[points[i].beside].width;
    spl_wires_grid_finish(&grid);
    return rc;
}

/* How far off a piece points are its line's. */
static double reach_of(const struct spl_wire_vertex *v, double noise)
{
    return fmax(0.75 * (double)v->width + 3 * noise, 0.25 * (double)v->radius);
}

static bool is_on(const struct spl_wire_vertex *v, const double at[3], double reach)
{
    double along = 0, length = 0, squared = 0;
    for (int c = 0; c < 3; c++) {
        double way = v[1].position[c] - v[0].position[c];
        along += (at[c] - v[0].position[c]) * way;
        length += way * way;
    }
    double t = length > 0 ? fmin(fmax(along / length, 0), 1) : 0;
    for (int c = 0; c < 3; c++) {
        double off = v[0].position[c] + t * (v[1].position[c] - v[0].position[c]) - at[c];
        squared += off * off;
    }
    return squared <= reach * reach;
}

static double length_of(const struct spl_wire_vertex *v)
{
    double squared = 0;
    for (int c = 0; c < 3; c++)
        squared += (v[1].position[c] - v[0].position[c]) * (v[1].position[c] - v[0].position[c]);
    return sqrt(squared);
}

/* Adds a piece to the cells that its reach, which is a quarter of one at most, touches: stretch by stretch, each no
 * longer than a cell, those of the box around it. `grid` NULL: only counts them. */
static int add_piece(struct spl_wires_grid *grid, double edge, const double low[3], const struct spl_wire_vertex *v,
                     uint32_t piece, double reach, size_t *count, struct spl_error *err)
{
    uint32_t steps = (uint32_t)fmin(ceil(length_of(v) / edge), 1e6);
    int rc = SPL_OK;
    steps += !steps;
    for (uint32_t s = 0; s < steps; s++) {
        double first[3];
        uint32_t across[3];
        for (int c = 0; c < 3; c++) {
            double way = v[1].position[c] - v[0].position[c];
            double from = v[0].position[c] + way * s / steps, to = v[0].position[c] + way * (s + 1) / steps;
            first[c] = floor((fmin(from, to) - reach - low[c]) / edge);
            across[c] = (uint32_t)(floor((fmax(from, to) + reach - low[c]) / edge) - first[c]) + 1;
        }
        *count += (size_t)across[0] * across[1] * across[2];
        for (uint32_t k = 0; grid && k < across[0] * across[1] * across[2] && !rc; k++) {
            const uint32_t at[3] = {k % across[0], k / across[0] % across[1], k / across[0] / across[1]};
            double middle[3];
            for (int c = 0; c < 3; c++)
                middle[c] = low[c] + (first[c] + at[c] + 0.5) * edge;
            rc = spl_wires_grid_add(grid, middle, piece, err);
        }
    }
    return rc;
}

/* The pieces by the cells that they reach into: some 2 to 6 each, of 16 bytes, since a cell is twice as wide as pieces
 * are long. */
static int lay_pieces(struct spl_wires_grid *grid, const struct spl_wires *w, double noise, struct spl_error *err)
{
    double length = 0;
    size_t pieces = 0, count = 0;
    int rc = SPL_OK;
    for (size_t i = 0; i < w->count; i++) {
        bool begins = w->vertices[i].point != SPL_WIRE_END && i + 1 < w->count;
        grid->edge = fmax(grid->edge, 4 * reach_of(&w->vertices[i], noise));
        length += begins ? length_of(&w->vertices[i]) : 0;
        pieces += begins;
    }
    grid->edge = fmax(grid->edge, pieces ? 2 * length / (double)pieces : 0);
    for (int adds = 0; adds < 2 && !rc; adds++) {
        rc = adds ? spl_wires_grid_reserve(grid, count, err) : SPL_OK;
        for (size_t i = 0; i + 1 < w->count && !rc; i++)
            if (w->vertices[i].point != SPL_WIRE_END)
                rc = add_piece(adds ? grid : NULL, grid->edge, grid->low, &w->vertices[i], (uint32_t)i,
                               reach_of(&w->vertices[i], noise), &count, err);
    }
    spl_wires_grid_sort(grid);
    return rc;
}

static void claim_points(const struct spl_wires_grid *grid, const struct spl_wires *w, struct spl_points *p,
                         double noise, const struct spl_stage *stage)
{
    for (size_t i = 0; i < p->count; i++) {
        if (i % every == 0)
            spl_spill_keep_bound(p->spill);
        if (i % every == 0 && spl_stage_is_cancelled(stage))
            return;
        if (p->linear[i] || (p->plane && p->plane[i] != SPL_NO_PLANE))
            continue;
        const double at[3] = {spl_points_at(p, 0, i), spl_points_at(p, 1, i), spl_points_at(p, 2, i)};
        size_t first, end = spl_wires_grid_find(grid, at, (int[3]){0}, &first);
        for (; first < end && !p->linear[i]; first++) {
            const struct spl_wire_vertex *v = &w->vertices[grid->cells[first].item];
            p->linear[i] = is_on(v, at, reach_of(v, noise));
        }
    }
}

int spl_wires_claim(const struct spl_wires *wires, struct spl_points *points, double noise,
                    const struct spl_stage *stage, struct spl_error *err)
{
    struct spl_wires_grid grid = {0};
    memcpy(grid.low, points->bounds_min, sizeof grid.low);
    int rc = lay_pieces(&grid, wires, noise, err);
    if (!rc)
        claim_points(&grid, wires, points, noise, stage);
    spl_wires_grid_finish(&grid);
    return rc ? rc : spl_stage_check(stage, err);
}
