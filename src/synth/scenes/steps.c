/* Steps: depth discontinuities at every scale. Flights of stairs with risers of 1, 2, 5 mm … 1 m, fins on a wall whose
 * spacing grows from 8 mm to 0.5 m, a fence whose pickets and gaps grow from 8 mm to 0.16 m. On a floor of 16 × 11 m;
 * x is east, y north, z up. */
#include "synth/build.h"

#include <math.h>

static const double east[3] = {1, 0, 0}, north[3] = {0, 1, 0}, up[3] = {0, 0, 1};

enum { paving, plaster, light, deep, fin, wood };
static const struct spl_material materials[] = {
    [paving] = {.kind = SPL_MATERIAL_MASONRY,
                .colors = {{120, 116, 110}, {148, 142, 134}, {78, 76, 72}},
                .size = {0.8, 0.4},
                .joint = 0.014,
                .grain = 0.3,
                .seed = 203},
    [plaster] = {.kind = SPL_MATERIAL_PLASTER,
                 .colors = {{206, 170, 140}, {222, 194, 166}, {236, 216, 194}},
                 .size = {0.6, 0.6},
                 .seed = 207},
    [light] = {.kind = SPL_MATERIAL_SOLID,
               .colors = {{200, 190, 160}, {222, 214, 190}, {240, 236, 220}},
               .size = {0.3, 0.3},
               .seed = 211},
    [deep] = {.kind = SPL_MATERIAL_SOLID,
              .colors = {{60, 90, 110}, {90, 126, 140}, {130, 160, 166}},
              .size = {0.3, 0.3},
              .seed = 223},
    [fin] = {.kind = SPL_MATERIAL_SOLID,
             .colors = {{150, 40, 50}, {190, 70, 66}, {220, 130, 100}},
             .size = {0.2, 0.2},
             .seed = 227},
    [wood] = {.kind = SPL_MATERIAL_SOLID,
              .colors = {{84, 60, 36}, {130, 96, 56}, {170, 136, 90}},
              .size = {0.06, 0.3},
              .seed = 229},
};

static const struct spl_named_camera cameras[] = {
    {"overview", {-7.4, -1.2, 1.7}, {2, 2.4, 0.9}, 65},    {"flights", {3.2, -0.6, 1.7}, {4.6, 3.6, 0.9}, 65},
    {"millimetres", {-5.4, 0.9, 1.2}, {-6.3, 2.2, 0}, 50}, {"centimetres", {-2.2, 0.5, 1.5}, {-2.6, 2.4, 0.1}, 50},
    {"fins", {-3.2, -2.6, 1.6}, {-4.6, -5, 1.4}, 60},      {"fins-grazing", {7, -4.5, 1.6}, {-2, -5, 1.3}, 55},
    {"fence", {-2.6, 1, 1.6}, {-1.6, -1.8, 0.9}, 65},      {"through-fence", {1.5, -2.3, 1.1}, {1.4, 3, 0.9}, 60},
};

/* Risers of 1, 2, 5 times ten to the n, three steps each, treads of 0.35 m, two colours in turn. */
static void stairs(struct spl_scene *scene)
{
    static const struct {
        const char *name;
        double riser;
    } flights[] = {
        {"stairs-1mm", 0.001}, {"stairs-2mm", 0.002}, {"stairs-5mm", 0.005}, {"stairs-10mm", 0.01},
        {"stairs-20mm", 0.02}, {"stairs-50mm", 0.05}, {"stairs-100mm", 0.1}, {"stairs-200mm", 0.2},
        {"stairs-500mm", 0.5}, {"stairs-1m", 1},
    };
    const double tread = 0.35;
    for (int i = 0; i < 10; i++) {
        uint32_t object = spl_build_object(scene, flights[i].name);
        for (int k = 0; k < 3; k++) {
            double height = flights[i].riser * (k + 1), depth = tread * (3 - k);
            spl_build_box(scene, (struct spl_skin){k % 2 ? deep : light, object},
                          (double[3]){-6.75 + 1.5 * i, 3.2 - depth / 2, height / 2}, east,
                          (double[3]){0.6, depth / 2, height / 2});
        }
    }
}

/* Along x from -7.5; each 1.06 times as far from the last as that was, so sixty cover all scales in equal parts. */
static void fins(struct spl_scene *scene)
{
    struct spl_skin fins = {fin, spl_build_object(scene, "fins")};
    double x = -7.5;
    for (double pitch = 0.008; x + pitch < 7.5; pitch *= 1.06) {
        x += pitch;
        spl_build_rectangle(scene, fins, (double[3]){x, -4.85, 1.3}, north, up, (double[2]){0.15, 1}, NULL);
    }
}

static void fence(struct spl_scene *scene)
{
    struct spl_skin pickets = {wood, spl_build_object(scene, "pickets")};
    struct spl_skin rails = {wood, spl_build_object(scene, "rails")};
    double x = -4;
    for (double width = 0.008; x + 2 * width < 4; width *= 1.045) {
        spl_build_box(scene, pickets, (double[3]){x + width / 2, -1.8, 0.75}, east, (double[3]){width / 2, 0.01, 0.65});
        x += 2 * width;
    }
    for (int i = 0; i < 2; i++)
        spl_build_box(scene, rails, (double[3]){0, -1.825, 0.35 + 0.8 * i}, east, (double[3]){4.05, 0.015, 0.04});
}

void spl_build_steps(struct spl_scene *scene)
{
    scene->materials = materials;
    scene->cameras = cameras;
    scene->camera_count = sizeof cameras / sizeof *cameras;
    struct spl_skin wall = {plaster, spl_build_object(scene, "walls")};
    spl_build_rectangle(scene, (struct spl_skin){paving, spl_build_object(scene, "floor")}, (double[3]){0, -0.5, 0},
                        east, north, (double[2]){8, 5}, NULL);
    spl_build_rectangle(scene, wall, (double[3]){0, -5, 1.75}, east, up, (double[2]){8, 1.75}, NULL);
    spl_build_rectangle(scene, wall, (double[3]){0, 4.5, 1.75}, east, up, (double[2]){8, 1.75}, (double[2]){40, 0});
    stairs(scene);
    fins(scene);
    fence(scene);
    spl_build_station(scene, (double[3]){-5.5, -0.4, 1.7}, 20, 1);
    spl_build_station(scene, (double[3]){0.2, 0.3, 1.7}, 95, -0.8);
    spl_build_station(scene, (double[3]){6.3, -0.7, 1.7}, 170, 1.3);
    spl_build_station(scene, (double[3]){-2.9, -3.4, 1.6}, 260, 0.6);
    spl_build_station(scene, (double[3]){3.4, -3.3, 1.6}, 300, -1.1);
    scene->scanner = (struct spl_scanner){.kind = SPL_SCANNER_TERRESTRIAL,
                                          .noise = 0.0005,
                                          .aperture = 0.003,
                                          .divergence = 0.0002,
                                          .range = 10,
                                          .returns = 1};
}
