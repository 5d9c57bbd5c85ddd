/* From a field to polygons: the line on which the field is 0 is followed from cell to cell (marching squares; corners
 * that touch stay apart), each ring in turn, inside on its left. Rings of no size are dropped, holes go to the smallest
 * border around them, and vertices that say nothing are left out. All of it is one thread's, in the order of cells. */
#include "pack/export/outline.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/memory.h"
#include "pack/export/field.h"
#include "pack/export/simplify.h"
#include "pack/median.h"

static const double radius_spacing = 1.128; /* radius of a disc amid a surface, over its points' spacing */
static const double least_area = 6;         /* of a ring, in squared spacings */
static const double least_off = 1;          /* spacings that a border is uncertain by */
static const uint32_t none = UINT32_MAX;

struct rings {
    double (*vertices)[3]; /* of all rings, z is 0 */
    struct raw_ring {
        size_t first, count;
        double area, spacing, low[2], high[2]; /* spacing: the mean of points along it */
        uint32_t border; /* of a hole: the ring around it */
    } *list;
    size_t vertex_count, vertex_capacity, count, capacity;
};

double spl_outline_area(const double (*vertices)[2], size_t count)
{
    double sum = 0;
    for (size_t i = 0; i < count; i++) { /* about the first, so that far coordinates cost nothing */
        const double *a = vertices[i], *b = vertices[i + 1 < count ? i + 1 : 0], *o = vertices[0];
        sum += (a[0] - o[0]) * (b[1] - o[1]) - (b[0] - o[0]) * (a[1] - o[1]);
    }
    return sum / 2;
}

/* Of each side of cells that the border crosses, the side that it crosses next. Sides: 2 * cell to the right neighbour,
 * 2 * cell + 1 to the upper one. */
static void link_sides(const struct spl_field *f, uint32_t *next)
{
    uint32_t w = f->width;
    memset(next, 0xff, 2 * (size_t)w * f->height * sizeof *next);
    for (uint32_t y = 0; y + 1 < f->height; y++)
        for (uint32_t x = 0; x + 1 < w; x++) {
            uint32_t cell = y * w + x;
            const uint32_t side[4] = {2 * cell, 2 * (cell + 1) + 1, 2 * (cell + w), 2 * cell + 1};
            const bool in[4] = {f->inside[cell] > 0, f->inside[cell + 1] > 0, f->inside[cell + w + 1] > 0,
                                f->inside[cell + w] > 0};
            for (unsigned k = 0; k < 4; k++) {
                unsigned first = k;
                if (!in[k] || in[(k + 1) % 4])
                    continue;
                while (in[(first + 3) % 4])
                    first = (first + 3) % 4;
                next[side[k]] = side[(first + 3) % 4];
            }
        }
}

/* Where the border crosses a side; returns the spacing of the points there. */
static double crossing(const struct spl_field *f, uint32_t side, double at[3])
{
    uint32_t cell = side / 2, other = cell + (side % 2 ? f->width : 1);
    double a = f->inside[cell], b = f->inside[other], t = a / (a - b);
    at[0] = f->origin[0] + f->cell * (cell % f->width + (side % 2 ? 0 : t));
    at[1] = f->origin[1] + f->cell * (cell / f->width + (side % 2 ? t : 0));
    at[2] = 0;
    return fmax(f->spacing[cell], f->spacing[other]);
}

static double raw_area(const double (*v)[3], size_t count)
{
    double sum = 0;
    for (size_t i = 0; i < count; i++) {
        const double *a = v[i], *b = v[i + 1 < count ? i + 1 : 0];
        sum += (a[0] - v[0][0]) * (b[1] - v[0][1]) - (b[0] - v[0][0]) * (a[1] - v[0][1]);
    }
    return sum / 2;
}

static int follow(struct rings *r, const struct spl_field *f, uint32_t *next, uint32_t begin, double least,
                  struct spl_error *err)
{
    struct raw_ring ring = {.first = r->vertex_count, .low = {INFINITY, INFINITY}, .high = {-INFINITY, -INFINITY}};
    for (uint32_t side = begin; next[side] != none;) {
        uint32_t to = next[side];
        if (spl_array_reserve(r->vertices, r->vertex_capacity, r->vertex_count + 1, err))
            return SPL_E_NOMEM;
        double *at = r->vertices[r->vertex_count++];
        ring.spacing += crossing(f, side, at);
        for (int c = 0; c < 2; c++) {
            ring.low[c] = fmin(ring.low[c], at[c]);
            ring.high[c] = fmax(ring.high[c], at[c]);
        }
        next[side] = none;
        side = to;
    }
    ring.count = r->vertex_count - ring.first;
    ring.spacing /= (double)ring.count;
    ring.area = raw_area((const double(*)[3])r->vertices + ring.first, ring.count);
    if (fabs(ring.area) < least) {
        r->vertex_count = ring.first;
        return 0;
    }
    if (spl_array_reserve(r->list, r->capacity, r->count + 1, err))
        return SPL_E_NOMEM;
    r->list[r->count++] = ring;
    return 0;
}

static int trace(struct rings *r, const struct spl_field *f, double least, struct spl_error *err)
{
    size_t sides = 2 * (size_t)f->width * f->height;
    uint32_t *next = spl_alloc_raw(sides, sizeof *next, err);
    int rc = next ? 0 : SPL_E_NOMEM;
    if (!rc)
        link_sides(f, next);
    for (size_t side = 0; !rc && side < sides; side++)
        if (next[side] != none)
            rc = follow(r, f, next, (uint32_t)side, least, err);
    free(next);
    return rc;
}

static bool contains(const struct rings *r, const struct raw_ring *ring, const double at[2])
{
    bool inside = false;
    if (at[0] < ring->low[0] || at[0] > ring->high[0] || at[1] < ring->low[1] || at[1] > ring->high[1])
        return false;
    for (size_t i = 0; i < ring->count; i++) {
        const double *a = r->vertices[ring->first + i], *b = r->vertices[ring->first + (i + 1) % ring->count];
        if ((a[1] > at[1]) != (b[1] > at[1]) && at[0] < a[0] + (at[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]))
            inside = !inside;
    }
    return inside;
}

static void find_borders(struct rings *r)
{
    for (size_t h = 0; h < r->count; h++) {
        double least = INFINITY;
        r->list[h].border = none;
        for (size_t k = 0; r->list[h].area < 0 && k < r->count; k++) {
            const struct raw_ring *ring = &r->list[k];
            if (ring->area <= 0 || ring->area >= least || !contains(r, ring, r->vertices[r->list[h].first]))
                continue;
            least = ring->area;
            r->list[h].border = (uint32_t)k;
        }
    }
}

/* A ring of fewer vertices, which keeps its turn and most of its size. */
static int add_ring(struct spl_outline *o, const struct rings *r, const struct raw_ring *raw, double tolerance,
                    struct spl_error *err)
{
    const double(*from)[3] = (const double(*)[3])r->vertices + raw->first;
    uint8_t *kept = spl_alloc_raw(raw->count, 1, err);
    size_t *stack = spl_alloc_raw(2 * raw->count + 2, sizeof *stack, err);
    int rc = kept && stack ? 0 : SPL_E_NOMEM;
    tolerance = fmax(tolerance, least_off * raw->spacing);
    if (!rc && o->vertex_count + raw->count > UINT32_MAX / 4)
        rc = spl_fail(err, SPL_E_LIMIT, "the outlines of a plane take more than 2^30 vertices");
    if (!rc)
        rc = spl_array_reserve(o->vertices, o->vertex_capacity, o->vertex_count + raw->count, err);
    if (!rc)
        rc = spl_array_reserve(o->rings, o->ring_capacity, o->ring_count + 1, err);
    for (int tries = 0; !rc && tries < 8; tries++, tolerance /= 2) {
        struct spl_ring ring = {.first = (uint32_t)o->vertex_count, .hole = raw->area < 0};
        size_t left = spl_simplify(from, raw->count, true, tolerance, kept, stack);
        for (size_t i = 0; i < raw->count; i++)
            if (kept[i])
                memcpy(o->vertices[o->vertex_count + ring.count++], from[i], 2 * sizeof(double));
        double share = left < 3 ? 0 : spl_outline_area((const double(*)[2])o->vertices + ring.first, left) / raw->area;
        if (tries < 7 && (share < 0.9 || share > 1.1))
            continue;
        o->vertex_count += ring.count;
        o->rings[o->ring_count++] = ring;
        break;
    }
    free(kept);
    free(stack);
    return rc;
}

static int add_polygon(struct spl_outline *o, const struct rings *r, uint32_t border, double tolerance,
                       struct spl_error *err)
{
    struct spl_polygon polygon = {.ring = (uint32_t)o->ring_count};
    int rc = add_ring(o, r, &r->list[border], tolerance, err);
    for (size_t h = 0; !rc && h < r->count; h++)
        if (r->list[h].border == border && r->list[h].area < 0)
            rc = add_ring(o, r, &r->list[h], tolerance, err);
    if (rc)
        return rc;
    polygon.rings = (uint32_t)o->ring_count - polygon.ring;
    for (uint32_t k = 0; k < polygon.rings; k++) {
        const struct spl_ring *ring = &o->rings[polygon.ring + k];
        polygon.area += spl_outline_area((const double(*)[2])o->vertices + ring->first, ring->count);
    }
    rc = spl_outline_add_loop(o, &polygon, err);
    if (!rc)
        rc = spl_array_reserve(o->polygons, o->polygon_capacity, o->polygon_count + 1, err);
    if (!rc)
        o->polygons[o->polygon_count++] = polygon;
    return rc;
}

/* A fifth of the points lie closer, and half of them. */
static int find_spacing(const float *radius, size_t count, double *close, double *median, struct spl_error *err)
{
    size_t sample = count < 4096 ? count : 4096, below = 0;
    float *values = spl_alloc_raw(sample, sizeof *values, err);
    if (!values)
        return SPL_E_NOMEM;
    for (size_t i = 0; i < sample; i++)
        values[i] = radius[i * count / sample];
    *median = spl_median(values, sample) / radius_spacing;
    for (size_t i = 0; i < sample; i++) /* the closer half's median is a quarter of all */
        if (values[i] <= *median * radius_spacing)
            values[below++] = values[i];
    *close = below ? spl_median(values, below) / radius_spacing : *median;
    free(values);
    return 0;
}

int spl_outline_find(struct spl_outline *outline, const double (*points)[2], const float *radius, size_t count,
                     double tolerance, struct spl_error *err)
{
    struct rings rings = {0};
    struct spl_field field = {0};
    double close, spacing;
    *outline = (struct spl_outline){0};
    int rc = find_spacing(radius, count, &close, &spacing, err);
    if (!rc)
        rc = spl_field_init(&field, points, radius, count, fmax(0.5 * close, 0.5 * tolerance), err);
    if (!rc)
        rc = trace(&rings, &field, least_area * spacing * spacing, err);
    if (!rc && !rings.count) /* slivers alone */
        rc = trace(&rings, &field, 0, err);
    if (!rc)
        find_borders(&rings);
    tolerance = fmax(tolerance, 0.5 * field.cell);
    for (size_t k = 0; !rc && k < rings.count; k++)
        if (rings.list[k].area > 0)
            rc = add_polygon(outline, &rings, (uint32_t)k, tolerance, err);
    spl_field_finish(&field);
    free(rings.vertices);
    free(rings.list);
    return rc;
}

void spl_outline_finish(struct spl_outline *outline)
{
    free(outline->vertices);
    free(outline->loop);
    free(outline->rings);
    free(outline->polygons);
    *outline = (struct spl_outline){0};
}
