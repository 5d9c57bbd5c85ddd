/* Thin walls: pairs of sheets 5, 10, 20 and 50 mm apart, warm in front and cool behind, which a blend margin must not
 * mix; a pair that closes from 80 mm to nothing; sheets without thickness that are seen along their edge. In a room of
 * 14 × 10 m without a ceiling; x is east, y north, z up. */
#include "synth/build.h"

static const double east[3] = {1, 0, 0}, north[3] = {0, 1, 0}, up[3] = {0, 0, 1};

enum { paving, plaster, warm, cool, pale, dark, lettering };
static const struct spl_material materials[] = {
    [paving] = {.kind = SPL_MATERIAL_MASONRY,
                .colors = {{150, 146, 138}, {176, 170, 160}, {96, 94, 88}},
                .size = {0.5, 0.5},
                .joint = 0.012,
                .grain = 0.25,
                .seed = 103},
    [plaster] = {.kind = SPL_MATERIAL_PLASTER,
                 .colors = {{190, 196, 186}, {210, 212, 200}, {230, 228, 214}},
                 .size = {0.7, 0.7},
                 .seed = 107},
    [warm] = {.kind = SPL_MATERIAL_PLASTER,
              .colors = {{170, 40, 24}, {214, 84, 40}, {240, 150, 70}},
              .size = {0.45, 0.45},
              .seed = 109},
    [cool] = {.kind = SPL_MATERIAL_PLASTER,
              .colors = {{20, 50, 130}, {40, 100, 170}, {90, 180, 200}},
              .size = {0.45, 0.45},
              .seed = 113},
    [pale] = {.kind = SPL_MATERIAL_PLASTER,
              .colors = {{220, 190, 90}, {236, 216, 130}, {246, 236, 180}},
              .size = {0.3, 0.3},
              .seed = 127},
    [dark] = {.kind = SPL_MATERIAL_PLASTER,
              .colors = {{30, 70, 40}, {50, 100, 60}, {90, 140, 80}},
              .size = {0.3, 0.3},
              .seed = 131},
};

static const struct spl_named_camera cameras[] = {
    {"overview", {-6.4, -4.4, 1.7}, {1.5, 1, 1.1}, 65},     {"behind", {6.3, 4.3, 1.7}, {-1.5, -0.5, 1.1}, 65},
    {"front-5mm", {-4.4, -2, 1.5}, {-4.5, 0, 1.1}, 55},     {"back-10mm", {-1.1, 2.1, 1.5}, {-1.5, 0, 1.1}, 55},
    {"along-20mm", {3.6, -0.6, 1.5}, {1.2, 0.01, 1.1}, 50}, {"into-the-gaps", {6.5, 0.03, 1.5}, {3, 0.03, 1.2}, 40},
    {"edge-on", {0, -4.6, 1.5}, {0, -2.3, 1.2}, 55},        {"wedge", {-5.6, 3.9, 1.5}, {-3.9, 2.8, 1.1}, 55},
};

/* Two sheets upright over the line of direction `along` through (x, y), `gap` apart at both ends or at the first only.
 */
static void pair(struct spl_scene *scene, const char *front, const char *back, double x, double gap)
{
    struct spl_skin first = {warm, spl_build_object(scene, front)}, second = {cool, spl_build_object(scene, back)};
    const double half[2] = {1.2, 1.1};
    spl_build_rectangle(scene, first, (double[3]){x, 0, 1.1}, east, up, half, (double[2]){x, 0});
    spl_build_rectangle(scene, second, (double[3]){x, gap, 1.1}, east, up, half, (double[2]){x, 0});
}

static void room(struct spl_scene *scene)
{
    struct spl_skin wall = {plaster, spl_build_object(scene, "room")};
    spl_build_rectangle(scene, (struct spl_skin){paving, spl_build_object(scene, "floor")}, (double[3]){0}, east, north,
                        (double[2]){7, 5}, NULL);
    for (int side = -1; side <= 1; side += 2) {
        spl_build_rectangle(scene, wall, (double[3]){0, 5 * side, 1.5}, east, up, (double[2]){7, 1.5},
                            (double[2]){20 * side, 0});
        spl_build_rectangle(scene, wall, (double[3]){7 * side, 0, 1.5}, north, up, (double[2]){5, 1.5},
                            (double[2]){50 + 20 * side, 0});
    }
}

void spl_build_thin_walls(struct spl_scene *scene)
{
    scene->materials = materials;
    scene->cameras = cameras;
    scene->camera_count = sizeof cameras / sizeof *cameras;
    room(scene);
    pair(scene, "front-5mm", "back-5mm", -4.5, 0.005);
    pair(scene, "front-10mm", "back-10mm", -1.5, 0.01);
    pair(scene, "front-20mm", "back-20mm", 1.5, 0.02);
    pair(scene, "front-50mm", "back-50mm", 4.5, 0.05);

    /* Both lean on x = -2.7, y = 2.5; the second turns away by 80 mm over 2.4 m. */
    struct spl_skin straight = {pale, spl_build_object(scene, "wedge-front")};
    struct spl_skin leaning = {dark, spl_build_object(scene, "wedge-back")};
    const double turned[3] = {-0.99944491, 0.03331483, 0};
    spl_build_rectangle(scene, straight, (double[3]){-3.9, 2.5, 1.1}, east, up, (double[2]){1.2, 1.1}, NULL);
    spl_build_rectangle(scene, leaning, (double[3]){-2.7 + 1.2 * turned[0], 2.5 + 1.2 * turned[1], 1.1}, turned, up,
                        (double[2]){1.2, 1.1}, NULL);

    struct spl_skin sheets = {pale, spl_build_object(scene, "sheets")};
    for (int i = -1; i <= 1; i++)
        spl_build_rectangle(scene, sheets, (double[3]){1.5 * i, -2.3, 1.1}, north, up, (double[2]){0.9, 1.1},
                            (double[2]){9 * i, 3});
    spl_build_rectangle(scene, (struct spl_skin){dark, sheets.object}, (double[3]){3.2, 2.4, 1.3}, east, north,
                        (double[2]){1, 0.7}, NULL); /* lies level, just below the eye */

    spl_build_station(scene, (double[3]){-3.1, -3.6, 1.6}, 31, 0.7);
    spl_build_station(scene, (double[3]){3.3, -3.2, 1.7}, 140, -1.2);
    spl_build_station(scene, (double[3]){5.2, 3.1, 1.6}, 251, 1.1);
    spl_build_station(scene, (double[3]){-0.4, 2.9, 1.65}, 12, -0.5);
    spl_build_station(scene, (double[3]){-5.8, 3.4, 1.6}, 80, 0.9);
    scene->scanner = (struct spl_scanner){.kind = SPL_SCANNER_TERRESTRIAL,
                                          .noise = 0.0005,
                                          .aperture = 0.003,
                                          .divergence = 0.0002,
                                          .range = 10,
                                          .returns = 1};
}
