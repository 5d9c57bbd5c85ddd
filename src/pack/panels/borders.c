/* Where planes end beside others. What clip.c takes for one surface by its slope is told apart by planes here: the face
 * of a plaque and the wall a spacing behind it, a step of a stair and the next.
 *
 * A point near another plane asks the points around it. Where those of the other plane are among them and those of its
 * own lie on one side of the line in which both meet, its plane goes on to that line and ends there: cells that lie
 * beyond it as a whole are not there, so that planes meet without a gap. Else, where it lies before the other one, it
 * ends where its own points do; what lies behind goes on beneath it, since scans seldom see where to.
 *
 * Only points that lie near a plane with points in the same leaf are asked; what has relief is no plane here. One
 * worker's; a point's line is its own. */
#include "pack/panels/borders.h"

#include <math.h>
#include <stdlib.h>

#include "base/array.h"
#include "geom/tangent.h"

enum { asked = 36, other_points = 4 };
static const double beside = 1.5;     /* radii from another plane, or from the box of its points, that are looked at */
static const double meets = 0.25;     /* sine of the angle from which on planes meet in a line */
static const double astray = 0.3;     /* spacings that points may lie beyond the line in which planes meet */
static const double half_disc = 0.42; /* spacings beyond that line at which discs end, where cells end at it */

struct spl_panel_box {
    double low[3], high[3];
};

static void find_box(const struct spl_points *p, const struct spl_panel_groups *g, const struct spl_panel_run *run,
                     size_t first, struct spl_panel_box *box)
{
    for (int c = 0; c < 3; c++) {
        box->low[c] = INFINITY;
        box->high[c] = -INFINITY;
        for (size_t k = run->begin; k < run->begin + run->count; k++) {
            double at = spl_points_at(p, c, first + g->members[k]);
            double reach = beside * (double)p->radius[first + g->members[k]];
            box->low[c] = fmin(box->low[c], at - reach);
            box->high[c] = fmax(box->high[c], at + reach);
        }
    }
}

static bool overlap(const struct spl_panel_box *a, const struct spl_panel_box *b)
{
    bool all = true;
    for (int c = 0; c < 3; c++)
        all &= a->low[c] <= b->high[c] && b->low[c] <= a->high[c];
    return all;
}

static double distance(const struct spl_points *p, size_t i, const struct spl_plane *plane)
{
    double off = 0;
    for (int c = 0; c < 3; c++)
        off += plane->normal[c] * (spl_points_at(p, c, i) - plane->origin[c]);
    return off;
}

static bool is_within(const struct spl_points *p, size_t i, const struct spl_panel_box *box)
{
    bool all = true;
    for (int c = 0; c < 3; c++)
        all &= spl_points_at(p, c, i) >= box->low[c] && spl_points_at(p, c, i) <= box->high[c];
    return all;
}

/* Where the plane of point i meets `other`, if it ends there: as of spl_clip_find_border(). */
static bool find_crease(const struct spl_points *p, size_t i, const struct spl_nearest *near, uint32_t label,
                        const struct spl_plane *other, const float u[3], const float v[3], double direction[2],
                        double *end)
{
    double along[2] = {0}, off = distance(p, i, other), spacing = (double)p->radius[i] / (double)SPL_RADIUS_SPACING;
    unsigned count = 0;
    for (int c = 0; c < 3; c++) {
        along[0] += other->normal[c] * (double)u[c];
        along[1] += other->normal[c] * (double)v[c];
    }
    double sine = hypot(along[0], along[1]);
    if (sine < meets)
        return false;
    double side = off > 0 ? -1 : 1;
    *end = fabs(off) / sine;
    for (int a = 0; a < 2; a++)
        direction[a] = side * along[a] / sine;
    for (unsigned a = 0; a < near->count; a++) {
        uint32_t k = near->index[a];
        double out = 0;
        count += p->plane[k] == label;
        if (p->plane[k] != p->plane[i])
            continue;
        for (int c = 0; c < 3; c++)
            out += (spl_points_at(p, c, k) - spl_points_at(p, c, i)) *
                   (direction[0] * (double)u[c] + direction[1] * (double)v[c]);
        if (out > *end + astray * spacing)
            return false;
    }
    return count >= other_points;
}

static void find_line(const struct spl_panel_maker *m, const struct spl_nearest *near, size_t i)
{
    struct spl_points *p = m->points;
    const struct spl_plane *own = &m->planes->list[p->plane[i]];
    const float normal[3] = {(float)own->normal[0], (float)own->normal[1], (float)own->normal[2]};
    float u[3], v[3];
    double best[2] = {0}, least = INFINITY, direction[2] = {0}, end;
    uint32_t seen[asked];
    unsigned count = 0, behind = 0, before = 0;
    spl_tangent_frame(normal, u, v);
    for (unsigned a = 0; a < near->count; a++) {
        uint32_t label = p->plane[near->index[a]];
        if (label != p->plane[i]) {
            bool lower = distance(p, near->index[a], own) < distance(p, i, own);
            behind += lower;
            before += !lower;
        }
        bool known = label == SPL_NO_PLANE || label == p->plane[i] || m->planes->list[label].heights;
        for (unsigned k = 0; k < count && !known; k++)
            known = seen[k] == label;
        if (known)
            continue;
        seen[count++] = label;
        if (find_crease(p, i, near, label, &m->planes->list[label], u, v, direction, &end) && end < least) {
            m->crease[i] = label;
            least = end;
            best[0] = direction[0];
            best[1] = direction[1];
        }
    }
    if (least < INFINITY)
        least += half_disc * (double)p->radius[i] / (double)SPL_RADIUS_SPACING;
    else if (behind > before && spl_clip_find_border(p, i, near, &m->turns, true, u, v, direction, &end)) {
        least = end;
        best[0] = direction[0];
        best[1] = direction[1];
    }
    if (least < INFINITY)
        spl_clip_set(p, i, u, v, best, least);
}

bool spl_panel_borders_find(struct spl_panel_borders *b, const struct spl_panel_groups *g,
                            const struct spl_panel_maker *m, size_t first)
{
    const struct spl_points *p = m->points;
    if (!p->clip || g->run_count < 2)
        return true;
    if (spl_array_reserve(b->boxes, b->box_capacity, g->run_count, NULL) ||
        spl_array_reserve(b->others, b->other_capacity, g->run_count, NULL))
        return false;
    spl_nearest_init(&b->near);
    for (size_t r = 0; r < g->run_count; r++)
        find_box(p, g, &g->runs[r], first, &b->boxes[r]);
    for (size_t r = 0; r < g->run_count; r++) {
        size_t others = 0;
        if (m->planes->list[g->runs[r].plane].heights)
            continue;
        for (size_t o = 0; o < g->run_count; o++)
            if (o != r && !m->planes->list[g->runs[o].plane].heights && overlap(&b->boxes[r], &b->boxes[o]))
                b->others[others++] = (uint32_t)o;
        for (size_t k = g->runs[r].begin; k < g->runs[r].begin + g->runs[r].count; k++) {
            size_t i = first + g->members[k];
            bool near = false;
            for (size_t o = 0; o < others && !near; o++)
                near = is_within(p, i, &b->boxes[b->others[o]]) &&
                       fabs(distance(p, i, &m->planes->list[g->runs[b->others[o]].plane])) <=
                           beside * (double)p->radius[i];
            if (!near)
                continue;
            spl_neighbours_find(m->neighbours, i, asked, &b->near);
            find_line(m, &b->near, i);
        }
    }
    return true;
}

void spl_panel_borders_finish(struct spl_panel_borders *b)
{
    free(b->boxes);
    free(b->others);
    *b = (struct spl_panel_borders){0};
}
