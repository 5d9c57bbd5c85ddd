/* Where the discs of a plane's points lie on its cells. Pure; any thread. */
#include "geom/vector.h"
#include "pack/panels/raster_parts.h"

#include <math.h>

static const double most_cells = 1 << 29; /* either way from the plane's origin */
/* How far a cell's middle may lie beyond a crease, as a share of the cell across it. */
static const double cut_in_corner = 0.5, cut_at_edge = 0.25, cut_at_either = 0.35;
static const double least_up = 0.6; /* cosine of the steepest tilt of a disc on a piece with relief */

static void init_grid(struct spl_panel_grid *g, const struct spl_panel_group *group)
{
    struct spl_panel_plane plane = {.cell = (float)group->cell};
    struct spl_panel_frame frame;
    struct spl_chunk chunk;
    for (int c = 0; c < 3; c++)
        plane.normal[c] = (float)group->plane->normal[c];
    spl_panels_begin(&plane, &chunk);
    spl_panels_get_frame(&chunk, &frame);
    bool lines = group->leaf && (group->crease || group->points->clip);
    *g = (struct spl_panel_grid){.group = group, .inverse = 1 / group->cell, .round = !lines && !group->plane->heights};
    for (int c = 0; c < 3; c++) {
        g->u[c] = frame.u[c];
        g->v[c] = frame.v[c];
        g->normal[c] = frame.normal[c];
        g->normal_f[c] = plane.normal[c];
    }
}

/* How a disc of that normal rises: no steeper than pieces are. */
static void get_tilt(const struct spl_panel_grid *g, const float normal[3], double tilt[2])
{
    const double n[3] = {normal[0], normal[1], normal[2]};
    double up = dot3(n, g->normal);
    tilt[0] = -dot3(n, g->u) / copysign(fmax(fabs(up), least_up), up);
    tilt[1] = -dot3(n, g->v) / copysign(fmax(fabs(up), least_up), up);
}

/* Ends the disc of point i at the line in which its plane meets `other`. In a corner, which is seen from within, it
 * goes on to that line, and a cell that this cuts is there on both planes, so that nothing shows between them: what
 * lies beyond is hidden. At an edge, which is seen from without, what lies beyond is seen: a cell's middle lies beyond
 * it by less. Where nobody says from where a point was seen, it may be either. */
static void end_at_crease(const struct spl_panel_grid *g, size_t i, const struct spl_plane *other,
                          struct spl_panel_disc *d)
{
    const struct spl_points *p = g->group->points;
    bool known = p->eye_count || (p->station && p->station[i] != SPL_NO_STATION);
    double off[3];
    for (int c = 0; c < 3; c++)
        off[c] = spl_points_at(p, c, i) - other->origin[c];
    double above = dot3(off, other->normal), side = above > 0 ? -1 : 1;
    double cut = !known ? cut_at_either : above > 0 ? cut_in_corner : cut_at_edge;
    double along[2] = {side * dot3(other->normal, g->u), side * dot3(other->normal, g->v)};
    double sine = hypot(along[0], along[1]);
    d->clip[0] = along[0] / sine;
    d->clip[1] = along[1] / sine;
    d->clip_offset = fabs(above) / sine * g->inverse;
    d->reach = known && above < 0 ? 0 : d->clip_offset;
    d->clip_offset += cut * (fabs(d->clip[0]) + fabs(d->clip[1]));
}

void spl_panel_grid_shape(const struct spl_panel_grid *g, size_t i, struct spl_panel_disc *d)
{
    const struct spl_points *p = g->group->points;
    const struct spl_point_clip *clip = p->clip ? &p->clip[i] : NULL;
    if (g->group->plane->heights)
        get_tilt(g, p->normal[i], d->tilt);
    uint32_t crease = g->group->leaf && g->group->crease ? g->group->crease[i] : SPL_NO_PLANE;
    if (crease != SPL_NO_PLANE)
        end_at_crease(g, i, &g->group->planes->list[crease], d);
    else if (g->group->leaf && clip && (clip->direction[0] || clip->direction[1] || clip->direction[2])) {
        double direction[3] = {clip->direction[0] / 127.0, clip->direction[1] / 127.0, clip->direction[2] / 127.0};
        d->clip[0] = dot3(direction, g->u) + d->tilt[0] * dot3(direction, g->normal);
        d->clip[1] = dot3(direction, g->v) + d->tilt[1] * dot3(direction, g->normal);
        d->clip_offset = d->radius * clip->offset / 255;
    }
}

/* Where the group's cells begin; false: they cannot be counted. */
static bool find_first(struct spl_panel_grid *g)
{
    double own[2] = {INFINITY, INFINITY},
           reach[2] = {INFINITY, INFINITY}; /* the least of a middle, and of what it covers */
    for (size_t m = 0; m < g->group->count; m++) {
        struct spl_panel_disc d = spl_panel_grid_disc(g, g->group->members[m]);
        const double at[2] = {d.x, d.y};
        if (!(fabs(d.x) < most_cells && fabs(d.y) < most_cells && d.radius <= SPL_PANEL_RADIUS_MAX))
            return false;
        for (int a = 0; a < 2; a++) {
            double end = at[a] + (d.reach > 0 ? d.reach * d.clip[a] : 0);
            double low = (at[a] < end ? at[a] : end) - d.radius - 0.5;
            own[a] = at[a] < own[a] ? at[a] : own[a];
            reach[a] = low < reach[a] ? low : reach[a];
        }
    }
    for (int a = 0; a < 2; a++) { /* as spl_panel_disc_range() has it of each */
        int32_t low = spl_panel_ceil(reach[a]), least = spl_panel_floor(own[a]);
        g->first[a] = low < least ? low : least;
    }
    for (int a = 0; g->group->plane->heights && a < 2; a++) /* lattices of all nodes are parts of one */
        g->first[a] -= (g->first[a] % SPL_PANEL_SIDE + SPL_PANEL_SIDE) % SPL_PANEL_SIDE;
    return true;
}

bool spl_panel_grid_init(struct spl_panel_grid *g, const struct spl_panel_group *group)
{
    init_grid(g, group);
    return find_first(g);
}
