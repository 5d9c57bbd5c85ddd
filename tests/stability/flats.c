/* One ray a point, without noise: a scan is the same on every machine. It reaches pack as PTX; tiles, of which no
 * tripod sees a hundred thousand evenly, as points. */
#include "flats.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "support/make_dataset.h"
#include "synth/build.h"
#include "synth/random.h"

static const double east[3] = {1, 0, 0}, north[3] = {0, 1, 0}, up[3] = {0, 0, 1};

enum { stucco, floor_stone, leaf, wire, wood };
static const struct spl_material materials[] = {
    [stucco] = {.kind = SPL_MATERIAL_PLASTER,
                .colors = {{150, 120, 96}, {206, 184, 150}, {236, 224, 206}},
                .size = {0.6, 0.6},
                .seed = 801},
    [floor_stone] = {.kind = SPL_MATERIAL_PLASTER,
                     .colors = {{70, 76, 84}, {120, 124, 126}, {170, 168, 160}},
                     .size = {1.2, 1.2},
                     .finest = 0.1,
                     .seed = 807},
    [leaf] = {.kind = SPL_MATERIAL_SOLID,
              .colors = {{30, 70, 26}, {70, 120, 40}, {150, 170, 70}},
              .size = {0.2, 0.2},
              .seed = 811},
    [wire] = {.kind = SPL_MATERIAL_FLAT, .colors = {{30, 30, 36}}},
    [wood] = {.kind = SPL_MATERIAL_SOLID,
              .colors = {{84, 60, 36}, {130, 96, 56}, {190, 160, 110}},
              .size = {0.1, 0.4},
              .seed = 821},
};

/* A tripod, and the part of a sphere that it looks at; degrees, turned from north to the east, risen from level. */
struct sweep {
    double position[3], turn[2], rise[2], step[2];
};
enum { SWEEPS = 2 };

static const struct {
    const char *name;
    struct sweep sweeps[SWEEPS]; /* step 0: none */
    int tiles, points;           /* a side; of each tile */
} flats[FLAT_COUNT] = {
    [FLAT_BORDERS] = {"borders",
                      {{{-1, -3, 1.6}, {-50, 60}, {-35, 25}, {0.25, 0.25}},
                       {{1, -3, 1.5}, {-60, 50}, {-35, 25}, {0.25, 0.25}}},
                      0,
                      0},
    [FLAT_LINES] = {"scan-lines", {{{0, -3, 1.7}, {-40, 40}, {-45, -3}, {0.04, 0.4}}}, 0, 0},
    [FLAT_ROUND] = {"round",
                    {{{-1.5, -3, 1.6}, {-40, 60}, {-50, 30}, {0.2, 0.2}},
                     {{1.5, -3, 1.6}, {-60, 40}, {-50, 30}, {0.2, 0.2}}},
                    0,
                    0},
    [FLAT_DENSITY] = {"density-step",
                      {{{0, -3, 1.4}, {-40, 40}, {-26, 26}, {0.5, 0.5}},
                       {{0, -3, 1.4}, {0, 40}, {-26, 26}, {0.1, 0.1}}},
                      0,
                      0},
    [FLAT_WINDOWS] = {"windows", {{{0, -3, 1.4}, {-45, 45}, {-30, 30}, {0.2, 0.2}}}, 0, 0},
    [FLAT_SLATS] = {"slats", {{{0, -3, 1.4}, {-30, 30}, {-30, 20}, {0.1, 0.15}}}, 0, 0},
    [FLAT_STEPS] = {"tilted-steps",
                    {{{-0.8, -3, 2.2}, {-40, 50}, {-60, 0}, {0.2, 0.2}},
                     {{0.8, -3, 2.2}, {-50, 40}, {-60, 0}, {0.2, 0.2}}},
                    0,
                    0},
    [FLAT_TILES] = {"tiles", {{{0}}}, 32, 12},
    [FLAT_SMALL] = {"small-tiles", {{{0}}}, 32, 6},
    [FLAT_MANY] = {"many-tiles", {{{0}}}, 316, 6},
    [FLAT_LEAVES] = {"leaves",
                     {{{-1, -3, 1.4}, {-30, 50}, {-25, 25}, {0.15, 0.15}},
                      {{1, -3, 1.4}, {-50, 30}, {-25, 25}, {0.15, 0.15}}},
                     0,
                     0},
};

static void *must_have(void *p)
{
    if (!p)
        abort();
    return p;
}

static struct spl_skin skin(struct spl_scene *scene, uint32_t material, const char *name)
{
    return (struct spl_skin){material, spl_build_object(scene, name)};
}

/* The part of the plane y = 0 from (x0, z0) to (x1, z1). */
static void wall(struct spl_scene *scene, struct spl_skin skin, double x0, double x1, double z0, double z1)
{
    spl_build_rectangle(scene, skin, (double[3]){(x0 + x1) / 2, 0, (z0 + z1) / 2}, east, up,
                        (double[2]){(x1 - x0) / 2, (z1 - z0) / 2}, NULL);
}

static void balls(struct spl_scene *scene, int count, double radius, const double low[3], const double high[3])
{
    struct spl_skin leaves = skin(scene, leaf, "leaves");
    for (int i = 0; i < count; i++) {
        uint64_t state = hash64(2000000 + (uint64_t)i);
        double at[3];
        for (int a = 0; a < 3; a++)
            at[a] = random_between(&state, low[a], high[a]);
        spl_build_sphere(scene, leaves, at, radius);
    }
}

static void build_borders(struct spl_scene *scene)
{
    struct spl_skin wires = skin(scene, wire, "wires");
    wall(scene, skin(scene, stucco, "wall"), -2.5, 2.5, 0, 2.4);
    balls(scene, 2500, 0.02, (double[3]){-2, -0.35, 0}, (double[3]){0.5, -0.02, 0.8});
    for (int i = 0; i < 2; i++)
        spl_build_cone(scene, wires, (double[3]){-2.5, -0.1, 1.5 + 0.4 * i}, (double[3]){2.5, -0.1, 1.5 + 0.4 * i},
                       0.004, 0.004);
}

static void build_round(struct spl_scene *scene)
{
    spl_build_rectangle(scene, skin(scene, floor_stone, "floor"), (double[3]){0, -1, 0}, east, north,
                        (double[2]){3, 2.5}, NULL);
    spl_build_rectangle(scene, skin(scene, stucco, "wall"), (double[3]){0, 1.5, 1.25}, east, up, (double[2]){3, 1.25},
                        NULL);
    spl_build_cone(scene, skin(scene, wood, "column"), (double[3]){-0.9, 0, 0}, (double[3]){-0.9, 0, 2.2}, 0.3, 0.3);
    spl_build_sphere(scene, skin(scene, stucco, "sphere"), (double[3]){0.8, 0, 0.9}, 0.5);
}

/* Three windows above, slots between what is left of the wall below. */
static void build_windows(struct spl_scene *scene)
{
    struct spl_skin plaster = skin(scene, stucco, "wall");
    static const double posts[4][2] = {{-2.4, -1.8}, {-0.9, -0.45}, {0.45, 0.9}, {1.8, 2.4}};
    static const double below[4][2] = {{-2.4, -1.2}, {-1, 0}, {0.1, 1.2}, {1.25, 2.4}};
    for (int i = 0; i < 4; i++) {
        wall(scene, plaster, posts[i][0], posts[i][1], 1.2, 2.2);
        wall(scene, plaster, below[i][0], below[i][1], 0.2, 1);
    }
    wall(scene, plaster, -2.4, 2.4, 0, 0.2);
    wall(scene, plaster, -2.4, 2.4, 1, 1.2);
    wall(scene, plaster, -2.4, 2.4, 2.2, 2.6);
}

static void build_slats(struct spl_scene *scene)
{
    struct spl_skin slats = skin(scene, wood, "slats");
    for (int i = 0; i < 60; i++)
        wall(scene, slats, -1.2 + 0.04 * i, -1.18 + 0.04 * i, 0.4, 2.4);
}

static void build_steps(struct spl_scene *scene)
{
    struct spl_skin stone[2] = {skin(scene, stucco, "treads"), skin(scene, floor_stone, "risers")};
    const double tilt = 20 * M_PI / 180, along[3] = {0, cos(tilt), sin(tilt)}, off[3] = {0, -sin(tilt), cos(tilt)};
    for (int i = 0; i < 16; i++) {
        double tread[3], riser[3];
        for (int a = 0; a < 3; a++) {
            double low = along[a] * 0.15 * i + off[a] * 0.02 * i - (a == 1 ? 1.2 : 0);
            tread[a] = low + along[a] * 0.075;
            riser[a] = low + along[a] * 0.15 + off[a] * 0.01;
        }
        spl_build_rectangle(scene, stone[0], tread, east, along, (double[2]){1.2, 0.075}, NULL);
        spl_build_rectangle(scene, stone[1], riser, east, off, (double[2]){1.2, 0.01}, NULL);
    }
}

/* Tile i of `side` x `side`, level but for its tilt, 0.1 m apart: middle and sides. */
static void place_tile(int i, int side, double middle[3], double u[3], double v[3])
{
    uint64_t state = hash64(3000000 + (uint64_t)i);
    double a = random_between(&state, -0.35, 0.35), b = random_between(&state, -0.35, 0.35);
    middle[0] = 0.1 * (i % side - side / 2);
    middle[1] = 0.1 * (i / side) - 1.5;
    middle[2] = random_between(&state, -0.03, 0.03);
    memcpy(u, (double[3]){cos(a), 0, sin(a)}, 3 * sizeof *u);
    memcpy(v, (double[3]){-sin(a) * sin(b), cos(b), cos(a) * sin(b)}, 3 * sizeof *v);
}

static void build_tiles(struct spl_scene *scene, int side)
{
    struct spl_skin tiles = skin(scene, floor_stone, "tiles");
    for (int i = 0; i < side * side; i++) {
        double middle[3], u[3], v[3];
        place_tile(i, side, middle, u, v);
        spl_build_rectangle(scene, tiles, middle, u, v, (double[2]){0.04, 0.04}, (double[2]){middle[0], middle[1]});
    }
}

struct spl_scene *flat_create(enum flat what)
{
    struct spl_scene *scene = must_have(calloc(1, sizeof *scene));
    struct spl_error err = {0};
    scene->name = flats[what].name;
    scene->materials = materials;
    if (what == FLAT_BORDERS)
        build_borders(scene);
    else if (what == FLAT_LINES)
        spl_build_rectangle(scene, skin(scene, floor_stone, "ground"), (double[3]){0, 17, 0}, east, north,
                            (double[2]){20, 20}, NULL);
    else if (what == FLAT_ROUND)
        build_round(scene);
    else if (what == FLAT_DENSITY)
        wall(scene, skin(scene, stucco, "wall"), -2, 2, 0.2, 2.6);
    else if (what == FLAT_WINDOWS)
        build_windows(scene);
    else if (what == FLAT_SLATS)
        build_slats(scene);
    else if (what == FLAT_STEPS)
        build_steps(scene);
    else if (what == FLAT_LEAVES)
        balls(scene, 12000, 0.006, (double[3]){-1.5, -0.6, 0.4}, (double[3]){1.5, 0.6, 2.4});
    else
        build_tiles(scene, flats[what].tiles);
    if (scene->error.code || spl_bvh_build(scene->primitives, scene->primitive_count, &scene->nodes, &err))
        abort();
    return scene;
}

/* A grid of rays, column by column, from below. */
static void write_sweep(FILE *file, const struct spl_scene *scene, const struct sweep *s)
{
    const double *p = s->position, degree = M_PI / 180;
    int columns = (int)((s->turn[1] - s->turn[0]) / s->step[0]), rows = (int)((s->rise[1] - s->rise[0]) / s->step[1]);
    fprintf(file, "%d\n%d\n%.6f %.6f %.6f\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n%.6f %.6f %.6f 1\n", columns,
            rows, p[0], p[1], p[2], p[0], p[1], p[2]);
    for (int i = 0; i < columns * rows; i++) {
        double turn = (s->turn[0] + (i / rows + 0.5) * s->step[0]) * degree;
        double rise = (s->rise[0] + (i % rows + 0.5) * s->step[1]) * degree;
        struct spl_hit hit;
        if (spl_scene_hit(scene, p, (double[3]){sin(turn) * cos(rise), cos(turn) * cos(rise), sin(rise)}, &hit))
            fprintf(file, "%.6f %.6f %.6f 0.5 %d %d %d\n", hit.position[0] - p[0], hit.position[1] - p[1],
                    hit.position[2] - p[2], hit.color[0], hit.color[1], hit.color[2]);
        else
            fprintf(file, "0 0 0 0.5 0 0 0\n");
    }
}

static void init_tiles(struct world worlds[2], enum flat what, const struct spl_scene *scene, double error)
{
    const int side = flats[what].tiles, own = flats[what].points;
    size_t count = (size_t)side * (size_t)side * (size_t)own * (size_t)own;
    struct point *points = must_have(calloc(count, sizeof *points));
    for (size_t i = 0; i < count; i++) {
        int tile = (int)(i / (size_t)(own * own)), at = (int)(i % (size_t)(own * own));
        double middle[3], u[3], v[3], x = 0.08 * (at % own + 0.5) / own - 0.04,
                                      y = 0.08 * (at / own + 0.5) / own - 0.04;
        struct spl_hit hit;
        place_tile(tile, side, middle, u, v);
        for (int a = 0; a < 3; a++)
            points[i].position[a] = middle[a] + x * u[a] + y * v[a];
        double above[3] = {points[i].position[0], points[i].position[1], 1};
        if (!spl_scene_hit(scene, above, (double[3]){0, 0, -1}, &hit))
            abort();
        memcpy(points[i].color, hit.color, sizeof hit.color);
    }
    world_init_points_both(worlds, flats[what].name, points, count, error);
    free(points);
}

void world_init_flat(struct world worlds[2], enum flat what, double error)
{
    struct spl_scene *scene = flat_create(what);
    char folder[256], path[512];
    if (flats[what].tiles) {
        init_tiles(worlds, what, scene, error);
        worlds[0].scene = scene;
        return;
    }
    make_folder(folder);
    snprintf(path, sizeof path, "%s/flat.ptx", folder);
    FILE *file = must_have(fopen(path, "wb"));
    for (int s = 0; s < SWEEPS && flats[what].sweeps[s].step[0] > 0; s++)
        write_sweep(file, scene, &flats[what].sweeps[s]);
    if (fclose(file))
        abort();
    world_init_scan_both(worlds, flats[what].name, path, error);
    worlds[0].scene = scene;
    unlink(path);
    rmdir(folder);
}
