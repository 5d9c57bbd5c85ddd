/* Meshes of panels: the heights of a piece at the points of a lattice, which is the same for all panels of the piece
 * that have cells of one size: neighbours agree along their edges. Of the levels the least is taken whose triangles
 * follow the surface at each cell; those of inner nodes, whose cells are larger, follow it less closely. */
#include <math.h>

#include "pack/panels/raster_parts.h"
#include "pack/planes/heights.h"

enum { side = SPL_PANEL_SIDE, rings = 6 };
static const double share = 0.4;      /* of the piece's bound, as what is no noise may be off a plane */
static const double cell_share = 0.1; /* of a cell, where that is more */
static const double few = 0.05;       /* of a panel's cells, that may be farther off the surface */
static const double stray = 3;        /* times the limit, that these may */
static const double steps = 4;        /* of heights, that the limit is */

static double limit_of(const struct spl_panel_group *group)
{
    return fmax(share * group->plane->bound, cell_share * group->cell);
}

unsigned spl_panel_relief_step(const struct spl_panel_group *group, float range)
{
    double wanted = fmin(fmax(ceil(2 * log2(group->cell * steps / limit_of(group))), 0), SPL_RELIEF_STEP_MAX);
    unsigned finest = spl_relief_choose_step((float)group->cell, 0.51f * range);
    return finest < (unsigned)wanted ? finest : (unsigned)wanted;
}

/* The surface over the cells: its heights at the middles of those that are there, and a plane through these. */
struct surface {
    float height[side][side];
    double middle[2], plane[3]; /* height = plane[0] + plane[1] (x - middle[0]) + plane[2] (y - middle[1]), in cells */
};

static double height_at(const struct spl_panel_grid *g, double x, double y, bool *has)
{
    double height, cell = g->group->cell;
    *has = spl_heights_get(g->group->plane->heights, x * cell, y * cell, rings, &height, NULL);
    return height;
}

static void get_surface(const struct spl_panel_grid *g, const struct spl_panel *panel, int32_t column, int32_t row,
                        struct surface *s)
{
    double n = 0, sx = 0, sy = 0, xx = 0, xy = 0, yy = 0, sz = 0, xz = 0, yz = 0;
    bool has;
    for (int y = 0; y < side; y++)
        for (int x = 0; x < side; x++) {
            if (!(panel->cells[y] >> x & 1))
                continue;
            double z = height_at(g, column + x + 0.5, row + y + 0.5, &has);
            s->height[y][x] = (float)z;
            n += has;
            sx += has * (x + 0.5);
            sy += has * (y + 0.5);
            sz += has * z;
        }
    s->middle[0] = n > 0 ? sx / n : 0;
    s->middle[1] = n > 0 ? sy / n : 0;
    s->plane[0] = n > 0 ? sz / n : 0;
    for (int y = 0; y < side; y++)
        for (int x = 0; x < side; x++) {
            if (!(panel->cells[y] >> x & 1))
                continue;
            double dx = x + 0.5 - s->middle[0], dy = y + 0.5 - s->middle[1];
            double dz = (double)s->height[y][x] - s->plane[0];
            xx += dx * dx;
            xy += dx * dy;
            yy += dy * dy;
            xz += dx * dz;
            yz += dy * dz;
        }
    xx += 1; /* a single row says nothing across it */
    yy += 1;
    double whole = xx * yy - xy * xy;
    s->plane[1] = (xz * yy - yz * xy) / whole;
    s->plane[2] = (yz * xx - xz * xy) / whole;
}

static void fill(const struct spl_panel_grid *g, const struct surface *s, int32_t column, int32_t row, unsigned level,
                 double worth, struct spl_panel_relief *made)
{
    int across = (1 << level) + 1, apart = side >> level;
    made->relief.level = level;
    made->low = INFINITY;
    made->high = -INFINITY;
    for (int j = 0; j < across; j++)
        for (int i = 0; i < across; i++) {
            bool has;
            double z = height_at(g, column + i * apart, row + j * apart, &has);
            if (!has)
                z = s->plane[0] + s->plane[1] * (i * apart - s->middle[0]) + s->plane[2] * (j * apart - s->middle[1]);
            float height = (float)(worth * floor(z / worth + 0.5));
            made->relief.height[j * across + i] = height;
            made->low = fminf(made->low, height);
            made->high = fmaxf(made->high, height);
        }
}

/* Whether the mesh is off the surface by no more than `limit`, but for a few cells, at borders mostly, where the
 * surface goes on beyond its points. */
static bool follows(const struct spl_panel *panel, const struct surface *s, const struct spl_relief *relief,
                    double limit)
{
    unsigned cells = 0, beyond = 0;
    for (int y = 0; y < side; y++)
        for (int x = 0; x < side; x++) {
            if (!(panel->cells[y] >> x & 1))
                continue;
            float height = spl_relief_height(relief, (float)x + 0.5f, (float)y + 0.5f, NULL);
            double off = fabs((double)height - (double)s->height[y][x]);
            cells++;
            beyond += off > limit;
            if (off > stray * limit)
                return false;
        }
    return beyond <= few * cells;
}

void spl_panel_relief_make(const struct spl_panel_grid *g, const struct spl_panel *panel, int32_t column, int32_t row,
                           unsigned step, unsigned level, struct spl_panel_relief *made)
{
    struct surface s;
    get_surface(g, panel, column, row, &s);
    fill(g, &s, column, row, level, (double)spl_relief_worth((float)g->group->cell, step), made);
}

void spl_panel_relief_choose(const struct spl_panel_grid *g, const struct spl_panel *panel, int32_t column, int32_t row,
                             struct spl_panel_relief *made)
{
    struct surface s;
    double worth = (double)spl_relief_worth((float)g->group->cell, spl_panel_relief_step(g->group, 0));
    get_surface(g, panel, column, row, &s);
    for (unsigned level = 0; level <= SPL_RELIEF_LEVEL_MAX; level++) {
        fill(g, &s, column, row, level, worth, made);
        if (follows(panel, &s, &made->relief, limit_of(g->group)))
            return;
    }
}
