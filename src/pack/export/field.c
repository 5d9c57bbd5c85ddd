/* A closing: discs of the points are laid over the grid, and what they cover is taken back from its outside, by what a
 * disc reaches beyond half a spacing. Radii differ over a scan, so each cell remembers the radius of the disc that it
 * lies deepest in; and at edges they are up to three times as large, having neighbours on one side alone, or half as
 * large, having those of two sides, so the spacing there is that of the points around. Distances to the outside are
 * exact (Felzenszwalb and Huttenlocher, "Distance transforms of sampled functions", 2012). Each call is one thread's; a
 * cell is visited by some four discs, whatever their sizes. */
#include "pack/export/field.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"

static const double radius_spacing = 1.128; /* radius of a disc amid a surface, over its points' spacing */
static const double least_radius = 0.75;    /* in cells: so that each disc holds the middle of one */
static const double cells_a_point = 24; /* at most: a few points far from each other need no finer ones */
static const double unusual = 1.5; /* times the radii around, is what one may be */
/* Spacings that a sheet ends beyond its outer points: half of one, and what the border between them, which what lies
 * outside is measured from, is drawn in by their unevenness. */
static const double beyond = 0.65;
static const double side_most = 1 << 20;
enum { bin_cells = 16 };

struct scratch {
    float *deep, *radius;    /* of each cell: how deep in a disc, and that disc's radius; 0 outside */
    double *value, *border;  /* of a row or column: squared distances so far; where parabolas meet */
    uint32_t *bottom;        /* and their columns */
};

/* Spacings in each bin and those around it, each weighed by the area that it stands for. */
struct bins {
    uint32_t width, height;
    double (*sums)[2]; /* of areas, and of areas times spacings */
};

static int init_bins(struct bins *b, const struct spl_field *f, const double (*points)[2], const float *radius,
                     size_t count, struct spl_error *err)
{
    *b = (struct bins){f->width / bin_cells + 1, f->height / bin_cells + 1, NULL};
    b->sums = spl_alloc((size_t)b->width * b->height, sizeof *b->sums, err);
    if (!b->sums)
        return SPL_E_NOMEM;
    for (size_t i = 0; i < count; i++) {
        double x = (points[i][0] - f->origin[0]) / f->cell, y = (points[i][1] - f->origin[1]) / f->cell;
        size_t bin = (size_t)(y / bin_cells) * b->width + (size_t)(x / bin_cells);
        double spacing = fmax(radius[i] / f->cell, least_radius) / radius_spacing;
        b->sums[bin][0] += spacing * spacing;
        b->sums[bin][1] += spacing * spacing * spacing;
    }
    return 0;
}

/* In cells, around bin (x, y); 0 where there are no points. */
static double spacing_around(const struct bins *b, uint32_t x, uint32_t y)
{
    double area = 0, sum = 0;
    for (uint32_t v = y ? y - 1 : 0; v <= y + 1 && v < b->height; v++)
        for (uint32_t u = x ? x - 1 : 0; u <= x + 1 && u < b->width; u++) {
            area += b->sums[(size_t)v * b->width + u][0];
            sum += b->sums[(size_t)v * b->width + u][1];
        }
    return area > 0 ? sum / area : 0;
}

static void lay_discs(const struct spl_field *f, const struct scratch *s, const struct bins *b,
                      const double (*points)[2], const float *radius, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        double x = (points[i][0] - f->origin[0]) / f->cell, y = (points[i][1] - f->origin[1]) / f->cell;
        double usual = radius_spacing * spacing_around(b, (uint32_t)(x / bin_cells), (uint32_t)(y / bin_cells));
        double r = fmax(least_radius, fmin(fmax(radius[i] / f->cell, usual), unusual * usual));
        long first = lrint(ceil(y - r)), last = lrint(floor(y + r));
        for (long row = first; row <= last; row++) {
            double dy = (double)row - y, half = sqrt(fmax(0, r * r - dy * dy));
            long from = lrint(ceil(x - half)), to = lrint(floor(x + half));
            for (long column = from; column <= to; column++) {
                double dx = (double)column - x;
                float deep = (float)(r - sqrt(dx * dx + dy * dy));
                size_t cell = (size_t)row * f->width + (size_t)column;
                if (deep <= s->deep[cell])
                    continue;
                s->deep[cell] = deep;
                s->radius[cell] = (float)r;
            }
        }
    }
}

/* Squared distances of `count` cells, `stride` apart, to what has none: the lower envelope of parabolas. */
static void distances_of_row(const struct scratch *s, float *cells, size_t count, size_t stride)
{
    size_t k = 0;
    for (size_t i = 0; i < count; i++)
        s->value[i] = cells[i * stride];
    s->bottom[0] = 0;
    s->border[0] = -INFINITY;
    for (size_t i = 1; i < count; i++) {
        double meet;
        for (;; k--) {
            double p = s->bottom[k], q = (double)i;
            meet = (s->value[i] + q * q - s->value[s->bottom[k]] - p * p) / (2 * (q - p));
            if (k == 0 || meet > s->border[k])
                break;
        }
        k += meet > s->border[k];
        s->bottom[k] = (uint32_t)i;
        s->border[k] = k ? meet : -INFINITY;
    }
    size_t found = k;
    k = 0;
    for (size_t i = 0; i < count; i++) {
        while (k < found && s->border[k + 1] < (double)i)
            k++;
        double d = (double)i - s->bottom[k];
        cells[i * stride] = (float)(d * d + s->value[s->bottom[k]]);
    }
}

/* Distances to the outside, in cells, become what lies inside of half a spacing. */
static void take_back(struct spl_field *f, const struct scratch *s, const struct bins *b)
{
    for (uint32_t v = 0; v < b->height; v++)
        for (uint32_t u = 0; u < b->width; u++) {
            double usual = spacing_around(b, u, v);
            for (uint32_t y = v * bin_cells; y < (v + 1) * bin_cells && y < f->height; y++)
                for (uint32_t x = u * bin_cells; x < (u + 1) * bin_cells && x < f->width; x++) {
                    size_t cell = (size_t)y * f->width + x;
                    double r = s->radius[cell], spacing = fmin(r / radius_spacing, usual);
                    /* between two discs of a row the cover ends so far beyond their middles */
                    double reach = sqrt(r * r - spacing * spacing / 4);
                    /* its border lies half a cell before the first one outside */
                    f->inside[cell] = (float)(f->cell * (sqrt(f->inside[cell]) - 0.5 - (reach - beyond * spacing)));
                    f->spacing[cell] = (float)(f->cell * spacing);
                }
        }
}

static int init_scratch(struct scratch *s, size_t cells, size_t side, struct spl_error *err)
{
    *s = (struct scratch){.deep = spl_alloc(cells, sizeof *s->deep, err),
                          .radius = spl_alloc(cells, sizeof *s->radius, err),
                          .value = spl_alloc_raw(side, sizeof *s->value, err),
                          .border = spl_alloc_raw(side, sizeof *s->border, err),
                          .bottom = spl_alloc_raw(side, sizeof *s->bottom, err)};
    return s->deep && s->radius && s->value && s->border && s->bottom ? 0 : SPL_E_NOMEM;
}

static void finish_scratch(struct scratch *s)
{
    free(s->deep);
    free(s->radius);
    free(s->value);
    free(s->border);
    free(s->bottom);
}

/* Where the grid lies, and how wide its cells are. */
static void place(struct spl_field *f, const double (*points)[2], const float *radius, size_t count, double cell)
{
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY}, size[2], widest = 0;
    for (size_t i = 0; i < count; i++) {
        widest = fmax(widest, radius[i]);
        for (int c = 0; c < 2; c++) {
            low[c] = fmin(low[c], points[i][c]);
            high[c] = fmax(high[c], points[i][c]);
        }
    }
    for (int c = 0; c < 2; c++) { /* no spacing around is more than the widest */
        low[c] -= widest;
        high[c] += widest;
    }
    double most = fmax(high[0] - low[0], high[1] - low[1]);
    cell = fmax(cell, fmax(most / side_most, 1e-12 * fmax(1, most)));
    for (;; cell *= 1.25) {
        for (int c = 0; c < 2; c++)
            size[c] = ceil((high[c] - low[c]) / cell) + 6;
        if (size[0] * size[1] <= fmin(SPL_FIELD_CELLS, cells_a_point * ((double)count + 100)) || cell >= most)
            break;
    }
    f->cell = cell;
    f->width = (uint32_t)size[0];
    f->height = (uint32_t)size[1];
    for (int c = 0; c < 2; c++)
        f->origin[c] = low[c] - 2.5 * cell;
}

int spl_field_init(struct spl_field *field, const double (*points)[2], const float *radius, size_t count, double cell,
                   struct spl_error *err)
{
    struct scratch s;
    struct bins bins = {0};
    *field = (struct spl_field){0};
    place(field, points, radius, count, cell);
    size_t cells = (size_t)field->width * field->height;
    int rc = init_scratch(&s, cells, field->width > field->height ? field->width : field->height, err);
    if (!rc)
        rc = init_bins(&bins, field, points, radius, count, err);
    if (!rc) {
        field->inside = spl_alloc_raw(cells, sizeof *field->inside, err);
        field->spacing = spl_alloc_raw(cells, sizeof *field->spacing, err);
        rc = field->inside && field->spacing ? 0 : SPL_E_NOMEM;
    }
    if (!rc) {
        lay_discs(field, &s, &bins, points, radius, count);
        for (size_t i = 0; i < cells; i++)
            field->inside[i] = s.radius[i] > 0 ? 1e12f : 0;
        for (uint32_t y = 0; y < field->height; y++)
            distances_of_row(&s, field->inside + (size_t)y * field->width, field->width, 1);
        for (uint32_t x = 0; x < field->width; x++)
            distances_of_row(&s, field->inside + x, field->height, field->width);
        take_back(field, &s, &bins);
    }
    finish_scratch(&s);
    free(bins.sums);
    return rc;
}

void spl_field_finish(struct spl_field *field)
{
    free(field->inside);
    free(field->spacing);
    *field = (struct spl_field){0};
}
