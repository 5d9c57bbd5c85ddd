/* Slits between scan lines, which panels close. Where points lie much closer along a scan line than lines lie apart,
 * the discs of two lines may not meet, though the plane is known on both sides: bundles of lines, the far lines of a
 * road, the rings around a scanner. A cell is closed where it lies in a gap of few cells between two borders whose
 * points lie closer than cells ask for; or where the four cells beside it are there. At the border of a window, a slat
 * or a door points lie as densely as their cells ask for, so these stay open; and so does what is wider.
 *
 * Cells are judged by what discs cover, never by what was closed: the same in any order. One worker's. */
#include "pack/panels/raster_parts.h"

#include <stdlib.h>
#include <string.h>

#include "base/array.h"

enum { side = SPL_PANEL_SIDE, gap_most = 8, deep = 4, beside = 3 };
/* How much of the surface points behind a border claim at least for a gap of no cells, and more for each of its cells,
 * as shares of it. Those of an even sampling claim three quarters at most, since discs reach beyond them. */
static const float dense = 1, denser = 0.05f;
static const int ways[2][2] = {{1, 0}, {0, 1}}; /* aslant a hole's corner would look like a gap */

/* A panel with those around it. */
struct surroundings {
    struct spl_panel_raster *raster;
    size_t near[3][3];       /* [row][column]: places, or SIZE_MAX */
    uint64_t rows[3 * side]; /* their cells */
};

static void look_around(struct spl_panel_raster *r, size_t place, struct surroundings *s)
{
    s->raster = r;
    memset(s->rows, 0, sizeof s->rows);
    for (int j = 0; j < 3; j++)
        for (int i = 0; i < 3; i++) {
            s->near[j][i] = spl_panel_place_find(r, r->places[place].column + i - 1, r->places[place].row + j - 1);
            for (int y = 0; y < side && s->near[j][i] != SIZE_MAX; y++)
                s->rows[side * j + y] |= (uint64_t)r->filled[s->near[j][i]].covered[y] << side * i;
        }
}

static bool has(const struct surroundings *s, int x, int y)
{
    return s->rows[y] >> x & 1;
}

static const struct spl_panel_filled *filled_at(const struct surroundings *s, int x, int y)
{
    size_t place = s->near[y / side][x / side];
    return place == SIZE_MAX ? NULL : &s->raster->filled[place];
}

/* How much the points claim of the cells from (x, y) on along a way, and of those beside them, as a share of them. */
static float claimed(const struct surroundings *s, int x, int y, int dx, int dy)
{
    float sum = 0;
    for (int k = 0; k < deep; k++)
        for (int across = -beside; across <= beside; across++) {
            int at[2] = {x + k * dx - across * dy, y + k * dy + across * dx};
            const struct spl_panel_filled *f = filled_at(s, at[0], at[1]);
            sum += f ? f->claimed[at[1] % side][at[0] % side] : 0;
        }
    return sum / ((2 * beside + 1) * deep);
}

/* Whether the cell is to be closed, and of which color. */
static bool close_cell(const struct surroundings *s, int x, int y, uint8_t color[3])
{
    int best = gap_most + 2, way = -1, from = 0;
    bool inside = has(s, x - 1, y) && has(s, x + 1, y) && has(s, x, y - 1) && has(s, x, y + 1);
    for (int w = 0; w < 2; w++) {
        int dx = ways[w][0], dy = ways[w][1], a = 1, b = 1;
        for (; a <= gap_most && !has(s, x - a * dx, y - a * dy);)
            a++;
        for (; a + b <= gap_most && !has(s, x + b * dx, y + b * dy);)
            b++;
        if (a + b >= best || !has(s, x - a * dx, y - a * dy) || !has(s, x + b * dx, y + b * dy))
            continue;
        float least = inside ? 0 : dense + denser * (float)(a + b - 1);
        if (claimed(s, x - a * dx, y - a * dy, -dx, -dy) < least || claimed(s, x + b * dx, y + b * dy, dx, dy) < least)
            continue;
        best = a + b;
        way = w;
        from = a;
    }
    if (way < 0)
        return false;
    int x0 = x - from * ways[way][0], y0 = y - from * ways[way][1];
    int x1 = x0 + best * ways[way][0], y1 = y0 + best * ways[way][1];
    const uint8_t *first = filled_at(s, x0, y0)->panel.color[y0 % side][x0 % side];
    const uint8_t *last = filled_at(s, x1, y1)->panel.color[y1 % side][x1 % side];
    for (int c = 0; c < 3; c++)
        color[c] = (uint8_t)((first[c] * (best - from) + last[c] * from + best / 2) / best);
    return true;
}

/* The cells of row y that have others on two opposite sides, few cells apart. */
static uint64_t find_gaps(const struct surroundings *s, int y)
{
    uint64_t found = 0;
    for (int w = 0; w < 2; w++)
        for (int a = 1; a <= gap_most; a++)
            for (int b = 1; a + b <= gap_most + 1; b++) {
                uint64_t before = s->rows[y - a * ways[w][1]] << a * ways[w][0];
                found |= before & s->rows[y + b * ways[w][1]] >> b * ways[w][0];
            }
    return found & ~s->rows[y] & (uint64_t)0xffff << side;
}

/* What the points claim of each cell: all of them as much, since discs at a slit are as small as at any border. */
static void claim(struct spl_panel_raster *r, const struct spl_panel_grid *g)
{
    const struct spl_panel_group *group = g->group;
    double area = 0, spacing;
    for (size_t k = 0; k < group->count; k++) {
        spacing = (double)group->points->radius[group->first + group->members[k]] / (double)SPL_RADIUS_SPACING;
        area += spacing * spacing * g->inverse * g->inverse / (double)group->count;
    }
    for (size_t t = 0; t < r->touch_count; t++) {
        const struct spl_panel_touch *touch = &r->sorted[t];
        if (!touch->own)
            continue;
        const struct spl_panel_place *p = &r->places[touch->place];
        double at[2];
        spl_panel_grid_middle(g, group->first + touch->member, at);
        int x = spl_panel_floor(at[0]) - g->first[0] - side * p->column;
        int y = spl_panel_floor(at[1]) - g->first[1] - side * p->row;
        r->filled[touch->place].claimed[y][x] += (float)area;
    }
}

void spl_panel_slits_close(struct spl_panel_raster *r, const struct spl_panel_grid *g)
{
    bool any = false;
    for (size_t i = 0; i < r->place_count; i++) {
        struct surroundings s;
        look_around(r, i, &s);
        for (int y = side; y < 2 * side; y++)
            for (uint64_t gaps = find_gaps(&s, y); gaps; gaps &= gaps - 1) {
                int x = __builtin_ctzll(gaps);
                struct spl_panel *panel = &r->filled[i].panel;
                if (!any)
                    claim(r, g);
                any = true;
                if (close_cell(&s, x, y, panel->color[y % side][x % side]))
                    panel->cells[y % side] |= (uint16_t)(1u << x % side);
            }
    }
}
