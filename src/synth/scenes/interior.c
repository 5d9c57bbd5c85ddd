/* Two rooms with a door between: a living room (x 0 to 6) and a study (x 6.12 to 10), both 4.4 m deep and 2.6 m high,
 * with furniture, skirting, a window each, and on every wall a label of its own that must stay readable. No ray leaves.
 * x is east, y north, z up. */
#include "synth/build.h"

#include "synth/random.h"

static const double east[3] = {1, 0, 0}, north[3] = {0, 1, 0}, up[3] = {0, 0, 1};
static const double depth = 4.4, height = 2.6, inner[2] = {6, 6.12}, outer = 10;

enum { parquet, tiles, ceiling, cream, sage, oak, walnut, fabric, glass, white, brass, books, labels = books + 6 };
#define LABEL(paper, ink, ...)                                                                                         \
    {                                                                                                                  \
        .kind = SPL_MATERIAL_PLAQUE, .colors = {paper, ink},                                                           \
        .text = (const char[SPL_PLAQUE_LINES][SPL_PLAQUE_LETTERS + 1])                                                 \
        {                                                                                                              \
            __VA_ARGS__                                                                                                \
        }                                                                                                              \
    }
#define RGB(r, g, b)                                                                                                   \
    {                                                                                                                  \
        r, g, b                                                                                                        \
    }
#define BOOK(number, a, b, c)                                                                                          \
    {                                                                                                                  \
        .kind = SPL_MATERIAL_SOLID, .colors = {a, b, c}, .size = {0.12, 0.12}, .seed = number                          \
    }
static const struct spl_material materials[] = {
    [parquet] = {.kind = SPL_MATERIAL_MASONRY,
                 .colors = {{150, 104, 62}, {188, 140, 92}, {92, 62, 38}},
                 .size = {0.6, 0.12},
                 .joint = 0.008,
                 .grain = 0.25,
                 .seed = 703},
    [tiles] = {.kind = SPL_MATERIAL_MASONRY,
               .colors = {{190, 186, 176}, {214, 210, 200}, {120, 118, 112}},
               .size = {0.33, 0.33},
               .joint = 0.01,
               .grain = 0.15,
               .seed = 709},
    [ceiling] = {.kind = SPL_MATERIAL_PLASTER,
                 .colors = {{222, 220, 214}, {234, 232, 226}, {244, 242, 238}},
                 .size = {0.5, 0.5},
                 .seed = 719},
    [cream] = {.kind = SPL_MATERIAL_PLASTER,
               .colors = {{206, 184, 140}, {224, 206, 166}, {238, 224, 194}},
               .size = {0.4, 0.4},
               .seed = 727},
    [sage] = {.kind = SPL_MATERIAL_PLASTER,
              .colors = {{126, 148, 130}, {150, 170, 150}, {176, 192, 172}},
              .size = {0.35, 0.35},
              .seed = 733},
    [oak] = {.kind = SPL_MATERIAL_SOLID,
             .colors = {{150, 110, 66}, {186, 144, 94}, {212, 176, 128}},
             .size = {0.08, 0.08},
             .seed = 739},
    [walnut] = {.kind = SPL_MATERIAL_SOLID,
                .colors = {{66, 42, 28}, {98, 66, 44}, {132, 94, 66}},
                .size = {0.09, 0.09},
                .seed = 743},
    [fabric] = {.kind = SPL_MATERIAL_SOLID,
                .colors = {{60, 80, 120}, {86, 108, 150}, {120, 140, 176}},
                .size = {0.06, 0.06},
                .seed = 751},
    [glass] = {.kind = SPL_MATERIAL_WINDOW, .colors = {{120, 150, 180}, {196, 214, 230}, {240, 238, 232}}},
    [white] = {.kind = SPL_MATERIAL_FLAT, .colors = {{236, 234, 228}}},
    [brass] = {.kind = SPL_MATERIAL_SOLID,
               .colors = {{150, 116, 50}, {190, 154, 80}, {226, 200, 130}},
               .size = {0.1, 0.1},
               .seed = 757},
    [books] = BOOK(761, RGB(120, 30, 34), RGB(150, 50, 46), RGB(190, 160, 110)),
    [books + 1] = BOOK(769, RGB(30, 60, 100), RGB(46, 84, 130), RGB(170, 180, 190)),
    [books + 2] = BOOK(773, RGB(40, 90, 60), RGB(60, 116, 76), RGB(190, 190, 130)),
    [books + 3] = BOOK(787, RGB(200, 180, 130), RGB(216, 200, 160), RGB(120, 90, 60)),
    [books + 4] = BOOK(797, RGB(60, 40, 70), RGB(90, 64, 100), RGB(200, 180, 190)),
    [books + 5] = BOOK(809, RGB(190, 110, 30), RGB(214, 140, 60), RGB(90, 60, 40)),
    [labels] =
        LABEL(RGB(240, 238, 230), RGB(30, 30, 34), "LIVING ROOM", "", "NORTH WALL", "", "CREAM PLASTER", "BOOKS"),
    [labels + 1] = LABEL(RGB(250, 226, 120), RGB(60, 30, 20), "LIVING ROOM", "", "WEST WALL", "", "ONE WINDOW", ""),
    [labels + 2] =
        LABEL(RGB(226, 238, 244), RGB(20, 50, 110), "LIVING ROOM", "", "SOUTH WALL", "", "KEEP CLEAR", "SOFA"),
    [labels + 3] = LABEL(RGB(40, 70, 50), RGB(236, 236, 220), "LIVING ROOM", "", "EAST WALL", "", "TO THE STUDY", ""),
    [labels + 4] = LABEL(RGB(240, 238, 230), RGB(140, 24, 24), "STUDY", "", "NORTH WALL", "", "SAGE PLASTER", ""),
    [labels + 5] = LABEL(RGB(30, 34, 60), RGB(240, 220, 150), "STUDY", "", "EAST WALL", "", "ONE WINDOW", ""),
    [labels + 6] = LABEL(RGB(250, 250, 246), RGB(20, 90, 60), "STUDY", "", "SOUTH WALL", "", "QUIET PLEASE", "DESK"),
    [labels + 7] = LABEL(RGB(236, 220, 230), RGB(70, 20, 70), "STUDY", "", "WEST WALL", "", "WAY OUT", ""),
};

static const struct spl_named_camera cameras[] = {
    {"living-room", {0.5, 0.5, 1.65}, {4.5, 3.2, 1}, 70},
    {"from-the-sofa", {2.5, 0.9, 1.15}, {3.6, 4.4, 1.2}, 65},
    {"through-the-door", {2.4, 2.9, 1.6}, {8.6, 1.9, 1.2}, 55},
    {"doorway", {6.3, 1.5, 1.65}, {9.4, 2.6, 1}, 70},
    {"study", {9.6, 3.9, 1.65}, {7, 0.8, 0.9}, 70},
    {"label", {1.1, 3.1, 1.6}, {0.9, 4.4, 1.6}, 50},
    {"under-the-table", {1.5, 1.3, 0.4}, {4.4, 2.9, 0.4}, 60},
    {"shelf", {4.1, 3, 1.5}, {4.4, 4.4, 1.1}, 60},
};

static void wall(struct spl_scene *scene, struct spl_skin skin, const double low[3], const double high[3])
{
    double center[3], half[3];
    for (int i = 0; i < 3; i++) {
        center[i] = (low[i] + high[i]) / 2;
        half[i] = (high[i] - low[i]) / 2;
    }
    spl_build_box(scene, skin, center, east, half);
}

/* Upright, with its face towards right × up; `at` is a point of the wall. */
static void on_wall(struct spl_scene *scene, const char *name, uint32_t material, const double at[3],
                    const double right[3], const double half[2])
{
    spl_build_rectangle(scene, (struct spl_skin){material, spl_build_object(scene, name)}, at, right, up, half, NULL);
}

static void shell(struct spl_scene *scene)
{
    static const char *const rooms[2][4] = {{"living-room-walls", "living-room-floor", "living-room-ceiling"},
                                            {"study-walls", "study-floor", "study-ceiling"}};
    for (int r = 0; r < 2; r++) {
        double low = r ? inner[1] : 0, high = r ? outer : inner[0], middle = (low + high) / 2, half = (high - low) / 2;
        struct spl_skin walls = {r ? sage : cream, spl_build_object(scene, rooms[r][0])};
        struct spl_skin floor = {r ? tiles : parquet, spl_build_object(scene, rooms[r][1])};
        struct spl_skin above = {ceiling, spl_build_object(scene, rooms[r][2])};
        struct spl_skin skirting = {white, walls.object};
        spl_build_rectangle(scene, floor, (double[3]){middle, depth / 2, 0}, east, north, (double[2]){half, depth / 2},
                            NULL);
        spl_build_rectangle(scene, above, (double[3]){middle, depth / 2, height}, east, north,
                            (double[2]){half, depth / 2}, (double[2]){30 * r, 0});
        for (int side = 0; side < 2; side++) {
            double y = side ? depth : 0;
            spl_build_rectangle(scene, walls, (double[3]){middle, y, height / 2}, east, up,
                                (double[2]){half, height / 2}, (double[2]){middle + 30 * side, 0});
            wall(scene, skirting, (double[3]){low, side ? depth - 0.015 : 0, 0},
                 (double[3]){high, side ? depth : 0.015, 0.08});
        }
        spl_build_rectangle(scene, walls, (double[3]){r ? outer : 0, depth / 2, height / 2}, north, up,
                            (double[2]){depth / 2, height / 2}, (double[2]){60, 0});
    }
    /* Between the rooms, around a door of 0.9 × 2.05 m; each side has its room's colour. */
    const double door[2] = {1.2, 2.1}, lintel = 2.05;
    const double parts[3][4] = {
        {0, door[0], 0, height}, {door[1], depth, 0, height}, {door[0], door[1], lintel, height}};
    for (int r = 0; r < 2; r++) {
        struct spl_skin walls = {r ? sage : cream, spl_scene_find_object(scene, rooms[r][0])};
        for (int p = 0; p < 3; p++) {
            double y = (parts[p][0] + parts[p][1]) / 2, z = (parts[p][2] + parts[p][3]) / 2;
            spl_build_rectangle(scene, walls, (double[3]){inner[r], y, z}, north, up,
                                (double[2]){(parts[p][1] - parts[p][0]) / 2, (parts[p][3] - parts[p][2]) / 2},
                                (double[2]){y, z});
        }
    }
    struct spl_skin frame = {oak, spl_build_object(scene, "door-frame")};
    for (int side = 0; side < 2; side++)
        wall(scene, frame, (double[3]){inner[0] - 0.015, side ? door[1] - 0.03 : door[0], 0},
             (double[3]){inner[1] + 0.015, side ? door[1] : door[0] + 0.03, lintel});
    wall(scene, frame, (double[3]){inner[0] - 0.015, door[0], lintel - 0.03},
         (double[3]){inner[1] + 0.015, door[1], lintel});
    wall(scene, frame, (double[3]){inner[0] - 0.015, door[0], 0}, (double[3]){inner[1] + 0.015, door[1], 0.012});
    /* The door's leaf stands open into the study. */
    spl_build_box(scene, (struct spl_skin){walnut, spl_build_object(scene, "door")},
                  (double[3]){inner[1] + 0.46, door[1] + 0.05, lintel / 2}, east, (double[3]){0.43, 0.02, 1});
}

static void signs(struct spl_scene *scene)
{
    const double west[3] = {-1, 0, 0}, south[3] = {0, -1, 0}, half[2] = {0.3, 0.2}, window[2] = {0.7, 0.6};
    const double off = 0.006; /* a sheet on the wall */
    on_wall(scene, "label-living-north", labels, (double[3]){0.9, depth - off, 1.6}, east, half);
    on_wall(scene, "label-living-west", labels + 1, (double[3]){off, 0.8, 1.6}, north, half);
    on_wall(scene, "label-living-south", labels + 2, (double[3]){4.6, off, 1.6}, west, half);
    on_wall(scene, "label-living-east", labels + 3, (double[3]){inner[0] - off, 3.2, 1.6}, south, half);
    on_wall(scene, "label-study-north", labels + 4, (double[3]){8.8, depth - off, 1.6}, east, half);
    on_wall(scene, "label-study-east", labels + 5, (double[3]){outer - off, 3.6, 1.6}, south, half);
    on_wall(scene, "label-study-south", labels + 6, (double[3]){9.2, off, 1.6}, west, half);
    on_wall(scene, "label-study-west", labels + 7, (double[3]){inner[1] + off, 0.6, 1.6}, north, half);
    on_wall(scene, "window-west", glass, (double[3]){0.01, 2.6, 1.5}, north, window);
    on_wall(scene, "window-east", glass, (double[3]){outer - 0.01, 1.8, 1.5}, south, window);
}

static void table(struct spl_scene *scene, const char *name, uint32_t material, const double at[3],
                  const double half[2], double thick)
{
    struct spl_skin skin = {material, spl_build_object(scene, name)};
    spl_build_box(scene, skin, (double[3]){at[0], at[1], at[2] - thick / 2}, east,
                  (double[3]){half[0], half[1], thick / 2});
    for (int leg = 0; leg < 4; leg++) {
        double x = at[0] + (leg & 1 ? 1 : -1) * (half[0] - 0.04), y = at[1] + (leg & 2 ? 1 : -1) * (half[1] - 0.04);
        spl_build_box(scene, skin, (double[3]){x, y, (at[2] - thick) / 2}, east,
                      (double[3]){0.025, 0.025, (at[2] - thick) / 2});
    }
}

static void chair(struct spl_scene *scene, const char *name, const double at[2], double back)
{
    table(scene, name, walnut, (double[3]){at[0], at[1], 0.45}, (double[2]){0.2, 0.2}, 0.03);
    struct spl_skin skin = {walnut, spl_scene_find_object(scene, name)};
    for (int slat = 0; slat < 3; slat++)
        spl_build_box(scene, skin, (double[3]){at[0], at[1] + back * 0.19, 0.6 + 0.14 * slat}, east,
                      (double[3]){0.2, 0.01, 0.035});
    for (int side = -1; side <= 1; side += 2)
        spl_build_box(scene, skin, (double[3]){at[0] + side * 0.18, at[1] + back * 0.19, 0.68}, east,
                      (double[3]){0.018, 0.014, 0.25});
}

static void shelf(struct spl_scene *scene)
{
    struct spl_skin skin = {oak, spl_build_object(scene, "shelf")};
    uint32_t object = spl_build_object(scene, "books");
    uint64_t random = 811;
    for (int side = 0; side < 2; side++)
        wall(scene, skin, (double[3]){side ? 5.38 : 3.4, 4.1, 0}, (double[3]){side ? 5.4 : 3.42, 4.385, 2});
    for (int board = 0; board < 6; board++)
        wall(scene, skin, (double[3]){3.42, 4.1, 0.04 + 0.38 * board}, (double[3]){5.38, 4.385, 0.06 + 0.38 * board});
    for (int row = 0; row < 5; row++) {
        double x = 3.44;
        while (x < 5.28 - 0.25 * (row % 3)) {
            uint32_t cover = books + (uint32_t)random_between(&random, 0, 6);
            double thick = random_between(&random, 0.02, 0.05), high = random_between(&random, 0.18, 0.3);
            wall(scene, (struct spl_skin){cover, object}, (double[3]){x, 4.16, 0.06 + 0.38 * row},
                 (double[3]){x + thick, 4.36, 0.06 + 0.38 * row + high});
            x += thick + 0.002;
        }
    }
}

static void furniture(struct spl_scene *scene)
{
    table(scene, "table", oak, (double[3]){3.6, 2.4, 0.75}, (double[2]){0.8, 0.45}, 0.04);
    chair(scene, "chair-1", (double[2]){3.3, 3}, 1);
    chair(scene, "chair-2", (double[2]){3.9, 1.75}, -1);
    chair(scene, "chair-3", (double[2]){8.7, 1.15}, 1);
    table(scene, "desk", walnut, (double[3]){8.7, 0.45, 0.74}, (double[2]){0.75, 0.38}, 0.03);
    spl_build_sphere(scene, (struct spl_skin){brass, spl_build_object(scene, "globe")}, (double[3]){9.2, 0.4, 0.9},
                     0.16);
    shelf(scene);
    struct spl_skin sofa = {fabric, spl_build_object(scene, "sofa")};
    wall(scene, sofa, (double[3]){1.5, 0.1, 0.08}, (double[3]){3.5, 0.9, 0.42});
    wall(scene, sofa, (double[3]){1.5, 0.1, 0.42}, (double[3]){3.5, 0.32, 0.85});
    for (int side = 0; side < 2; side++)
        wall(scene, sofa, (double[3]){side ? 3.5 : 1.3, 0.1, 0.08}, (double[3]){side ? 3.7 : 1.5, 0.9, 0.62});
    struct spl_skin cabinet = {oak, spl_build_object(scene, "cabinet")};
    wall(scene, cabinet, (double[3]){6.5, 3.95, 0.05}, (double[3]){8.1, 4.38, 0.8});
    struct spl_skin lamp = {brass, spl_build_object(scene, "lamp")};
    spl_build_cone(scene, lamp, (double[3]){3.6, 2.4, 1.75}, (double[3]){3.6, 2.4, 2.6}, 0.004, 0.004);
    spl_build_cone(scene, lamp, (double[3]){3.6, 2.4, 1.55}, (double[3]){3.6, 2.4, 1.8}, 0.22, 0.06);
}

void spl_build_interior(struct spl_scene *scene)
{
    scene->materials = materials;
    scene->cameras = cameras;
    scene->camera_count = sizeof cameras / sizeof *cameras;
    shell(scene);
    signs(scene);
    furniture(scene);
    spl_build_station(scene, (double[3]){1.1, 1.9, 1.5}, 40, 0.9);
    spl_build_station(scene, (double[3]){5.2, 0.9, 1.6}, 130, -1.2);
    spl_build_station(scene, (double[3]){2.3, 3.6, 1.4}, 250, 1.1);
    spl_build_station(scene, (double[3]){7.3, 1.4, 1.5}, 330, -0.7);
    spl_build_station(scene, (double[3]){9.3, 3, 1.5}, 200, 0.6);
    scene->scanner = (struct spl_scanner){.kind = SPL_SCANNER_TERRESTRIAL,
                                          .noise = 0.001,
                                          .aperture = 0.003,
                                          .divergence = 0.0002,
                                          .range = 10,
                                          .returns = 1};
}
