/* Small planes that meet in a cell: reveals, sills, treads. Points of the cell take turns in saying what plane it is,
 * by their own place and normal; the plane that most others agree with, in place and normal, is fitted to them. Those
 * that say are spread evenly over the points, in their order: there is nothing random. */
#include "pack/planes/fit.h"
#include "pack/planes/planes.h"

enum { speakers = 12 };
static const double alike = 0.9; /* cosine of two normals of one plane */

static bool is_open(const struct spl_fit *f, size_t i, const uint32_t *label)
{
    return label[i] == SPL_NO_PLANE && !(f->points->linear && f->points->linear[i]);
}

/* Marks, as group 1, the open points that agree with the plane through point `at`; returns how many. */
static size_t mark(const struct spl_fit *f, size_t begin, size_t end, const uint32_t *label, size_t at)
{
    const struct spl_points *p = f->points;
    const float *n = p->normal[at];
    const double origin[3] = {spl_points_at(p, 0, at), spl_points_at(p, 1, at), spl_points_at(p, 2, at)};
    const double normal[3] = {n[0], n[1], n[2]};
    size_t count = 0;
    for (size_t i = begin; i < end; i++) {
        const float *own = p->normal[i];
        bool agrees = is_open(f, i, label) && own[0] * n[0] + own[1] * n[1] + own[2] * n[2] >= alike &&
                      fabs(spl_plane_distance(p, i, origin, normal)) <= f->limits.bound;
        f->group[i - f->base] = agrees;
        count += agrees;
    }
    return count;
}

bool spl_fit_corner(const struct spl_fit *f, size_t begin, size_t end, const uint32_t *label, struct spl_patch *patch)
{
    size_t open = 0, seen = 0, most = 0, best = begin;
    bool layers;
    for (size_t i = begin; i < end; i++)
        open += is_open(f, i, label);
    if (open < SPL_PATCH_POINTS)
        return false;
    for (size_t i = begin, turn = 0; i < end; i++) {
        if (!is_open(f, i, label) || seen++ < (2 * turn + 1) * open / (2 * speakers))
            continue;
        turn++;
        size_t count = mark(f, begin, end, label, i);
        if (count > most) {
            most = count;
            best = i;
        }
    }
    if (most < SPL_PATCH_POINTS)
        return false;
    mark(f, begin, end, label, best);
    if (!spl_fit_group(f, begin, end, 1, most, patch, &layers))
        return false;
    const float *n = f->points->normal[best];
    spl_patch_face(patch, (const double[3]){n[0], n[1], n[2]});
    return true;
}
