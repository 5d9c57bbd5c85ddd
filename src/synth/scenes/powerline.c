/* A power line of 400 m over fields, trees, a road and a barn, scanned from the air at 20 points a square metre (with a
 * million of them) and written in UTM coordinates, zone 32. Nothing in its textures is finer than what such a scan can
 * carry, but for the road's markings. x is east, y north, z above the ground. */
#include "synth/build.h"

#include "synth/random.h"
#include "geom/vector.h"

static const double east[3] = {1, 0, 0}, north[3] = {0, 1, 0};
static const double reach[2] = {200, 60}, pylons[3] = {-130, 10, 150};

enum {
    wheat,
    meadow,
    ploughed,
    clover,
    rape,
    stubble,
    asphalt,
    white,
    steel,
    aluminium,
    ceramic,
    boards,
    tiles,
    bark,
    leaf
};
#define FIELD(a, b, c, wave, number)                                                                                   \
    {                                                                                                                  \
        .kind = SPL_MATERIAL_PLASTER, .colors = {a, b, c}, .size = {wave, wave}, .finest = 0.7, .seed = number         \
    }
#define RGB(r, g, b)                                                                                                   \
    {                                                                                                                  \
        r, g, b                                                                                                        \
    }
static const struct spl_material materials[] = {
    [wheat] = FIELD(RGB(170, 140, 70), RGB(200, 174, 96), RGB(222, 200, 130), 9, 603),
    [meadow] = FIELD(RGB(70, 96, 40), RGB(104, 126, 56), RGB(144, 152, 84), 14, 607),
    [ploughed] = FIELD(RGB(84, 62, 46), RGB(112, 86, 64), RGB(140, 114, 90), 6, 613),
    [clover] = FIELD(RGB(40, 90, 44), RGB(66, 120, 60), RGB(120, 150, 110), 11, 617),
    [rape] = FIELD(RGB(180, 170, 30), RGB(214, 202, 50), RGB(160, 176, 60), 8, 619),
    [stubble] = FIELD(RGB(150, 120, 84), RGB(180, 152, 108), RGB(130, 128, 76), 12, 631),
    [asphalt] = FIELD(RGB(66, 66, 70), RGB(84, 84, 88), RGB(104, 102, 100), 5, 641),
    [white] = {.kind = SPL_MATERIAL_FLAT, .colors = {{220, 220, 214}}},
    [steel] = {.kind = SPL_MATERIAL_SOLID,
               .colors = {{110, 118, 116}, {136, 144, 142}, {160, 166, 164}},
               .size = {3, 3},
               .finest = 0.7,
               .seed = 643},
    [aluminium] = {.kind = SPL_MATERIAL_FLAT, .colors = {{92, 96, 100}}},
    [ceramic] = {.kind = SPL_MATERIAL_FLAT, .colors = {{110, 60, 44}}},
    [boards] = FIELD(RGB(96, 54, 40), RGB(124, 76, 56), RGB(150, 106, 84), 4, 647),
    [tiles] = FIELD(RGB(140, 66, 44), RGB(172, 90, 60), RGB(190, 120, 90), 5, 653),
    [bark] = {.kind = SPL_MATERIAL_SOLID,
              .colors = {{60, 46, 36}, {92, 74, 58}, {120, 102, 84}},
              .size = {1, 1},
              .finest = 0.7,
              .seed = 659},
    [leaf] = {.kind = SPL_MATERIAL_LEAF, .colors = {{38, 80, 34}, {96, 130, 52}, {130, 156, 90}}},
};

static const struct spl_named_camera cameras[] = {
    {"overview", {-185, -80, 62}, {-70, 0, 0}, 55}, {"along-the-line", {-178, 3, 36}, {-60, 0, 4}, 50},
    {"pylon", {-16, -34, 30}, {10, 1, 12}, 60},     {"conductors", {62, -15, 27}, {84, 5, 8}, 55},
    {"road", {-76, -52, 3}, {-62, 20, 2}, 60},      {"barn", {62, -24, 8}, {84, -42, 2}, 55},
    {"trees", {-142, 14, 13}, {-112, 42, 3}, 60},   {"from-above", {40, -70, 85}, {30, -2, 0}, 55},
};

static void fields(struct spl_scene *scene)
{
    static const char *const names[2][3] = {{"field-wheat", "field-meadow", "field-ploughed"},
                                            {"field-clover", "field-rape", "field-stubble"}};
    const double edges[2][4] = {{-200, -66, 48, 200}, {-200, -66, 90, 200}};
    for (int row = 0; row < 2; row++)
        for (int i = 0; i < 3; i++) {
            double low = edges[row][i], high = edges[row][i + 1];
            struct spl_skin skin = {(uint32_t)(wheat + 3 * row + i), spl_build_object(scene, names[row][i])};
            spl_build_rectangle(scene, skin, (double[3]){(low + high) / 2, row ? 30 : -30, 0}, east, north,
                                (double[2]){(high - low) / 2, 30}, NULL);
        }
    struct spl_skin road = {asphalt, spl_build_object(scene, "road")};
    spl_build_box(scene, road, (double[3]){-66, 0, 0}, north, (double[3]){reach[1], 3, 0.15});
    struct spl_skin marking = {white, spl_build_object(scene, "markings")};
    for (double y = -57; y < 60; y += 6)
        spl_build_rectangle(scene, marking, (double[3]){-66, y, 0.152}, north, (double[3]){-1, 0, 0},
                            (double[2]){1.5, 0.08}, NULL);
}

static void strut(struct spl_scene *scene, struct spl_skin skin, double x, const double from[3], const double to[3])
{
    spl_build_cone(scene, skin, (double[3]){x + from[0], from[1], from[2]}, (double[3]){x + to[0], to[1], to[2]}, 0.06,
                   0.06);
}

/* Four legs that come together towards the top, braced crosswise on every side, and three arms across the line. */
static void pylon(struct spl_scene *scene, double x, const char *name)
{
    struct spl_skin skin = {steel, spl_build_object(scene, name)};
    const double levels[7] = {0, 6, 11, 15.5, 19.5, 23.5, 28};
    for (int k = 0; k < 6; k++) {
        double w = 3 - 0.1 * levels[k], v = 3 - 0.1 * levels[k + 1], z = levels[k], t = levels[k + 1];
        for (int corner = 0; corner < 4; corner++) {
            double a = corner & 1 ? 1 : -1, b = corner & 2 ? 1 : -1; /* this corner, and the next one around */
            double c = a * b > 0 ? -a : a, d = a * b > 0 ? b : -b;
            spl_build_cone(scene, skin, (double[3]){x + a * w, b * w, z}, (double[3]){x + a * v, b * v, t}, 0.1, 0.09);
            strut(scene, skin, x, (double[3]){a * w, b * w, z}, (double[3]){c * v, d * v, t});
            strut(scene, skin, x, (double[3]){c * w, d * w, z}, (double[3]){a * v, b * v, t});
            strut(scene, skin, x, (double[3]){a * v, b * v, t}, (double[3]){c * v, d * v, t});
        }
    }
    for (int corner = 0; corner < 4; corner++)
        strut(scene, skin, x, (double[3]){corner & 1 ? 0.2 : -0.2, corner & 2 ? 0.2 : -0.2, 28}, (double[3]){0, 0, 32});
    for (int arm = 0; arm < 2; arm++)
        for (int side = -1; side <= 1; side += 2) {
            double z = arm ? 23.5 : 19.5, out = arm ? 6 : 9, w = 3 - 0.1 * z;
            for (int corner = -1; corner <= 1; corner += 2) {
                strut(scene, skin, x, (double[3]){corner * w, side * w, z}, (double[3]){0, side * out, z});
                strut(scene, skin, x, (double[3]){corner * w * 0.9, side * w * 0.9, z + 1.6},
                      (double[3]){0, side * out, z});
            }
        }
}

/* Three conductors a side on insulators of 1.6 m, a ground wire on the tops; spans end where the area does. */
static void line(struct spl_scene *scene)
{
    struct spl_skin conductors = {aluminium, spl_build_object(scene, "conductors")};
    struct spl_skin ground = {aluminium, spl_build_object(scene, "ground-wire")};
    struct spl_skin insulators = {ceramic, spl_build_object(scene, "insulators")};
    const double places[7][2] = {{-9, 19.5}, {-5.5, 19.5}, {-6, 23.5}, {6, 23.5}, {5.5, 19.5}, {9, 19.5}, {0, 32}};
    for (int w = 0; w < 7; w++) {
        double y = places[w][0], z = places[w][1], low = w == 6 ? z : z - 1.6;
        struct spl_skin skin = w == 6 ? ground : conductors;
        double radius = w == 6 ? 0.009 : 0.015;
        for (int i = 0; i < 3; i++) {
            if (w < 6)
                spl_build_cone(scene, insulators, (double[3]){pylons[i], y, low}, (double[3]){pylons[i], y, z}, 0.08,
                               0.08);
            if (i < 2)
                spl_build_wire(scene, skin, (double[3]){pylons[i], y, low}, (double[3]){pylons[i + 1], y, low},
                               w == 6 ? 4 : 6, radius, 40);
        }
        spl_build_wire(scene, skin, (double[3]){-200, y, low - 3}, (double[3]){pylons[0], y, low}, 1.5, radius, 20);
        spl_build_wire(scene, skin, (double[3]){pylons[2], y, low}, (double[3]){200, y, low - 2.5}, 0.8, radius, 20);
    }
}

static void barn(struct spl_scene *scene)
{
    struct spl_skin walls = {boards, spl_build_object(scene, "barn")};
    struct spl_skin roof = {tiles, spl_build_object(scene, "roof")};
    const double slope[3] = {0, 0.8, 0.6};
    spl_build_box(scene, walls, (double[3]){86, -42, 2}, east, (double[3]){8, 5, 2});
    for (int side = -1; side <= 1; side += 2)
        spl_build_rectangle(scene, roof, (double[3]){86, -42 + side * 2.6, 5.8}, east,
                            (double[3]){0, -side * slope[1], slope[2]}, (double[2]){8.6, 3.25}, NULL);
}

/* A trunk under a crown of leaf discs as large as such a scan can tell, in an ellipsoid. */
static void small_tree(struct spl_scene *scene, struct spl_skin trunk, struct spl_skin leaves, double x, double y,
                       uint64_t *random)
{
    double height = random_between(random, 4, 9), wide = height * random_between(random, 0.22, 0.34);
    spl_build_cone(scene, trunk, (double[3]){x, y, 0}, (double[3]){x, y, height * 0.7}, height * 0.03, height * 0.012);
    for (int i = 0; i < 160; i++) {
        double center[3], normal[3], length;
        do {
            for (int a = 0; a < 3; a++)
                center[a] = random_between(random, -1, 1);
            length = dot3(center, center);
        } while (length > 1 || length < 0.15);
        for (int a = 0; a < 3; a++)
            normal[a] = center[a] + random_between(random, -0.5, 0.5);
        normal[2] += 0.7;
        center[0] = x + center[0] * wide;
        center[1] = y + center[1] * wide;
        center[2] = height * (0.66 + 0.34 * center[2]);
        spl_build_disc(scene, leaves, center, normal, random_between(random, 0.18, 0.36));
    }
}

void spl_build_powerline(struct spl_scene *scene)
{
    scene->materials = materials;
    scene->cameras = cameras;
    scene->camera_count = sizeof cameras / sizeof *cameras;
    scene->offset[0] = 691000;
    scene->offset[1] = 5336000;
    scene->offset[2] = 520;
    fields(scene);
    pylon(scene, pylons[0], "pylon-1");
    pylon(scene, pylons[1], "pylon-2");
    pylon(scene, pylons[2], "pylon-3");
    line(scene);
    barn(scene);
    struct spl_skin trunks = {bark, spl_build_object(scene, "trunks")};
    struct spl_skin leaves = {leaf, spl_build_object(scene, "leaves")};
    uint64_t random = 661;
    for (int i = 0; i < 60; i++) { /* a grove in the north-west, a row along the south */
        double x = i < 30 ? random_between(&random, -140, -85) : -190 + 13 * (i - 30) + random_between(&random, -2, 2);
        double y = i < 30 ? random_between(&random, 28, 57) : random_between(&random, -57, -54);
        if (fabs(x + 66) > 8)
            small_tree(scene, trunks, leaves, x, y, &random);
    }
    /* There at one height, back at another. */
    spl_build_station(scene, (double[3]){-reach[0], -18, 90}, 0, 0);
    spl_build_station(scene, (double[3]){reach[0], 20, 96}, 180, 0);
    scene->scanner = (struct spl_scanner){.kind = SPL_SCANNER_AIRBORNE,
                                          .noise = 0.015,
                                          .aperture = 0.01,
                                          .divergence = 0.0005,
                                          .range = 90,
                                          .returns = 3,
                                          .length = 2 * reach[0],
                                          .half_angle = 25,
                                          .zigzag = true};
}
