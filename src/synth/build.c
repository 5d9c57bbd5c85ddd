/* The builders of single shapes, and of wires and trees from them. Owned by the thread that creates the scene. */
#include "synth/build.h"

#include <math.h>
#include <string.h>

#include "base/array.h"
#include "base/memory.h"
#include "synth/random.h"
#include "geom/vector.h"

uint32_t spl_build_object(struct spl_scene *scene, const char *name)
{
    if (spl_array_reserve(scene->objects, scene->object_capacity, scene->object_count + 1, &scene->error))
        return 0;
    scene->objects[scene->object_count] = name;
    return (uint32_t)scene->object_count++;
}

void spl_build_station(struct spl_scene *scene, const double position[3], double yaw, double tilt)
{
    if (spl_array_reserve(scene->stations, scene->station_capacity, scene->station_count + 1, &scene->error))
        return;
    double cy = cos(yaw * M_PI / 180), sy = sin(yaw * M_PI / 180);
    double ct = cos(tilt * M_PI / 180), st = sin(tilt * M_PI / 180);
    scene->stations[scene->station_count++] = (struct spl_station){
        .position = {position[0], position[1], position[2]},
        .rotation = {cy, -sy * ct, sy * st, sy, cy * ct, -cy * st, 0, st, ct},
    };
}

void spl_build_track(struct spl_scene *scene, const double (*points)[3], size_t count)
{
    scene->track = spl_alloc(count, sizeof *scene->track, &scene->error);
    if (!scene->track)
        return;
    scene->track_count = count;
    for (size_t i = 0; i < count; i++) {
        struct spl_track_point *p = &scene->track[i];
        double step[3];
        memcpy(p->position, points[i], sizeof p->position);
        sub3(points[i + 1 < count ? i + 1 : i], points[i > 0 ? i - 1 : 0], p->heading);
        normalise3(p->heading);
        sub3(points[i], points[i > 0 ? i - 1 : 0], step);
        p->at = i ? p[-1].at + sqrt(dot3(step, step)) : 0;
    }
}

static void add(struct spl_scene *scene, const struct spl_primitive *primitive)
{
    if (!spl_array_reserve(scene->primitives, scene->primitive_capacity, scene->primitive_count + 1, &scene->error))
        scene->primitives[scene->primitive_count++] = *primitive;
}

/* A primitive around `normal`, which need not be unit; its length is kept in .length. */
static struct spl_primitive around(enum spl_primitive_kind kind, struct spl_skin skin, const double center[3],
                                   const double normal[3])
{
    struct spl_primitive p = {.kind = kind, .material = skin.material, .object = skin.object};
    for (int i = 0; i < 3; i++) {
        p.center[i] = center[i];
        p.normal[i] = normal[i];
    }
    p.length = normalise3(p.normal);
    orthogonal3(p.normal, p.u);
    cross3(p.normal, p.u, p.v);
    return p;
}

void spl_build_rectangle(struct spl_scene *scene, struct spl_skin skin, const double center[3], const double u[3],
                         const double v[3], const double half[2], const double offset[2])
{
    double normal[3];
    cross3(u, v, normal);
    struct spl_primitive p = around(SPL_PRIMITIVE_RECTANGLE, skin, center, normal);
    for (int i = 0; i < 3; i++) {
        p.u[i] = u[i];
        p.v[i] = v[i];
    }
    for (int i = 0; i < 2; i++) {
        p.half[i] = half[i];
        p.offset[i] = offset ? offset[i] : 0;
    }
    add(scene, &p);
}

void spl_build_box(struct spl_scene *scene, struct spl_skin skin, const double center[3], const double along[3],
                   const double half[3])
{
    double axes[3][3] = {{along[0], along[1], along[2]}, {0}, {0, 0, 1}};
    cross3(axes[2], axes[0], axes[1]);
    for (int face = 0; face < 6; face++) {
        int n = face / 2, a = (n + 1) % 3, b = (n + 2) % 3;
        double at[3], sign = face % 2 ? -1 : 1, u[3];
        mad3(center, sign * half[n], axes[n], at);
        mad3((double[3]){0}, sign, axes[a], u);
        /* Texture coordinates are the world's along the face: boxes in a row do not repeat each other. */
        spl_build_rectangle(scene, skin, at, u, axes[b], (double[2]){half[a], half[b]},
                            (double[2]){dot3(at, u), dot3(at, axes[b])});
    }
}

void spl_build_disc(struct spl_scene *scene, struct spl_skin skin, const double center[3], const double normal[3],
                    double radius)
{
    struct spl_primitive p = around(SPL_PRIMITIVE_DISC, skin, center, normal);
    p.half[0] = radius;
    add(scene, &p);
}

void spl_build_sphere(struct spl_scene *scene, struct spl_skin skin, const double center[3], double radius)
{
    struct spl_primitive p = around(SPL_PRIMITIVE_SPHERE, skin, center, (double[3]){0, 0, 1});
    p.half[0] = radius;
    add(scene, &p);
}

void spl_build_cone(struct spl_scene *scene, struct spl_skin skin, const double from[3], const double to[3],
                    double radius_from, double radius_to)
{
    double axis[3];
    sub3(to, from, axis);
    struct spl_primitive p = around(SPL_PRIMITIVE_CONE, skin, from, axis);
    p.half[0] = radius_from;
    p.half[1] = radius_to;
    add(scene, &p);
}

void spl_build_wire(struct spl_scene *scene, struct spl_skin skin, const double from[3], const double to[3], double sag,
                    double radius, unsigned segments)
{
    /* A parabola: within a thousandth of the sag of the catenary for wires as taut as ours. */
    double last[3] = {from[0], from[1], from[2]};
    for (unsigned i = 1; i <= segments; i++) {
        double s = (double)i / segments, next[3];
        for (int a = 0; a < 3; a++)
            next[a] = from[a] + s * (to[a] - from[a]);
        next[2] -= 4 * sag * s * (1 - s);
        spl_build_cone(scene, skin, last, next, radius, radius);
        for (int a = 0; a < 3; a++)
            last[a] = next[a];
    }
}

struct tree {
    struct spl_scene *scene;
    struct spl_skin bark, leaf;
    uint64_t random;
};

enum { generations = 4, children = 3, leaves = 40 };

static void grow_leaves(struct tree *tree, const double from[3], const double axis[3], double length)
{
    for (int i = 0; i < leaves; i++) {
        double center[3], normal[3];
        mad3(from, random_between(&tree->random, 0.2, 1.15) * length, axis, center);
        for (int a = 0; a < 3; a++) {
            center[a] += random_between(&tree->random, -0.14, 0.14);
            normal[a] = random_between(&tree->random, -1, 1);
        }
        normal[2] += 1.2; /* towards the light, never zero */
        spl_build_disc(tree->scene, tree->leaf, center, normal, random_between(&tree->random, 0.025, 0.045));
    }
}

static void grow_branch(struct tree *tree, const double from[3], const double axis[3], double length, double radius,
                        int generation)
{
    double to[3], side[3], other[3];
    mad3(from, length, axis, to);
    double tip = radius * (generation == generations ? 0.4 : 0.7);
    spl_build_cone(tree->scene, tree->bark, from, to, radius, tip);
    if (generation >= generations - 1)
        grow_leaves(tree, from, axis, length);
    if (generation == generations)
        return;
    orthogonal3(axis, side);
    cross3(axis, side, other);
    double turn = random_between(&tree->random, 0, 2 * M_PI);
    for (int i = 0; i < children; i++) {
        double angle = turn + 2 * M_PI * i / children + random_between(&tree->random, -0.4, 0.4);
        double spread = random_between(&tree->random, 0.45, 0.85), next[3], start[3];
        for (int a = 0; a < 3; a++)
            next[a] = cos(spread) * axis[a] + sin(spread) * (cos(angle) * side[a] + sin(angle) * other[a]);
        next[2] += 0.15;
        normalise3(next);
        mad3(from, random_between(&tree->random, 0.8, 1) * length, axis, start);
        grow_branch(tree, start, next, length * random_between(&tree->random, 0.6, 0.75), tip * 0.75, generation + 1);
    }
}

void spl_build_tree(struct spl_scene *scene, struct spl_skin bark, struct spl_skin leaf, const double foot[3],
                    double height, uint64_t seed)
{
    struct tree tree = {.scene = scene, .bark = bark, .leaf = leaf, .random = seed};
    grow_branch(&tree, foot, (double[3]){0, 0, 1}, height * 0.38, height * 0.035, 0);
}
