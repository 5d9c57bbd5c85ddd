/* The beam is four planes through its origin. A node of the hierarchy is dropped when its box lies outside of one of
 * them; that keeps a few boxes too many and never loses one. What is left is sorted by the distance of its box, so that
 * a ray stops at the first box that begins behind its hit. Sixteen rays or more share one look-up, which makes a ray
 * some five times cheaper than a walk through the hierarchy. */
#include "synth/beam.h"

#include "geom/vector.h"

enum { stack_max = 128 }; /* as deep as the hierarchy */

/* Whether the box lies wholly on the outer side of a plane through the origin. */
static bool outside(double planes[4][3], double box[2][3])
{
    for (int i = 0; i < 4; i++) {
        const double *n = planes[i];
        double farthest = 0;
        for (int a = 0; a < 3; a++)
            farthest += n[a] * box[n[a] > 0][a];
        if (farthest < 0)
            return true;
    }
    return false;
}

/* The box between two corners, relative to `origin`; returns its distance. */
static double relative(const double low[3], const double high[3], const double origin[3], double box[2][3])
{
    double square = 0;
    for (int a = 0; a < 3; a++) {
        box[0][a] = low[a] - origin[a];
        box[1][a] = high[a] - origin[a];
        double off = fmax(fmax(box[0][a], -box[1][a]), 0);
        square += off * off;
    }
    return sqrt(square);
}

static void insert(struct spl_beam *beam, uint32_t primitive, double from)
{
    size_t at = beam->count++;
    if (at >= SPL_BEAM_MAX)
        return;
    for (; at && beam->items[at - 1].from > from; at--)
        beam->items[at] = beam->items[at - 1];
    beam->items[at].from = from;
    beam->items[at].primitive = primitive;
}

void spl_beam_init(struct spl_beam *beam, const struct spl_scene *scene, const double origin[3], double nearest,
                   double corners[4][3])
{
    double planes[4][3], middle[3] = {0}, longest = 0, box[2][3];
    for (int i = 0; i < 4; i++) {
        longest = fmax(longest, dot3(corners[i], corners[i]));
        mad3(middle, 1, corners[i], middle);
    }
    longest = sqrt(longest) * (1 + 1e-9);
    for (int i = 0; i < 4; i++) {
        cross3(corners[i], corners[(i + 1) % 4], planes[i]);
        double side = dot3(planes[i], middle), small = 1e-12 * longest * longest;
        if (dot3(planes[i], planes[i]) < small * small)
            side = 0; /* two equal corners bound nothing */
        for (int a = 0; a < 3; a++)
            planes[i][a] = side > 0 ? planes[i][a] : side < 0 ? -planes[i][a] : 0;
    }
    beam->scene = scene;
    beam->nearest = nearest;
    beam->count = 0;
    for (int a = 0; a < 3; a++)
        beam->origin[a] = origin[a];

    uint32_t stack[stack_max] = {0};
    for (int depth = 1; depth && beam->count <= SPL_BEAM_MAX;) {
        uint32_t at = stack[--depth];
        const struct spl_bvh_node *node = &scene->nodes[at];
        relative(node->bounds[0], node->bounds[1], origin, box);
        if (outside(planes, box))
            continue;
        if (!node->count) {
            stack[depth++] = node->first;
            stack[depth++] = at + 1;
            continue;
        }
        for (uint32_t i = node->first; i < node->first + node->count; i++) {
            double bounds[2][3];
            spl_primitive_bounds(&scene->primitives[i], bounds);
            double distance = relative(bounds[0], bounds[1], origin, box);
            if (!outside(planes, box))
                insert(beam, i, distance / longest);
        }
    }
}

bool spl_beam_hit(const struct spl_beam *beam, const double direction[3], double *t, uint32_t *index)
{
    const struct spl_primitive *primitives = beam->scene->primitives;
    double start[3], rest = *t - beam->nearest;
    mad3(beam->origin, beam->nearest, direction, start);
    bool found = false;
    if (beam->count > SPL_BEAM_MAX) {
        found = spl_bvh_hit(beam->scene->nodes, primitives, start, direction, &rest, index);
    } else {
        for (size_t i = 0; i < beam->count && beam->items[i].from < rest + beam->nearest; i++) {
            if (spl_primitive_hit(&primitives[beam->items[i].primitive], start, direction, &rest)) {
                *index = beam->items[i].primitive;
                found = true;
            }
        }
    }
    if (found)
        *t = rest + beam->nearest;
    return found;
}
