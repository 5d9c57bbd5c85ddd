/* The courtyard: 20 × 16 m between four façades, each with another kind of texture, and in it one of everything that is
 * hard to render: windows behind reveals, columns, a sphere, wires of 8 mm, a tree of leaf discs, a bench, steps, an
 * inscription and a flat red panel. x is east, y north, z up; the ground is z = 0. */
#include "synth/build.h"

#include "geom/vector.h"

static const double width = 20, depth = 16, height = 7;
static const double east[3] = {1, 0, 0}, north[3] = {0, 1, 0}, up[3] = {0, 0, 1};

enum { paving, stone, brick, ashlar, marbled, plaster, glass, bark, wood, glaze, green, black, grey, red, lettering };
static const struct spl_material materials[] = {
    [paving] = {.kind = SPL_MATERIAL_MASONRY, .colors = {{132, 128, 120}, {158, 152, 142}, {86, 84, 78}},
                .size = {0.6, 0.4}, .joint = 0.014, .grain = 0.3, .seed = 3},
    [brick] = {.kind = SPL_MATERIAL_MASONRY, .colors = {{150, 70, 52}, {184, 104, 74}, {198, 190, 176}},
               .size = {0.25, 0.0833}, .joint = 0.012, .grain = 0.2, .seed = 11},
    [ashlar] = {.kind = SPL_MATERIAL_MASONRY, .colors = {{196, 182, 150}, {216, 204, 176}, {128, 118, 100}},
                .size = {0.9, 0.45}, .joint = 0.02, .grain = 0.35, .seed = 23},
    [marbled] = {.kind = SPL_MATERIAL_PLASTER, .colors = {{92, 120, 134}, {206, 196, 170}, {170, 108, 70}},
                 .size = {1.4, 1.4}, .seed = 37},
    [plaster] = {.kind = SPL_MATERIAL_PLASTER, .colors = {{214, 190, 140}, {228, 210, 168}, {240, 226, 192}},
                 .size = {0.4, 0.4}, .seed = 41},
    [stone] = {.kind = SPL_MATERIAL_SOLID, .colors = {{176, 170, 158}, {206, 200, 188}, {228, 224, 214}},
               .size = {0.3, 0.3}, .seed = 53},
    [bark] = {.kind = SPL_MATERIAL_SOLID, .colors = {{58, 42, 30}, {104, 82, 60}, {140, 118, 92}},
              .size = {0.08, 0.3}, .seed = 61},
    [wood] = {.kind = SPL_MATERIAL_SOLID, .colors = {{92, 56, 30}, {142, 92, 52}, {176, 126, 78}},
              .size = {0.1, 0.1}, .seed = 67},
    [glaze] = {.kind = SPL_MATERIAL_SOLID, .colors = {{24, 60, 120}, {60, 130, 170}, {230, 220, 150}},
               .size = {0.45, 0.45}, .seed = 71},
    [glass] = {.kind = SPL_MATERIAL_WINDOW, .colors = {{40, 52, 66}, {128, 150, 168}, {236, 234, 226}}},
    [green] = {.kind = SPL_MATERIAL_LEAF, .colors = {{54, 96, 34}, {116, 150, 52}, {176, 190, 110}}},
    [lettering] = {.kind = SPL_MATERIAL_PLAQUE, .colors = {{238, 236, 228}, {28, 30, 36}}},
    [black] = {.kind = SPL_MATERIAL_FLAT, .colors = {{38, 38, 42}}},
    [grey] = {.kind = SPL_MATERIAL_FLAT, .colors = {{120, 120, 120}}},
    [red] = {.kind = SPL_MATERIAL_FLAT, .colors = {{255, 0, 0}}},
};

struct opening_row {
    double low, high; /* metres above the ground */
    int count;        /* openings, evenly spaced */
    double width;
};

struct facade {
    double corner[3]; /* its left end on the ground, seen from the court */
    double right[3];  /* the court lies on the side of right × up */
    double width;
    struct spl_skin wall, reveal, pane;
    struct opening_row rows[2];
};

/* A part of the wall from (s, z) = low to high, pushed back by `recess`; texture coordinates are (s, z). */
static void wall_part(struct spl_scene *scene, const struct facade *f, struct spl_skin skin, const double low[2],
                      const double high[2], double recess, bool textured_across)
{
    double inwards[3], center[3], middle[2] = {(low[0] + high[0]) / 2, (low[1] + high[1]) / 2};
    cross3(f->right, up, inwards);
    mad3(f->corner, middle[0], f->right, center);
    mad3(center, middle[1], up, center);
    mad3(center, -recess, inwards, center);
    spl_build_rectangle(scene, skin, center, f->right, up, (double[2]){(high[0] - low[0]) / 2, (high[1] - low[1]) / 2},
                        textured_across ? middle : NULL);
}

static void opening(struct spl_scene *scene, const struct facade *f, const double low[2], const double high[2])
{
    const double recess = 0.25;
    double inwards[3], center[3];
    wall_part(scene, f, f->pane, low, high, recess, false);
    cross3(f->right, up, inwards);
    for (int side = 0; side < 4; side++) { /* left, right, bottom, top */
        double s = side == 0 ? low[0] : side == 1 ? high[0] : (low[0] + high[0]) / 2;
        double z = side == 2 ? low[1] : side == 3 ? high[1] : (low[1] + high[1]) / 2;
        mad3(f->corner, s, f->right, center);
        mad3(center, z, up, center);
        mad3(center, -recess / 2, inwards, center);
        double along = (side < 2 ? high[1] - low[1] : high[0] - low[0]) / 2;
        spl_build_rectangle(scene, f->reveal, center, inwards, side < 2 ? up : f->right, (double[2]){recess / 2, along},
                            (double[2]){s, z});
    }
    mad3(f->corner, (low[0] + high[0]) / 2, f->right, center);
    mad3(center, low[1] - 0.04, up, center);
    mad3(center, 0.06, inwards, center);
    spl_build_box(scene, f->reveal, center, f->right, (double[3]){(high[0] - low[0]) / 2 + 0.08, 0.06, 0.04});
}

static void facade(struct spl_scene *scene, const struct facade *f)
{
    double z = 0;
    for (int r = 0; r < 2; r++) {
        const struct opening_row *row = &f->rows[r];
        if (!row->count)
            continue;
        wall_part(scene, f, f->wall, (double[2]){0, z}, (double[2]){f->width, row->low}, 0, true);
        double pitch = f->width / row->count, s = 0;
        for (int i = 0; i < row->count; i++) {
            double left = pitch * (i + 0.5) - row->width / 2, right = left + row->width;
            wall_part(scene, f, f->wall, (double[2]){s, row->low}, (double[2]){left, row->high}, 0, true);
            opening(scene, f, (double[2]){left, row->low}, (double[2]){right, row->high});
            s = right;
        }
        wall_part(scene, f, f->wall, (double[2]){s, row->low}, (double[2]){f->width, row->high}, 0, true);
        z = row->high;
    }
    wall_part(scene, f, f->wall, (double[2]){0, z}, (double[2]){f->width, height}, 0, true);
    double center[3], inwards[3];
    cross3(f->right, up, inwards);
    mad3(f->corner, f->width / 2, f->right, center);
    mad3(center, height - 0.15, up, center);
    mad3(center, 0.08, inwards, center);
    spl_build_box(scene, f->reveal, center, f->right, (double[3]){f->width / 2, 0.08, 0.15});
}

static void facades(struct spl_scene *scene)
{
    const char *const names[4] = {"facade-north", "facade-east", "facade-south", "facade-west"};
    const uint32_t walls[4] = {brick, marbled, ashlar, plaster};
    const struct opening_row rows[4][2] = {
        {{0.9, 2.6, 7, 1.1}, {4.0, 5.7, 7, 1.1}},
        {{0}, {4.2, 5.8, 5, 1.0}},
        {{0.48, 2.9, 5, 1.3}, {4.0, 5.8, 7, 1.1}},
        {{0}, {4.2, 5.8, 5, 1.0}},
    };
    const double corners[4][3] = {
        {-width / 2, depth / 2, 0}, {width / 2, depth / 2, 0}, {width / 2, -depth / 2, 0}, {-width / 2, -depth / 2, 0}};
    const double rights[4][3] = {{1, 0, 0}, {0, -1, 0}, {-1, 0, 0}, {0, 1, 0}};
    uint32_t windows = spl_build_object(scene, "windows");
    for (int i = 0; i < 4; i++) {
        uint32_t object = spl_build_object(scene, names[i]);
        struct facade f = {.width = i % 2 ? depth : width,
                           .wall = {walls[i], object},
                           .reveal = {stone, object},
                           .pane = {glass, windows},
                           .rows = {rows[i][0], rows[i][1]}};
        for (int a = 0; a < 3; a++) {
            f.corner[a] = corners[i][a];
            f.right[a] = rights[i][a];
        }
        facade(scene, &f);
    }
}

static void arcade(struct spl_scene *scene)
{
    struct spl_skin columns = {stone, spl_build_object(scene, "columns")};
    struct spl_skin beam = {stone, spl_build_object(scene, "architrave")};
    for (int i = 0; i < 6; i++) {
        double x = 7.2, y = -5 + 2 * i;
        spl_build_box(scene, columns, (double[3]){x, y, 0.12}, east, (double[3]){0.32, 0.32, 0.12});
        spl_build_cone(scene, columns, (double[3]){x, y, 0.24}, (double[3]){x, y, 2.95}, 0.24, 0.2);
        spl_build_box(scene, columns, (double[3]){x, y, 3.05}, east, (double[3]){0.29, 0.29, 0.1});
    }
    spl_build_box(scene, beam, (double[3]){7.2, 0, 3.35}, north, (double[3]){5.5, 0.25, 0.2});
    spl_build_box(scene, beam, (double[3]){8.475, 0, 3.6}, north, (double[3]){5.5, 1.525, 0.05});
}

static void furniture(struct spl_scene *scene)
{
    struct spl_skin bench = {wood, spl_build_object(scene, "bench")};
    struct spl_skin steps = {stone, spl_build_object(scene, "steps")};
    for (int i = 0; i < 3; i++)
        spl_build_box(scene, bench, (double[3]){-1, 6.7 + 0.16 * i, 0.46}, east, (double[3]){0.9, 0.07, 0.02});
    for (int i = 0; i < 2; i++)
        spl_build_box(scene, bench, (double[3]){-1, 7.2, 0.62 + 0.18 * i}, east, (double[3]){0.9, 0.02, 0.07});
    for (int side = -1; side <= 1; side += 2) {
        spl_build_box(scene, bench, (double[3]){-1 + side * 0.75, 6.86, 0.22}, east, (double[3]){0.04, 0.22, 0.22});
        spl_build_box(scene, bench, (double[3]){-1 + side * 0.75, 7.16, 0.46}, east, (double[3]){0.03, 0.02, 0.46});
    }
    for (int i = 0; i < 3; i++)
        spl_build_box(scene, steps, (double[3]){0, -7.5 - 0.15 * i, 0.08 + 0.16 * i}, east,
                      (double[3]){1.4 - 0.1 * i, 0.5 - 0.15 * i, 0.08});
}

static void panels(struct spl_scene *scene)
{
    struct spl_skin plaque = {lettering, spl_build_object(scene, "plaque")};
    struct spl_skin rim = {grey, plaque.object};
    struct spl_skin panel = {red, spl_build_object(scene, "red-panel")};
    /* On the west wall; u runs along +y, which is rightwards for who reads it. */
    spl_build_rectangle(scene, plaque, (double[3]){-9.95, -3.5, 1.7}, north, up, (double[2]){0.9, 0.6}, NULL);
    spl_build_box(scene, rim, (double[3]){-9.976, -3.5, 1.7}, north, (double[3]){0.95, 0.024, 0.65});
    spl_build_box(scene, panel, (double[3]){-9.97, 3.5, 1.7}, north, (double[3]){0.75, 0.03, 0.5});
}

static const struct spl_named_camera cameras[] = {
    {"overview", {-9.3, -7.3, 1.7}, {3, 2, 1.9}, 70},
    {"high", {6.3, 7.4, 5.6}, {-4, -3, 0.8}, 65},
    {"wall", {4.6, 6.8, 1.6}, {2.9, 8, 1.7}, 60},
    {"wires", {0.4, -4.6, 1.6}, {-0.8, 2.5, 5.4}, 60},
    {"tree", {-1, 0.1, 1.6}, {-4, 2.6, 3.3}, 55},
    {"ground", {-2, -6.2, 0.25}, {3, 1.5, 0.4}, 60},
    {"arcade", {8.9, -6.6, 1.6}, {6.4, 2, 1.8}, 65},
    {"plaque", {-7.7, -3.1, 1.6}, {-9.95, -3.5, 1.7}, 45},
};

void spl_build_courtyard(struct spl_scene *scene)
{
    scene->materials = materials;
    scene->cameras = cameras;
    scene->camera_count = sizeof cameras / sizeof *cameras;
    spl_build_rectangle(scene, (struct spl_skin){paving, spl_build_object(scene, "ground")}, (double[3]){0}, east,
                        north, (double[2]){width / 2, depth / 2}, NULL);
    facades(scene);
    arcade(scene);
    furniture(scene);
    panels(scene);

    struct spl_skin sphere = {glaze, spl_build_object(scene, "sphere")};
    struct spl_skin plinth = {stone, spl_build_object(scene, "plinth")};
    spl_build_sphere(scene, sphere, (double[3]){2.5, -1.5, 1.6}, 0.75);
    spl_build_cone(scene, plinth, (double[3]){2.5, -1.5, 0}, (double[3]){2.5, -1.5, 0.9}, 0.5, 0.42);
    spl_build_disc(scene, plinth, (double[3]){2.5, -1.5, 0.9}, up, 0.42);

    struct spl_skin wires = {black, spl_build_object(scene, "wires")};
    spl_build_wire(scene, wires, (double[3]){-10, -2.5, 6.1}, (double[3]){10, -2.0, 6.1}, 0.5, 0.004, 48);
    spl_build_wire(scene, wires, (double[3]){-10, -2.1, 6.1}, (double[3]){10, -1.6, 6.1}, 0.45, 0.004, 48);
    spl_build_wire(scene, wires, (double[3]){3, -8, 6.2}, (double[3]){1.5, 8, 6.2}, 0.4, 0.004, 48);

    struct spl_skin branches = {bark, spl_build_object(scene, "branches")};
    struct spl_skin leaves = {green, spl_build_object(scene, "leaves")};
    spl_build_tree(scene, branches, leaves, (double[3]){-4, 2.6, 0}, 5.2, 5);

    spl_build_station(scene, (double[3]){-6.5, -4.8, 1.7}, 17, 1.5);
    spl_build_station(scene, (double[3]){4.9, -5.4, 1.7}, -121, -2);
    spl_build_station(scene, (double[3]){4.1, 4.7, 1.7}, 64, 0.8);
    spl_build_station(scene, (double[3]){-7.4, 5.6, 1.7}, 203, -1.1);
    scene->scanner = (struct spl_scanner){.kind = SPL_SCANNER_TERRESTRIAL,
                                          .noise = 0.0015,
                                          .aperture = 0.004,
                                          .divergence = 0.0003,
                                          .range = 10,
                                          .returns = 1};
}
