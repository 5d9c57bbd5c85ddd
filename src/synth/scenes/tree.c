/* Trees: leaves and branches that fill space instead of bounding it. Three trees of different heights, a hedge of four
 * thousand leaves, and a brick wall behind them that shows through every gap. x is east, y north, z up. */
#include "synth/build.h"

#include "synth/random.h"

static const double east[3] = {1, 0, 0}, north[3] = {0, 1, 0}, up[3] = {0, 0, 1};

enum { lawn, brick, bark, birch, green, yellow, hedge };
static const struct spl_material materials[] = {
    [lawn] = {.kind = SPL_MATERIAL_PLASTER,
              .colors = {{70, 84, 36}, {98, 116, 52}, {136, 140, 78}},
              .size = {0.9, 0.9},
              .seed = 403},
    [brick] = {.kind = SPL_MATERIAL_MASONRY,
               .colors = {{140, 76, 60}, {176, 110, 84}, {200, 192, 180}},
               .size = {0.25, 0.0833},
               .joint = 0.012,
               .grain = 0.2,
               .seed = 409},
    [bark] = {.kind = SPL_MATERIAL_SOLID,
              .colors = {{52, 40, 30}, {96, 78, 60}, {134, 116, 94}},
              .size = {0.08, 0.3},
              .seed = 419},
    [birch] = {.kind = SPL_MATERIAL_SOLID,
               .colors = {{60, 58, 54}, {206, 200, 190}, {234, 230, 222}},
               .size = {0.2, 0.07},
               .seed = 421},
    [green] = {.kind = SPL_MATERIAL_LEAF, .colors = {{44, 90, 34}, {106, 146, 52}, {166, 186, 106}}},
    [yellow] = {.kind = SPL_MATERIAL_LEAF, .colors = {{150, 130, 30}, {200, 180, 70}, {226, 214, 140}}},
    [hedge] = {.kind = SPL_MATERIAL_LEAF, .colors = {{24, 62, 34}, {60, 104, 50}, {120, 150, 90}}},
};

static const struct spl_named_camera cameras[] = {
    {"overview", {0.6, -8.6, 1.7}, {-0.4, 1, 2.4}, 65},
    {"crown", {2.6, -3.2, 1.7}, {0.2, 0.2, 4.6}, 55},
    {"inside-crown", {0.7, -0.9, 4.2}, {-2.5, 3.5, 3.4}, 65},
    {"trunk", {-1.5, -1.4, 1.5}, {0, 0, 1.5}, 55},
    {"through-the-leaves", {-5.9, -3.2, 1.7}, {-3.6, 1.4, 3}, 50},
    {"birch", {5.6, -2.6, 1.6}, {4, 1.2, 2.6}, 60},
    {"hedge", {-1.6, -4.4, 1.4}, {0.4, -6, 0.7}, 60},
    {"from-above", {6.5, -6.8, 6.5}, {-0.5, 0.5, 2}, 55},
};

static void build_hedge(struct spl_scene *scene)
{
    struct spl_skin leaves = {hedge, spl_build_object(scene, "hedge")};
    uint64_t random = 433;
    for (int i = 0; i < 4000; i++) {
        double center[3] = {random_between(&random, -3.5, 3.5), random_between(&random, -6.4, -5.8),
                            random_between(&random, 0.02, 1.05)};
        double normal[3] = {random_between(&random, -1, 1), random_between(&random, -1, 1),
                            random_between(&random, 0.1, 1.5)};
        spl_build_disc(scene, leaves, center, normal, random_between(&random, 0.03, 0.05));
    }
}

void spl_build_trees(struct spl_scene *scene)
{
    scene->materials = materials;
    scene->cameras = cameras;
    scene->camera_count = sizeof cameras / sizeof *cameras;
    struct spl_skin wall = {brick, spl_build_object(scene, "wall")};
    spl_build_rectangle(scene, (struct spl_skin){lawn, spl_build_object(scene, "lawn")}, (double[3]){0, -1.5, 0}, east,
                        north, (double[2]){9, 7.5}, NULL);
    spl_build_rectangle(scene, wall, (double[3]){0, 6, 2}, east, up, (double[2]){9, 2}, NULL);
    spl_build_tree(scene, (struct spl_skin){bark, spl_build_object(scene, "oak-branches")},
                   (struct spl_skin){green, spl_build_object(scene, "oak-leaves")}, (double[3]){0, 0, 0}, 7, 439);
    spl_build_tree(scene, (struct spl_skin){birch, spl_build_object(scene, "birch-branches")},
                   (struct spl_skin){yellow, spl_build_object(scene, "birch-leaves")}, (double[3]){4.2, 1.6, 0}, 5.4,
                   443);
    spl_build_tree(scene, (struct spl_skin){bark, spl_build_object(scene, "sapling-branches")},
                   (struct spl_skin){green, spl_build_object(scene, "sapling-leaves")}, (double[3]){-4.4, 1.8, 0}, 4,
                   449);
    build_hedge(scene);
    spl_build_station(scene, (double[3]){-2.2, -3.9, 1.7}, 20, 1);
    spl_build_station(scene, (double[3]){3.5, -3.4, 1.7}, 110, -0.9);
    spl_build_station(scene, (double[3]){1.9, 3.9, 1.7}, 215, 1.2);
    spl_build_station(scene, (double[3]){-2.4, 4, 1.7}, 300, -1.3);
    spl_build_station(scene, (double[3]){0.5, -8.2, 1.7}, 75, 0.7);
    scene->scanner = (struct spl_scanner){.kind = SPL_SCANNER_TERRESTRIAL,
                                          .noise = 0.001,
                                          .aperture = 0.004,
                                          .divergence = 0.0003,
                                          .range = 10,
                                          .returns = 1};
}
