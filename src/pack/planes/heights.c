/* The fit is one sum for each vertex over the points within two squares of it: a hash of vertices, filled in the order
 * of the points, so the result depends on them alone. One worker's while it is fitted; read by any afterwards. */
#include "pack/planes/heights.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/hash.h"
#include "base/memory.h"
#include "dataset/panels.h"

enum { reach = 2, points_least = 8, passes = 2 };
static const double ridge = 1e-4;      /* of a vertex's weight, against bends */
static const double most = 1 << 29;    /* squares either way */
static const double most_length = 1.6; /* secant of the steepest slope: 51 degrees */

struct fitting {
    struct spl_heights *heights;
    struct spl_quadratic_sums *sums; /* of each vertex */
    uint32_t *counts;
    size_t capacity, sums_capacity, counts_capacity;
};

void spl_heights_init(struct spl_heights *r, const double origin[3], const double normal[3], double edge)
{
    struct spl_panel_plane plane = {.cell = 1};
    struct spl_panel_frame frame;
    struct spl_chunk chunk;
    for (int c = 0; c < 3; c++)
        plane.normal[c] = (float)normal[c];
    spl_panels_begin(&plane, &chunk);
    spl_panels_get_frame(&chunk, &frame);
    *r = (struct spl_heights){.edge = edge};
    for (int c = 0; c < 3; c++) {
        r->origin[c] = origin[c];
        r->u[c] = frame.u[c];
        r->v[c] = frame.v[c];
        r->normal[c] = frame.normal[c];
    }
}

void spl_heights_finish(struct spl_heights *r)
{
    free(r->vertices);
    free(r->slots);
    *r = (struct spl_heights){0};
}

/* Index of a vertex, or of the slot where it would be. */
static size_t find_slot(const struct spl_heights *r, int32_t column, int32_t row)
{
    size_t at = spl_hash_slot(spl_hash_pair(column, row), r->mask);
    while (r->slots[at] && (r->vertices[r->slots[at] - 1].column != column || r->vertices[r->slots[at] - 1].row != row))
        at = (at + 1) & r->mask;
    return at;
}

static bool make_slots(struct spl_heights *r, uint32_t room)
{
    free(r->slots);
    r->mask = room - 1;
    r->slots = spl_alloc(room, sizeof *r->slots, NULL);
    if (!r->slots)
        return false;
    for (uint32_t k = 0; k < r->count; k++)
        r->slots[find_slot(r, r->vertices[k].column, r->vertices[k].row)] = k + 1;
    return true;
}

static const struct spl_heights_vertex *find(const struct spl_heights *r, int32_t column, int32_t row)
{
    uint32_t slot = r->slots ? r->slots[find_slot(r, column, row)] : 0;
    return slot ? &r->vertices[slot - 1] : NULL;
}

uint32_t spl_heights_vertex_at(const struct spl_heights *r, const double at[2])
{
    double x = floor(at[0] / r->edge + 0.5), y = floor(at[1] / r->edge + 0.5);
    if (!(fabs(x) < most && fabs(y) < most))
        return UINT32_MAX;
    const struct spl_heights_vertex *v = find(r, (int32_t)x, (int32_t)y);
    return v ? (uint32_t)(v - r->vertices) : UINT32_MAX;
}

/* The vertex, which is made where it is not yet; UINT32_MAX: no memory. */
static uint32_t take_vertex(struct fitting *f, int32_t column, int32_t row)
{
    struct spl_heights *r = f->heights;
    if ((!r->slots || 2 * (r->count + 1) > r->mask) && !make_slots(r, r->slots ? 2 * (r->mask + 1) : 256))
        return UINT32_MAX;
    size_t at = find_slot(r, column, row);
    if (r->slots[at])
        return r->slots[at] - 1;
    if (spl_array_reserve(r->vertices, f->capacity, (size_t)r->count + 1, NULL) ||
        spl_array_reserve(f->sums, f->sums_capacity, (size_t)r->count + 1, NULL) ||
        spl_array_reserve(f->counts, f->counts_capacity, (size_t)r->count + 1, NULL))
        return UINT32_MAX;
    r->vertices[r->count] = (struct spl_heights_vertex){.column = column, .row = row};
    f->sums[r->count] = (struct spl_quadratic_sums){0};
    f->counts[r->count] = 0;
    r->slots[at] = ++r->count;
    return r->count - 1;
}

static bool add_point(struct fitting *f, const double at[3])
{
    double x = at[0] / f->heights->edge, y = at[1] / f->heights->edge, z = at[2] / f->heights->edge;
    if (!(fabs(x) < most && fabs(y) < most))
        return true;
    int32_t column = (int32_t)floor(x), row = (int32_t)floor(y);
    for (int32_t j = row - reach + 1; j <= row + reach; j++)
        for (int32_t i = column - reach + 1; i <= column + reach; i++) {
            double dx = x - i, dy = y - j, near = 1 - (dx * dx + dy * dy) / (reach * reach);
            if (!(near > 0))
                continue;
            uint32_t vertex = take_vertex(f, i, j);
            if (vertex == UINT32_MAX)
                return false;
            spl_quadratic_add(&f->sums[vertex], dx, dy, z, near * near);
            f->counts[vertex]++;
        }
    return true;
}

/* Vertices that have enough points are solved, the others are left out. */
static bool solve(struct fitting *f)
{
    struct spl_heights *r = f->heights;
    uint32_t kept = 0;
    for (uint32_t k = 0; k < r->count; k++) {
        if (f->counts[k] < points_least)
            continue;
        r->vertices[kept] = r->vertices[k];
        kept += spl_quadratic_solve(&f->sums[k], ridge, r->vertices[kept].q);
    }
    r->count = kept;
    return make_slots(r, r->mask + 1);
}

bool spl_heights_fit(struct spl_heights *r, const struct spl_points *points, const uint32_t *member, size_t count,
                     const float *bound)
{
    struct fitting f = {.heights = r};
    uint8_t *out = spl_alloc(count, 1, NULL);
    bool ok = out;
    for (int pass = 0; ok && pass < passes; pass++) {
        for (size_t k = 0; pass && k < count; k++)
            out[k] = !(spl_heights_off(r, points, member[k], NULL) <= (double)bound[k]);
        struct spl_heights fresh = *r;
        fresh.vertices = NULL;
        fresh.slots = NULL;
        fresh.count = fresh.mask = 0;
        free(r->vertices);
        free(r->slots);
        *r = fresh;
        f.capacity = 0;
        for (size_t k = 0; ok && k < count; k++) {
            double at[3];
            spl_heights_place(r, points, member[k], at);
            ok = out[k] || add_point(&f, at);
        }
        ok = ok && (!r->count || solve(&f));
    }
    free(f.sums);
    free(f.counts);
    free(out);
    return ok;
}

void spl_heights_place(const struct spl_heights *r, const struct spl_points *points, size_t i, double at[3])
{
    at[0] = at[1] = at[2] = 0;
    for (int c = 0; c < 3; c++) {
        double d = spl_points_at(points, c, i) - r->origin[c];
        at[0] += d * r->u[c];
        at[1] += d * r->v[c];
        at[2] += d * r->normal[c];
    }
}

/* Blends the vertices of the square that has (x, y); false: there is none. */
static bool blend(const struct spl_heights *r, double x, double y, double *height, double slope[2])
{
    int32_t column = (int32_t)floor(x), row = (int32_t)floor(y);
    double weight = 0, sum = 0, along[2] = {0}, change[2] = {0};
    for (int k = 0; k < 4; k++) {
        const struct spl_heights_vertex *v = find(r, column + (k & 1), row + (k >> 1));
        if (!v)
            continue;
        double dx = x - v->column, dy = y - v->row, tilt[2];
        double fx = 1 - fabs(dx), fy = 1 - fabs(dy), w = fx * fy + 1e-9;
        double h = spl_quadratic_height(v->q, dx, dy);
        spl_quadratic_slope(v->q, dx, dy, tilt);
        double dw[2] = {k & 1 ? fy : -fy, k >> 1 ? fx : -fx};
        weight += w;
        sum += w * h;
        for (int a = 0; a < 2; a++) {
            along[a] += w * tilt[a] + dw[a] * h;
            change[a] += dw[a];
        }
    }
    if (!(weight > 0))
        return false;
    *height = sum / weight;
    for (int a = 0; slope && a < 2; a++)
        slope[a] = (along[a] - change[a] * *height) / weight;
    return true;
}

/* Goes on from the vertices of the nearest ring of squares that has any, without their bends. */
static bool go_on(const struct spl_heights *r, double x, double y, int rings, double *height, double slope[2])
{
    int32_t column = (int32_t)floor(x + 0.5), row = (int32_t)floor(y + 0.5);
    for (int ring = 1; ring <= rings; ring++) {
        double weight = 0, sum = 0, along[2] = {0};
        for (int32_t j = -ring; j <= ring; j++)
            for (int32_t i = -ring; i <= ring; i += j == -ring || j == ring ? 1 : 2 * ring) {
                const struct spl_heights_vertex *v = find(r, column + i, row + j);
                if (!v)
                    continue;
                double dx = x - v->column, dy = y - v->row, w = 1 / (dx * dx + dy * dy);
                weight += w;
                sum += w * (v->q[0] + v->q[1] * dx + v->q[2] * dy);
                along[0] += w * v->q[1];
                along[1] += w * v->q[2];
            }
        if (!(weight > 0))
            continue;
        *height = sum / weight;
        for (int a = 0; slope && a < 2; a++)
            slope[a] = along[a] / weight;
        return true;
    }
    return false;
}

bool spl_heights_get(const struct spl_heights *r, double x, double y, int rings, double *height, double slope[2])
{
    double column = x / r->edge, row = y / r->edge;
    *height = 0;
    if (slope)
        slope[0] = slope[1] = 0;
    if (!(fabs(column) < most && fabs(row) < most) ||
        !(blend(r, column, row, height, slope) || go_on(r, column, row, rings, height, slope)))
        return false;
    *height *= r->edge;
    return true;
}

double spl_heights_measure(const struct spl_heights *r, const struct spl_points *points, size_t i, double at[3],
                           double normal[3])
{
    double height, slope[2];
    spl_heights_place(r, points, i, at);
    bool has = spl_heights_get(r, at[0], at[1], 0, &height, slope);
    double length = sqrt(1 + slope[0] * slope[0] + slope[1] * slope[1]);
    for (int c = 0; normal && c < 3; c++)
        normal[c] = (r->normal[c] - slope[0] * r->u[c] - slope[1] * r->v[c]) / length;
    return has && length <= most_length ? (at[2] - height) / length : INFINITY;
}

double spl_heights_off(const struct spl_heights *r, const struct spl_points *points, size_t i, double normal[3])
{
    double at[3];
    return fabs(spl_heights_measure(r, points, i, at, normal));
}
