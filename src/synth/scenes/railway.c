/* A railway of 120 m in a curve of 600 m radius, scanned from a train on its southern track: rails on sleepers and
 * ballast, catenary wires with sag, droppers, poles, a platform, and a road bridge with the gap under it that the train
 * goes through. Places are given along the southern track (s, metres), to its left and above its rails. */
#include "synth/build.h"

#include "geom/vector.h"

static const double radius = 600, reach = 60, gauge = 1.505,
                    tracks[2] = {0, 4.2}; /* gauge: between rail heads' middles */
static const double up[3] = {0, 0, 1};

enum { grass, ballast, concrete, sleeper, steel, mast, wire, slabs, sign, wood };
static const char words[SPL_PLAQUE_LINES][SPL_PLAQUE_LETTERS + 1] = {"", "  QUARRY ROAD", "", "  PLATFORM TWO", "", ""};
static const struct spl_material materials[] = {
    [grass] = {.kind = SPL_MATERIAL_PLASTER,
               .colors = {{74, 86, 40}, {108, 118, 56}, {150, 144, 88}},
               .size = {2.3, 2.3},
               .seed = 503},
    [ballast] = {.kind = SPL_MATERIAL_SOLID,
                 .colors = {{84, 78, 74}, {120, 112, 106}, {160, 152, 144}},
                 .size = {0.09, 0.09},
                 .seed = 509},
    [concrete] = {.kind = SPL_MATERIAL_SOLID,
                  .colors = {{146, 142, 136}, {172, 168, 160}, {196, 192, 184}},
                  .size = {0.8, 0.8},
                  .seed = 521},
    [sleeper] = {.kind = SPL_MATERIAL_SOLID,
                 .colors = {{52, 42, 34}, {78, 64, 52}, {110, 94, 78}},
                 .size = {0.2, 0.2},
                 .seed = 523},
    [steel] = {.kind = SPL_MATERIAL_SOLID,
               .colors = {{84, 60, 48}, {116, 90, 74}, {150, 130, 114}},
               .size = {0.15, 0.15},
               .seed = 541},
    [mast] = {.kind = SPL_MATERIAL_SOLID,
              .colors = {{96, 106, 104}, {120, 130, 128}, {140, 150, 148}},
              .size = {0.5, 0.5},
              .seed = 547},
    [wire] = {.kind = SPL_MATERIAL_FLAT, .colors = {{52, 58, 54}}},
    [slabs] = {.kind = SPL_MATERIAL_MASONRY,
               .colors = {{150, 140, 130}, {178, 166, 152}, {104, 98, 92}},
               .size = {0.5, 0.5},
               .joint = 0.012,
               .grain = 0.2,
               .seed = 557},
    [sign] = {.kind = SPL_MATERIAL_PLAQUE, .colors = {{30, 60, 130}, {240, 240, 236}}, .text = words},
    [wood] = {.kind = SPL_MATERIAL_SOLID,
              .colors = {{96, 62, 36}, {140, 96, 60}, {176, 132, 90}},
              .size = {0.1, 0.1},
              .seed = 563},
};

static const struct spl_named_camera cameras[] = {
    {"platform", {-18, 7.9, 2.4}, {4, 5, 1.9}, 60},
    {"cab", {-34, 0.97, 2.2}, {2, 0, 1.6}, 50},
    {"under-the-bridge", {31, 1.8, 1.4}, {46, 3.2, 2.6}, 65},
    {"wires", {3, -3.4, 1.2}, {14, 4.5, 3.9}, 60},
    {"rails", {-3, 2.1, 0.5}, {9, 1.4, -0.6}, 55},
    {"pole", {-27, -4.6, 1.4}, {-15, 2, 2.2}, 60},
    {"bridge-rail", {36.9, 4, 9.6}, {18, 2, 1.5}, 60},
    {"sign", {-6.2, 6.6, 2.3}, {-7, 9.1, 2.4}, 55},
};

/* The place (s, left, above) and, where asked for, the axes of the track there. */
static void place(double s, double left, double above, double at[3], double ahead[3])
{
    double angle = s / radius;
    at[0] = (radius - left) * sin(angle);
    at[1] = radius - (radius - left) * cos(angle);
    at[2] = above;
    if (ahead) {
        ahead[0] = cos(angle);
        ahead[1] = sin(angle);
        ahead[2] = 0;
    }
}

static void box(struct spl_scene *scene, struct spl_skin skin, const double at[3], double along, double across,
                double high)
{
    double center[3], ahead[3];
    place(at[0], at[1], at[2], center, ahead);
    spl_build_box(scene, skin, center, ahead, (double[3]){along / 2, across / 2, high / 2});
}

static void rod(struct spl_scene *scene, struct spl_skin skin, const double from[3], const double to[3], double thick)
{
    double a[3], b[3];
    place(from[0], from[1], from[2], a, NULL);
    place(to[0], to[1], to[2], b, NULL);
    spl_build_cone(scene, skin, a, b, thick, thick);
}

/* Level around the tracks, rising to a bank on either side: what stands in front of a bank has no sky behind it. */
static void ground(struct spl_scene *scene)
{
    struct spl_skin skin = {grass, spl_build_object(scene, "ground")};
    const double east[3] = {1, 0, 0}, north[3] = {0, 1, 0};
    spl_build_rectangle(scene, skin, (double[3]){0, 4, -0.6}, east, north, (double[2]){66, 14}, NULL);
    for (int side = -1; side <= 1; side += 2)
        spl_build_rectangle(scene, skin, (double[3]){0, 4 + side * (14 + 3.2), 1.8}, east,
                            (double[3]){0, 0.8, side * 0.6}, (double[2]){66, 4}, (double[2]){0, side * 40});
}

static void permanent_way(struct spl_scene *scene)
{
    struct spl_skin bed = {ballast, spl_build_object(scene, "ballast")};
    struct spl_skin sleepers = {sleeper, spl_build_object(scene, "sleepers")};
    struct spl_skin rails = {steel, spl_build_object(scene, "rails")};
    for (double s = -reach + 1.5; s < reach; s += 3) {
        box(scene, bed, (double[3]){s, 2.1, -0.5}, 3.02, 8.2, 0.6);
        for (int t = 0; t < 2; t++) {
            for (int side = -1; side <= 1; side += 2) {
                double left = tracks[t] + side * gauge / 2;
                box(scene, rails, (double[3]){s, left, -0.02}, 3.004, 0.072, 0.04);
                box(scene, rails, (double[3]){s, left, -0.09}, 3.004, 0.018, 0.1);
                box(scene, rails, (double[3]){s, left, -0.15}, 3.004, 0.15, 0.02);
            }
            for (int k = 0; k < 5; k++)
                box(scene, sleepers, (double[3]){s - 1.2 + 0.6 * k, tracks[t], -0.22}, 0.26, 2.5, 0.12);
        }
    }
}

/* Poles every 36 m on the outer sides, a cantilever each, the messenger in spans between them, the contact wire below
 * it on droppers. Wires zigzag by 0.2 m about the middle of their track. */
static void catenary(struct spl_scene *scene)
{
    struct spl_skin poles = {mast, spl_build_object(scene, "poles")};
    struct spl_skin arms = {mast, spl_build_object(scene, "cantilevers")};
    struct spl_skin messenger = {wire, spl_build_object(scene, "messenger-wires")};
    struct spl_skin contact = {wire, spl_build_object(scene, "contact-wires")};
    struct spl_skin droppers = {wire, spl_build_object(scene, "droppers")};
    const double span = 36, high = 6.7, low = 5.4, sag = 0.75;
    for (int t = 0; t < 2; t++) {
        double out = t ? 1 : -1;
        for (int i = 0; i < 4; i++) {
            double s = -54 + span * i, stagger = i % 2 ? 0.2 : -0.2, wires = tracks[t] + stagger;
            double pole = tracks[t] + out * (t && i == 1 ? 6.2 : 3); /* behind the platform's edge where there is one */
            rod(scene, poles, (double[3]){s, pole, -0.6}, (double[3]){s, pole, 7.6}, 0.12);
            rod(scene, arms, (double[3]){s, pole, 7.2}, (double[3]){s, wires, high + 0.05}, 0.025);
            rod(scene, arms, (double[3]){s, pole, 5.8}, (double[3]){s, wires, high + 0.05}, 0.02);
            rod(scene, arms, (double[3]){s, pole, 5.8}, (double[3]){s, wires, low + 0.03}, 0.015);
            if (i == 3)
                continue;
            double from[3], to[3], next = tracks[t] - stagger;
            place(s, wires, high, from, NULL);
            place(s + span, next, high, to, NULL);
            spl_build_wire(scene, messenger, from, to, sag, 0.006, 36);
            place(s, wires, low, from, NULL);
            place(s + span, next, low, to, NULL);
            spl_build_cone(scene, contact, from, to, 0.006, 0.006);
            for (int k = 1; k < 9; k++) {
                double share = k / 9.0, bottom[3], top[3];
                for (int a = 0; a < 3; a++)
                    bottom[a] = top[a] = from[a] + share * (to[a] - from[a]);
                top[2] = high - 4 * sag * share * (1 - share);
                spl_build_cone(scene, droppers, bottom, top, 0.0025, 0.0025);
            }
        }
    }
}

static void platform(struct spl_scene *scene)
{
    struct spl_skin deck = {slabs, spl_build_object(scene, "platform")};
    struct spl_skin board = {sign, spl_build_object(scene, "sign")};
    struct spl_skin bench = {wood, spl_build_object(scene, "bench")};
    for (double s = -27; s < 12; s += 3)
        box(scene, deck, (double[3]){s, 7.4, 0.05}, 3.01, 3, 1.4);
    for (int i = 0; i < 3; i++)
        box(scene, bench, (double[3]){1, 8.2 + 0.16 * i, 1.2}, 1.8, 0.14, 0.04);
    for (int side = -1; side <= 1; side += 2) {
        box(scene, bench, (double[3]){1 + 0.75 * side, 8.36, 0.97}, 0.08, 0.4, 0.43);
        rod(scene, (struct spl_skin){mast, board.object}, (double[3]){-7 + 0.95 * side, 8.6, 0.7},
            (double[3]){-7 + 0.95 * side, 8.6, 3}, 0.03);
    }
    /* Faces the tracks: what reads it looks to the left, so its letters run along the track. */
    double center[3], ahead[3];
    place(-7, 8.55, 2.5, center, ahead);
    spl_build_rectangle(scene, board, center, ahead, up, (double[2]){0.9, 0.45}, NULL);
}

static void bridge(struct spl_scene *scene)
{
    struct spl_skin deck = {concrete, spl_build_object(scene, "bridge")};
    struct spl_skin railing = {mast, spl_build_object(scene, "railing")};
    box(scene, deck, (double[3]){40, 2.1, 7.9}, 7, 22, 0.7);
    for (int side = -1; side <= 1; side += 2) {
        box(scene, deck, (double[3]){40, 2.1 + side * 8.2, 3.45}, 7, 1, 8.2);
        for (int rail = 0; rail < 3; rail++)
            rod(scene, railing, (double[3]){40 + 3.4 * side, -8.9, 8.6 + 0.35 * rail},
                (double[3]){40 + 3.4 * side, 13.1, 8.6 + 0.35 * rail}, 0.02);
        for (int post = 0; post <= 11; post++)
            rod(scene, railing, (double[3]){40 + 3.4 * side, -8.9 + 2 * post, 8.25},
                (double[3]){40 + 3.4 * side, -8.9 + 2 * post, 9.35}, 0.025);
    }
}

void spl_build_railway(struct spl_scene *scene)
{
    double points[25][3];
    scene->materials = materials;
    scene->cameras = cameras;
    scene->camera_count = sizeof cameras / sizeof *cameras;
    ground(scene);
    permanent_way(scene);
    catenary(scene);
    platform(scene);
    bridge(scene);

    for (int i = 0; i < 25; i++)
        place(-reach + 5 * i, 0, 0, points[i], NULL);
    spl_build_track(scene, (const double(*)[3])points, 25);
    /* Two heads on the roof; each turns about an axis that leans 30 degrees to its side, so that what the one sees
     * edge-on the other sees square. */
    spl_build_station(scene, (double[3]){2, 0.5, 3.6}, 60, 80);
    spl_build_station(scene, (double[3]){2, -0.5, 3.6}, 120, 80);
    scene->scanner = (struct spl_scanner){
        .kind = SPL_SCANNER_MOBILE, .noise = 0.003, .aperture = 0.005, .divergence = 0.0004, .range = 8, .returns = 1};
}
