/* The cells of a panel, from the discs that reach into it: those whose middles a disc covers, or what lies between it
 * and its crease, and each point's own.
 *
 * Colours are sums over discs in the order of the points, in floats: the same for any number of threads. */
#include "pack/panels/raster_parts.h"

enum { side = SPL_PANEL_SIDE };
/* A point's weight in a cell beside its own, whose middle its disc covers, where no point is nearer. */
static const float aside = 1e-3f;
/* Of a cell: what ends before it covers no middle of the next one, whatever is lost in rounding. */
static const double alone = 1.499;

typedef float four __attribute__((vector_size(16)));

struct sums {
    four color[side][side]; /* of red, green, blue and 1, by weight */
    uint16_t covered[side];
};

/* A disc and the part of a panel that it may cover. */
struct part {
    struct spl_panel_disc disc;
    int32_t column, row;     /* of the panel's first cell */
    int32_t low[2], high[2]; /* cells of both */
    int32_t own[2];          /* the middle's */
    bool plain;              /* it is round, and ends where it does by itself */
};

static void get_part(const struct spl_panel_raster *r, const struct spl_panel_grid *g,
                     const struct spl_panel_touch *touch, struct part *p)
{
    const struct spl_panel_place *place = &r->places[touch->place];
    p->disc = spl_panel_grid_disc(g, touch->member);
    p->column = g->first[0] + side * place->column;
    p->row = g->first[1] + side * place->row;
    p->own[0] = spl_panel_floor(p->disc.x);
    p->own[1] = spl_panel_floor(p->disc.y);
    p->plain = g->round || !(p->disc.reach > 0 || g->group->plane->heights);
    spl_panel_disc_range(&p->disc, p->low, p->high);
    p->low[0] = p->low[0] > p->column ? p->low[0] : p->column;
    p->low[1] = p->low[1] > p->row ? p->low[1] : p->row;
    p->high[0] = p->high[0] < p->column + side ? p->high[0] : p->column + side - 1;
    p->high[1] = p->high[1] < p->row + side ? p->high[1] : p->row + side - 1;
}

/* Whether the disc covers the cell, whose middle lies (dx, dy) from its own, and the square of how far that is. */
static inline bool covers(const struct part *p, double dx, double dy, bool own, double *squared)
{
    const struct spl_panel_disc *d = &p->disc;
    *squared = p->plain ? dx * dx + dy * dy : spl_panel_disc_squared(d, dx, dy);
    return own || (*squared <= d->radius * d->radius && d->clip[0] * dx + d->clip[1] * dy <= d->clip_offset);
}

static float tent(double x)
{
    return x < 1 && x > -1 ? (float)(1 - fabs(x)) : 0;
}

static four shade_of(uint32_t color)
{
    return (four){(float)(color & 255), (float)(color >> 8 & 255), (float)(color >> 16 & 255), 1};
}

/* Adds what a disc covers. In a leaf colours are interpolated between points, which lie a spacing apart, and sharper
 * than drawing cells interpolates once more; in an inner node a cell has the mean of what lies in it. */
static void add_disc(const struct part *p, uint32_t color, bool leaf, struct sums *s)
{
    const struct spl_panel_disc *d = &p->disc;
    const four shade = shade_of(color);
    double area = d->radius * d->radius, apart = d->radius / (double)SPL_RADIUS_SPACING;
    float beside[side];
    for (int32_t x = p->low[0]; leaf && x <= p->high[0]; x++)
        beside[x - p->column] = tent((x + 0.5 - d->x) / apart);
    for (int32_t y = p->low[1]; y <= p->high[1]; y++) {
        double dy = y + 0.5 - d->y, squared;
        float above = leaf ? tent(dy / apart) : 0;
        for (int32_t x = p->low[0]; x <= p->high[0]; x++) {
            bool own = x == p->own[0] && y == p->own[1];
            if (!covers(p, x + 0.5 - d->x, dy, own, &squared))
                continue;
            double inside = 1 - squared / area;
            float within = (float)(inside > 0 ? inside : 0), near = leaf ? beside[x - p->column] * above : 0;
            float weight = leaf ? near * near + aside * within : (float)area * (own ? 1 : aside * within);
            s->color[y - p->row][x - p->column] += (weight + 1e-9f) * shade;
            s->covered[y - p->row] |= (uint16_t)(1u << (x - p->column));
        }
    }
}

/* Adds the member of a touch to its own cell where it covers no other: most of those of inner nodes, whose cells are
 * larger than discs. False: it is not so simple. */
static bool add_within(const struct spl_panel_grid *g, const struct spl_panel_touch *touch, int32_t column, int32_t row,
                       struct sums *s)
{
    const struct spl_points *points = g->group->points;
    size_t i = g->group->first + touch->member;
    double at[2], radius = (double)points->radius[i] * g->inverse;
    spl_panel_grid_middle(g, i, at);
    double x = at[0] - spl_panel_floor(at[0]), y = at[1] - spl_panel_floor(at[1]);
    if (!touch->own || !(x + radius < alone && y + radius < alone && x - radius > 1 - alone && y - radius > 1 - alone))
        return false;
    int own_x = spl_panel_floor(at[0]) - column, own_y = spl_panel_floor(at[1]) - row;
    s->color[own_y][own_x] += ((float)(radius * radius) + 1e-9f) * shade_of(points->color_class[i]);
    s->covered[own_y] |= (uint16_t)(1u << own_x);
    return true;
}

void spl_panel_fill(const struct spl_panel_raster *r, const struct spl_panel_grid *g, size_t place,
                    struct spl_panel *panel)
{
    const struct spl_panel_group *group = g->group;
    struct sums s = {0};
    const int32_t column = g->first[0] + side * r->places[place].column;
    const int32_t row = g->first[1] + side * r->places[place].row;
    const bool simple = g->round && !group->leaf;
    for (uint32_t t = spl_panel_first_touch(r, place); t < r->places[place].touches; t++) {
        struct part part;
        if (simple && add_within(g, &r->sorted[t], column, row, &s))
            continue;
        get_part(r, g, &r->sorted[t], &part);
        add_disc(&part, group->points->color_class[group->first + r->sorted[t].member], group->leaf, &s);
    }
    for (int y = 0; y < side; y++) {
        panel->cells[y] = s.covered[y];
        for (int x = 0; x < side; x++) {
            const four *sum = &s.color[y][x];
            for (int c = 0; c < 3; c++)
                panel->color[y][x][c] = s.covered[y] >> x & 1 ? (uint8_t)((*sum)[c] / (*sum)[3] + 0.5f) : 0;
        }
    }
}
